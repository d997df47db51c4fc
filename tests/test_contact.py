"""Contact between bodies: the law, its limits of the step, and bodies that bounce."""

import numpy as np
import pytest
from composite_runs import advance

from hvisph.casefile.loader import load_case
from hvisph.core.errors import CaseError
from hvisph.setup.build import build
from hvisph.sph.contact.penalty_contact import Pressing
from hvisph.sph.contact.repulsion import Contact
from hvisph.sph.kernels import CUBIC_SPLINE
from hvisph.sph.neighbours.pairs import Pairs
from hvisph.sph.neighbours.particle_layout import slots

SPRING = {"density": 2785.0, "eos": {"type": "elastic", "youngs_modulus": 70e9, "poisson_ratio": 0.3},
          "strength": {"type": "elastic"}}  # fmt: skip


def rates_of(position, body, dim, h=1.4, velocity=None, law=None, axisymmetric=False, **more):
    """Rates of unit masses and volumes, body 0 of unit stiffness and the others stiffer."""
    law = law or Contact()
    layout, constants = law.row_layout(dim, axisymmetric), law.coefficients(CUBIC_SPLINE, 1.4, dim)
    if isinstance(law, Pressing):
        constants[0] = 1.0
    pairs = Pairs(layout, CUBIC_SPLINE, law.passes(dim, axisymmetric), constants, position, h)
    to = layout.slots()
    pairs.rows[:, :dim] = position
    if velocity is not None:
        pairs.rows[:, to["U"] : to["U"] + dim] = velocity
    for name, value in ({"H": h, "M": 1.0, "V": 1.0, "K": 1.0 + np.asarray(body), "BODY": body} | more).items():
        width = dim if name == "D" else 1
        pairs.rows[:, to[name] : to[name] + width] = np.reshape(value, (-1, width))
    pairs.evaluate(h)
    return pairs.rates[pairs.place[: len(position)]]


def energy(position, body, h=1.4):
    """E = sum over pairs of different bodies of K w^4 with the softer's stiffness, straight from the definition."""
    total = 0.0
    for i in range(len(position)):
        for j in range(i):
            if body[i] != body[j]:
                r = np.linalg.norm(position[i] - position[j])
                w = CUBIC_SPLINE.shape.py_func(r / h) / CUBIC_SPLINE.shape.py_func(1 / h)
                total += (1.0 + min(body[i], body[j])) * w**4
    return total


def pressed(position, body, starts, displaced, h=1.4):
    """E = sum K max(phi - phi0, 0)^2/2 straight from the definition; what was beyond the reach counts as another body."""
    total, reach = 0.0, 2.0 * h
    for i in range(len(position)):
        phi = 0.0
        for j in range(len(position)):
            then = np.linalg.norm(position[i] - displaced[i] - position[j] + displaced[j])
            if i != j and (body[i] != body[j] or then > reach):
                phi += CUBIC_SPLINE.value(float(np.linalg.norm(position[i] - position[j])), h, position.shape[1])
        total += 0.5 * (1.0 + body[i]) * max(phi - starts[i], 0.0) ** 2
    return total


@pytest.mark.parametrize("dim", [2, pytest.param(1, marks=pytest.mark.slow), pytest.param(3, marks=pytest.mark.slow)])
def test_force_is_the_gradient_of_the_energy_and_balances(dim):
    random = np.random.default_rng(dim)
    position = random.uniform(0.0, 3.0, (12, dim))
    body = np.arange(12) % 3
    found = rates_of(position, body, dim)
    for i, f in ((0, 0), (7, dim - 1)):
        moved = position.copy()
        step = 1e-6
        moved[i, f] += step
        plus = energy(moved, body)
        moved[i, f] -= 2 * step
        slope = (plus - energy(moved, body)) / (2 * step)
        assert found[i, f] == pytest.approx(-slope, rel=1e-6, abs=1e-7)  # differences of 1e-6
    size = np.abs(found[:, :dim]).sum()
    assert np.abs(found[:, :dim].sum(axis=0)).max() < 1e-14 * size
    assert not rates_of(position, np.zeros(12), dim)[:, : dim + 2].any()  # one body: nothing


