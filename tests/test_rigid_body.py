"""Rigid bodies: mass properties, free rotation, a bar on a free mass, walls, balances, resumed runs, bad input."""

import numpy as np
import pytest
from small_runs import LIQUID, METAL, SPRING, assert_same_results, final, row_of

from hvisph.casefile.loader import load_case
from hvisph.core.errors import CaseError
from hvisph.integrators.rigid_body import _loops
from hvisph.integrators.rotation import flow, quaternion, rotation
from hvisph.output.reader import read_history
from hvisph.precheck.advice import advice
from hvisph.setup.initial_state import begin
from hvisph.setup.rigid_bodies import mass_properties
from hvisph.simulation.run import resume, run

LENGTH, SPEED = 10e-3, 1.0
MODULUS = 70e9 * 0.7 / (1.3 * 0.4)  # of uniaxial strain
SOUND = (MODULUS / 2785.0) ** 0.5


def struck_mass(ratio, **further):
    """An elastic bar of 100 particles at SPEED on a rigid body of `ratio` times its mass, in 1D."""
    end = 2.6 * LENGTH / SOUND
    return load_case({
        "kinematics": "uniaxial_strain", "resolution": LENGTH / 100,
        "bodies": {
            "bar": {"material": SPRING, "shape": {"type": "interval", "length": LENGTH}, "velocity": [SPEED]},
            "mass": {"material": SPRING | {"density": 2785.0 * ratio}, "rigid": "x",
                     "shape": {"type": "interval", "length": LENGTH}},
        },
        "time": {"end": end}, "output": {"every": end},
    } | further)  # fmt: skip


@pytest.mark.parametrize(("ratio", "spacings", "within"), [(1.0, 100, 0.015), (10.0, 100, 0.025), (1.0, 400, 0.005),
                                                         (10.0, 400, 0.01)])  # fmt: skip
def test_an_elastic_bar_on_a_free_mass(ratio, spacings, within, tmp_path):
    """The mass leaves with v (1 - exp(-2 m/M)), after two transits of the bar; the balances hold to round-off.

    The front is some spacings wide and loses energy: the error falls with the power 0.7 of the spacing.
    """
    outcome = run(struck_mass(ratio, resolution=LENGTH / spacings), tmp_path / "run")
    end = final(tmp_path / "run")
    u = end.fields["velocity"][spacings:, 0]
    assert np.ptp(u) == 0.0
    assert u[0] == pytest.approx(SPEED * (1.0 - np.exp(-2.0 / ratio)), rel=within)
    kept = outcome.summary["conservation"]
    assert abs(kept["energy_drift"]) < 1e-12
    assert abs(kept["momentum_drift"]) < 1e-12


def plane(who, rigid, **further):
    """Two boxes of metal, the first at 800 m/s, one of them rigid."""
    case = row_of([METAL, METAL], 2, speed=800.0, time={"end": 6e-7}, output={"every": 3e-7}).model_dump(mode="json")
    name = list(case["bodies"])[who]
    case["bodies"][name] |= {"rigid": rigid}
    return load_case(case | further)


@pytest.mark.parametrize(("who", "rigid"), [(0, "x"), (1, "x"), (1, "fixed")])
def test_the_balances_of_an_impact(who, rigid, tmp_path):
    """The rigid body keeps its shape, density and stress; energy and momentum are balanced to round-off."""
    outcome = run(plane(who, rigid), tmp_path / "run")
    end = final(tmp_path / "run")
    fields, own = end.fields, end.body == who
    assert np.ptp(fields["velocity"][own], axis=0).max() == 0.0
    assert np.all(fields["density"][own] == METAL["density"])
    assert np.all(fields["plastic_strain"][own] == 0.0)
    assert fields["plastic_strain"][~own].max() > 0.01
    kept = outcome.summary["conservation"]
    assert abs(kept["energy_drift"]) < 1e-12
    assert abs(kept["momentum_drift"]) < 1e-12


