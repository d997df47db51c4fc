"""Perforated or not: roles, layers and ways through them, on bodies made by hand."""

from dataclasses import replace

import numpy as np
import pytest
from measure_bodies import MM, ball, box, snapshot

from hvisph.casefile.loader import load_case
from hvisph.core.errors import OutputError
from hvisph.core.measure_catalogue import SECTIONS
from hvisph.diagnostics.budgets import stated_roles
from hvisph.measures.impact_geometry import roles_of
from hvisph.measures.measure import add_variation, measure_scene, measure_snapshot, recent_moments
from hvisph.measures.measurement_frame import Scene
from hvisph.measures.result import Result, entries, undefined_result
from hvisph.measures.target_geometry import front_surface
from hvisph.measures.targets import Moment, Timeline, layer_measures, perforation_text

DX = 0.5 * MM
THICK, WIDE = 3 * MM, 30 * MM


def plates(dim, gap=20 * MM):
    """Two plates across x, the first at x = 0."""
    across = [-0.5 * WIDE] * (dim - 1), [0.5 * WIDE] * (dim - 1)
    return [box([x, *across[0]], [x + THICK, *across[1]], DX) for x in (0.0, gap)]


def shot(dim, x):
    return ball([x, *[0.0] * (dim - 1)], 6 * MM, DX)


def moment(parts, velocities, kept=None, time=0.0):
    """Snapshot of bodies with a velocity each along x [m/s]; `kept` chooses particles, their numbers stay."""
    made = snapshot(parts[0], np.concatenate(parts[1:]), dx=DX, time=time)
    body = np.repeat(np.arange(len(parts)), [len(part) for part in parts])
    made.fields["velocity"][:] = 0.0
    made.fields["velocity"][:, 0] = np.asarray(velocities, float)[body]
    made = replace(made, body=body, bodies=["shot", "bumper", "wall"][: len(parts)])
    if kept is None:
        return made
    fields = {name: values[kept] for name, values in made.fields.items()}
    return replace(made, fields=fields, body=body[kept], material=made.material[kept], id=made.id[kept])


def holed(dim, x, velocity, hole=(True, False), radius=4 * MM, others=(0.0, 0.0)):
    """Start and a moment with holes in the plates and the projectile at x."""
    layers = plates(dim)
    start = moment([shot(dim, -3 * MM), *layers], [1000.0, 0.0, 0.0])
    parts = [shot(dim, x), *layers]
    position, body = np.concatenate(parts), np.repeat([0, 1, 2], [len(part) for part in parts])
    near = np.sqrt((position[:, 1:] ** 2).sum(axis=1)) < radius
    gone = near & np.isin(body, [k + 1 for k, open_ in enumerate(hole) if open_])
    return start, moment(parts, [velocity, *others], ~gone, time=1e-5)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize(
    ("x", "velocity", "hole", "expected"),
    [
        (-3 * MM, 1000.0, (False, False), ["not yet", "not yet"]),
        (-3 * MM, -50.0, (False, False), ["no", "no"]),
        (10 * MM, 500.0, (True, False), ["yes", "not yet"]),
        (10 * MM, 10.0, (True, False), ["yes", "no"]),
        (30 * MM, 300.0, (True, True), ["yes", "yes"]),
    ],
)
def test_layers_of_a_whipple_shield(dim, x, velocity, hole, expected):
    start, now = holed(dim, x, velocity, hole)
    found = measure_snapshot(now, start)
    assert [layer.state for layer in found.layers] == expected
    assert [layer.body for layer in found.layers] == ["bumper", "wall"]
    assert all(layer.obliquity == 0.0 for layer in found.layers)
    assert found["perforated"].value == {"yes": 1.0, "no": 0.0, "not yet": None}[expected[-1]]


@pytest.mark.parametrize("dim", [2, 3])
def test_a_projectile_stuck_in_its_hole_has_not_perforated_the_plate(dim):
    start, now = holed(dim, 1.5 * MM, 0.0, (True, False), radius=3.3 * MM)
    assert layer_measures(Scene.from_snapshot(now, start))[0].state == "no"
    start, now = holed(dim, 1.5 * MM, 200.0, (True, False), radius=3.3 * MM)
    assert layer_measures(Scene.from_snapshot(now, start))[0].state == "yes"


