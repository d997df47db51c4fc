"""Craters and ejecta: bodies of known shape, ballistic flight with and without gravity, invariance against turns."""

from dataclasses import replace

import numpy as np
import pytest
from measure_bodies import MM, ball, box, snapshot

from hvisph.core.measure_catalogue import format_of
from hvisph.measures.measure import measure, measure_snapshot
from hvisph.measures.measurement_frame import Scene
from hvisph.measures.targets import layer_measures
from hvisph.output.hdf5 import write_hdf5

DX = 0.5 * MM
HALF, THICK = 30 * MM, 16 * MM


def plate(dim, radius=0.0, lip=0.0):
    """A plate with a hollow of a spherical cap about the origin, and a lip of a height beyond its edge, 3 mm wide."""
    x = box([-3 * MM, *[-HALF] * (dim - 1)], [THICK, *[HALF] * (dim - 1)], DX)
    r = np.sqrt((x[:, 1:] ** 2).sum(axis=1))
    inside = (x**2).sum(axis=1) < radius**2
    on_the_lip = (x[:, 0] > -lip) & (r >= radius) & (r < radius + 3 * MM)
    return x[((x[:, 0] > 0.0) & ~inside) | on_the_lip]


def moments(dim, radius=10 * MM, lip=0.0, time=1e-4, velocity=None):
    """A whole plate before the impact, and one with a crater."""
    shot = ball([-5 * MM - 3 * DX, *[0.0] * (dim - 1)], 6 * MM, DX)
    start = snapshot(shot, plate(dim), dx=DX)
    now = snapshot(shot - np.eye(dim)[0] * 40 * MM, plate(dim, radius, lip), time=time, dx=DX)
    now.fields["velocity"][:] = 0.0
    if velocity is not None:
        velocity(now)
    return start, now


def layer(start, now):
    return layer_measures(Scene.from_snapshot(now, start))[0].results


@pytest.mark.parametrize(("dim", "lip"), [(2, 0.0), (2, 2 * MM), (3, 0.0), (3, 2 * MM)])
def test_depth_diameter_and_volume_of_a_bowl(dim, lip):
    """Half a sphere, or in the plane half a disc. Cells are 1 mm wide: volume to 4 % of the exact one."""
    found = layer(*moments(dim, lip=lip))
    r = 10 * MM
    exact = {2: 0.5 * np.pi * r**2, 3: 2.0 / 3.0 * np.pi * r**3}[dim]
    assert found["crater_volume"].value == pytest.approx(exact, rel=0.04)
    assert found["crater_volume"].unit == {2: "m^2", 3: "m^3"}[dim]
    # depth r and diameter 2 r are uncertain by dx each; tables print the same unit
    share = DX * np.hypot(1.0 / r, (dim - 1) / (2.0 * r))
    assert found["crater_volume"].uncertainty == pytest.approx(share * found["crater_volume"].value, rel=0.1)
    assert format_of("crater_volume", found["crater_volume"].unit).unit == found["crater_volume"].unit
    depth, wide = found["crater_depth"].variants, found["crater_outer_diameter"].variants
    assert depth["face"].value == pytest.approx(r, abs=DX)
    assert wide["face"].value == pytest.approx(2 * r, abs=2 * DX)
    if lip:
        assert depth["rim"].value == pytest.approx(r + lip, abs=DX)
        assert 2 * r < wide["rim"].value < 2 * (r + 3 * MM)  # the crest is 3 mm wide
    else:
        assert "no rim" in depth["rim"].reason
    assert "--at all" in depth["transient"].reason
    assert depth["face"].settled