def test_pressing_is_the_gradient_of_its_energy_and_balances():
    random = np.random.default_rng(5)
    position, body, starts = random.uniform(0.0, 3.0, (14, 2)), np.arange(14) % 3, random.uniform(0.1, 0.5, 14)
    displaced, step = random.uniform(-2.0, 2.0, (14, 2)), 1e-6
    law = Pressing(self_contact=True)
    found = rates_of(position, body, 2, law=law, START=starts, D=displaced, TIED=1.0)
    for i, f in ((0, 0), (7, 1), (4, 0)):
        away = np.zeros_like(position)
        away[i, f] = step  # the displacement goes with the place
        ahead, back = (pressed(position + k * away, body, starts, displaced + k * away) for k in (1, -1))
        assert found[i, f] == pytest.approx(-(ahead - back) / (2 * step), rel=1e-6, abs=1e-8)  # differences of 1e-6
    assert np.abs(found[:, :2].sum(axis=0)).max() < 1e-14 * np.abs(found[:, :2]).sum()
    loose = rates_of(position, np.zeros(14), 2, law=law, START=starts, D=displaced, TIED=0.0)
    assert not loose[:, :2].any()  # of one body, and not tied to it: nothing
    # two free masses: omega^2 = 2 k_ab, at least the curvature of the energy along the line
    near, no, step = np.array([[0.0], [0.8]]), np.zeros((2, 1)), 1e-4
    at = [pressed(near + np.array([[0.0], [d * step]]), [0, 1], [0.1, 0.1], no) for d in (1, 0, -1)]
    omega2 = rates_of(near, np.array([0, 1]), 1, law=law, START=0.1, D=no, TIED=1.0)[0, 2]
    assert omega2 >= 2.0 * (at[0] - 2 * at[1] + at[2]) / step**2 > 0.0


def test_friction_is_coulombs_and_heats_both_sides():
    """Two lattices that face each other nearer than a spacing slide: shear over pressure, and where its work goes."""
    side = np.arange(-6.0, 7.0)
    x, y = (each.ravel() for each in np.meshgrid(side, np.arange(3.0), indexing="ij"))
    position = np.concatenate([np.column_stack([x, y]), np.column_stack([x + 0.3, -0.8 - y])])
    body = np.repeat([0.0, 1.0], len(x))
    velocity = np.where(body[:, None] == 0.0, [[5.0, 0.0]], [[0.0, 0.0]])
    for mu in (0.1, 0.3):
        law = Pressing(friction=mu, self_contact=False)
        found = rates_of(position, body, 2, velocity=velocity, law=law, START=law.touching(CUBIC_SPLINE, 1.4, 2))
        middle = (body == 0.0) & (np.abs(position[:, 0]) < 2.5)
        along, into = found[middle, :2].sum(axis=0)
        assert into > 0.0
        assert -along / into == pytest.approx(mu, rel=0.05)  # normals near the ends of the row lean
        heat = found[:, slots(2)["R_SLIP"]]
        assert (heat >= 0.0).all()
        work = (found[:, :2] * velocity).sum() + found[:, 2].sum()  # of friction alone: the rest is held
        assert heat.sum() == pytest.approx(-work, rel=1e-10)
        assert heat[body == 0.0].sum() == pytest.approx(0.5 * heat.sum(), rel=1e-10)


def test_friction_at_rest_is_a_dashpot():
    """Where there is next to no slip the shear follows it, far below what would slide."""
    position, body = np.array([[0.0, 0.0], [0.0, -0.5]]), np.array([0.0, 1.0])
    shears = []
    for slip in (1e-6, 2e-6):
        velocity = np.array([[slip, 0.0], [0.0, 0.0]])
        found = rates_of(
            position, body, 2, velocity=velocity, law=Pressing(friction=0.5, self_contact=False), START=0.0
        )
        shears.append(-found[0, 0])
        assert 0.0 < shears[-1] < 1e-3 * found[0, 1]
    assert shears[1] == pytest.approx(2.0 * shears[0], rel=1e-9)


def test_the_image_of_a_ring_is_no_face_of_its_body():
    """A ring that has come from afar is pressed by another of its body that has, not by its own image over the axis."""
    position, displaced = np.array([[0.0, 0.4], [0.0, -0.4]]), np.array([[0.0, -4.0], [0.0, 4.0]])

    def push(ring):
        found = rates_of(position, np.zeros(2), 2, law=Pressing(self_contact=True), axisymmetric=True, START=0.0, D=displaced,
                         TIED=1.0, RING=np.array([0.4, ring]))  # fmt: skip
        return found[0, 1]

    assert push(-0.4) == 0.0
    assert push(0.4) > 0.0


def test_work_goes_half_to_each_side():
    position, body = np.array([[0.0, 0.0], [0.9, 0.3]]), np.array([0.0, 1.0])
    velocity = np.array([[1.0, 0.5], [-2.0, 0.1]])
    found = rates_of(position, body, 2, velocity=velocity)
    work = (found[:, :2] * velocity).sum()
    assert found[0, 2] == pytest.approx(found[1, 2])
    assert found[:, 2].sum() == pytest.approx(-work)