def test_what_is_stuck_in_a_plate_that_swings_moves_with_its_middle():
    """The rim of a free plate goes on at 100 m/s, its middle and what is stuck there stand still."""
    start, now = holed(2, 1.5 * MM, 0.0, (True, False), radius=3.3 * MM)
    rim = (now.body == 1) & (np.abs(now.fields["position"][:, 1]) > 6 * MM)
    velocity = now.fields["velocity"].copy()
    velocity[rim, 0] = 100.0
    assert rim.any()
    assert (
        layer_measures(Scene.from_snapshot(replace(now, fields=now.fields | {"velocity": velocity}), start))[0].state
        == "no"
    )


@pytest.mark.parametrize("dim", [2, 3])
def test_loose_rubble_closes_no_hole(dim):
    """What is in the hole closes it, crushed or sound, but rubble that is drawn apart does not, nor holds a plug."""
    start, now = holed(dim, 10 * MM, 500.0, (False, False))
    radius = np.sqrt((now.fields["position"][:, 1:] ** 2).sum(axis=1))
    inside = (now.body == 1) & (radius < 4 * MM)
    band = inside & (radius > 1.5 * MM)
    before = replace(start, fields=start.fields | {"damage": np.zeros(len(start.body))})

    def layer(damage, share, rubble=inside, speed=0.0):
        fields = {name: values.copy() for name, values in now.fields.items()} | {"damage": damage * rubble}
        fields["density"][rubble] *= share
        fields["velocity"][inside, 0] = speed
        return layer_measures(Scene.from_snapshot(replace(now, fields=fields), before))[0]

    assert layer(0.9, 0.4).state == layer(1.0, 0.7).state == layer(1.0, 0.7, now.body == 1).state == "no"
    opened = layer(1.0, 0.4)
    assert opened.state == "yes"
    assert opened.results["hole_diameter"].value == pytest.approx(8 * MM, abs=1.5 * DX)
    assert layer(1.0, 0.4, band, speed=100.0).state == "yes"  # what only rubble holds, flying
    assert layer(1.0, 0.7, band, speed=100.0).state == "no"
    narrow = inside & (radius > 3 * MM)
    assert layer(1.0, 0.4, narrow, speed=100.0).state == "yes"
    assert layer(1.0, 0.4, narrow).state == "no"  # stuck: what is left beside it is no way


@pytest.mark.parametrize("radius", [0.6, 1.4, 4.0])
def test_a_way_is_wider_than_three_spacings(radius):
    """Between a hole of one row and one of eight: what is linked at 2 dx is no hole."""
    start, now = holed(3, 10 * MM, 500.0, (True, False), radius=radius * DX)
    assert layer_measures(Scene.from_snapshot(now, start))[0].state == ("yes" if radius > 2.0 else "no")


@pytest.mark.parametrize("outline", ["disc", "turned square"])
def test_beside_a_plate_there_is_no_way_through_it(outline):
    """The corners of the box about a disc, or about a square that is turned in its plane, are none of the plate."""
    start, now = holed(3, -3 * MM, 1000.0, (False, False))

    def cut(snap):
        y, z = snap.fields["position"][:, 1:].T
        beyond = np.hypot(y, z) if outline == "disc" else (np.abs(y) + np.abs(z))
        kept = (snap.body == 0) | (beyond < 0.5 * WIDE)
        fields = {name: values[kept] for name, values in snap.fields.items()}
        return replace(snap, fields=fields, body=snap.body[kept], material=snap.material[kept], id=snap.id[kept])

    assert [layer.state for layer in layer_measures(Scene.from_snapshot(cut(now), cut(start)))] == [
        "not yet",
        "not yet",
    ]
    start, now = holed(3, 10 * MM, 500.0, (True, False))
    assert [layer.state for layer in layer_measures(Scene.from_snapshot(cut(now), cut(start)))] == ["yes", "not yet"]