def graded(dim):
    """Places and spacings of a plate whose rows, down and along the face, grow by a tenth from 4 mm on, first 0.5 mm."""
    sizes, edge = [], 0.0
    while edge < 24 * MM:
        sizes.append(max(0.1 * (edge + 1 * MM), DX))
        edge += sizes[-1]
    size = np.array(sizes)
    middle = np.cumsum(size) - 0.5 * size
    both, wide, deep = np.concatenate([-middle[::-1], middle]), np.concatenate([size[::-1], size]), middle < 18 * MM
    x = np.stack([one.ravel() for one in np.meshgrid(middle[deep], *[both] * (dim - 1), indexing="ij")], axis=1)
    edges = [one.ravel() for one in np.meshgrid(size[deep], *[wide] * (dim - 1), indexing="ij")]
    return x, np.max(edges, axis=0)


@pytest.mark.parametrize(("dim", "slope", "seed"), [(2, None, 0), (2, None, 1), (2, 0.6, 0), (2, 0.6, 1), (3, 0.6, 1)])
def test_bowls_and_slumped_cones_in_graded_layers(dim, slope, seed):
    """Half a sphere of 12 mm, or sides at 31 degrees down to the axis; particles are 0.5 to 1.3 mm wide there.

    With a `seed` they are off their places by up to 0.3 of their spacings, as in matter that has slid: columns as wide
    as the finest particles hold few, of which the foremost may lie deep.
    """
    place, own = graded(dim)
    shot, r = ball([-5 * MM - 3 * DX, *[0.0] * (dim - 1)], 6 * MM, DX), 12 * MM
    start = snapshot(shot, place, dx=DX, h_over_dx=1.4)
    target = start.body == 1
    start.fields["smoothing_length"][target] = 1.4 * own
    start.fields["mass"][target] *= (own / DX) ** dim
    x = place + (seed > 0) * 0.3 * own[:, None] * np.random.default_rng(seed).uniform(-1.0, 1.0, place.shape)
    x[:, 0] = np.maximum(x[:, 0], 0.2 * own)
    off, kept = np.sqrt((x[:, 1:] ** 2).sum(axis=1)), np.ones(start.count, dtype=bool)
    kept[target] = off + x[:, 0] / slope > r if slope else (x**2).sum(axis=1) > r**2
    fields = start.fields | {"position": np.concatenate([shot - np.eye(dim)[0] * 40 * MM, x]),
                             "velocity": np.zeros((start.count, dim))}  # fmt: skip
    found = layer(start, replace(start, time=1e-4, fields=fields).part(kept))
    depth = slope * r if slope else r
    exact = np.pi * r**2 * depth / 3.0 if dim == 3 else depth * r * (1.0 if slope else 0.5 * np.pi)
    # cells are two spacings of 0.8 mm wide at the tip of a cone; half a finest spacing over the surface is a tenth
    assert found["crater_depth"].value == pytest.approx(depth, abs=1.6 * MM if slope else 0.8 * MM)
    assert found["crater_outer_diameter"].value == pytest.approx(2 * r, abs=2.6 * MM)
    assert found["crater_volume"].value == pytest.approx(exact, rel=0.1)
    assert found["bulge_height"].value < 0.9 * MM  # 0.3 of 2.5 mm, by the seed


def test_a_layer_of_revolution_has_the_volume_of_the_solid():
    """The section of an axisymmetric run, one side of which is computed."""
    start, now = moments(2)
    parts = [replace(one.part(one.fields["position"][:, 1] > 0.0),
                     metadata=one.metadata | {"kinematics": "axisymmetric"}) for one in (start, now)]  # fmt: skip
    found = layer(*parts)["crater_volume"]
    assert found.unit == "m^3"
    assert found.value == pytest.approx(2.0 / 3.0 * np.pi * (10 * MM) ** 3, rel=0.04)


def test_a_crater_whose_floor_moves_on_still_grows():
    def sink(now):
        x = now.fields["position"]
        now.fields["velocity"][(now.body == 1) & ((x**2).sum(axis=1) < (12 * MM) ** 2), 0] = 20.0

    found = layer(*moments(2, velocity=sink))["crater_depth"]
    # of the floor, the least depth of which is 0.8 of the greatest; some of its cells are beside what sinks
    assert float(found.note.split()[-2]) == pytest.approx(20.0, rel=0.1)
    assert not found.settled


