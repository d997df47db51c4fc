"""Bars, shells and free surfaces: what is measured of shapes and records that are known."""

from dataclasses import replace

import numpy as np
import pytest
from measure_bodies import MM, ball, box, snapshot

from hvisph.measures.measure import measure_snapshot
from hvisph.measures.measurement_frame import Scene
from hvisph.measures.result import evaluate

LENGTH, WIDTH, DX = 24 * MM, 8 * MM, 0.4 * MM


def cylinder(dx=DX):
    """Bar of 24 by 8 mm that flies at a wall at x = 0, towards negative x."""
    points = box([0, -WIDTH / 2, -WIDTH / 2], [LENGTH, WIDTH / 2, WIDTH / 2], dx)
    return points[np.hypot(points[:, 1], points[:, 2]) <= WIDTH / 2]


def widening(x):
    """Radial stretch of a struck bar at the distance `x` [m] from the foot before it was struck."""
    return 1.0 + 0.6 * np.exp(-((x / (4 * MM)) ** 2))


def struck(points):
    """Widen the bar at its foot, at constant volume: its length is the integral of 1/stretch^2."""
    x = np.linspace(0.0, LENGTH, 4001)
    place = np.concatenate([[0.0], np.cumsum(0.5 * (1 / widening(x[1:]) ** 2 + 1 / widening(x[:-1]) ** 2)) * x[1]])
    stretch = widening(points[:, 0])
    return np.column_stack([np.interp(points[:, 0], x, place), points[:, 1:] * stretch[:, None]]), place[-1]


def moment(points, **metadata):
    """Snapshot of one bar that flies along -x."""
    one = snapshot(points, dx=DX, names=("bar",), **metadata)
    one.fields["velocity"][:, 0] = -200.0
    return one


def bar_measures(points=None, turn=None, planes=()):
    """Measures of the struck bar, all turned, or of the part that planes of symmetry leave."""
    points = cylinder() if points is None else points
    start = moment(points, shot={"roles": [None], "planes": list(planes)})
    now = replace(start, time=5e-5, fields=dict(start.fields, position=struck(points)[0]))
    if turn is not None:
        for one in (start, now):
            for name in ("position", "velocity"):
                one.fields[name] = one.fields[name] @ turn.T
    return measure_snapshot(now, start)


def test_a_struck_bar_has_the_length_and_the_widths_that_it_was_given():
    found, length = bar_measures(), struck(cylinder())[1]
    # surfaces are known to the second order in dx, sections to the part of them that a slice is thick
    assert found["final_length"].value == pytest.approx(length, abs=0.1 * DX)
    assert found["length_ratio"].value == pytest.approx(length / LENGTH, abs=1e-3)
    assert found["foot_diameter"].value == pytest.approx(1.6 * WIDTH, rel=5e-3)
    # where a fifth of the length, 4.8 mm, is from the foot now
    x = np.linspace(0.0, LENGTH, 4001)
    place = np.array([struck(np.array([[one, 0.0, 0.0]]))[0][0, 0] for one in x[::40]])
    at = np.interp(LENGTH / 5, place, x[::40])
    assert found["diameter_at_fifth"].value == pytest.approx(widening(at) * WIDTH, rel=5e-3)
    free = 4 * MM * np.sqrt(np.log(0.6 / 0.01))  # where the stretch is 1 %
    assert found["undeformed_length"].value == pytest.approx(length - np.interp(free, x[::40], place), abs=0.3 * DX)
    assert found.profile["diameter"][0] == found["foot_diameter"].value
    assert np.ptp(found.profile["distance"]) == pytest.approx(length, abs=DX)


def test_a_bar_that_has_not_struck_is_as_it_was():
    points = cylinder()
    start = moment(points)
    found = measure_snapshot(start, start)
    assert found["final_length"].value == pytest.approx(LENGTH, rel=1e-9)
    assert found["undeformed_length"].value == pytest.approx(LENGTH, rel=1e-9)
    assert found["foot_diameter"].value == pytest.approx(WIDTH, rel=5e-3)  # the lattice's own volume


def test_whole_quarter_and_turned_bars_measure_alike():
    whole = bar_measures()
    points = cylinder()
    quarter = bar_measures(points[(points[:, 1] > 0) & (points[:, 2] > 0)],
                           planes=[{"axis": axis, "at": 0.0} for axis in "xyz"])  # fmt: skip
    axis = np.array([1.0, 2.0, -0.5]) / np.sqrt(5.25)
    k = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    turn = np.eye(3) + np.sin(0.65) * k + (1 - np.cos(0.65)) * k @ k
    turned = bar_measures(turn=turn)
    for name in ("final_length", "foot_diameter", "diameter_at_fifth", "undeformed_length"):
        assert quarter[name].value == pytest.approx(whole[name].value, rel=1e-9)
        assert turned[name].value == pytest.approx(whole[name].value, rel=1e-9)


def test_a_foot_of_one_particle_has_no_width_and_a_length_all_the_same():
    points = cylinder()
    tip = np.array([[-1.0 * DX, 0.0, 0.0]])
    start = moment(np.vstack([points, tip]), shot={"roles": [None], "planes": []})
    found = measure_snapshot(start, start)
    assert found["foot_diameter"].value == pytest.approx(0.0, abs=1e-12)
    assert found["final_length"].value == pytest.approx(LENGTH + 1.5 * DX, abs=0.1 * DX)