def turned(snap, matrix, shift):
    fields = dict(snap.fields)
    fields["position"] = fields["position"] @ matrix.T + shift
    fields["velocity"] = fields["velocity"] @ matrix.T
    return replace(snap, fields=fields)


def rotation(rng, dim):
    matrix = np.linalg.qr(rng.normal(size=(dim, dim)))[0]
    matrix[:, -1] *= np.sign(np.linalg.det(matrix))
    return matrix


@pytest.mark.parametrize("dim", [2, 3])
def test_a_turned_shot_measures_the_same(dim):
    start, now = holed(dim, 10 * MM, 500.0)
    rng = np.random.default_rng(5)
    now.fields["position"] += rng.uniform(-0.1 * DX, 0.1 * DX, now.fields["position"].shape)
    straight = timed(now, start)
    for _ in range(3):
        matrix, shift = rotation(rng, dim), rng.uniform(-1.0, 1.0, dim)
        found = timed(turned(now, matrix, shift), turned(start, matrix, shift))
        same(found, straight)
        np.testing.assert_allclose(found.fragments[1].fragments[0].velocity, 0.0, atol=1e-12)
        np.testing.assert_allclose(found.fragments[0].fragments[0].velocity, matrix[:, 0] * 500.0, atol=1e-9)


@pytest.mark.parametrize("dim", [2, 3])
def test_a_shot_whose_layers_fly_measures_the_same(dim):
    """A reversed impact, and one seen from a train: lengths and velocities are against the layers."""
    start, now = holed(dim, 10 * MM, 500.0)
    now.metadata["witness"] = 60 * MM
    still = timed(now, start)
    for drift in ([-1000.0, 0.0, 0.0], [300.0, -70.0, 20.0]):
        seen = []
        for one in (start, now):
            velocity = one.fields["velocity"] + drift[:dim]
            position = one.fields["position"] + one.time * np.array(drift[:dim])
            told = {"roles": ["projectile", None, None]}
            seen.append(replace(one, fields=one.fields | {"velocity": velocity, "position": position},
                                metadata=one.metadata | {"shot": told}))  # fmt: skip
        found = timed(seen[1], seen[0])
        same(found, still, 1e-8)
        piece = found.fragments[0].fragments[0]  # of these the case's own
        np.testing.assert_allclose(piece.velocity, np.array([500.0, 0.0, 0.0])[:dim] + drift[:dim], atol=1e-9)
        np.testing.assert_allclose(piece.centre[0], 10 * MM + drift[0] * now.time, atol=1e-4)


def same(found, straight, relative=1e-9):
    """Every measure has the same value, or the same reason."""
    pairs = [(found.results, straight.results), (found.projectile, straight.projectile)]
    pairs += [(found.cloud.results, straight.cloud.results)]
    for told, other in ((found.cloud.over_angle, straight.cloud.over_angle), (found.profile, straight.profile),
                        (found.cloud.witness, straight.cloud.witness)):  # fmt: skip
        assert told.keys() == other.keys()
        for name, values in other.items():
            scale = np.abs(values).max() if np.size(values) else 0.0
            np.testing.assert_allclose(told[name], values, rtol=relative, atol=relative * scale, err_msg=name)
    pairs += [(a.results, b.results) for a, b in zip(found.layers, straight.layers, strict=True)]
    assert [layer.state for layer in found.layers] == [layer.state for layer in straight.layers]
    for one, other in pairs:
        assert one.keys() == other.keys()
        for name, result in other.items():
            if result.value is None:
                assert one[name].value is None, name
            else:
                # lengths are differences of coordinates of up to a metre, velocities of sums of 500 m/s
                tiny = {"m": 1e-12, "Pa": 0.01}.get(result.unit, 1e-9)
                assert one[name].value == pytest.approx(result.value, rel=relative, abs=tiny), name


def timed(now, start):
    """Every measure of a run of two snapshots, with what only the first of them tells."""
    return measure_scene(in_time(start, now))


def in_time(*snapshots):
    """Scene of the last of some snapshots, with those before it."""
    scenes = [Scene.from_snapshot(one, snapshots[0]) for one in snapshots]
    scenes[-1].timeline = Timeline(scenes.__getitem__, len(scenes))
    return scenes[-1]


