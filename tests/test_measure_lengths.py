"""Crater, extension and penetration on bodies whose lengths are known."""

from dataclasses import replace

import numpy as np
import pytest
from measure_bodies import MM, ball, box, impact_end, impact_start, reordered, snapshot

from hvisph.core.errors import OutputError
from hvisph.geometry.lattices import Grading, fill_graded
from hvisph.geometry.shapes import Box
from hvisph.measures.lengths import length_of
from hvisph.measures.measurement_frame import Scene, reference
from hvisph.measures.result import evaluate

CRATER = ("crater_diameter", "crater_diameter_min", "crater_lip_diameter")


def crater_diameter(scene):
    return evaluate("run", scene, names=CRATER)


def extension(scene):
    return evaluate("run", scene, names=["extension"])["extension"]


def penetration(scene):
    return evaluate("run", scene, names=["penetration"])["penetration"]


@pytest.mark.parametrize("dx", [0.1 * MM, 0.2 * MM, 0.4 * MM])
def test_known_crater_and_projectile(dx):
    scene = Scene(impact_end(dx), impact_start(dx))
    crater = crater_diameter(scene)
    # edges are particle centres, half a spacing inside the material on each side
    for name in ("crater_diameter", "crater_diameter_min"):
        assert crater[name].value == pytest.approx(20 * MM + dx, abs=1.01 * dx)
        assert crater[name].unit == "m"
        assert crater[name].uncertainty >= dx
    # on a flat face the five front-most particles are the five next to the hole, 2 dx a side on average
    assert crater["crater_lip_diameter"].value == pytest.approx(20 * MM + 5 * dx, abs=1.01 * dx)
    assert extension(scene).value == pytest.approx(7 * MM - dx, abs=1.01 * dx)
    # the 99 % quantile leaves out 1 % of 7 mm and the half spacing of the front row
    assert penetration(scene).value == pytest.approx(19 * MM - 0.07 * MM - 0.5 * dx, abs=dx)
    assert penetration(scene).support == pytest.approx(2.8 * dx)
    scene.state.metadata["kernel_reach"] = 3.0
    assert penetration(Scene(scene.state, scene.start)).support == pytest.approx(4.2 * dx)


def test_mean_and_minimum_of_a_conical_crater():
    dx = 0.1 * MM
    plate = box([0, -25 * MM], [2 * MM, 25 * MM], dx)
    plate = plate[np.abs(plate[:, 1]) > 8 * MM + plate[:, 0]]
    scene = Scene(snapshot(ball([10 * MM, 0], 6 * MM, dx), plate), impact_start())
    crater = crater_diameter(scene)
    # diameter 16 to 20 mm along the thickness; the edges' staircase is one spacing a side
    assert crater["crater_diameter"].value == pytest.approx(18 * MM, abs=2.5 * dx)
    assert crater["crater_diameter_min"].value == pytest.approx(16 * MM, abs=2.5 * dx)
    assert crater["crater_lip_diameter"].value == pytest.approx(20 * MM + 4 * dx, abs=2.5 * dx)
    assert crater["crater_diameter"].uncertainty > crater["crater_diameter_min"].uncertainty


def test_intact_plate_has_no_crater():
    scene = Scene(impact_start(), impact_start())
    assert crater_diameter(scene)["crater_diameter"].value <= 1.01 * scene.spacing
    assert penetration(scene).value < 0.0


def test_loose_particles_do_not_count():
    clean = impact_end()
    scene = Scene(clean, impact_start())
    count = int((clean.body == 0).sum())
    stray = np.array([[25 * MM, 0.3 * MM], [-9 * MM, 0.0], [-9.1 * MM, 0.0]])
    debris = box([0.5 * MM, -2 * MM], [1.5 * MM, -1 * MM], 0.1 * MM)
    position = clean.fields["position"]
    dirty = snapshot(np.concatenate([position[:count], stray]), np.concatenate([position[count:], debris]), time=8e-6)
    soiled = Scene(dirty, impact_start())
    assert crater_diameter(soiled)["crater_diameter"].value == crater_diameter(scene)["crater_diameter"].value
    assert extension(soiled).value == extension(scene).value
    assert penetration(soiled).value == penetration(scene).value


def test_order_of_particles_does_not_matter():
    start, end = impact_start(), impact_end()
    order = np.random.default_rng(3).permutation(end.count)
    one, other = Scene(end, start), Scene(reordered(end, order), start)
    for name, result in crater_diameter(one).items():
        # means are summed in another order: round-off only
        assert crater_diameter(other)[name].value == pytest.approx(result.value, rel=1e-12)
    assert extension(other).value == extension(one).value
    assert penetration(other).value == penetration(one).value