@pytest.mark.parametrize(("rigid", "further"), [
    (True, {"gravity": [2e9, -1e9]}), ("fixed", {"gravity": [-2e9, 0.0]}),
    (True, {"gravity": [2e9, -1e9], "time": {"end": 6e-7, "integrator": "staggered"}}),
    ("x", {"kinematics": "plane_stress"}), (True, {"kinematics": "plane_stress"}),
])  # fmt: skip
def test_the_balances_under_gravity_and_in_plane_stress(rigid, further, tmp_path):
    """The work of gravity on the body is that of its way; what holds a fixed one takes its weight, too."""
    who = int(rigid == "fixed")
    kept = run(plane(who, rigid, **further), tmp_path / "run").summary["conservation"]
    assert abs(kept["energy_drift"]) < 1e-12
    assert abs(kept["momentum_drift"]) < 1e-12


@pytest.mark.parametrize("kind", ["uniform", "sphere"])
def test_a_body_in_free_fall(kind, tmp_path):
    """It falls by g t^2/2 in a uniform field; in that of a sphere as the mass point at its centre, to (r/R)^2.

    A second body falls beside it, out of reach.
    """
    g, end, far = 1e7, 1e-5, 1.0  # strong, so that the way is not lost in round-off
    field = [0.0, -g] if kind == "uniform" else {
        "type": "sphere", "mass": g * far**2 / 6.67430e-11, "radius": 0.1, "centre": [0.0, -far]}  # fmt: skip
    case = plane(0, True, gravity=field, time={"end": end}).model_dump(mode="json")
    for name, x in zip(case["bodies"], (-5e-3, 5e-3), strict=True):
        case["bodies"][name] |= {"position": [x, 0.0], "velocity": [0.0, 0.0]}
    outcome = run(load_case(case), tmp_path / "run")
    moved = final(tmp_path / "run").fields["displacement"][final(tmp_path / "run").body == 0]
    assert moved[:, 1].mean() == pytest.approx(-0.5 * g * end**2, rel=1e-9 if kind == "uniform" else 2e-3)
    assert abs(outcome.summary["conservation"]["energy_drift"]) < (1e-12 if kind == "uniform" else 1e-6)


def test_a_resumed_run_has_the_same_bits(tmp_path):
    case = plane(0, "x")
    run(case, tmp_path / "whole")
    run(case.model_copy(update={"time": case.time.model_copy(update={"max_steps": 25})}), tmp_path / "part")
    resume(tmp_path / "part", max_steps=10**6)
    assert_same_results(tmp_path / "whole", tmp_path / "part")


@pytest.mark.parametrize(("who", "rigid", "further", "words"), [
    (0, "y", {}, "component along x"), (0, "z", {}, "cannot move along z"), (0, "up", {}, "none of free, fixed"),
    (0, True, {"formulation": {"type": "projection"}}, "need another formulation"),
    (0, True, {"formulation": {"type": "eulerian", "contact": {"type": "bonded"}}}, "`frictional` contact alone"),
    (0, "x", {"time": {"end": 1e-6, "integrator": "predictor_corrector"}}, "one force a step"),
    (0, {"mass": 0.0}, {}, "mass: 0.0 is out of range"), (0, {"inertia": [-1.0]}, {}, "out of range"),
    (0, {"inertia": [1.0, 1.0, 1.0]}, {}, "has 3 moments, needs 1"),
    (0, {"move": {"about": "x"}}, {}, "cannot turn about"), (0, {"move": {"about": "z"}}, {}, "component along x"),
    (0, {"move": {"about": "z", "along": "x"}}, {}, "not several"),
    (0, {"move": {"along": [0.0, 0.0, 0.0]}}, {}, "not be all zero"),
    (1, {"velocity": [[1e-6, 1.0], [0.0, 2.0]]}, {}, "must rise"),
    (1, {"along": "y"}, {}, "give `move: y`"), (1, {"move": "fixed", "inertia": [1.0]}, {}, "has no effect"),
    (0, {"velocity": [[0.0, 1.0]]}, {}, "given twice"), (1, {"velocity": [[0.0, "3 kg"]]}, {}, "3 kg"),
])  # fmt: skip
def test_bad_input(who, rigid, further, words):
    with pytest.raises(CaseError, match=words):
        plane(who, rigid, **further)


