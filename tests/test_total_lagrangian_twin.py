"""The compiled Total Lagrangian passes against their formulas written out in plain Python."""

import numpy as np
import pytest
from test_total_lagrangian import SPRING, body

from hvisph.setup.build import build
from hvisph.sph.neighbours.reference_neighbours import RIM

# It has flowed and is damaged; nothing that happens here would damage it further.
FLOWING = SPRING | {"strength": {"type": "von_mises", "yield_stress": 0.3e9},
                    "damage": {"type": "johnson_cook", "d1": 1e30}}  # fmt: skip
HALF = {1: [(0, 0)], 2: [(0, 0), (1, 1), (0, 1)], 3: [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)]}


def reference_gradients(at, volume, kernel, h, correction):
    """Return of each pair (a, b) the vector V0_b g_ab."""
    count, dim = at.shape
    found = {}
    for a in range(count):
        near = [b for b in range(count) if b != a and np.linalg.norm(at[a] - at[b]) < kernel.reach * h * RIM]
        d = {b: at[a] - at[b] for b in near}
        r = {b: np.linalg.norm(d[b]) for b in near}
        w = {b: volume[b] * kernel.value(r[b], h, dim) for b in near}
        g = {b: volume[b] * kernel.derivative(r[b], h, dim) * d[b] / r[b] for b in near}
        if correction == "mixed":
            total = sum(w.values()) + volume[a] * kernel.value(0.0, h, dim)
            slope = sum(g.values())
            g = {b: g[b] / total - w[b] * slope / total**2 for b in near}
        if correction != "none":
            inverse = np.linalg.inv(sum(np.outer(g[b], -d[b]) for b in near))
            g = {b: inverse @ g[b] for b in near}
        found |= {(a, b): g[b] for b in near}
    return found


def share_of_viscosity(l):
    """Return the share of the linear viscosity at a velocity gradient of 1, 2 or 3 dimensions."""
    full = np.zeros((3, 3))
    full[: len(l), : len(l)] = l
    d = 0.5 * (full + full.T)
    deviator = d - np.trace(d) / 3.0 * np.eye(3)
    swelling = abs(np.trace(d))
    return max(0.1, swelling / (swelling + 0.2 * np.sqrt(2.0 / 3.0 * (deviator**2).sum())))


def written_out(stepper, young_modulus, correction="mixed", hourglass=0.0, printed=False, yield_stress=np.inf):
    """Return J, velocity gradients, accelerations and powers of a Total Lagrangian body at its stage."""
    particles, kernel, h = stepper.particles, stepper.formulation.kernel, stepper.h
    alpha, beta = stepper.formulation.viscosity.alpha, stepper.formulation.viscosity.beta
    count, dim = particles["position"].shape
    rows, slots = stepper.rows_[:count], stepper.slots
    x, u = rows[:, :dim], rows[:, slots["U"] : slots["U"] + dim]
    at, m = particles["reference_position"], particles["mass"]
    rho0 = stepper.materials[0].density
    volume = m / rho0
    pairs = reference_gradients(at, volume, kernel, h, correction)
    f, rate = np.tile(np.eye(dim), (count, 1, 1)), np.zeros((count, dim, dim))
    for (a, b), g in pairs.items():
        f[a] += np.outer((x[b] - x[a]) - (at[b] - at[a]), g)
        rate[a] += np.outer(u[b] - u[a], g)
    j, inverse = stepper.swellings * np.linalg.det(f), np.linalg.inv(f)
    rho, l = rho0 / j, rate @ inverse
    c = stepper.materials[0].bulk_sound_speed * np.array([share_of_viscosity(one) for one in l])
    modulus = young_modulus / (1.0 + young_modulus * particles["plastic_strain"] / yield_stress)
    modulus = modulus * (1.0 - particles["damage"])
    sigma = np.zeros((count, dim, dim))
    for k, (p, q) in enumerate(HALF[dim]):
        sigma[:, p, q] = sigma[:, q, p] = rows[:, slots["S"] + k]
    sigma -= stepper.pressures[:, None, None] * np.eye(dim)
    stress = j[:, None, None] * sigma @ inverse.transpose(0, 2, 1)
    acceleration = np.zeros((count, dim))
    power = (stress * rate).sum(axis=(1, 2)) / rho0
    for (a, b), g in pairs.items():
        back = volume[b] / volume[a] * pairs[b, a]  # V0_b g_ba
        d, v, apart = x[a] - x[b], u[a] - u[b], at[a] - at[b]
        r = np.linalg.norm(d)
        mu = min(h * v @ d / (r**2 + 0.01 * h**2), 0.0)
        pi = (-alpha * 0.5 * (c[a] + c[b]) * mu + beta * mu**2) / (0.5 * (rho[a] + rho[b]))
        if printed:
            pair = -0.5 * pi * rho0 * (inverse[a].T @ g / j[b] - inverse[b].T @ back / j[a])
        else:
            pair = -pi * m[b] * kernel.derivative(r, h, dim) * d / r
        errors = modulus[a] * ((f[a] @ apart) @ d - r**2) + modulus[b] * ((f[b] @ apart) @ d - r**2)
        w0 = kernel.value(np.linalg.norm(apart), h, dim)
        pair = pair + 0.5 * hourglass * volume[b] * w0 * errors / (apart @ apart * r**2) / rho0 * d
        acceleration[a] += (stress[a] @ g - stress[b] @ back) / rho0 + pair
        power[a] -= 0.5 * v @ pair
    return j, l.reshape(count, -1), acceleration, power


