"""Options of the standard law against sums written out: both forms of momentum and density, dissipation, f^n."""

import numpy as np
import pytest
from small_runs import LIQUID as LIQUID_CASE
from small_runs import METAL as METAL_CASE
from small_runs import final, row_of

from hvisph.core.particles import Particles
from hvisph.materials.eos import StiffenedGas
from hvisph.materials.material_table import Material
from hvisph.materials.strength import VonMises
from hvisph.schemes.standard.options import NO_VISCOSITY, DensityDissipation, GrayArtificialStress
from hvisph.schemes.standard.scheme import Eulerian
from hvisph.schemes.stepper import Stepper
from hvisph.simulation.run import run
from hvisph.sph.kernels import KERNELS

METAL = Material("metal", 2785.0, StiffenedGas(5328.0, 2.0), VonMises(27.6e9, 0.3e9))
LIGHT = Material("light", 1000.0, StiffenedGas(2000.0, 1.5))
DX = 1e-3


def particles_of(dim, extra=()):
    """A disordered lattice of two materials, in motion, compressed here and stretched there."""
    random = np.random.default_rng(dim)
    side = {1: 12, 2: 6, 3: 4}[dim]
    axes = np.meshgrid(*[np.arange(side) * DX] * dim, indexing="ij")
    x = np.stack([a.ravel() for a in axes], axis=1)
    particles = Particles(dim, len(x), extra)
    count = len(x)
    particles["position"] = x + random.uniform(-0.2, 0.2, x.shape) * DX
    particles["velocity"] = random.normal(0.0, 200.0, x.shape)
    heavy = x[:, 0] < 0.5 * side * DX
    rho0 = np.where(heavy, 2785.0, 1000.0)
    particles["mass"] = rho0 * DX**dim
    particles["density"] = rho0 * random.uniform(0.9, 1.2, count)
    particles["internal_energy"] = random.uniform(0.0, 1e5, count)
    particles["smoothing_length"] = random.uniform(1.2, 1.4, count) * DX
    particles["deviator"][heavy, :2] = random.normal(0.0, 5e7, (heavy.sum(), 2))
    particles["deviator"][:, 2] = -particles["deviator"][:, :2].sum(axis=1)
    particles.tags[:, 0] = np.arange(count)
    particles.tags[:, 2] = ~heavy
    return particles


def rates_of(dim, **options):
    formulation = Eulerian(h_over_dx=1.4, **options)
    particles = particles_of(dim, formulation.fields)
    stepper = Stepper(particles, formulation, [METAL, LIGHT], 0.5, 0.0, 1.4 * DX)
    stepper.h_max = 1.4 * DX
    stepper.start()
    return particles, stepper.rates[stepper.place].copy()


def written_out(particles, alpha, beta, product, mass_form, alpha_rho, kernel="cubic_spline"):
    """Return acceleration, power and the further rate of ln(rho), by double sums over full tensors."""
    dim, count, kernel = particles.dim, particles.count, KERNELS[kernel]
    x, u = particles["position"], particles["velocity"]
    m, rho, h = particles["mass"], particles["density"], particles["smoothing_length"]
    materials = [METAL, LIGHT]
    p = np.array([materials[k].pressure(r, e) for k, r, e in
                  zip(particles.material, rho, particles["internal_energy"], strict=True)])  # fmt: skip
    c = np.array([np.sqrt(materials[k].sound_speed_squared(r, e)) for k, r, e in
                  zip(particles.material, rho, particles["internal_energy"], strict=True)])  # fmt: skip
    sigma = np.zeros((count, dim, dim))
    s = particles["deviator"]
    for i in range(dim):
        sigma[:, i, i] = s[:, i] - p
    if dim > 1:
        sigma[:, 0, 1] = sigma[:, 1, 0] = s[:, 3]
    acceleration, power, chi = np.zeros((count, dim)), np.zeros(count), np.zeros(count)
    for a in range(count):
        for b in range(count):
            d = x[a] - x[b]
            r, hm = np.linalg.norm(d), 0.5 * (h[a] + h[b])
            if a == b or r >= kernel.reach * hm:
                continue
            slope = kernel.derivative(r, hm, dim)
            gradient = slope * d / r
            v = u[a] - u[b]
            mu = min(hm * v @ d / (r * r + 0.01 * hm * hm), 0.0)
            pi = (-alpha * 0.5 * (c[a] + c[b]) * mu + beta * mu * mu) / (0.5 * (rho[a] + rho[b]))
            own = sigma[a] / (rho[a] * rho[b] if product else rho[a] ** 2)
            other = sigma[b] / (rho[a] * rho[b] if product else rho[b] ** 2)
            acceleration[a] += m[b] * (own + other - pi * np.eye(dim)) @ gradient
            power[a] -= m[b] * v @ ((own - 0.5 * pi * np.eye(dim)) @ gradient)
            q = alpha_rho * m[b] / rho[b] * (p[a] - p[b]) / (0.5 * (c[a] + c[b])) * slope
            chi[a] += q / rho[a]
            if mass_form:
                chi[a] += (m[b] / rho[a] - m[b] / rho[b]) * v @ gradient
            power[a] += 0.5 * q / rho[a] * (p[a] / rho[a] + p[b] / rho[b])
    return acceleration, power, chi


