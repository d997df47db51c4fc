"""Pictures are stored, with the right particles in them; what cannot be drawn is refused."""

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.image import imread
from measure_bodies import MM, ball, box, impact_end, snapshot

from hvisph.core.errors import CaseError, OutputError
from hvisph.core.measure_catalogue import format_share, format_time
from hvisph.measures.frame.measurement_frame import Scene
from hvisph.visualization.curves import label_and_scale
from hvisph.visualization.history import draw_particles, picture

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


@pytest.mark.parametrize(("size", "unit"), [(1e-3, "um"), (1.0, "mm"), (2e4, "m"), (1e6, "km")])
def test_lengths_and_times_are_in_units_that_suit_them(tmp_path, size, unit):
    snap = impact_end(DX)
    snap.fields["position"] = snap.fields["position"] * size
    snap.metadata["spacing"] = DX * size
    axes = Figure().add_subplot()
    draw_particles(axes, Scene(snap), np.arange(snap.count), "body")
    assert axes.get_xlabel() == f"x [{unit}]"
    assert 1.0 <= axes.get_xlim()[1] - axes.get_xlim()[0] < 1e3
    metres = {"um": 1e-6, "mm": 1e-3, "m": 1.0, "km": 1e3}[unit]
    np.testing.assert_allclose(axes.collections[1].get_widths(), 2.0**0.5 * DX * size / metres)


def test_curves_have_units_that_suit_them():
    assert label_and_scale("time", False, shown=[np.array([0.0, 3e-9])]) == ("time [ns]", 1e9)
    assert label_and_scale("time", False, shown=[np.array([0.0, 2.0, np.nan])]) == ("time [s]", 1.0)
    assert label_and_scale("time", False, shown=[np.zeros(2)]) == ("time [us]", 1e6)
    assert label_and_scale("time", True, shown=[np.array([0.0, 3e-9])]) == ("time", 1.0)
    assert (format_time(8e-6, ".2f"), format_time(3e-9), format_time(0.0), format_time(2.0)) == (
        "8.00 us",
        "3 ns",
        "0 us",
        "2 s",
    )
    assert format_time(1e-9, ".2f", 3e-9) == "1 ns"
    assert [format_share(share) for share in (1.0, 0.998, 0.98, 0.003)] == ["100 %", "100 %", "98 %", "0.3 %"]


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