@pytest.mark.parametrize(
    ("dim", "options", "plainly"),
    [(1, {"hourglass": 0.0, "correction": "gradient"}, {"correction": "gradient"}),
     (2, {"material": FLOWING}, {"hourglass": 10.0, "yield_stress": 0.3e9}),
     (3, {"viscosity_gradient": "reference", "hourglass": 0.0}, {"printed": True}),
     pytest.param(2, {"correction": "none"}, {"correction": "none", "hourglass": 10.0}, marks=pytest.mark.slow)],
)  # fmt: skip
def test_deformation_forces_and_power_are_those_of_the_formulas(dim, options, plainly):
    random = np.random.default_rng(8)
    setup = build(body(dim, shape={"type": "box", "size": [2e-3, 2e-3, 2e-3]} if dim == 3 else None, **options))
    particles, stepper = setup.particles, setup.stepper
    stepper.start()
    particles["position"] += 2e-5 * random.normal(size=particles["position"].shape)
    particles["velocity"] = 100.0 * random.normal(size=particles["velocity"].shape)
    particles["deviator"][:, :2] = 1e8 * random.normal(size=(particles.count, 2))
    particles["deviator"][:, 2] = -particles["deviator"][:, :2].sum(axis=1)
    particles["plastic_strain"] = random.uniform(0.0, 0.5, particles.count)
    particles["damage"] = random.uniform(0.0, 0.5, particles.count)
    stepper.swellings[:] = random.uniform(0.9, 1.1, particles.count)
    stepper.predict(0.0)
    stepper.evaluate()
    j, gradient, acceleration, power = written_out(stepper, 70e9, **plainly)
    assert stepper.jacobians == pytest.approx(j, rel=1e-12)
    density = stepper.materials[0].density / j
    assert stepper.rows_[: particles.count, stepper.slots["RHO"]] == pytest.approx(density, rel=1e-12)
    assert particles["density"] == pytest.approx(density, rel=1e-12)
    # forces are small sums of large terms of a stiff spring: their rounding is that of the terms
    for found, wanted in ((stepper.rates[:, dim + 2 :], gradient), (stepper.rates[:, :dim], acceleration),
                          (stepper.rates[:, dim], power)):  # fmt: skip
        np.testing.assert_allclose(found, wanted, rtol=1e-9, atol=1e-10 * np.abs(wanted).max())