@pytest.mark.parametrize(("dim", "planes"), [(2, "y"), (3, "y"), (3, "yz")])
@pytest.mark.parametrize("case", [(10 * MM, 500.0, (True, False)), (-3 * MM, -50.0, (False, False)),
                                  (30 * MM, 300.0, (True, True))])  # fmt: skip
def test_half_and_quarter_measure_as_the_whole(dim, planes, case):
    start, now = holed(dim, *case)
    now.metadata["witness"] = 60 * MM
    whole = timed(now, start)
    assert bool(whole.cloud.witness) == (case[2][0])
    told = {"planes": [{"axis": axis, "at": 0.0} for axis in planes]}
    parts = []
    for snap in (start, now):
        kept = (snap.fields["position"][:, 1 : 1 + len(planes)] > 0.0).all(axis=1)
        fields = {name: values[kept] for name, values in snap.fields.items()}
        part = replace(snap, fields=fields, body=snap.body[kept], material=snap.material[kept], id=snap.id[kept])
        parts.append(replace(part, metadata={**part.metadata, "shot": told}))
    found = timed(parts[1], parts[0])
    assert found.whole.factor == 2 ** len(planes)
    same(found, whole)
    for one, other in zip(found.fragments, whole.fragments, strict=True):
        assert one.counts.tolist() == other.counts.tolist()
        np.testing.assert_allclose(one.masses, other.masses, rtol=1e-9)


def test_roles_by_default():
    start, _ = holed(2, 0.0, 0.0)
    assert roles_of(start, start) == ("projectile", "layer", "layer")
    # a target that is listed first is one all the same; so is a core that flies with its jacket
    start.fields["velocity"][:, 0] = np.array([0.0, 900.0, 900.0])[start.body]
    assert roles_of(start, start) == ("other", "projectile", "projectile")  # it lies behind
    start.fields["velocity"][:, 0] = np.array([0.0, 0.0, -900.0])[start.body]
    assert roles_of(start, start) == ("layer", "layer", "projectile")
    assert roles_of(start, start, (None, "other", None)) == ("layer", "other", "projectile")
    assert roles_of(start, start, ("projectile", None, None)) == ("projectile", "layer", "layer")
    assert roles_of(None, start) == ("projectile", "layer", "layer")


def test_a_gas_around_a_projectile_is_no_layer():
    gas = "{material: {density: 1.2, eos: {type: ideal_gas, gamma: 1.4}}, internal_energy: 2e5, shape: {type: disc, diameter: 5 mm}}"
    assert stated_roles(load_case("al_al_coarse", [f"bodies.air={gas}"])) == [None, None, "other"]
    thrown = load_case("al_al_coarse", [f"bodies.air={gas}", "bodies.air.velocity=[1 km/s, 0]"])
    assert stated_roles(thrown) == [None, None, None]
    assert stated_roles(load_case("al_al_coarse", [f"bodies.air={gas}", "bodies.air.role=layer"]))[2] == "layer"


def test_a_run_without_a_projectile_has_a_scene_and_says_so():
    start, now = holed(2, 30 * MM, 300.0, (True, True))
    start.metadata["shot"] = now.metadata["shot"] = {"roles": ["other"] * 3}
    scene = Scene.from_snapshot(now, start)
    assert (scene.layers, len(scene.shot_groups), scene.width) == ((), 0, 0.0)
    assert scene.axis.tolist() == [0.0]
    with pytest.raises(OutputError, match="role: projectile"):
        measure_snapshot(now, start)


def test_times_are_found_by_bisection():
    start, _ = holed(2, 30 * MM, 300.0, (True, True))
    loaded = []

    def load(number):
        """Perforated from 13 and 61 on, passed from 17 on."""
        loaded.append(number)
        x = 10 * MM if number >= 17 else -3 * MM
        snap = holed(2, x, 10.0 * number, (number >= 13, number >= 61))[1]
        return Scene.from_snapshot(replace(snap, time=1e-6 * number), start)

    scene = load(64)
    scene.timeline = Timeline(load, 65)
    first, second = (layer.results for layer in layer_measures(scene))
    assert first["exit_time"].value == pytest.approx(16.5e-6)
    assert first["exit_velocity"].value == pytest.approx(170.0)
    assert "not behind" in second["exit_velocity"].reason
    assert first["perforation_time"].value == pytest.approx(12.5e-6)
    assert second["perforation_time"].value == pytest.approx(60.5e-6)
    assert first["perforation_time"].uncertainty == pytest.approx(0.5e-6)
    assert len(set(loaded)) < 26


