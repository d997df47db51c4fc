"""Layers that were open before they were struck, and what is residual only behind the layers."""

import numpy as np
import pytest
from measure_bodies import MM, ball, box
from test_measure_perforation import DX, holed, in_time, moment, rotation, same, turned

from hvisph.measures.measure import measure_snapshot
from hvisph.measures.measurement_frame import Scene
from hvisph.measures.target_geometry import Grid, place_of, plate_of
from hvisph.measures.targets import layer_measures

WIDE = 30 * MM
RESIDUAL = ("residual_mass", "residual_length", "residual_angle")


def slab(dim, thick=3 * MM):
    return box([0.0, *[-0.5 * WIDE] * (dim - 1)], [thick, *[0.5 * WIDE] * (dim - 1)], DX)


def off(coordinate, pitch, wall):
    """Whether a coordinate is between walls at a pitch, in the middle of which the shot line is."""
    return np.abs((coordinate + 0.5 * pitch) % pitch - 0.5 * pitch) < 0.5 * (pitch - wall)


def honeycomb():
    """Square cells of 5 mm along the shot, of foil of one particle, 6 mm deep."""
    place = slab(3, 6 * MM)
    return place[~(off(place[:, 1], 5 * MM, DX) & off(place[:, 2], 5 * MM, DX))]


def holes():
    """Round holes of 5 mm, 12 mm apart, one on the shot line."""
    place = slab(3)
    around = (place[:, 1:] + 6 * MM) % (12 * MM) - 6 * MM
    return place[(around**2).sum(axis=1) > (2.5 * MM) ** 2]


def mesh():
    """Wires of 1 mm, 4 mm apart, those along y behind those along z."""
    place = slab(3, 2 * MM)
    first, second = ~off(place[:, 1], 4 * MM, 1 * MM), ~off(place[:, 2], 4 * MM, 1 * MM)
    return place[np.where(place[:, 0] < 1 * MM, first, second)]


def two_parts():
    """In the plane, with a gap of 4 mm."""
    place = slab(2)
    return place[np.abs(place[:, 1]) > 2 * MM]


def tiles():
    """In the plane: three tiles, of which the middle one reaches no edge, 2.5 mm apart."""
    place = slab(2)
    return place[np.abs(np.abs(place[:, 1]) - 8 * MM) > 1.25 * MM]


def an_l():
    """A corner is missing, away from the shot."""
    place = slab(3)
    return place[(place[:, 1] < 5 * MM) | (place[:, 2] < 5 * MM)]


LAYERS = {"honeycomb": honeycomb, "plate with holes": holes, "mesh": mesh, "two parts": two_parts, "tiles": tiles,
          "L": an_l}  # fmt: skip


def struck(layer, x, velocity, diameter=10 * MM, hole=0.0, others=0.0, moved=0.0):
    """Start and a moment: the ball at x, what was within `hole` of the shot line gone, the layer moved along it."""
    dim = layer.shape[1]

    def shot(at):
        return ball([at, *[0.0] * (dim - 1)], diameter, DX)

    start = moment([shot(-0.5 * diameter - DX), layer], [1000.0, 0.0])
    parts = [shot(x), layer + np.eye(dim)[0] * moved]
    position, body = np.concatenate(parts), np.repeat([0, 1], [len(part) for part in parts])
    gone = (np.sqrt((position[:, 1:] ** 2).sum(axis=1)) < hole) & (body == 1)
    return start, moment(parts, [velocity, others], ~gone, time=1e-5)


@pytest.mark.parametrize("name", list(LAYERS))
def test_what_was_open_from_the_start_is_no_perforation(name):
    layer = LAYERS[name]()
    for x, velocity, expected in [(-6 * MM, 1000.0, "not yet"), (-6 * MM, -20.0, "no")]:
        start, now = struck(layer, x, velocity)
        found = layer_measures(Scene.from_snapshot(now, start))[0]
        assert found.state == expected
        assert "not there at the start" in found.results["perforated"].reason or expected == "no"
        assert found.results["mass_loss"].value == 0.0  # every part is as it was
        assert measure_snapshot(now, start)["residual_velocity"].value is None