def test_impossible_moments_of_inertia_are_refused():
    """I_3 is at most I_1 + I_2."""
    with pytest.raises(CaseError, match="above the sum of the two others"):
        eccentric(3, {"inertia": [1.0, 2.0, 4.0]})


def test_a_plane_of_symmetry_is_no_wall_for_a_rigid_body(tmp_path):
    with pytest.raises(CaseError, match="does not cut this body"):
        run(plane(0, "x", symmetry=[{"axis": "x", "at": -0.1}]), tmp_path / "run")


@pytest.mark.parametrize("keep", ["above", "below"])
def test_a_half_keeps_to_its_plane(keep, tmp_path):
    """A box that the plane y = 0 cuts moves along x alone, on both sides."""
    run(plane(0, True, symmetry=[{"axis": "y", "keep": keep}]), tmp_path / "run")
    state = final(tmp_path / "run")
    velocity = state.fields["velocity"][state.body == 0]
    assert np.all(velocity[:, 1] == 0.0)
    assert 0.0 < velocity[0, 0] < 790.0


def test_what_a_rigid_body_does_not_have_is_told():
    case = row_of(["steel-4340", METAL], 2, speed=800.0).model_dump(mode="json")
    case["bodies"]["body_0"]["rigid"] = True
    assert any("without strength and damage of its material" in note for note in begin(load_case(case)).notes)


def test_two_rigid_bodies_may_only_be_fixed():
    both = plane(0, "x").model_dump(mode="json")
    for body in both["bodies"].values():
        body |= {"rigid": "fixed", "velocity": [0.0, 0.0]}
    load_case(both)
    both["bodies"]["body_1"]["rigid"] = True
    with pytest.raises(CaseError, match="two rigid bodies"):
        load_case(both)


def test_a_clamp_within_a_rigid_body_is_refused(tmp_path):
    with pytest.raises(CaseError, match="a clamp holds"):
        run(plane(1, "x", clamped=[{"box": {"min": [1e-3, None]}}]), tmp_path / "run")


def test_mass_properties_of_a_box_and_a_sphere():
    """Boxes on a lattice are exact; a sphere of 10 spacings across has 2/5 m r^2 within 1 % (m: of its particles)."""
    counts, s = np.array([10, 20, 6]), 0.1
    x = np.stack(np.meshgrid(*((np.arange(k) + 0.5) * s for k in counts), indexing="ij"), -1).reshape(-1, 3)
    found = mass_properties(np.full(len(x), 0.3), x, np.full(len(x), s))
    squares = (counts * s) ** 2
    assert np.allclose(found.centre, counts * s / 2, rtol=1e-13)
    assert np.allclose(found.inertia, np.diag(found.mass / 12.0 * (squares.sum() - squares)), rtol=1e-12, atol=1e-12)
    y = (np.indices((20, 20, 20)).reshape(3, -1).T - 9.5) * s
    y = y[(y * y).sum(axis=1) <= 1.0]
    radius = (3.0 * len(y) * s**3 / (4.0 * np.pi)) ** (1.0 / 3.0)
    ball = mass_properties(np.full(len(y), 1.0), y, np.full(len(y), s))
    assert np.allclose(np.diag(ball.inertia), 0.4 * ball.mass * radius**2, rtol=0.01)