@pytest.mark.parametrize("dim", [2, 3])
def test_the_projectile_at_its_exit(dim):
    start, now = holed(dim, 10 * MM, 500.0, (True, False))
    moment = Moment(lambda: Scene.from_snapshot(now, start))
    assert moment.passed == (True, False)
    assert moment.exit["exit_velocity"] == pytest.approx(500.0)
    assert moment.exit["exit_mass_fraction"] == pytest.approx(1.0)
    assert Moment(lambda: Scene.from_snapshot(start, start)).passed == (False, False)


@pytest.mark.parametrize("dim", [2, 3])
def test_what_a_later_wall_receives(dim):
    """A ball stuck in the wall, which has its momentum now: over its width, since the middle of two moments."""
    start = moment([shot(dim, -3 * MM), *plates(dim)], [1000.0, 0.0, 0.0])
    now = moment([shot(dim, 23 * MM), *plates(dim)], [0.0, 0.0, 2.0], time=3e-5)
    first, wall = measure_snapshot(now, start).layers
    mass = now.fields["mass"][now.body == 2].sum()
    assert wall.results["impulse"].value == pytest.approx(2.0 * mass)
    assert first.results["impulse"].value == pytest.approx(0.0, abs=1e-12)
    # 90 % of a ball's or a disc's mass is within 0.886 or 0.80 of its radius; the centre of a particle is half of dx off
    share = {2: 0.805, 3: 0.886}[dim]
    assert wall.results["loaded_diameter"].value == pytest.approx(share * 6 * MM + DX, abs=1.01 * DX)
    between = moment([shot(dim, 8 * MM), *plates(dim)], [900.0, 0.0, 0.0], time=1e-5)
    scene = in_time(start, between, now)
    assert [scene.timeline.moment(k).struck for k in range(3)] == [(True, False), (True, False), (True, True)]
    wall = layer_measures(scene)[1]
    area = wall.results["loaded_diameter"].value
    area = area if dim == 2 else 0.25 * np.pi * area**2
    assert wall.results["mean_pressure"].value == pytest.approx(2.0 * mass / area / 1e-5)


def at_layer(start, now, number=0):
    return layer_measures(Scene.from_snapshot(now, start))[number].results


@pytest.mark.parametrize("dim", [2, 3])
def test_a_round_hole_has_its_diameter_in_every_direction(dim):
    start, now = holed(dim, 10 * MM, 500.0, (True, False), radius=6 * MM)
    found = at_layer(start, now)
    # edges of a round hole in a lattice are stairs of one spacing
    hole = {name: one.value for name, one in found["hole_diameter"].variants.items()}
    for name in ("mean", "front", "rear", "clear"):
        assert hole[name] == pytest.approx(12 * MM, abs=DX), name
    assert 11 * MM < hole["min"] <= found["hole_diameter"].value + 1e-12
    assert hole["mean"] - 1e-12 <= hole["max"] < 13 * MM
    size = {2: 2 * 6 * MM, 3: np.pi * (6 * MM) ** 2}[dim]
    if dim == 3:
        assert found["hole_area"].value == pytest.approx(size, rel=0.05)
    assert found["mass_loss"].value == pytest.approx(size * THICK * 2785.0, rel=0.05)
    assert found["front_lip_height"].value == pytest.approx(0.0, abs=1e-12)
    assert found["rear_lip_height"].value == pytest.approx(0.0, abs=1e-12)
    assert hole["mass_loss"] == pytest.approx(12 * MM, rel=0.03)
    assert {found[name].value for name in ("crater_depth", "bulge_height", "spall_mass")} == {None}


