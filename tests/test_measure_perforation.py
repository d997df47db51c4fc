"""Perforated or not: roles, layers and ways through them, on bodies made by hand."""

from dataclasses import replace

import numpy as np
import pytest
from measure_bodies import MM, ball, box, snapshot

from hvisph.measures.layers import layer_measures, perforated, with_times
from hvisph.measures.measure import measure_snapshot
from hvisph.measures.roles import roles_of
from hvisph.measures.scene import Scene

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
    layers = layer_measures(Scene.of(now, start))
    assert [layer.state for layer in layers] == expected
    assert [layer.body for layer in layers] == ["bumper", "wall"]
    assert all(layer.obliquity == 0.0 for layer in layers)
    assert perforated(layers).value == {"yes": 1.0, "no": 0.0, "not yet": None}[expected[-1]]


@pytest.mark.parametrize("dim", [2, 3])
def test_a_projectile_stuck_in_its_hole_has_not_perforated_the_plate(dim):
    start, now = holed(dim, 1.5 * MM, 0.0, (True, False), radius=3.3 * MM)
    assert layer_measures(Scene.of(now, start))[0].state == "no"
    start, now = holed(dim, 1.5 * MM, 200.0, (True, False), radius=3.3 * MM)
    assert layer_measures(Scene.of(now, start))[0].state == "yes"


@pytest.mark.parametrize("radius", [0.6, 1.4, 4.0])
def test_a_way_is_wider_than_three_spacings(radius):
    """Between a hole of one row and one of eight: what is linked at 2 dx is no hole."""
    start, now = holed(3, 10 * MM, 500.0, (True, False), radius=radius * DX)
    assert layer_measures(Scene.of(now, start))[0].state == ("yes" if radius > 2.0 else "no")


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
    straight = measure_snapshot(now, start)
    for _ in range(3):
        matrix, shift = rotation(rng, dim), rng.uniform(-1.0, 1.0, dim)
        found = measure_snapshot(turned(now, matrix, shift), turned(start, matrix, shift))
        same(found, straight)
        np.testing.assert_allclose(found.fragments[1].fragments[0].velocity, 0.0, atol=1e-12)
        np.testing.assert_allclose(found.fragments[0].fragments[0].velocity, matrix[:, 0] * 500.0, atol=1e-9)


def same(found, straight, relative=1e-9):
    """Every measure has the same value, or the same reason."""
    pairs = [(found.results, straight.results)]
    pairs += [(a.results, b.results) for a, b in zip(found.layers, straight.layers, strict=True)]
    assert [layer.state for layer in found.layers] == [layer.state for layer in straight.layers]
    for one, other in pairs:
        assert one.keys() == other.keys()
        for name, result in other.items():
            if result.value is None:
                assert one[name].value is None, name
            else:
                # lengths are differences of coordinates of up to a metre
                assert one[name].value == pytest.approx(result.value, rel=relative, abs=1e-12), name


@pytest.mark.parametrize(("dim", "planes"), [(2, "y"), (3, "y"), (3, "yz")])
@pytest.mark.parametrize("case", [(10 * MM, 500.0, (True, False)), (-3 * MM, -50.0, (False, False))])
def test_half_and_quarter_measure_as_the_whole(dim, planes, case):
    start, now = holed(dim, *case)
    whole = measure_snapshot(now, start)
    told = {"planes": [{"axis": axis, "at": 0.0} for axis in planes]}
    parts = []
    for snap in (start, now):
        kept = (snap.fields["position"][:, 1 : 1 + len(planes)] > 0.0).all(axis=1)
        fields = {name: values[kept] for name, values in snap.fields.items()}
        part = replace(snap, fields=fields, body=snap.body[kept], material=snap.material[kept], id=snap.id[kept])
        parts.append(replace(part, metadata={**part.metadata, "shot": told}))
    found = measure_snapshot(parts[1], parts[0])
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


def test_time_of_perforation_is_found_by_halving():
    start, now = holed(2, 30 * MM, 300.0, (True, True))
    layers = layer_measures(Scene.of(now, start))
    asked = []

    def at(number):
        asked.append(number)
        return 1e-6 * number, ["yes" if number >= 13 else "no", "yes" if number >= 61 else "not yet"]

    first, second = with_times(layers, 65, at)
    assert first.results["perforation_time"].value == pytest.approx(12.5e-6)
    assert second.results["perforation_time"].value == pytest.approx(60.5e-6)
    assert first.results["perforation_time"].uncertainty == pytest.approx(0.5e-6)
    assert len(asked) < 16
    assert len(asked) == len(set(asked))