@pytest.mark.parametrize("dim", [1, 2, 3])
def test_the_loops_over_particles_of_a_body(dim):
    """Against plain formulas: forces, torques, powers, compliances of contacts; positions and velocities."""
    rng, count, n, axial = np.random.default_rng(dim), 40, 25, {1: 0, 2: 1, 3: 3}[dim]
    group, place = rng.permutation(count)[:n], rng.permutation(count).astype(np.uint32)
    state, rates = rng.random((count, 2 + 2 * dim)) + 0.5, rng.random((count, dim + 4))
    packed, rows = rng.random((count, 2 * dim + 4)), rng.random((count, 2 * dim + 1))
    rates[place[group[:9]]] = rows[place[group[:9]], dim:] = 0.0  # near nothing
    columns = 0, 1, 2, 2 + dim
    turn_rate, torque = (2 * dim, dim + 1) if axial else (0, 0)
    compliances, forces, placed = _loops(dim, columns, dim, turn_rate, torque, dim)

    def space(values):
        return np.pad(values, ((0, 0), (0, 3 - dim)))

    centre, m, at = rng.random(3) * (np.arange(3) < dim), state[group, :1], place[group]
    terms, loads = np.zeros((n, 7)), space(m * rates[at, :dim])
    torques = np.cross(space(packed[group, :dim]) - centre, loads)
    torques[:, 3 - axial :] += m * rates[at, torque : torque + axial]
    expected = np.hstack([loads, torques, m * rates[at, dim : dim + 1]])[9:]
    assert forces(group, place, rates, state, packed, centre, terms) == n - 9
    assert np.allclose(terms[: n - 9], expected, rtol=1e-13, atol=1e-15)  # sums of at most three products

    moves, turns, found = *(one + one.T for one in rng.random((2, 3, 3))), np.zeros(n)
    normal, r = space(rows[at, dim : 2 * dim])[9:], space(packed[group, :dim])[9:] - centre
    arm, size = np.cross(r, normal), np.sqrt((normal**2).sum(1))
    whole = np.einsum("ni,ij,nj->n", normal, moves, normal) + np.einsum("ni,ij,nj->n", arm, turns, arm)
    assert compliances(group, place, rows, state, packed, centre, moves, turns, found) == n - 9
    assert np.allclose(found[: n - 9], 2.0 * (state[group, 0] / state[group, 1])[9:] * whole / size, rtol=1e-12)

    before, now, ahead = frames = rng.random((3, 9)) * (np.arange(9) % 3 < dim)
    frames[:, 6:] *= np.arange(3) >= 3 - axial
    turns = np.stack([np.eye(3)] * 2)
    if axial:
        turns = np.stack([rotation(np.array([0.8, 0.0, 0.0, sign * 0.6])) for sign in (1.0, -1.0)])
    r = (space(state[group, 2 : 2 + dim]) - before[:3]) @ turns[0].T
    here = state[:, 2 : 2 + dim].copy()
    here[group] = (now[:3] + r)[:, :dim]
    stage = r @ turns[1].T
    placed(group, state, packed, frames, turns, True)
    assert np.allclose(state[:, 2 : 2 + dim], here, rtol=1e-13)
    assert np.allclose(state[group, 2 + dim :], (now[3:6] + np.cross(now[6:], r))[:, :dim], rtol=1e-12)
    assert np.allclose(packed[group, :dim], (ahead[:3] + stage)[:, :dim], rtol=1e-12)
    assert np.allclose(packed[group, dim : 2 * dim], (ahead[3:6] + np.cross(ahead[6:], stage))[:, :dim], rtol=1e-12)
    assert (packed[group, 2 * dim : 2 * dim + axial] == ahead[9 - axial :]).all()


@pytest.mark.parametrize(("steps", "within"), [(200, 2e-4), (800, 1.25e-5)])
def test_a_free_top_returns_after_its_period(steps, within):
    """I = 1, 2, 3, w = (0.3, 0.2, 1): w has the period 6.310095 by elliptic functions; the error is of second order."""
    inertia, w, q, energies = np.array([1.0, 2.0, 3.0]), np.array([0.3, 0.2, 1.0]), np.array([1.0, 0, 0, 0]), []
    for _ in range(steps):
        q = flow(q, inertia * w, inertia, 6.310095 / steps)  # L in space is that of the start
        now = ((inertia * w) @ rotation(q)) / inertia
        energies.append(0.5 * (inertia * now * now).sum())
    assert np.abs(now - w).max() < within
    assert np.ptp(energies) < 3e-6 * (200 / steps) ** 2