def test_an_oval_hole_off_the_shot_line():
    layers = plates(3)
    start = moment([shot(3, -3 * MM), *layers], [1000.0, 0.0, 0.0])
    parts = [shot(3, 10 * MM), *layers]
    position, body = np.concatenate(parts), np.repeat([0, 1, 2], [len(part) for part in parts])
    inside = ((position[:, 1] - 3 * MM) / (7 * MM)) ** 2 + ((position[:, 2] + 2 * MM) / (4 * MM)) ** 2 < 1.0
    found = at_layer(start, moment(parts, [500.0, 0.0, 0.0], ~(inside & (body == 1)), time=1e-5))
    assert found["hole_diameter"].variants["min"].value == pytest.approx(8 * MM, abs=1.5 * DX)
    assert found["hole_diameter"].variants["max"].value == pytest.approx(
        14 * MM, abs=2 * DX
    )  # its pointed ends, by sectors of 2 dx
    assert found["hole_area"].value == pytest.approx(np.pi * 28 * MM**2, rel=0.08)


@pytest.mark.parametrize("dim", [2, 3])
def test_a_crater_has_depth_diameter_and_a_bulge_behind_it(dim):
    layers = plates(dim)
    start = moment([shot(dim, -3 * MM), *layers], [1000.0, 0.0, 0.0])
    parts = [shot(dim, -1.5 * MM), *layers]
    position, body = np.concatenate(parts), np.repeat([0, 1, 2], [len(part) for part in parts])
    radius = np.sqrt((position[:, 1:] ** 2).sum(axis=1))
    parts[1] = parts[1].copy()
    own = radius[body == 1]
    parts[1][(own < 2 * MM) & (parts[1][:, 0] > 2 * MM), 0] += 1 * MM
    pressed = (body == 1) & (radius < 4 * MM) & (position[:, 0] < 1.5 * MM)
    found = at_layer(start, moment(parts, [0.0, 0.0, 0.0], ~pressed, time=1e-5))
    assert found["crater_depth"].value == pytest.approx(1.5 * MM, abs=1e-9)
    assert found["crater_outer_diameter"].value == pytest.approx(8 * MM, abs=DX)
    assert found["bulge_height"].value == pytest.approx(1 * MM, abs=1e-9)
    assert {found[name].value for name in ("hole_diameter", "rear_lip_height", "spall_mass")} == {None}
    assert "not perforated" in found["hole_diameter"].reason


def test_spall_is_what_comes_off_the_rear():
    layers = plates(3)
    start = moment([shot(3, -3 * MM), *layers], [1000.0, 0.0, 0.0])
    parts = [shot(3, -3 * MM), layers[0].copy(), layers[1]]
    flake = (np.sqrt((parts[1][:, 1:] ** 2).sum(axis=1)) < 3 * MM) & (parts[1][:, 0] > 2 * MM)
    parts[1][flake, 0] += 5 * MM
    now = moment(parts, [-20.0, 0.0, 0.0], time=1e-5)
    now.fields["velocity"][np.flatnonzero(now.body == 1)[flake], 0] = 150.0
    found = at_layer(start, now)
    assert found["spall_velocity"].value == pytest.approx(150.0)
    assert found["spall_thickness"].value == pytest.approx(1 * MM)
    assert found["spall_mass"].value == pytest.approx(flake.sum() * 2785.0 * DX**3)
    assert found["mass_loss"].value == pytest.approx(found["spall_mass"].value)
    # a wall that is not perforated yet has failed by its spall all the same: the verdict names it
    (layer, *_) = layer_measures(Scene(now, start))
    assert perforation_text([layer]).endswith(
        f"not perforated, {1e3 * found['spall_mass'].value:.2g} g of spall behind it"
    )


