"""Pictures are stored, with the right particles in them; what cannot be drawn is refused."""

import numpy as np
import pytest
from matplotlib.image import imread
from measure_bodies import MM, box, impact_end, snapshot

from hvisph.core.errors import CaseError, OutputError
from hvisph.core.measure_catalogue import format_share, format_time
from hvisph.visualization.curves import label_and_scale
from hvisph.visualization.particles import Look, Moment, draw, view_picture
from hvisph.visualization.style import appearance, field_of

DX = 0.4 * MM


@pytest.mark.parametrize("field", ["pressure", "velocity", "body", "smoothing_length"])
def test_picture_of_an_impact(tmp_path, field):
    snap = impact_end(DX)
    snap.fields["pressure"] = 1e9 * np.sin(snap.fields["position"][:, 0] * 1e3)
    image = imread(view_picture([Moment(snap)], tmp_path / "impact.png", Look(field)))[..., :3]
    # taller than wide, as the plate is, and not blank
    assert image.shape[0] > image.shape[1]
    assert (image.min(axis=2) < 0.9).mean() > 0.05
    assert [path.name for path in tmp_path.iterdir()] == ["impact.png"]


@pytest.mark.parametrize("log", [False, True])
def test_one_dimension_shows_a_profile_of_each_body(log):
    line = snapshot(box([-2 * MM], [0], DX), box([0], [2 * MM], DX), dx=DX)
    line.fields["pressure"] = 1e9 * (1.5 + np.sin(line.fields["position"][:, 0] * 1e3))
    (axes,) = draw([Moment(line)], Look("pressure", log=log)).axes
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("x [mm]", "pressure [GPa]")
    assert axes.get_yscale() == ("log" if log else "linear")
    for body, curve in enumerate(axes.get_lines()):
        own = line.body == body
        np.testing.assert_allclose(curve.get_xdata(), 1e3 * line.fields["position"][own, 0])
        np.testing.assert_allclose(curve.get_ydata(), 1e-9 * line.fields["pressure"][own])
        assert axes.get_ylim()[1] > curve.get_ydata().max()  # a curve is shown whole


def test_a_case_without_units_has_none_in_its_picture():
    snap = impact_end(DX)
    snap.metadata["units"] = "none"
    snap.fields["pressure"] = np.linspace(-1.0, 3.0, snap.count)
    axes, bar = draw([Moment(snap)], Look("pressure", (-1.0, 3.0))).axes
    assert (axes.get_xlabel(), axes.get_ylabel(), bar.get_ylabel()) == ("x", "y", "pressure")
    assert bar.get_ylim() == (-1.0, 3.0)
    assert axes.get_xlim()[1] == pytest.approx(snap.fields["position"][:, 0].max(), rel=0.5)  # not in mm


@pytest.mark.parametrize(("size", "unit"), [(1e-3, "um"), (1.0, "mm"), (2e4, "m"), (1e6, "km")])
def test_lengths_and_times_are_in_units_that_suit_them(size, unit):
    snap = impact_end(DX)
    snap.fields["position"] = snap.fields["position"] * size
    snap.metadata["spacing"] = DX * size
    axes = draw([Moment(snap)], Look("body")).axes[0]
    assert axes.get_xlabel() == f"x [{unit}]"
    assert 1.0 <= axes.get_xlim()[1] - axes.get_xlim()[0] < 1e3


def test_components_and_the_speed_are_fields():
    snap = impact_end(DX)
    velocity = snap.fields["velocity"] = np.random.default_rng(1).normal(size=(snap.count, 2))
    np.testing.assert_array_equal(field_of(snap, "velocity_y"), velocity[:, 1])
    np.testing.assert_allclose(field_of(snap, "speed"), np.hypot(*velocity.T))
    assert appearance(snap, "velocity_y") == ("velocity_y [m/s]", 1.0, "RdBu_r", True)
    assert appearance(snap, "speed")[:2] == ("speed [m/s]", 1.0)
    assert appearance(snap, "pressure")[:2] == ("pressure [GPa]", 1e-9)


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


def test_what_cannot_be_drawn(tmp_path):
    snap = impact_end(DX)
    with pytest.raises(CaseError, match="did you mean 'pressure'"):
        view_picture([Moment(snap)], tmp_path / "a.png", Look("presure"))
    with pytest.raises(CaseError, match="did you mean"):
        view_picture([Moment(snap)], tmp_path / "a.pngg", Look())
    with pytest.raises(OutputError, match="cannot write"):
        view_picture([Moment(snap)], tmp_path / "nowhere" / "a.png", Look())
    assert not list(tmp_path.iterdir())