def hertz(arrangement, across, speed=10.0):
    """A ball of 6061, elastic, on a rigid wall: case, and largest force [N], contact time [s] by Hertz's theory."""
    radius, density, modulus, nu = 5e-3, 2700.0, 68.9e9, 0.33
    stiff, mass = modulus / (1.0 - nu**2), 4.0 / 3.0 * np.pi * radius**3 * density
    depth = (15.0 * mass * speed**2 / (16.0 * stiff * radius**0.5)) ** 0.4
    metal = {"density": density, "eos": {"type": "linear", "bulk_modulus": modulus / (3.0 - 6.0 * nu)},
             "strength": {"type": "elastic", "shear_modulus": modulus / (2.0 + 2.0 * nu)}}  # fmt: skip
    end = 1.4 * 2.943 * depth / speed
    case = load_case({
        "kinematics": "axisymmetric", "resolution": 2.0 * radius / across,
        "formulation": {"type": "total_lagrangian"},
        "bodies": {"ball": {"material": metal, "shape": {"type": "sphere", "diameter": 2.0 * radius},
                            "arrangement": arrangement, "velocity": [speed, 0.0]},
                   "wall": {"material": metal, "shape": {"type": "cylinder", "diameter": 6e-3, "length": 2e-3},
                            "rigid": "fixed"}},
        "time": {"end": end}, "output": {"every": end, "history_every": 1},
    })  # fmt: skip
    return case, 4.0 / 3.0 * stiff * radius**0.5 * depth**1.5, 2.943 * depth / speed


def test_a_ball_on_a_wall_by_hertz(tmp_path):
    """Force 15, time 20 %, speed 1 %: the contact is 0.11 spacings deep at 20 across, and half a spacing soft.

    At 40 and 80 across the force is 0.90 and 1.03 of Hertz's, the time 1.08 and 0.95.
    """
    case, force, time = hertz("relaxed", 20)
    run(case, tmp_path / "run")
    history = read_history(tmp_path / "run")
    found = np.gradient(history["support_momentum_x"], history["time"])
    assert found.max() == pytest.approx(force, rel=0.15)
    touching = history["time"][found > 0.02 * found.max()]
    assert np.ptp(touching) == pytest.approx(time, rel=0.2)
    assert final(tmp_path / "run").fields["velocity"][:, 0].min() < -9.9


def test_check_tells_contacts_too_shallow_for_a_lattice():
    """The front layer of a square lattice is a flat punch: 1.68 and 1.28 times the force measured at 40 and 80."""
    (text,) = [one for one in advice(hertz("square", 40)[0]) if "Hertz" in one]
    assert "0.23 spacings deep" in text
    assert "1.6 times" in text
    assert "arrangement=relaxed" in text
    assert not any("Hertz" in one for one in advice(hertz("relaxed", 40)[0]))
    assert not any("Hertz" in one for one in advice(hertz("square", 40, speed=100.0)[0]))


def test_a_symmetric_top_precesses():
    """I = (1, 1, 0.2): its axis turns about L by |L|/I_1, to 1e-6 of an angle at 1000 steps a turn."""
    inertia, w = np.array([1.0, 1.0, 0.2]), np.array([0.3, 0.0, 1.0])
    spin, q, angle = inertia * w, np.array([1.0, 0.0, 0.0, 0.0]), 2.0 * np.pi / 1000
    along = spin / np.linalg.norm(spin)
    for _ in range(250):
        q = flow(q, spin, inertia, angle / np.linalg.norm(spin))
    axis, start = rotation(q)[:, 2], np.array([0.0, 0.0, 1.0])
    exact = along * (along @ start) + np.cross(along, start)  # a quarter of a turn
    assert np.abs(axis - exact).max() < 1e-6 * np.pi / 2


def test_a_quaternion_is_its_matrix():
    generator = np.random.default_rng(5)
    for _ in range(20):
        axes = np.linalg.qr(generator.normal(size=(3, 3)))[0]
        axes *= np.sign(np.linalg.det(axes))
        assert np.allclose(rotation(quaternion(axes)), axes, atol=1e-14)


