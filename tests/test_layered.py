"""Layered impact (Zisis 2013) at half the published resolution, beside the exact solution."""

import pytest
from gauge_beside_exact import compare_gauge

from hvisph.casefile.loader import load_case
from hvisph.output.reader import read_history
from hvisph.postprocessing.exact_solution import exact_solution
from hvisph.simulation.run import run

COARSE = ("resolution=0.005", "time.step=2e-4", "output.every=null")


def computed(name, folder, *overrides):
    case = load_case(f"published/layered/{name}", overrides=(*COARSE, *overrides))
    return read_history(run(case, folder, threads=1).folder), exact_solution(case)


def compared(history, exact, name, column):
    gauge = next(g for g in exact.gauges if g.name == name)
    return compare_gauge(history["time"], history[f"gauge.{name}.{column}"], gauge.times, gauge.values(column),
                         shortest=0.04, smallest=0.05)  # fmt: skip


def test_velocities_at_the_gauges(tmp_path):
    history, exact = computed("test", tmp_path / "run")
    for name in "ABC":
        found = compared(history, exact, name, "velocity_x")
        assert found.mean_difference < 0.018  # 0.0079 at twice the resolution, of nearly first order
        # the figures asked at twice the resolution
        assert all(p.found == pytest.approx(p.exact, abs=0.01) for p in found.plateaus)
        assert all(a.found == pytest.approx(a.exact, abs=0.01) for a in found.arrivals)


def test_a_gap_delays_the_impact_by_itself(tmp_path):
    together = compared(*computed("test", tmp_path / "touching"), "A", "velocity_x")
    apart = compared(*computed("test_gap", tmp_path / "apart"), "A", "velocity_x")
    assert apart.arrivals[0].found - together.arrivals[0].found == pytest.approx(0.1, abs=0.005)


def test_density_keeps_to_the_spacing_in_the_mass_form(tmp_path):
    """Where the shock compresses fourfold, eq. 12 leaves density above m/dx, by 4 % at any resolution."""
    plateaus = {}
    for form in ("volume", "mass"):
        history, exact = computed("al_glass_al", tmp_path / form, f"formulation.density_form={form}")
        plateaus[form] = compared(history, exact, "B", "pressure").plateaus[-1]
    # The error in p; what goes into the momentum is p (m/(rho dx))^2, and is right in both.
    assert plateaus["mass"].found == pytest.approx(plateaus["mass"].exact, rel=0.02)
    assert plateaus["volume"].found / plateaus["volume"].exact == pytest.approx(1.085, abs=0.02)
