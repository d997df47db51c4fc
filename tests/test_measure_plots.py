"""Pictures are stored, with the right particles in them; what cannot be drawn is refused."""

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.image import imread
from measure_bodies import MM, ball, box, impact_end, snapshot

from hvisph.core.errors import CaseError, OutputError
from hvisph.measures.scene import Scene
from hvisph.pictures.plots import draw_particles, picture

DX = 0.4 * MM


@pytest.mark.parametrize("field", ["pressure", "velocity", "body", "smoothing_length"])
def test_picture_of_an_impact(tmp_path, field):
    snap = impact_end(DX)
    snap.fields["pressure"] = 1e9 * np.sin(snap.fields["position"][:, 0] * 1e3)
    image = imread(picture(snap, tmp_path / "impact.png", field=field))[..., :3]
    # taller than wide, as the plate is, and not blank
    assert image.shape[0] > image.shape[1]
    assert (image.min(axis=2) < 0.9).mean() > 0.05
    assert [path.name for path in tmp_path.iterdir()] == ["impact.png"]


def test_three_dimensions_show_a_slice_and_one_a_profile(tmp_path):
    sphere = snapshot(ball([0, 0, 0], 6 * MM, DX), dx=DX)
    line = snapshot(box([-2 * MM], [0], DX), box([0], [2 * MM], DX), dx=DX)
    assert picture(sphere, tmp_path / "slice.png").stat().st_size > 1000
    assert picture(line, tmp_path / "profile.svg").stat().st_size > 1000


def test_discs_have_the_size_of_cells_and_colours_their_scale():
    snap = impact_end(DX)
    snap.fields["pressure"] = np.linspace(-2e9, 1e9, snap.count)
    axes = Figure().add_subplot()
    draw_particles(axes, Scene(snap), np.arange(snap.count), "pressure")
    rims, discs = axes.collections
    np.testing.assert_allclose(discs.get_widths(), 2.0**0.5 * 0.4)
    assert (rims.get_widths() > discs.get_widths()).all()
    assert len(discs.get_array()) == snap.count
    low, high = discs.get_clim()
    # pressures in GPa, the scale symmetric about zero, half a per cent left beyond its ends
    assert high == -low == pytest.approx(2.0, rel=0.01)
    assert axes.get_aspect() == 1.0


def test_a_case_without_units_has_none_in_its_picture():
    snap = impact_end(DX)
    snap.metadata["units"] = "none"
    snap.fields["pressure"] = np.linspace(-1.0, 3.0, snap.count)
    axes = Figure().add_subplot()
    discs = draw_particles(axes, Scene(snap), np.arange(snap.count), "pressure", limits=(-1.0, 3.0))
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("x", "y")
    assert discs.get_clim() == (-1.0, 3.0)
    assert axes.get_xlim()[1] == pytest.approx(snap.fields["position"][:, 0].max(), rel=0.5)  # not in mm


def test_given_limits_are_kept(tmp_path):
    snap = impact_end(DX)
    axes = Figure().add_subplot()
    draw_particles(axes, Scene(snap), np.arange(snap.count), "pressure", limits=(-1e9, 3e9))
    assert axes.collections[1].get_clim() == pytest.approx((-1.0, 3.0))


def test_what_cannot_be_drawn(tmp_path):
    snap = impact_end(DX)
    with pytest.raises(CaseError, match="did you mean 'pressure'"):
        picture(snap, tmp_path / "a.png", field="presure")
    with pytest.raises(CaseError, match="did you mean"):
        picture(snap, tmp_path / "a.pngg")
    with pytest.raises(OutputError, match="cannot write"):
        picture(snap, tmp_path / "nowhere" / "a.png")
    assert not list(tmp_path.iterdir())
