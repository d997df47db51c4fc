"""Total Lagrangian rings: the compiled passes against sums over every pair of the whole section, from the formulas."""

import numpy as np
import pytest
from test_total_lagrangian import SPRING, E
from test_total_lagrangian_twin import FLOWING, reference_gradients, share_of_viscosity

from hvisph.casefile.loader import load_case
from hvisph.setup.build import build

MIRROR = np.array([1.0, -1.0])
YIELD = 0.3e9


def whole(values, signs=1.0):
    """Return values of rings and, behind them, of their images over the axis."""
    return np.concatenate([values, values * signs])


def written_out(stepper, hourglass):
    """Return J, accelerations, powers and rates of the circumference of the rings of a body at its stage."""
    particles, kernel, h = stepper.particles, stepper.formulation.kernel, stepper.h
    viscosity, rho0 = stepper.formulation.viscosity, stepper.materials[0].density
    alpha, beta = viscosity.alpha, viscosity.beta
    count, slots = particles.count, stepper.slots
    rows = stepper.rows_[:count]
    x, u = (whole(rows[:, k : k + 2], MIRROR) for k in (0, slots["U"]))
    at = whole(particles["reference_position"], MIRROR)
    hoop = x[:, 1] / at[:, 1]  # of images, too
    rho, c0 = whole(rows[:, slots["RHO"]]), stepper.materials[0].bulk_sound_speed
    area = whole(particles["mass"] / (rho0 * 2.0 * np.pi * at[:count, 1]))
    mass = whole(particles["mass"] / (2.0 * np.pi * x[:count, 1]))
    pairs = reference_gradients(at, area, kernel, h, "mixed")
    f, rate = np.tile(np.eye(2), (2 * count, 1, 1)), np.zeros((2 * count, 2, 2))
    for (a, b), g in pairs.items():
        f[a] += np.outer((x[b] - x[a]) - (at[b] - at[a]), g)
        rate[a] += np.outer(u[b] - u[a], g)
    section, inverse = whole(stepper.swellings) * np.linalg.det(f), np.linalg.inv(f)
    l = np.zeros((2 * count, 3, 3))
    l[:, :2, :2], l[:, 2, 2] = rate @ inverse, u[:, 1] / x[:, 1]
    c = c0 * np.array([share_of_viscosity(one) for one in l])
    modulus = whole(E / (1.0 + E / YIELD * particles["plastic_strain"]))
    s, p = rows[:, slots["S"] : slots["S"] + 3], stepper.pressures  # within yield, where the state need not be
    sigma = np.zeros((2 * count, 2, 2))
    for row, column, values, sign in ((0, 0, s[:, 0] - p, 1), (1, 1, s[:, 1] - p, 1), (0, 1, s[:, 2], -1)):
        sigma[:, row, column] = sigma[:, column, row] = whole(values, sign)
    stress = (section * hoop)[:, None, None] * sigma @ inverse.transpose(0, 2, 1)
    around = section[:count] * (-s[:, 0] - s[:, 1] - p)
    # kappa of corrected kernels is 1
    held = -around / (rho0 * at[:count, 1])
    acceleration = np.column_stack([np.zeros(count), held])
    power = -held * u[:count, 1]
    for (a, b), g in pairs.items():
        if a >= count:
            continue
        back = area[b] / area[a] * pairs[b, a]
        d, apart = x[a] - x[b], at[a] - at[b]
        r, of_axis = np.linalg.norm(d), at[b, 1] < 0.0
        then, now = 0.5 * (1.0 + at[b, 1] / at[a, 1]), 0.5 * (1.0 + x[b, 1] / x[a, 1])
        mu = min(h * (u[a] - u[b]) @ d / (r**2 + 0.01 * h**2), 0.0)
        pi = (-alpha * 0.5 * (c[a] + c[b]) * mu + beta * mu**2) / (0.5 * (rho[a] + rho[b]))
        now = 0.5 * (1.0 - x[b, 1] / x[a, 1]) if of_axis else now  # of the viscosity that of a mirror
        viscous = -now * pi * mass[b] * kernel.derivative(r, h, 2) * d / r
        errors = modulus[a] * ((f[a] @ apart) @ d - r**2) + modulus[b] * ((f[b] @ apart) @ d - r**2)
        w0 = kernel.value(np.linalg.norm(apart), h, 2)
        spring = then * 0.5 * hourglass * area[b] * w0 * errors / (apart @ apart * r**2) / rho0 * d
        own = then * stress[a] @ g / rho0
        force = own - then * stress[b] @ back / rho0 + viscous + spring
        acceleration[a] += force * ((0.0, 1.0) if of_axis else (1.0, 1.0))
        # of an image over the axis: the radial work of the two real rings
        v = np.array([0.0, u[a, 1] + u[b, 1]]) if of_axis else u[a] - u[b]
        power[a] -= v @ (own + 0.5 * spring) + 0.5 * viscous @ (np.array([0.0, 1.0]) * (u[a] - u[b]) if of_axis else v)
    return (section * hoop)[:count], acceleration, power, u[:count, 1] / x[:count, 1]