@pytest.mark.parametrize("shift", [[3 * MM, 0.0], [0.0, -7 * MM], [1.0, 2.0]])
def test_a_shifted_run_measures_the_same(shift):
    start, end = impact_start(), impact_end()
    there = Scene(end, start)
    start, end = (replace(snap, fields=dict(snap.fields)) for snap in (start, end))
    for snap in (start, end):
        snap.fields["position"] = snap.fields["position"] + np.array(shift)
    moved = Scene(end, start)
    # a metre of shift costs 1e-16 m of the positions
    assert crater_diameter(moved)["crater_diameter"].value == pytest.approx(
        crater_diameter(there)["crater_diameter"].value, abs=1e-12
    )
    assert extension(moved).value == pytest.approx(extension(there).value, abs=1e-12)
    assert penetration(moved).value == pytest.approx(penetration(there).value, abs=1e-12)
    assert moved.face == pytest.approx(shift[0], abs=1e-12)


def test_single_snapshot_finds_the_plate_by_its_rim():
    end = impact_end()
    target = end.fields["position"][end.body == 1]
    ejecta = box([-20 * MM, 25 * MM], [-19 * MM, 32 * MM], 0.1 * MM)
    soiled = snapshot(end.fields["position"][end.body == 0], np.concatenate([target, ejecta, -ejecta]))
    alone, run = Scene(soiled), Scene(end, impact_start())
    assert alone.thickness == pytest.approx(run.thickness)
    assert crater_diameter(alone)["crater_diameter"].value == pytest.approx(
        crater_diameter(run)["crater_diameter"].value
    )


def test_metadata_of_a_single_snapshot_comes_first():
    end = impact_end()
    end.metadata.update(axis=[1 * MM], face=0.5 * MM, thickness=1 * MM)
    scene = Scene(end)
    assert (scene.face, scene.thickness) == (0.5 * MM, 1 * MM)
    np.testing.assert_array_equal(scene.axis, [1 * MM])


def test_reference_of_the_start_serves_a_single_snapshot():
    start, end = impact_start(), impact_end()
    for snap in (start, end):
        snap.fields["position"] = snap.fields["position"] + np.array([3 * MM, 1 * MM])
    known = reference(start)
    assert known["axis"] == pytest.approx([1 * MM])
    assert (known["face"], known["thickness"], known["width"]) == pytest.approx((3 * MM, 2 * MM, 10 * MM))
    alone, run = Scene(snapshot_with(end, known)), Scene(end, start)
    assert crater_diameter(alone) == crater_diameter(run)
    assert (extension(alone), penetration(alone)) == (extension(run), penetration(run))


def snapshot_with(snap, metadata):
    return replace(snap, metadata={**snap.metadata, **metadata})


def test_half_model_has_its_axis_in_the_symmetry_plane():
    start, end = impact_start(), impact_end()
    halves = [reordered(snap, np.flatnonzero(snap.fields["position"][:, 1] > 0)) for snap in (start, end)]
    whole, half = Scene.from_snapshot(end, start), Scene.from_snapshot(halves[1], halves[0])
    np.testing.assert_allclose(half.axis, [0.0], atol=1e-17)
    for name, result in crater_diameter(whole).items():
        assert crater_diameter(half)[name].value == pytest.approx(result.value, abs=1e-9)
    assert extension(half).value == pytest.approx(extension(whole).value, abs=1e-9)


def test_axis_of_a_body_off_the_plane():
    def axis(start):
        return Scene.from_snapshot(start, start).axis

    dx = 0.5 * MM
    body = ball([0.0, 2 * MM, -4 * MM], 4 * MM, dx)
    plate = box([5 * MM, -6 * MM, -6 * MM], [6 * MM, 6 * MM, -2 * MM], dx)
    # a body that only touches y = 0 is no half model while the plate reaches across; to round-off
    np.testing.assert_allclose(axis(snapshot(body, plate, dx=dx)), [2 * MM, -4 * MM], atol=1e-15)
    np.testing.assert_allclose(axis(snapshot(body, dx=dx)), [0.0, -4 * MM], atol=1e-15)