def test_frequency_is_that_of_the_pair():
    # two free unit masses: omega^2 = 2 k_ab, k_ab at least the curvature of the energy along the line
    position, body, h = np.array([[0.0], [1.0]]), np.array([0.0, 1.0]), 1.4
    step = 1e-4
    curvature = sum(c * energy(np.array([[0.0], [1.0 + d * step]]), body) for c, d in ((1, 1), (-2, 0), (1, -1)))
    assert rates_of(position, body, 1, h)[0, 2] >= 2.0 * curvature / step**2 > 0.0


def bars(formulation, speed=20.0, end="20 us", gap=0.5e-3, turned=0.0, material=SPRING):
    return load_case({
        "kinematics": "plane_strain", "resolution": 0.5e-3,
        "bodies": {
            "left": {"material": material, "shape": {"type": "box", "size": [4e-3, 3e-3]}, "velocity": [speed, 0.0]},
            "right": {"material": material, "shape": {"type": "box", "size": [4e-3, 3e-3]}, "gap": gap,
                      "rotation": turned},
        },
        "formulation": formulation, "time": {"end": end},
    })  # fmt: skip


@pytest.mark.parametrize("kind", ["eulerian", "total_lagrangian"])
def test_equal_bars_exchange_their_velocities(kind):
    setup = build(bars({"type": kind, "contact": {"type": "penalty"}}))
    particles = setup.particles
    momentum, total = (
        (particles["mass"] * particles["velocity"][:, 0]).sum(),
        0.5 * (particles["mass"] * 400.0).sum() / 2,
    )
    drift, _ = advance(setup, 14e-6)
    speed = [np.average(particles["velocity"][particles.body == b, 0]) for b in (0, 1)]
    # what vibrates in short bars is lost to the bounce
    assert speed[1] > 16.0 > 4.0 > speed[0]
    assert (particles["mass"] * particles["velocity"][:, 0]).sum() == pytest.approx(momentum, rel=1e-12)
    assert abs(drift) < 1e-12 * total + 1e-12


def test_contact_gives_its_own_limit_of_the_step():
    times = []
    for stiffness in (0.025, 0.1):
        setup = build(bars({"type": "total_lagrangian", "contact": {"type": "penalty", "stiffness": stiffness}}))
        setup.particles["position"][setup.particles.body == 0, 0] += 0.5e-3  # the bodies touch
        setup.stepper.start()
        hourglass, (time, name, particle) = setup.stepper.limits()
        assert (hourglass[1], name) == ("hourglass", "contact")
        assert abs(setup.particles["position"][particle, 0]) < 1.5e-3  # at the interface
        times.append(time)
    assert times[0] == pytest.approx(2.0 * times[1], rel=1e-9)


def test_doubtful_stiffness_is_said():
    from hvisph.precheck.advice import contact_warnings

    def case(**contact):
        return bars({"type": "eulerian", "contact": {"type": "penalty"} | contact}, speed=1000.0)

    assert contact_warnings(case()) == []
    assert "pass through each other" in contact_warnings(case(absolute_stiffness=1e12))[0]
    assert "limits the step" in contact_warnings(case(stiffness=10.0))[0]


@pytest.mark.parametrize(("speed", "turned"), [(20.0, 0.0), (0.0, 0.0), (0.0, 30.0)])
def test_unloaded_bodies_meet_part_and_keep_their_account(speed, turned):
    setup = build(bars({"type": "total_lagrangian"}, speed=speed, gap=0.0, turned=turned))
    particles, held = setup.particles, []
    mass = particles["mass"].sum()
    drift, _ = advance(setup, 6e-6, watch=lambda one: held.append(one.stepper.stored_energy))
    if speed == 0.0:  # at rest nothing pushes, wherever the lattices of bodies that touch stand
        assert np.abs(particles["velocity"]).max() < 1e-9
        return
    velocity = [np.average(particles["velocity"][particles.body == b, 0]) for b in (0, 1)]
    assert velocity[1] > 16.0 > 4.0 > velocity[0]  # what vibrates in short bars stays in them
    before = 0.25 * mass * speed**2
    assert max(held) > 1e-3 * before  # in mid-bounce the contact holds some, none of it as heat
    assert abs(held[-1]) < 2e-3 * before  # and has given it back, but for the error of the steps
    assert abs(drift) < 1e-12 * before
    assert (particles["mass"] * particles["velocity"][:, 0]).sum() == pytest.approx(0.5 * mass * speed, rel=1e-12)