def test_forces_of_rings_are_those_of_the_formulas():
    random = np.random.default_rng(8)
    rod = {"material": FLOWING, "shape": {"type": "cylinder", "diameter": 4e-3, "length": 3e-3}}
    setup = build(load_case({"kinematics": "axisymmetric", "resolution": 0.5e-3, "bodies": {"rod": rod},
                             "formulation": {"type": "total_lagrangian"}, "time": {"end": 1e-6}}))  # fmt: skip
    particles, stepper = setup.particles, setup.stepper
    stepper.start()
    particles["position"] += 2e-5 * random.normal(size=particles["position"].shape)
    particles["velocity"] = 100.0 * random.normal(size=particles["velocity"].shape)
    particles["deviator"] = 1e8 * random.normal(size=(particles.count, 4))
    particles["deviator"][:, 2] = -particles["deviator"][:, :2].sum(axis=1)
    particles["plastic_strain"] = random.uniform(0.0, 0.5, particles.count)
    stepper.swellings[:] = random.uniform(0.9, 1.1, particles.count)
    stepper.predict(0.0)
    stepper.evaluate()
    j, acceleration, power, hoop = written_out(stepper, 10.0)
    assert stepper.jacobians == pytest.approx(j, rel=1e-12)
    # forces are small sums of large terms of a stiff spring: their rounding is that of the terms
    for found, wanted in ((stepper.rates[:, :2], acceleration), (stepper.rates[:, 2], power),
                          (stepper.rates[:, -1], hoop)):  # fmt: skip
        np.testing.assert_allclose(found, wanted, rtol=1e-9, atol=1e-10 * np.abs(wanted).max())


def meeting(kind):
    """Two discs, one in the other by a little, that fly and vibrate."""
    form = {"type": "total_lagrangian"} if kind == "total_lagrangian" else {"type": kind, "conversion": {"strain": 0.2}}
    discs = {name: {"material": SPRING, "shape": {"type": "cylinder", "diameter": size, "length": 2e-3}}
             for name, size in (("flyer", 5e-3), ("plate", 8e-3))}  # fmt: skip
    discs["flyer"]["velocity"] = [100.0, 0.0]
    return build(load_case({"kinematics": "axisymmetric", "resolution": 0.5e-3, "bodies": discs, "formulation": form,
                            "time": {"end": 1e-6}}))  # fmt: skip


@pytest.mark.parametrize("kind", ["total_lagrangian", "adaptive"])
def test_rings_that_meet_conserve_energy_and_axial_momentum(kind):
    setup = meeting(kind)
    particles, stepper = setup.particles, setup.stepper
    stepper.start()
    random = np.random.default_rng(3)
    particles["position"] += 1e-5 * random.normal(size=particles["position"].shape)
    particles["position"][particles.body == 0, 0] += 0.15e-3
    particles["velocity"] += 300.0 * random.normal(size=particles["velocity"].shape)
    particles["deviator"] = 1e8 * random.normal(size=(particles.count, 4))
    particles["deviator"][:, 2] = -particles["deviator"][:, :2].sum(axis=1)
    if kind == "adaptive":
        particles["kernel_type"][random.uniform(size=particles.count) < 0.4] = 0.0
        stepper._classify()
    stepper.predict(0.0)
    stepper.evaluate()
    m, rates = particles["mass"], stepper.rates
    force = m[:, None] * rates[:, :2]
    work = (force * particles["velocity"]).sum(axis=1)
    stored = stepper.contact._power  # work against the contact, which no ring has as heat
    assert stored != 0.0
    # sums over some hundred rings
    assert abs((work + m * rates[:, 2]).sum() + stored) < 1e-12 * np.abs(work).sum()
    assert abs(force[:, 0].sum()) < 1e-13 * np.abs(force[:, 0]).sum()


def test_the_work_against_a_contact_of_rings_is_its_energy():
    """E = sum V_a K_a p_a^2/2 over rings and images, summed plainly; its change along the motion is the contact's power."""
    setup = meeting("total_lagrangian")
    particles, stepper = setup.particles, setup.stepper
    stepper.start()
    particles["position"][particles.body == 0, 0] += 0.15e-3
    random = np.random.default_rng(5)
    particles["velocity"] = 50.0 * random.normal(size=particles["velocity"].shape)
    kernel, h, contact = stepper.formulation.kernel, stepper.h, stepper.contact
    starts, stiffness = contact.starts.copy(), contact.pairs.coefficients[0] * contact._stiffness

    def energy(x):
        found, section = 0.0, contact._volume / (2.0 * np.pi * x[:, 1])
        for a in range(particles.count):
            others = np.flatnonzero(particles.body != particles.body[a])
            r = np.concatenate([np.linalg.norm(x[a] - x[others] * side, axis=1) for side in (1.0, MIRROR)])
            w = np.array([kernel.value(float(one), h, 2) for one in r])
            excess = max(whole(section[others]) @ w - starts[a], 0.0)
            found += 0.5 * contact._volume[a] * stiffness[a] * excess**2
        return found

    stepper.predict(0.0)
    stepper.evaluate()
    x, u, dt = particles["position"].copy(), particles["velocity"], 1e-10
    difference = (energy(x + dt * u) - energy(x - dt * u)) / (2.0 * dt)
    assert contact._power == pytest.approx(difference, rel=1e-6)  # of the difference over 2 dt