def test_a_bar_that_still_moves_is_not_final():
    points = cylinder()
    start = moment(points)
    now = replace(start, fields=start.fields | {"velocity": np.zeros_like(points)})
    now.fields["velocity"][points[:, 0] > 0.2 * LENGTH, 0] = -170.0  # the foot stands, the rest flies on
    found = measure_snapshot(now, start)["length_ratio"]
    assert not found.settled
    assert "68 % of its impact velocity" in found.note  # 0.8 of the bar at 0.85
    now.fields["velocity"][:, 0] = 20.0  # it rebounds
    assert measure_snapshot(now, start)["length_ratio"].settled
    not_struck = measure_snapshot(start, start)["length_ratio"]  # a case that ends before the impact
    assert not not_struck.settled
    assert "has not struck" in not_struck.note


def test_a_sphere_on_a_plate_is_no_bar():
    start = snapshot(ball([-2 * MM, 0], 4 * MM, 0.2 * MM), box([0, -9 * MM], [2 * MM, 9 * MM], 0.2 * MM), dx=0.2 * MM)
    found = measure_snapshot(start, start)
    assert found["final_length"].value is None
    assert "no bar" in found["final_length"].reason
    assert "as a whole" in found["inner_radius"].reason


@pytest.mark.parametrize("part", [False, True])
def test_a_ring_that_closes_has_its_radii(part):
    dx = 0.2 * MM
    ring = box([-10 * MM] * 2, [10 * MM] * 2, dx)
    ring = ring[(np.hypot(*ring.T) >= 6 * MM) & (np.hypot(*ring.T) <= 10 * MM)]
    planes = []
    if part:
        ring = ring[(ring > 0).all(axis=1)]
        planes = [{"axis": axis, "at": 0.0} for axis in "xy"]
    start = snapshot(ring, dx=dx, names=("ring",), shot={"roles": [None], "planes": planes})
    start.fields["velocity"] = -100.0 * ring / np.hypot(*ring.T)[:, None]
    now = replace(start, fields=dict(start.fields, position=0.8 * ring))
    now.fields["density"] = now.fields["density"] / 0.64
    found = evaluate("run", Scene.from_snapshot(now, start))
    # the area of a lattice is the ring's to 0.3 %
    assert found["inner_radius"].value == pytest.approx(0.8 * 6 * MM, rel=3e-3)
    assert found["outer_radius"].value == pytest.approx(0.8 * 10 * MM, rel=3e-3)
    # Quarters that fly apart are no ring: without the test the heaviest one's own radii are reported.
    now.fields["position"] = now.fields["position"] + 4 * MM * np.sign(ring)
    assert "has broken" in evaluate("run", Scene.from_snapshot(now, start))["inner_radius"].reason


def test_a_hollow_sphere_and_a_tube_have_their_radii():
    dx = 0.5 * MM
    points = box([-8 * MM] * 3, [8 * MM] * 3, dx)
    distance = np.sqrt((points**2).sum(axis=1))
    sphere = points[(distance >= 5 * MM) & (distance <= 8 * MM)]
    across = np.hypot(points[:, 1], points[:, 2])
    tube = points[(across >= 5 * MM) & (across <= 8 * MM)]
    for shape in (sphere, tube):
        start = snapshot(shape, dx=dx, names=("shell",), shot={"roles": [None], "planes": []})
        start.fields["velocity"][:] = 0.0
        found = evaluate("run", Scene.from_snapshot(start, start))
        assert found["inner_radius"].value == pytest.approx(5 * MM, rel=1e-2)
        assert found["outer_radius"].value == pytest.approx(8 * MM, rel=1e-2)


def test_a_pull_back_is_the_fall_before_the_surface_rises_again():
    time = np.linspace(0, 4e-6, 401)
    velocity = np.interp(time * 1e6, [0, 0.5, 0.6, 1.5, 2.2, 2.6, 3.0, 4.0], [0, 0, 300, 302, 182, 240, 200, 230])
    velocity += 0.5 * np.sin(time * 2e8)  # ringing
    now = snapshot(np.zeros((1, 1)), time=4e-6,
                   surfaces={"rear": {"axis": 0, "sign": -1.0, "impedance": 14.5e6}})  # fmt: skip
    found = measure_snapshot(now, history={"time": time, "gauge.rear.velocity_x": -velocity})
    assert found["pull_back_velocity"].value == pytest.approx(120.0, abs=1.5)
    assert found["spall_strength"].value == pytest.approx(0.5 * 14.5e6 * 120.0, rel=0.0125)
    assert found["spall_strength"].time == pytest.approx(2.2e-6, abs=5e-8)
    held = np.interp(time * 1e6, [0, 0.5, 0.6, 1.5, 2.2, 4.0], [0, 0, 300, 302, 20, 0])
    found = measure_snapshot(now, history={"time": time, "gauge.rear.velocity_x": -held})
    assert "no pull-back" in found["spall_strength"].reason
    found = measure_snapshot(snapshot(np.zeros((1, 1))), history={"time": time})
    assert "no gauge" in found["spall_strength"].reason


def test_temperatures_are_means_of_the_mass():
    start = snapshot(ball([-2 * MM, 0], 4 * MM, 0.2 * MM), box([0, -9 * MM], [2 * MM, 9 * MM], 0.2 * MM), dx=0.2 * MM)
    assert "heat capacity" in measure_snapshot(start, start)["projectile_temperature"].reason
    first = start.body == 0
    start.fields["temperature"] = np.where(first, 600.0, 300.0)
    start.fields["temperature"][np.flatnonzero(first)[0]] = np.nan  # of a material without a heat capacity
    start.fields["temperature"][np.flatnonzero(first)[1]] = 5000.0  # one particle decides nothing
    found = measure_snapshot(start, start)
    count = first.sum() - 1
    assert found["projectile_temperature"].value == pytest.approx((600.0 * (count - 1) + 5000.0) / count)
    assert found["target_temperature"].value == pytest.approx(300.0)
    assert found["temperature_max"].value == 600.0