@pytest.mark.parametrize("name", list(LAYERS))
def test_a_new_way_through_is_one(name):
    start, now = struck(LAYERS[name](), 30 * MM, 600.0, hole=6 * MM)
    found = measure_snapshot(now, start)
    assert found.layers[0].state == "yes"
    assert found["perforated"].value == 1.0
    assert found["residual_velocity"].value == pytest.approx(600.0)


@pytest.mark.parametrize("name", ["honeycomb", "mesh"])
def test_a_layer_that_has_moved_as_a_whole_is_not_perforated(name):
    start, now = struck(LAYERS[name](), 6 * MM, 10.0, others=10.0, moved=20 * MM)
    assert layer_measures(Scene.from_snapshot(now, start))[0].state == "no"


def test_walls_that_bend_are_no_new_way():
    start, now = struck(honeycomb(), 0.0, 0.0)
    place = now.fields["position"]
    foil = (now.body == 1) & (np.abs(place[:, 1]) < 12 * MM) & (np.abs(place[:, 2]) < 12 * MM)
    place[foil, 1] += 1.5 * DX * np.sin(2.0 * np.pi * place[foil, 2] / (10 * MM))
    assert layer_measures(Scene.from_snapshot(now, start))[0].state == "no"


@pytest.mark.parametrize(("name", "diameter"), [("plate with holes", 3 * MM), ("two parts", 2 * MM)])
def test_a_way_along_the_path_of_the_projectile_is_no_answer(name, diameter):
    """It flies through an opening as if nothing were there: residual behind it, and no word of a perforation."""
    layer = LAYERS[name]()
    start, now = struck(layer, 1 * MM, 1000.0, diameter)
    found = measure_snapshot(now, start)
    assert found.layers[0].state == ""
    assert found["perforated"].value is None
    assert "open along the projectile's path" in found["perforated"].reason
    assert found["residual_velocity"].value is None
    assert "not behind" in found["residual_velocity"].reason
    start, now = struck(layer, 20 * MM, 1000.0, diameter)
    found = measure_snapshot(now, start)
    assert found.layers[0].state == ""
    assert found["residual_velocity"].value == pytest.approx(1000.0)
    assert "open from the start" in found.answer
    passed = layer_measures(in_time(start, now))[0].results
    assert passed["exit_velocity"].value == pytest.approx(1000.0)
    assert passed["perforation_time"].value is None


@pytest.mark.parametrize("wall", ["corrugated", "tube"])
def test_walls_that_are_curved_have_no_way_until_there_is_one(wall):
    place = box([-8 * MM, -0.5 * WIDE, -0.5 * WIDE], [8 * MM, 0.5 * WIDE, 0.5 * WIDE], DX)
    if wall == "tube":
        radius = np.hypot(place[:, 0], place[:, 2])
        layer = place[(radius > 6 * MM) & (radius < 8 * MM)]
    else:
        middle = 3 * MM * np.sin(2.0 * np.pi * place[:, 1] / (10 * MM))
        layer = place[np.abs(place[:, 0] - middle) < 1 * MM]
    start, now = struck(layer, -14 * MM, -20.0)
    assert layer_measures(Scene.from_snapshot(now, start))[0].state == "no"
    start, now = struck(layer, 30 * MM, 500.0, hole=5 * MM)
    assert layer_measures(Scene.from_snapshot(now, start))[0].state == "yes"


@pytest.mark.parametrize("name", ["honeycomb", "two parts"])
def test_a_turned_shot_on_an_open_layer_measures_the_same(name):
    start, now = struck(LAYERS[name](), 12 * MM, 500.0, hole=6 * MM)
    rng, dim = np.random.default_rng(7), start.dimensions
    now.fields["position"] += rng.uniform(-0.1 * DX, 0.1 * DX, now.fields["position"].shape)
    straight = measure_snapshot(now, start)
    matrix, shift = rotation(rng, dim), rng.uniform(-1.0, 1.0, dim)
    same(measure_snapshot(turned(now, matrix, shift), turned(start, matrix, shift)), straight)