@pytest.mark.parametrize("dim", [2, 3])
def test_an_emptied_crater_is_without_failed_matter_that_rises(dim):
    """A bowl of failed matter at 5 m/s with sound grains in it; about it what is sound, or falls back: 1 cm take 0.44."""

    def rise(now):
        r = np.sqrt((now.fields["position"] ** 2).sum(axis=1))
        own = now.body == 1
        now.fields["damage"] = np.where(own & (r < 14 * MM), 1.0, 0.0)
        now.fields["velocity"][own & (r < 14 * MM), 0] = -0.01
        now.fields["velocity"][own & (r < 10 * MM), 0] = -5.0
        grains = own & (r < 7 * MM) & (np.arange(now.count) % 7 == 0)
        now.fields["damage"][grains] = 0.0

    found = layer(*moments(dim, radius=0.0, velocity=rise))
    depth, wide = found["crater_depth"].variants, found["crater_outer_diameter"].variants
    assert depth["face"].value < DX
    assert depth["emptied"].value == pytest.approx(10 * MM, abs=DX)
    assert wide["emptied"].value == pytest.approx(20 * MM, abs=2 * DX)


def test_the_transient_crater_is_the_one_of_the_greatest_volume(tmp_path):
    """Three moments, the second with the largest crater."""
    files = []
    start = None
    for number, radius in enumerate((0.0, 10 * MM, 8 * MM)):
        start, now = moments(2, radius=radius, time=number * 1e-4)
        files.append(tmp_path / f"{number}.vtkhdf")
        write_hdf5(files[-1], start if number == 0 else now)
    found = measure(tmp_path, at="all").layers[0].results
    assert found["crater_depth"].value == pytest.approx(8 * MM, abs=DX)
    largest = found["crater_depth"].variants["transient"]
    assert largest.value == pytest.approx(10 * MM, abs=DX)
    assert largest.time == pytest.approx(1e-4)
    volume = found["crater_volume"].variants
    assert volume["face"].value / volume["transient"].value == pytest.approx(0.64, rel=0.05)


def test_an_ejecta_curtain_is_no_rim():
    """Matter that flies over the edge of the crater and is still connected to it: only without velocity it is a lip."""
    start, now = moments(2, lip=3 * MM)
    high = (now.body == 1) & (now.fields["position"][:, 0] < 0.0)
    assert layer(start, now)["crater_depth"].variants["rim"].value == pytest.approx(13 * MM, abs=0.5 * DX)
    now.fields["velocity"][high, 0] = -3 * MM / now.time
    # what is within 2 dx of the struck face, 1 mm, is none of the ejecta
    assert layer(start, now)["crater_depth"].variants["rim"].value == pytest.approx(11 * MM, abs=0.5 * DX)


def flown(start, speeds, angles, launched, g=0.0, time=2e-3, **metadata):
    """A moment at which target particles launched at t = 0 from the struck face have flown."""
    now = replace(start, time=time, fields={name: one.copy() for name, one in start.fields.items()},
                  metadata=start.metadata | metadata)  # fmt: skip
    rows = np.flatnonzero(now.body == 1)[: len(speeds)]
    up, along = speeds * np.sin(angles), speeds * np.cos(angles)
    now.fields["position"][rows] = np.stack([-(up * time - 0.5 * g * time**2), launched + along * time], 1)
    now.fields["velocity"][rows] = np.stack([-(up - g * time), along], 1)
    now.fields["velocity"][now.body == 0] = 0.0
    return now, rows