@pytest.mark.parametrize(
    ("dim", "product", "mass_form", "alpha_rho"),
    [(1, False, False, 0.0), (1, True, False, 0.0), (1, False, False, 0.4), (2, False, True, 0.0), (3, True, True, 0.8)],
)  # fmt: skip
def test_against_sums_written_out(dim, product, mass_form, alpha_rho):
    options = {"product": product, "mass_form": mass_form, "alpha_rho": alpha_rho}
    ways = {"product": product, "mass_form": mass_form, "dissipation": DensityDissipation(alpha_rho)}
    particles, rates = rates_of(dim, **ways)
    acceleration, power, chi = written_out(particles, 1.0, 2.0, **options)
    # rounding of sums of terms that nearly cancel
    np.testing.assert_allclose(rates[:, :dim], acceleration, rtol=1e-9, atol=1e-11 * np.abs(acceleration).max())
    np.testing.assert_allclose(rates[:, dim], power, rtol=1e-9, atol=1e-11 * np.abs(power).max())
    if alpha_rho or mass_form:
        np.testing.assert_allclose(rates[:, -1], chi, rtol=1e-9, atol=1e-11 * np.abs(chi).max())
    assert_balanced(particles, rates, dim)


def test_balances_pair_by_pair():
    stress = GrayArtificialStress(0.3, 3)
    made = rates_of(2, product=True, dissipation=DensityDissipation(0.6), artificial_stress=stress)
    assert_balanced(*made, 2)


def assert_balanced(particles, rates, dim):
    m, u = particles["mass"], particles["velocity"]
    forces = m[:, None] * rates[:, :dim]
    assert np.abs(forces.sum(axis=0)).max() < 1e-12 * np.abs(forces).sum()
    work, heat = (forces * u).sum(axis=1), m * rates[:, dim]
    # what the forces do to the motion, the internal energies lose; the exchange of density moves none of it
    assert abs(work.sum() + heat.sum()) < 1e-12 * (np.abs(work).sum() + np.abs(heat).sum())


def test_dissipation_heats_both_sides_of_a_jump_of_pressure():
    """Alike particles at rest, one side compressed: T ds = de - p/rho^2 drho is at least zero for each."""
    formulation = Eulerian(dissipation=DensityDissipation(0.5))
    particles = Particles(1, 20, formulation.fields)
    particles["position"][:, 0] = np.arange(20) * DX
    particles["mass"] = LIGHT.density * DX
    particles["density"] = np.where(np.arange(20) < 10, 1.1, 1.0) * LIGHT.density
    particles["smoothing_length"] = 1.4 * DX
    particles.tags[:, 0] = np.arange(20)
    stepper = Stepper(particles, formulation, [LIGHT], 0.5, 0.0, 1.4 * DX)
    stepper.start()
    rates, rho = stepper.rates[stepper.place], particles["density"]
    p = np.array([LIGHT.pressure(r, 0.0) for r in rho])
    heating = rates[:, 1] - p / rho * rates[:, -1]
    assert heating.min() > -1e-9 * heating.max()
    assert heating[9] > 0.0
    assert heating[10] > 0.0
    assert rates[9, -1] < 0.0 < rates[10, -1]


@pytest.mark.parametrize(("dim", "form"), [
    (2, "volume"), (2, "mass"), *(pytest.param(dim, "volume", marks=pytest.mark.slow) for dim in (1, 3)),
])  # fmt: skip
def test_runs_with_dissipation_keep_energy_and_momentum(tmp_path, dim, form):
    """Metal on a liquid: a jump of density 2.8, an energy equation."""
    peaks = {}
    for alpha in (0.01, 0.5):  # the same loops
        formulation = {
            "type": "eulerian",
            "density_form": form,
            "density_dissipation": {"type": "zisis", "alpha": alpha},
        }
        case = row_of([METAL_CASE, LIQUID_CASE], dim, formulation=formulation, time={"end": 3e-7})
        outcome = run(case, tmp_path / f"{alpha}", threads=1)
        conservation = outcome.summary["conservation"]
        # kept pair by pair: rounding of some tens of steps
        assert abs(conservation["energy_drift"]) < 1e-12
        assert abs(conservation["momentum_drift"]) < 1e-12
        peaks[alpha] = final(outcome.folder).fields["pressure"].max()
    assert peaks[0.5] < 0.99 * peaks[0.01]  # the overshoot at the impact point is less


@pytest.mark.parametrize("n", [pytest.param(1, marks=pytest.mark.slow), 7])
def test_exponent_of_artificial_stress(n):
    # two particles in tension at half the spacing's distance: the term beside the plain stress is R f^n
    found = {}
    for eps in (0.0, 0.3):
        formulation = Eulerian(viscosity=NO_VISCOSITY, artificial_stress=GrayArtificialStress(eps, n))
        particles = Particles(1, 2)
        particles["position"][:, 0] = 0.0, 0.8 * DX
        particles["mass"] = LIGHT.density * DX
        particles["density"] = 0.9 * LIGHT.density
        particles["smoothing_length"] = 1.4 * DX
        particles.tags[:, 0] = 0, 1
        stepper = Stepper(particles, formulation, [LIGHT], 0.5, 0.0, 1.4 * DX)
        stepper.start()
        found[eps] = float(stepper.rates[stepper.place][0, 0])
    kernel = KERNELS["cubic_spline"]
    f = kernel.value(0.8 * DX, 1.4 * DX, 1) / kernel.value(DX, 1.4 * DX, 1)
    assert found[0.3] / found[0.0] == pytest.approx(1.0 - 0.3 * f**n, rel=1e-12)
