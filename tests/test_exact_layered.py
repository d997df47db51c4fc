"""Layered barotropic impact: jump formulas, balances, mirrored cases, convergence, the published set-ups."""

from math import log, sqrt

import numpy as np
import pytest

from hvisph.core.errors import CaseError
from hvisph.exact.plate_impact import layered_impact
from hvisph.materials.eos import Linear, StiffenedGas
from hvisph.materials.material_table import Material
from hvisph.materials.strength import VonMises

# density and Cauchy number of the outer material and of the middle layer (Zisis 2013, tables 2 and 3)
SETUPS = {
    "test": (1.0, 1.0, 0.5, 0.25),
    "al_glass_al": (1.0, 3.7, 1900 / 2700, 7.6),
    "al_carbon_al": (1.0, 3.7, 1900 / 2700, 1.1),
    "st_glass_st": (1.0, 3.9, 1900 / 8000, 7.6),
    "st_carbon_st": (1.0, 3.9, 1900 / 8000, 1.1),
}
GAUGES = (0.6, 0.8, 1.0)


def barotropic(density, cauchy):
    return Material(f"{density} {cauchy}", density, Linear(density / cauchy))


def case(name, gap=0.0, step=0.02, end=0.75):
    rho, ca, rho_middle, ca_middle = SETUPS[name]
    outer, middle = barotropic(rho, ca), barotropic(rho_middle, ca_middle)
    layers = [(outer, 0.0, 0.5, 0.5)]
    for material, begin in ((outer, 0.5), (middle, 0.7), (outer, 0.9)):
        layers.append((material, begin + gap, begin + 0.2 + gap, -0.5))
    return layered_impact(layers, end, step)


def shock_pressure(rho, c, u):
    return rho * u * 0.5 * (u + sqrt(u * u + 4.0 * c * c))


@pytest.mark.parametrize("name", SETUPS)
def test_first_plateau_and_arrival_are_the_shock_formulas(name):
    rho, ca, *_ = SETUPS[name]
    times, states = case(name).gauge(0.6)
    shock_speed = 0.5 * (0.5 + sqrt(0.25 + 4.0 / ca))  # relative to the matter ahead
    assert states[0].velocity == -0.5
    assert states[1].velocity == pytest.approx(0.0, abs=1e-12)
    assert states[1].pressure == pytest.approx(shock_pressure(rho, ca**-0.5, 0.5), rel=1e-12)
    assert times[1] == pytest.approx(0.1 / shock_speed, rel=1e-12)


@pytest.mark.parametrize("name", SETUPS)
@pytest.mark.parametrize("gap", [0.0, 0.1])
@pytest.mark.parametrize("time", [0.05, 0.4, 0.74])
def test_mass_momentum_and_the_place_of_layers_hold(name, gap, time):
    tracked = case(name, gap)
    edges, states = tracked.profile(time)
    masses = np.diff(edges, axis=1)[:, 0] / [s.volume for s in states]
    velocities = np.array([s.velocity for s in states])
    rho, _, rho_middle, _ = SETUPS[name]
    start = 0.5 * 0.5 * rho - 0.5 * 0.2 * (2 * rho + rho_middle)
    assert masses.sum() == pytest.approx(0.9 * rho + 0.2 * rho_middle, rel=1e-12)
    # all balances are exact but for waves below 1e-7, which are left out
    assert masses @ velocities == pytest.approx(start, abs=1e-7)
    joined = np.isclose(edges[1:, 0], edges[:-1, 1], atol=1e-9)
    assert joined.all() == (gap == 0.0 or time > gap)


def test_impact_of_unlike_layers_matches_pressures():
    """Until a reflection comes back the contact of two layers is one Riemann problem."""
    heavy, light = barotropic(1.0, 1.0), barotropic(0.5, 0.25)
    tracked = layered_impact([(heavy, 0.0, 1.0, 1.0), (light, 1.0, 2.0, 0.0)], 0.1)
    _, states = tracked.profile(0.05)
    contact = states[1].velocity
    assert states[2].velocity == pytest.approx(contact, rel=1e-12)
    assert states[1].pressure == pytest.approx(shock_pressure(1.0, 1.0, 1.0 - contact), rel=1e-10)
    assert states[2].pressure == pytest.approx(shock_pressure(0.5, 2.0, contact), rel=1e-10)