@pytest.mark.parametrize(("self_contact", "left"), [("all", 3.0), ("none", 20.0)])
def test_parts_of_one_body_meet_as_bodies_do(self_contact, left):
    """Two bars that are one body strike each other: they part as two bodies do, or pass where they are told to."""
    bar = {"type": "box", "size": [4e-3, 3e-3]}
    parts = [{"shape": bar, "position": [x, 0.0]} for x in (-3e-3, 3e-3)]
    setup = build(load_case({
        "kinematics": "plane_strain", "resolution": 0.5e-3,
        "bodies": {"pair": {"material": SPRING, "shape": {"type": "union", "parts": parts},
                            "position": [0.0, 0.0]}},
        "formulation": {"type": "total_lagrangian", "contact": {"type": "frictional", "self_contact": self_contact}},
        "time": {"end": 1.0},
    }))  # fmt: skip
    particles = setup.particles
    striker = particles.id[particles["position"][:, 0] < 0.0].copy()
    particles["velocity"][np.isin(particles.id, striker), 0] = 20.0
    energy = 0.5 * particles["mass"].sum() / 2 * 400.0
    momentum = particles["mass"] @ particles["velocity"][:, 0]
    drift, _ = advance(setup, 110e-6)
    speed = np.average(particles["velocity"][np.isin(particles.id, striker), 0])
    assert abs(speed - left) < 3.0  # what vibrates in short bars is lost to the bounce
    assert abs(drift) < 1e-12 * energy
    assert particles["mass"] @ particles["velocity"][:, 0] == pytest.approx(momentum, rel=1e-12)


def test_a_gas_presses_the_wall_that_it_strikes_no_harder_than_its_shock():
    """Air at 500 m/s on aluminium, 0.55 MPa by impedance matching: its closing was taken for the wall's strain."""
    air = {"density": 1.2, "eos": {"type": "ideal_gas", "gamma": 1.4}}
    length = {"type": "interval", "length": 8e-3}
    gas = {"material": air, "internal_energy": 2e5, "shape": length, "velocity": [500.0]}
    wall = {"material": "aluminium-6061-t6", "shape": length}
    case = load_case({"kinematics": "uniaxial_strain", "resolution": 1e-3, "bodies": {"gas": gas, "wall": wall},
                      "time": {"end": 2e-6}})  # fmt: skip
    setup = build(case)
    advance(setup, 2e-6)
    density = setup.particles["density"][setup.particles.body == 1]
    assert 74.2e9 * np.abs(density / 2703.0 - 1.0).max() < 0.7e6


def test_stiffness_follows_the_pressure_to_come():
    metal = {"density": 2785.0, "eos": {"type": "mie_gruneisen", "sound_speed": 5328.0, "gamma": 2.0, "s1": 1.338}}
    slow, fast = (build(bars({"type": "total_lagrangian"}, speed=v, material=metal)) for v in (100.0, 12000.0))
    carried = [s.stepper.formulation.contact.carried_over_stiffness(CUBIC_SPLINE, 1.4, 2) for s in (slow, fast)]
    k = [s.stepper.formulation.contact.of_material(2785.0, 5328.0, 1.0, 2, carried[0]) for s in (slow, fast)]
    assert carried[0] == pytest.approx(1.13, rel=0.01)
    assert k[0] == 2785.0 * 5328.0**2
    assert carried[1] * k[1] > 2.0 * 190e9  # impedance matching: 191 GPa


def test_bodies_that_pass_through_each_other_stop_the_run():
    setup = build(bars({"type": "total_lagrangian", "contact": {"type": "frictional", "stiffness": 1e-6}}, speed=1000.0,
                       gap=0.0))  # fmt: skip
    seen = []
    advance(setup, 3e-6, watch=lambda one: seen.append([name for _, name, _ in one.stepper.limits()]), steps=300)
    assert ["passed_through"] in seen
    first = seen.index(["passed_through"])
    assert 3 < first < 200
    sound = build(bars({"type": "total_lagrangian"}, speed=1000.0, gap=0.0))
    advance(sound, 2e-6, watch=lambda one: seen.append([name for _, name, _ in one.stepper.limits()]))
    assert ["passed_through"] not in seen[300:]


def test_refused():
    with pytest.raises(CaseError, match="Total Lagrangian bodies"):
        bars({"type": "riemann", "contact": {"type": "frictional", "stiffness": 0.3}})
    with pytest.raises(CaseError, match="only one body"):
        load_case({
            "kinematics": "plane_strain", "resolution": 0.5e-3,
            "bodies": {"left": {"material": SPRING, "shape": {"type": "box", "size": [4e-3, 3e-3]}}},
            "formulation": {"type": "eulerian", "contact": {"type": "penalty"}}, "time": {"end": "1 us"},
        })  # fmt: skip
    with pytest.raises(CaseError, match="fixed smoothing length"):
        bars({"type": "eulerian", "contact": {"type": "penalty"}, "smoothing_length": {"type": "variable"}})