@pytest.mark.parametrize("blister", [False, True])
def test_slow_spall_has_come_off_and_what_is_loose_behind_a_blister_has_not(blister):
    layers = plates(3)
    start = moment([shot(3, -3 * MM), *layers], [8000.0, 0.0, 0.0])
    parts = [shot(3, -3 * MM), layers[0].copy(), layers[1]]
    radius, depth = np.sqrt((parts[1][:, 1:] ** 2).sum(axis=1)), parts[1][:, 0].copy()
    outermost = depth > depth.max() - 0.5 * DX
    flake = (radius < 2 * MM) & (depth > 2 * MM) & ~outermost
    if blister:
        parts[1][outermost, 0] += 6 * MM * np.clip(1.5 - radius[outermost] / (6 * MM), 0.0, 1.0)
    else:
        flake |= (radius < 2 * MM) & outermost
    parts[1][flake, 0] += 3 * MM
    now = moment(parts, [-20.0, 0.0, 0.0], time=1e-5)
    now.fields["velocity"][np.flatnonzero(now.body == 1)[flake], 0] = 300.0 if blister else 1.0
    found = at_layer(start, now)
    assert found["mass_loss"].value == pytest.approx(flake.sum() * 2785.0 * DX**3)
    assert found["spall_velocity"].value == (None if blister else pytest.approx(1.0))


@pytest.mark.parametrize("angle", [30.0, 45.0, 60.0])
@pytest.mark.parametrize("dim", [2, 3])
def test_an_oblique_plate_is_measured_along_its_own_normal(dim, angle):
    """The plate of a normal shot, turned: its hole keeps its size about the plate's own normal."""
    turn = np.eye(dim)
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    turn[:2, :2] = [[c, -s], [s, c]]
    plate = plates(dim)[0] - [0.5 * THICK, *[0.0] * (dim - 1)]
    near = np.sqrt((plate[:, 1:] ** 2).sum(axis=1)) < 5 * MM
    start = moment([shot(dim, -15 * MM), plate @ turn.T], [1000.0, 0.0])
    parts = [shot(dim, 25 * MM), plate @ turn.T]
    now = moment(parts, [500.0, 0.0], np.concatenate([np.ones(len(parts[0]), bool), ~near]), time=1e-5)
    layer = layer_measures(Scene.from_snapshot(now, start))[0]
    assert np.degrees(layer.obliquity) == pytest.approx(angle, abs=1e-6)
    assert layer.state == "yes"
    assert layer.results["hole_diameter"].value == pytest.approx(10 * MM, abs=DX)
    assert layer.results["rear_lip_height"].value == pytest.approx(0.0, abs=1e-12)


def test_catalogue_of_layers_knows_every_measure_and_its_unit():
    start, now = holed(3, 10 * MM, 500.0)
    for layer in layer_measures(Scene.from_snapshot(now, start)):
        assert list(layer.results) == list(SECTIONS["layer"])
        for name, result in layer.results.items():
            assert result.unit == SECTIONS["layer"][name].unit, name


def test_what_still_moves_is_not_settled():
    end = {
        "velocity": Result(300.0, "m/s", 4.0),
        "depth": Result(5e-3, "m", spacing=1e-4),
        "gone": Result(1.0, ""),
    }
    before = {"velocity": Result(490.0, "m/s", 4.0), "depth": Result(5.05e-3, "m"), "gone": undefined_result("", "why")}
    found = add_variation(end, 1e-5, [(0.95e-5, before)])
    assert found["velocity"].uncertainty_by == pytest.approx({"variation": 95.0, "scatter": 4.0})
    assert not found["velocity"].settled
    assert found["velocity"].as_dict()["settled"] is False
    assert found["depth"].settled
    assert found["depth"].uncertainty_by == pytest.approx({"variation": 2.5e-5, "spacing": 1e-4})
    assert found["gone"] == end["gone"]
    # a moment further back than a tenth of the run tells a drift
    assert add_variation(end, 1e-5, [(0.8e-5, before)])["velocity"].variation == pytest.approx(47.5)
    assert Result.from_dict(found["velocity"].as_dict()) == found["velocity"]