@pytest.mark.parametrize("g", [0.0, 3000.0])
@pytest.mark.parametrize("turn", [0.0, 37.0])
def test_launch_follows_from_any_later_moment(g, turn):
    start, _ = moments(2)
    speeds, angles = np.array([20.0, 35.0, 60.0]), np.radians([45.0, 50.0, 60.0])
    launched = np.array([6.0, 4.0, 2.0]) * MM
    now, rows = flown(start, speeds, angles, launched, g, gravity={"acceleration": [g, 0.0]} if g else {})
    if turn:
        c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
        turned = np.array([[c, s], [-s, c]])
        fields = [{name: one.fields[name] @ turned if name in ("position", "velocity") else one.fields[name]
                   for name in one.fields} for one in (start, now)]  # fmt: skip
        start, now = (replace(one, fields=new) for one, new in zip((start, now), fields, strict=True))
        if g:
            now.metadata["gravity"] = {"acceleration": (np.array([g, 0.0]) @ turned).tolist()}
    found = measure_snapshot(now, start)
    mass = now.fields["mass"][rows]
    # exact parabolas: round-off
    assert found["ejecta_mass"].value == pytest.approx(mass.sum(), rel=1e-9)
    assert found.layers[0].results["ejecta_angle"].value == pytest.approx(angles.mean(), rel=1e-9)
    assert found.layers[0].results["ejecta_radius"].value == pytest.approx(launched.mean(), rel=1e-9)
    table = found.ejecta
    assert np.allclose(table["mass"], np.cumsum(mass)[::-1])
    assert np.allclose(np.array(table["angle"]), angles)
    assert np.allclose(table["radius"], launched)
    assert (np.array(table["speed"]) <= speeds).all()
    assert (np.array(table["speed"]) * 10**0.1 > speeds).all()


def test_beta_of_what_escapes():
    start, _ = moments(2)
    speeds, angles = np.array([20.0, 60.0]), np.full(2, 0.5 * np.pi)
    launched = np.zeros(2)
    now, rows = flown(start, speeds, angles, launched)
    brought = 3100.0 * start.fields["mass"][start.body == 0].sum()
    gain = now.fields["mass"][rows] * speeds / brought

    def escaping(**metadata):
        return measure_snapshot(replace(now, metadata=now.metadata | metadata), start)["beta"].variants["escaping"]

    assert escaping().value == pytest.approx(1.0 + gain.sum(), rel=1e-12)
    assert escaping(escape=30.0).value == pytest.approx(1.0 + gain[1], rel=1e-12)
    assert "give `escape`" in escaping(gravity={"acceleration": [1.0, 0.0]}).reason
    # a sphere whose surface is the struck face at the origin, and whose escape velocity there is 30 m/s
    sphere = {"centre": [1.0, 0.0], "mass_parameter": 450.0, "radius": 1.0}
    assert escaping(gravity=sphere).value == pytest.approx(1.0 + gain[1], rel=1e-12)


def test_nothing_rises():
    start, now = moments(2)
    found = measure_snapshot(now, start)
    assert found["beta"].value == 1.0
    assert "nothing rises" in found.layers[0].results["ejecta_angle"].reason
    assert found.ejecta == {}


@pytest.mark.parametrize("dim", [2, 3])
def test_the_face_of_a_sphere_is_its_initial_surface(dim):
    """A bowl of 8 mm at the pole of a ball of 80 mm; the surface falls back by 16 mm within the rim."""
    shot = ball([-5 * MM, *[0.0] * (dim - 1)], 6 * MM, DX)
    dx = {2: 1, 3: 2}[dim] * DX
    body = ball([40 * MM, *[0.0] * (dim - 1)], 80 * MM, dx)
    hollow = (body**2).sum(axis=1) < (8 * MM) ** 2
    start = snapshot(shot, body, dx=dx)
    whole, struck = (snapshot(shot, bodies, time=1e-4, dx=dx) for bodies in (body, body[~hollow]))
    struck.id = start.id[np.concatenate([np.ones(len(shot), dtype=bool), ~hollow])]
    untouched, found = layer(start, whole), layer(start, struck)
    assert untouched["crater_depth"].value == pytest.approx(0.0, abs=1e-12)
    assert untouched["crater_volume"].value == pytest.approx(0.0, abs=1e-12)
    assert found["crater_depth"].value == pytest.approx(8 * MM, abs=dx)
    # columns of 1 dx beside the edge of the bowl
    assert found["crater_volume"].value == pytest.approx(hollow.sum() * dx**dim, rel=0.15)