def test_release_at_a_free_end_follows_the_rarefaction_formula():
    same = barotropic(1.0, 1.0)
    density = 1.0 + shock_pressure(1.0, 1.0, 0.5)
    exact = 0.5 + log(density)  # du = c drho/rho from rho to 1
    errors = []
    for step in (0.1, 0.05, 0.025):
        tracked = layered_impact([(same, 0.0, 1.0, 1.0), (same, 1.0, 1.3, 0.0)], 0.5, step)
        _, velocities = tracked.surface()
        errors.append(abs(velocities[-1] - exact))
    # chords of small pieces: n u^3 with u = 1/n, so second order in the piece
    assert errors[0] < 1e-3
    assert errors[2] < 0.3 * errors[1] < 0.09 * errors[0]


def test_mirrored_impact_is_the_mirror_image():
    a, b = barotropic(1.0, 1.0), barotropic(0.5, 0.25)
    there = layered_impact([(a, 0.0, 0.5, 1.0), (b, 0.5, 0.7, 0.0), (a, 0.7, 1.0, 0.0)], 0.7)
    back = layered_impact([(a, -1.0, -0.7, 0.0), (b, -0.7, -0.5, 0.0), (a, -0.5, 0.0, -1.0)], 0.7)
    times = np.linspace(0.0, 0.7, 141) + 1e-6
    for x in (0.3, 0.61, 0.85):
        np.testing.assert_allclose(there.sample(x, times), -back.sample(-x, times), atol=1e-6)


def test_histories_converge_with_the_pieces_of_rarefactions():
    times = np.linspace(0.0, 0.75, 1501)
    reference = case("test", step=0.005)
    errors = []
    for step in (0.08, 0.04, 0.02):
        coarse = case("test", step=step)
        errors.append(np.mean([np.abs(coarse.sample(x, times) - reference.sample(x, times)).mean() for x in GAUGES]))
    # a staircase for a slope: first order
    assert errors[2] < 0.65 * errors[1] < 0.65**2 * errors[0]
    assert errors[2] < 1e-3


def test_a_gap_delays_everything_by_its_closing_time():
    times = np.linspace(0.0, 0.6, 301)
    touching, apart = case("test"), case("test", gap=0.1)
    for x in GAUGES:
        late = apart.sample(x + 0.1, times + 0.1)
        # staircases may differ by one tread of 0.02 at single samples
        assert np.abs(late - touching.sample(x, times)).mean() < 1e-4


@pytest.mark.parametrize("name", SETUPS)
def test_reverberation_settles_between_equal_neighbours(name):
    """The outer layers are one material: before releases come, gauge A must return to the first plateau.

    Each pass through the middle layer brings it nearer to what a single block would show.
    """
    rho, ca, *_ = SETUPS[name]
    tracked = case(name)
    block = shock_pressure(rho, ca**-0.5, 0.5)
    pressures = tracked.sample(0.6, np.linspace(0.5, 0.749, 250), "pressure")
    assert np.abs(pressures / block - 1.0).min() < 5e-3  # after two or three passes


def test_layers_that_overlap_or_are_empty_and_other_materials_are_refused():
    a = barotropic(1.0, 1.0)
    with pytest.raises(CaseError, match="inside the one before"):
        layered_impact([(a, 0.0, 0.5, 1.0), (a, 0.4, 0.7, 0.0)], 0.1)
    with pytest.raises(CaseError, match="not beyond its begin"):
        layered_impact([(a, 0.5, 0.5, 1.0)], 0.1)
    with pytest.raises(CaseError, match="stiffened_gas"):
        layered_impact([(Material("x", 1.0, StiffenedGas(1.0, 2.0)), 0.0, 0.5, 1.0)], 0.1)
    with pytest.raises(CaseError, match="without strength"):
        layered_impact([(Material("x", 1.0, Linear(1.0), VonMises(1.0, 0.1)), 0.0, 0.5, 1.0)], 0.1)
    with pytest.raises(CaseError, match="x = 2"):
        case("test", end=0.01).gauge(2.0)