def eccentric(dim, rigid=True, block=METAL, **further):
    """A rod with a spin that strikes a block beside its middle; it is turned by 37 degrees."""
    c, s = np.cos(np.radians(37.0)), np.sin(np.radians(37.0))
    place, aside, wide = np.array([[c, -s], [s, c]]), [0.0] * (dim - 2), [1e-3] * (dim - 2)
    turn = 37.0 if dim == 2 else {"angle": 37.0, "axis": [0.0, 0.0, 1.0]}
    spin = {"type": "spin", "rate": 1e4} | ({"axis": [0.0, 0.6, 0.8]} if dim == 3 else {})
    return load_case({
        "kinematics": "plane_strain" if dim == 2 else "three_d", "resolution": 2.5e-4,
        "bodies": {
            "rod": {"material": METAL, "shape": {"type": "box", "size": [1e-3, 3e-3, *wide]}, "rotation": turn,
                    "position": [*(place @ [-0.4e-3, 1.2e-3]), *aside], "velocity": [*(place @ [300.0, 0.0]), *aside],
                    "initial_velocity": [spin], "rigid": rigid},
            "block": {"material": block, "shape": {"type": "box", "size": [2e-3, 2e-3, *wide]}, "rotation": turn,
                      "position": [*(place @ [1.2e-3, 0.0]), *aside]},
        },
        "time": {"end": 6e-7}, "output": {"every": 6e-7},
    } | further)  # fmt: skip


def shape_of(state):
    """Distances of the rod's neighbouring particles [m], and by how much these change over their speeds."""
    own = state.body == 0
    x, u = np.diff(state.fields["position"][own], axis=0), np.diff(state.fields["velocity"][own], axis=0)
    return np.linalg.norm(x, axis=1), np.abs((x * u).sum(axis=1)).max() / (300.0 * 3e-3)


@pytest.mark.parametrize(("dim", "variant"), [(2, "corrected"), (3, "corrected"), (3, "elastic")])
def test_a_spinning_rod_strikes_a_block_beside_its_middle(dim, variant, tmp_path):
    """The rod keeps its shape and has no energy but its motion; energy and momentum are balanced to round-off."""
    outcome = run(eccentric(dim, formulation={"type": "riemann", "variant": variant}), tmp_path / "run")
    state, kept = final(tmp_path / "run"), outcome.summary["conservation"]
    apart, rate = shape_of(state)
    assert rate < 1e-13
    assert apart.min() == pytest.approx(2.5e-4, rel=1e-12)
    assert not state.fields["internal_energy"][state.body == 0].any()
    assert state.fields["plastic_strain"].max() > 0.01
    assert abs(kept["energy_drift"]) < 1e-13
    assert abs(kept["momentum_drift"]) < 1e-13
    turning = outcome.summary["bodies"]["rod"]["angular_velocity"]
    assert len(turning) == (1 if dim == 2 else 3)
    x, u = (np.diff(state.fields[name][state.body == 0], axis=0)[0] for name in ("position", "velocity"))
    rate = np.array([0.0, 0.0, *turning]) if dim == 2 else turning
    assert np.allclose(np.cross(rate, [*x, 0.0][:3])[:dim], u, atol=1e-9)


def test_a_ball_on_foam_ends_as_with_a_fixed_h(tmp_path):
    """Where h follows density, lists reach from inside the ball to the plate; its own pairs have no depth there.

    Both ways of h differ in the plate alone: by 0.2 % of the ball's speed, at four particles across the ball.
    """
    speeds = []
    for kind in ("fixed", "variable"):
        case = load_case({
            "kinematics": "three_d", "resolution": "0.5 mm", "time": {"end": 1e-6}, "output": {"every": 1e-6},
            "formulation": {"type": "riemann", "smoothing_length": {"type": kind}},
            "bodies": {"ball": {"material": "aluminium-6061-t6", "shape": {"type": "sphere", "diameter": 2e-3},
                                "velocity": [800.0, 0.0, 0.0], "rigid": True},
                       "plate": {"material": "aluminium-foam-6101-t6",
                                 "shape": {"type": "box", "size": [1.5e-3, 4e-3, 4e-3]}}},
        })  # fmt: skip
        assert run(case, tmp_path / kind).exit_code == 0
        state = final(tmp_path / kind)
        speeds.append(state.fields["velocity"][state.body == 0, 0].mean())
    assert speeds[0] < 790.0
    assert speeds[1] == pytest.approx(speeds[0], rel=0.01)


