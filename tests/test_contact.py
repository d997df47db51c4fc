"""Contact between bodies: the law, its limits of the step, and bodies that bounce."""

import numpy as np
import pytest
from composite_runs import advance

from hvisph.casefile.loader import load_case
from hvisph.core.errors import CaseError
from hvisph.simulation.build import build
from hvisph.sph.kernels import CUBIC_SPLINE
from hvisph.sph.laws import contact
from hvisph.sph.laws.contact import Contact
from hvisph.sph.pairs import Pairs, Pass

SPRING = {"density": 2785.0, "eos": {"type": "elastic", "youngs_modulus": 70e9, "poisson_ratio": 0.3},
          "strength": {"type": "elastic"}}  # fmt: skip


def rates_of(position, body, dim, h=1.4, velocity=None):
    """Rates of unit masses and volumes with unit stiffness, in the order of the particles."""
    layout = contact.row_layout(dim)
    constants = Contact().coefficients(CUBIC_SPLINE, 1.4)
    pairs = Pairs(layout, CUBIC_SPLINE, [Pass(contact.accumulate, layout, {"EXPONENT": 4})], constants, position, h)
    to = layout.slots()
    pairs.rows[:, :dim] = position
    if velocity is not None:
        pairs.rows[:, to["U"] : to["U"] + dim] = velocity
    for name, value in (("H", h), ("M", 1.0), ("V", 1.0), ("K", 1.0), ("BODY", body)):
        pairs.rows[:, to[name]] = value
    pairs.evaluate(h)
    return pairs.rates[pairs.place[: len(position)]]


def energy(position, body, h=1.4):
    """E = sum over pairs of different bodies of w^4, straight from the definition."""
    total = 0.0
    for i in range(len(position)):
        for j in range(i):
            if body[i] != body[j]:
                r = np.linalg.norm(position[i] - position[j])
                total += (CUBIC_SPLINE.shape.py_func(r / h) / CUBIC_SPLINE.shape.py_func(1 / h)) ** 4
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


def bars(formulation, speed=20.0, end="20 us"):
    return load_case({
        "kinematics": "plane_strain", "resolution": 0.5e-3,
        "bodies": {
            "left": {"material": SPRING, "shape": {"type": "box", "size": [4e-3, 3e-3]}, "velocity": [speed, 0.0]},
            "right": {"material": SPRING, "shape": {"type": "box", "size": [4e-3, 3e-3]}, "gap": 0.5e-3},
        },
        "formulation": formulation, "time": {"end": end},
    })  # fmt: skip


@pytest.mark.parametrize("kind", ["eulerian", "total_lagrangian"])
def test_equal_bars_exchange_their_velocities(kind):
    setup = build(bars({"type": kind, "contact": {"type": "repulsive"}}))
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
        setup = build(bars({"type": "total_lagrangian", "contact": {"type": "repulsive", "stiffness": stiffness}}))
        setup.particles["position"][setup.particles.body == 0, 0] += 0.5e-3  # the bodies touch
        setup.stepper.start()
        ((time, name, particle),) = setup.stepper.limits()
        assert name == "contact"
        assert abs(setup.particles["position"][particle, 0]) < 1.5e-3  # at the interface
        times.append(time)
    assert times[0] == pytest.approx(2.0 * times[1], rel=1e-9)


def test_doubtful_stiffness_is_said():
    from hvisph.simulation.contact_warnings import contact_warnings

    def case(**contact):
        return bars({"type": "eulerian", "contact": {"type": "repulsive"} | contact}, speed=1000.0)

    assert contact_warnings(case()) == []
    assert "pass through each other" in contact_warnings(case(absolute_stiffness=1e12))[0]
    assert "limits the step" in contact_warnings(case(stiffness=10.0))[0]


def test_refused():
    with pytest.raises(CaseError, match="only one body"):
        load_case({
            "kinematics": "plane_strain", "resolution": 0.5e-3,
            "bodies": {"left": {"material": SPRING, "shape": {"type": "box", "size": [4e-3, 3e-3]}}},
            "formulation": {"type": "eulerian", "contact": {"type": "repulsive"}}, "time": {"end": "1 us"},
        })  # fmt: skip
    with pytest.raises(CaseError, match="fixed smoothing length"):
        bars({"type": "eulerian", "contact": {"type": "repulsive"}, "smoothing_length": {"type": "variable"}})