def test_moments_of_the_last_tenth():
    assert recent_moments([0.0, 5.0, 8.0], 10.0) == [2]
    assert recent_moments([0.0, 8.9, 9.2, 9.6], 10.0) == [2, 3]
    assert len(recent_moments(np.linspace(0, 9.9, 100).tolist(), 10.0)) <= 4
    assert recent_moments([], 10.0) == []


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("height", [1.0, 2.0, 5.0])
def test_the_hole_of_a_dished_plate_is_its_clear_width(dim, height):
    """A sheet that leaves its slab, wholly or in part: slices of the slab cut it where it bends, not at the hole."""
    start, now = holed(dim, 30 * MM, 300.0, (True, True))
    flat = layer_measures(Scene.from_snapshot(now, start))[0].results["hole_diameter"]
    assert flat.value == pytest.approx(flat.variants["clear"].value, rel=0.05)
    radius = np.sqrt((now.fields["position"][:, 1:] ** 2).sum(axis=1))
    sheet = now.body == 1
    now.fields["position"][sheet, 0] += height * MM * np.clip(2.0 - radius[sheet] / (5 * MM), 0.0, 1.0)
    bent = layer_measures(Scene.from_snapshot(now, start))[0].results["hole_diameter"]
    assert bent.value == pytest.approx(flat.value, rel=0.05)
    assert bent.uncertainty == pytest.approx(DX)
    assert "bent out of its place" in bent.note
    assert bent.variants["max"].value is None


@pytest.mark.parametrize("dim", [2, 3])
def test_a_countersunk_hole_is_not_bent(dim):
    """Matter that is gone, not moved: a hole 16 mm wide in front and 7 mm behind has its mean diameter."""
    layers = plates(dim)
    start = moment([shot(dim, -3 * MM), *layers], [1000.0, 0.0, 0.0])
    parts = [shot(dim, 30 * MM), *layers]
    position, body = np.concatenate(parts), np.repeat([0, 1, 2], [len(part) for part in parts])
    edge = 8 * MM - 1.5 * position[:, 0]
    gone = (body == 1) & (np.sqrt((position[:, 1:] ** 2).sum(axis=1)) < edge)
    found = at_layer(start, moment(parts, [500.0, 0.0, 0.0], ~gone, time=1e-5))["hole_diameter"]
    assert found.note == ""
    assert found.value == pytest.approx(11.5 * MM, abs=2 * DX)


def test_failed_matter_that_is_not_detached_is_told_beside_the_number_of_fragments():
    start, now = holed(3, -3 * MM, -50.0, (False, False))
    damage = np.where((now.body == 1) & (np.abs(now.fields["position"][:, 1]) < 10 * MM), 1.0, 0.0)
    found = measure_snapshot(replace(now, fields=now.fields | {"damage": damage}), start)["target_fragments"]
    assert found.value == 0.0
    assert "67 % of its mass has failed" in found.note


def test_velocities_are_no_better_known_than_half_a_spacing_of_the_projectile():
    start, now = holed(3, 30 * MM, 300.0, (True, True))
    found = measure_snapshot(now, start)["residual_velocity"]
    assert found.uncertainty_by["discretization"] == pytest.approx(300.0 * DX / (6 * MM), rel=0.1)
    assert found.uncertainty >= found.uncertainty_by["discretization"]


def test_every_measure_is_computed_by_one_function():
    for section, rows in SECTIONS.items():
        names = [name for entry in entries()[section] for name in entry.names]
        assert sorted(names) == sorted(rows)


def test_bodies_have_mass_velocity_and_kinetic_energy():
    start, now = holed(3, 30 * MM, 300.0, (True, True))
    table = measure_snapshot(now, start).bodies
    mass = now.fields["mass"][now.body == 0].sum()
    assert table["shot"]["mass"] == pytest.approx(mass)
    assert table["shot"]["velocity"] == pytest.approx([300.0, 0.0, 0.0])
    assert table["shot"]["kinetic_energy"] == pytest.approx(0.5 * mass * 300.0**2)
    assert table["wall"]["kinetic_energy"] == 0.0


def test_the_struck_face_is_that_of_whole_cells():
    """Where the rim begins within a cell, one column of it tells nothing: its particles may have moved inwards."""
    depth = np.array([0.0, 1.0, 0.0, 1.0, 0.7]) * MM
    across = np.array([[0.2], [0.2], [1.1], [1.1], [0.9]]) * MM
    assert front_surface(depth, across, np.ones(5), 0.8 * MM)[0].tolist() == [0.0, 0.0]