def test_a_penalty_contact_keeps_the_balances(tmp_path):
    """Central forces: angular momentum is kept to the order of leapfrog, 1e-7 at 60 steps, the others to round-off."""
    outcome = run(eccentric(2, formulation={"type": "total_lagrangian"}), tmp_path / "run")
    state, kept = final(tmp_path / "run"), outcome.summary["conservation"]
    own = state.body == 0
    assert shape_of(state)[1] < 1e-13
    assert not state.fields["internal_energy"][own].any()
    assert state.fields["plastic_strain"].max() > 0.01
    assert abs(kept["energy_drift"]) < 1e-13
    assert abs(kept["momentum_drift"]) < 1e-13
    assert abs(kept["angular_momentum_drift"]) < 1e-6


@pytest.mark.parametrize(("dim", "friction"), [(3, 0.2), pytest.param(2, 0.2, marks=pytest.mark.slow)])
def test_the_torques_of_a_contact_cancel(dim, friction, tmp_path):
    """With a block whose own forces are central, angular momentum is kept to round-off, with friction too."""
    formulation = {"type": "eulerian", "conserve_angular_momentum": False, "artificial_stress": {"type": "none"},
                   "contact": {"type": "frictional", "friction": friction}}  # fmt: skip
    case = eccentric(dim, block=LIQUID, formulation=formulation, time={"end": 3e-7, "integrator": "staggered"})
    kept = run(case, tmp_path / "run").summary["conservation"]
    assert kept["kinetic_energy_ratio"] < 0.99
    assert abs(kept["energy_drift"]) < 1e-12
    assert abs(kept["momentum_drift"]) < 1e-12
    assert abs(kept["angular_momentum_drift"]) < 1e-12


@pytest.mark.parametrize("kind", ["riemann", "total_lagrangian"])
def test_a_resumed_rotation_has_the_same_bits(kind, tmp_path):
    case = eccentric(3 if kind == "riemann" else 2, formulation={"type": kind}, output={"every": 3e-7})
    run(case, tmp_path / "whole")
    run(case.model_copy(update={"time": case.time.model_copy(update={"max_steps": 9})}), tmp_path / "part")
    resume(tmp_path / "part", max_steps=10**6)
    assert_same_results(tmp_path / "whole", tmp_path / "part")


def test_a_rod_goes_on_from_another_run(tmp_path):
    """Position, velocity and rotation are those of the snapshot to round-off; other masses and softness are refused."""
    first = eccentric(2, output={"every": 3e-7})
    run(first, tmp_path / "first")
    document = first.model_dump(mode="json") | {"start": {"run": str(tmp_path / "first"), "at": 3e-7}}
    outcome = run(load_case(document), tmp_path / "run")
    whole, gone = final(tmp_path / "first"), final(tmp_path / "run")
    own = whole.body == 0
    assert shape_of(gone)[1] < 1e-13
    # forces are evaluated anew at the start: steps differ
    assert np.abs(gone.fields["velocity"] - whole.fields["velocity"])[own].max() < 0.01 * 300.0
    assert np.abs(gone.fields["position"] - whole.fields["position"])[own].max() < 0.01 * 2.5e-4
    assert abs(outcome.summary["conservation"]["energy_drift"]) < 1e-12
    for rigid, words in ((None, "in both runs or in none"), ({"mass": 2.0}, "mass of the run"),
                         ({"inertia": [1.0]}, None)):  # fmt: skip
        document["bodies"]["rod"]["rigid"] = rigid
        if words:
            with pytest.raises(CaseError, match=words):
                begin(load_case(document))
        else:
            begin(load_case(document))