def test_particles_that_are_coarser_than_the_case_leave_no_ways_between_them():
    """A plate of 4 dx at the case's dx: between its particles there is more room than a ball of 1.5 dx needs."""
    start, now = holed(3, -3 * MM, 1000.0, (False, False))
    for snap in (start, now):
        snap.metadata |= {"spacing": 0.25 * DX, "h_over_dx": 1.2}
        snap.fields["smoothing_length"][:] = 1.2 * DX
        snap.fields["smoothing_length"][snap.body == 0] = 0.3 * DX
    assert [layer.state for layer in layer_measures(Scene.from_snapshot(now, start))] == ["not yet", "not yet"]


@pytest.mark.parametrize("dim", [2, 3])
def test_nothing_is_residual_before_the_projectile_is_through(dim):
    """A way is open, and the projectile is still before or in it: velocity, mass and length are not yet left over."""
    for x in (-3 * MM, 1.5 * MM, 2.9 * MM):
        start, now = holed(dim, x, 500.0, (True, True), radius=6 * MM)
        found = measure_snapshot(now, start)
        assert [layer.state for layer in found.layers] == ["yes", "yes"]
        for result in (found["residual_velocity"], *(found.projectile[name] for name in RESIDUAL)):
            assert result.value is None
            assert "not behind 'bumper' yet" in result.reason
        assert found.projectile["projectile_length"].value == pytest.approx(6 * MM, abs=2 * DX)
    start, now = holed(dim, 10 * MM, 500.0, (True, True), radius=6 * MM)
    assert "not behind 'wall' yet" in measure_snapshot(now, start)["residual_velocity"].reason
    start, now = holed(dim, 27 * MM, 500.0, (True, True), radius=6 * MM)
    found = measure_snapshot(now, start)
    assert found["residual_velocity"].value == pytest.approx(500.0)
    assert found.projectile["residual_length"] == found.projectile["projectile_length"]


def test_one_layer_that_holds_is_enough_beside_one_that_was_open():
    first, wall = holes(), slab(3) + np.eye(3)[0] * 30 * MM
    start = moment([ball([-3 * MM, 0.0, 0.0], 3 * MM, DX), first, wall], [1000.0, 0.0, 0.0])
    now = moment([ball([5 * MM, 0.0, 0.0], 3 * MM, DX), first, wall], [0.0, 0.0, 0.0], time=1e-5)
    found = measure_snapshot(now, start)
    assert [layer.state for layer in found.layers] == ["", "no"]
    assert found["perforated"].value == 0.0


@pytest.mark.parametrize("dim", [2, 3])
def test_free_cells_are_those_with_clearance(dim):
    """Steps about the particles tell what the distance from the nearest of them does."""
    random, reach = np.random.default_rng(dim), 1.5 * DX
    layer = slab(dim)
    plate = plate_of(1, layer, np.zeros(dim - 1), DX)
    place = place_of(plate, layer[random.random(len(layer)) < 0.3], DX, DX)
    grid = Grid.about(plate, DX, [place])
    np.testing.assert_array_equal(grid.free(place, reach), grid.clearance(place) > reach)


def test_what_is_beyond_a_share_of_the_way_to_the_edges():
    disc = slab(3)[np.hypot(*slab(3)[:, 1:].T) < 15 * MM]
    plate = plate_of(1, disc, np.array([2 * MM, 0.0]), DX)
    across = plate.in_plane(np.random.default_rng(1).uniform(-25 * MM, 25 * MM, (2000, 3)))
    for share in (0.3, 0.9, 1.0):
        beyond = plate.is_beyond(across, share)
        np.testing.assert_array_equal(beyond, plate.outward(across) >= share)
        assert 0 < beyond.sum() < len(across)