def test_round_hole_in_three_dimensions():
    dx = 0.5 * MM
    plate = box([0, -12 * MM, -12 * MM], [3 * MM, 12 * MM, 12 * MM], dx)
    hole = np.hypot(plate[:, 1], plate[:, 2]) > 7 * MM
    start = snapshot(ball([-6 * MM, 0, 0], 12 * MM, dx), plate, dx=dx)
    end = snapshot(ball([10 * MM, 0, 0], 12 * MM, dx), plate[hole], dx=dx, time=5e-5)
    scene = Scene(end, start)
    crater = crater_diameter(scene)
    # a circle cut from a cubic lattice: its innermost nodes are up to one spacing outside of it
    assert crater["crater_diameter"].value == pytest.approx(14 * MM, abs=1.5 * dx)
    assert crater["crater_diameter"].value >= 14 * MM
    # forty particles of a flat face: one row round the hole
    assert crater["crater_lip_diameter"].value == pytest.approx(14 * MM + dx, abs=1.5 * dx)
    assert extension(scene).value == pytest.approx(12 * MM - dx, abs=1.5 * dx)
    # 1 % of a sphere's volume is the cap beyond 0.883 of its radius (solve (1-s)^2 (2+s) / 4 = 0.01)
    assert penetration(scene).value == pytest.approx(10 * MM + 0.883 * 6 * MM, abs=dx)


def test_lip_of_a_three_dimensional_crater():
    dx = 0.5 * MM
    plate = box([0, -12 * MM, -12 * MM], [3 * MM, 12 * MM, 12 * MM], dx)
    lip = box([3 * MM, -12 * MM, -12 * MM], [5 * MM, 12 * MM, 12 * MM], dx)
    radius = np.hypot(lip[:, 1], lip[:, 2])
    hole = np.hypot(plate[:, 1], plate[:, 2]) > 8 * MM
    bent = np.concatenate([plate[hole], lip[(radius > 8 * MM) & (radius < 9 * MM)]])
    start = snapshot(ball([-6 * MM, 0, 0], 12 * MM, dx), plate, dx=dx)
    end = snapshot(ball([10 * MM, 0, 0], 12 * MM, dx), bent, dx=dx)
    lip_to_lip = crater_diameter(Scene(end, start))["crater_lip_diameter"]
    # forty particles of a ring between 16 and 18 mm
    assert 16 * MM < lip_to_lip.value < 18 * MM


def test_measures_without_meaning_say_why():
    one = Scene(snapshot(ball([0, 0], 4 * MM, 0.2 * MM), dx=0.2 * MM))
    assert crater_diameter(one)["crater_diameter"].value is None
    assert "no target" in penetration(one).reason
    assert extension(one).value == pytest.approx(4 * MM, abs=0.5 * MM)
    line = Scene(snapshot(box([-1 * MM], [0], 0.1 * MM), box([0], [1 * MM], 0.1 * MM)))
    assert "1D" in crater_diameter(line)["crater_lip_diameter"].reason
    assert "1D" in extension(line).reason
    assert "1D" in penetration(line).reason


def test_projectile_torn_open_on_the_axis():
    body = box([0, 2 * MM], [4 * MM, 6 * MM], 0.1 * MM)
    assert "shot line" in extension(Scene(snapshot(body), snapshot(body - [0, 4 * MM]))).reason


def test_position_that_is_not_finite_is_named():
    end = impact_end()
    end.fields["position"][17, 0] = np.nan
    with pytest.raises(OutputError, match="particle 17"):
        penetration(Scene(end))


@pytest.mark.parametrize(
    ("fine", "face"),
    [((8 * MM, None), "rear"), ((8 * MM, None), "front"), ((8 * MM, 4 * MM), "middle"), ((None, 4 * MM), "middle")],
)
def test_a_graded_projectile_is_as_long_as_its_shape(fine, face):
    """Its outermost layers are thicker than dx, by up to the coarsest spacing: half of that is a length's error."""
    dx, size = 0.5 * MM, (40 * MM, 20 * MM)
    filling = fill_graded(Box(size), dx, Grading(fine, 2 * MM, face=face))
    rod = snapshot(filling.positions, dx=dx, names=("rod",), h_over_dx=1.2)
    rod.fields["smoothing_length"] = 1.2 * filling.spacing
    assert length_of(Scene(rod, rod), filling.positions[:, 0]) == pytest.approx(size[0], abs=0.05 * dx)
    even = snapshot(box((0, 0), size, dx), dx=dx, names=("rod",), h_over_dx=1.2)
    even.fields["smoothing_length"][:] = 1.2 * dx
    assert length_of(Scene(even, even), even.fields["position"][:, 0]) == pytest.approx(size[0], rel=1e-12)