def test_a_given_mass_is_that_of_the_motion(tmp_path):
    """Twice the mass in the same volume: the bar gives it v (1 - exp(-2 m/M)); as above 2 % at this spacing."""
    bodies = struck_mass(1.0).model_dump(mode="json")["bodies"]
    bodies["mass"]["rigid"] = {"move": "x", "mass": 2785.0 * LENGTH * 2.0}
    run(struck_mass(1.0, bodies=bodies), tmp_path / "run")
    u = final(tmp_path / "run").fields["velocity"][100:, 0]
    assert u[0] == pytest.approx(SPEED * (1.0 - np.exp(-2.0 / 2.0)), rel=0.02)


def test_a_light_mass_limits_the_step(tmp_path):
    """Of a fiftieth of the bar's mass in one place: the contact is stable, and it leaves no faster than the bar's face.

    The bar follows it at v (1 - exp(-2 m/M)) = v; without the limit of the step it leaves at 2.8 v.
    """
    bodies = struck_mass(1.0).model_dump(mode="json")["bodies"]
    bodies["mass"] |= {"rigid": {"mass": 2785.0 * LENGTH * 0.002}, "shape": {"type": "interval", "length": LENGTH / 25}}
    run(struck_mass(1.0, bodies=bodies), tmp_path / "run")
    u = final(tmp_path / "run").fields["velocity"][100:, 0]
    assert u[0] == pytest.approx(SPEED, rel=0.1)
    assert "rigid_body" in set(read_history(tmp_path / "run")["criterion"])


def test_a_piston_drives_a_bar(tmp_path):
    """The work of a rigid piston at a velocity over time is the energy of what it drives; it moves by the integral."""
    bodies = struck_mass(1.0).model_dump(mode="json")["bodies"]
    end = LENGTH / SOUND
    bodies["bar"]["velocity"] = [0.0]
    bodies["mass"]["rigid"] = {"velocity": [[0.0, 0.0], [0.5 * end, -SPEED]], "along": "x"}
    outcome = run(struck_mass(1.0, bodies=bodies, time={"end": end}, output={"every": end}), tmp_path / "run")
    state, kept = final(tmp_path / "run"), outcome.summary["conservation"]
    assert np.all(state.fields["velocity"][100:, 0] == -SPEED)
    moved = state.fields["displacement"][100:, 0]
    assert np.allclose(moved, -0.75 * SPEED * end, rtol=1e-9)
    assert outcome.summary["energies"]["external_work"] > 0.0
    assert abs(kept["energy_drift"]) < 1e-12


def struck_wall(speed):
    """An axisymmetric bar that a rigid wall at `speed` meets with 200 m/s; length and radius at the end [m]."""
    wall = {"material": METAL, "shape": {"type": "cylinder", "diameter": 12e-3, "length": 3e-3}}
    bar = {"material": METAL, "shape": {"type": "cylinder", "diameter": 6e-3, "length": 12e-3}}
    return load_case({
        "kinematics": "axisymmetric", "resolution": 1e-3,
        "bodies": {
            "wall": wall | {"position": [-1.5e-3, 0.0], "rigid": {"velocity": [[0.0, speed]], "along": "x"}},
            "bar": bar | {"position": [6e-3, 0.0], "velocity": [speed - 200.0, 0.0]},
        },
        "time": {"end": 1e-5}, "output": {"every": 1e-5},
    })  # fmt: skip


def test_a_bar_on_a_moving_wall_is_that_on_a_wall_at_rest(tmp_path):
    """Invariance to the frame: round-off of positions that have moved 3 mm, 1e-12; the balance counts the work."""
    ends = []
    for speed in (0.0, 300.0):
        kept = run(struck_wall(speed), tmp_path / f"{speed}").summary["conservation"]
        assert abs(kept["energy_drift"]) < 1e-12
        state = final(tmp_path / f"{speed}")
        x = state.fields["position"][state.body == 1]
        ends.append([np.ptp(x[:, 0]), x[:, 1].max()])
    assert ends[0][1] > 2.7e-3  # 2.5 mm at the start
    assert np.allclose(ends[0], ends[1], rtol=1e-11)
