"""Elastic-plastic plate impacts, coarse, beside the exact waves: precursor, plateau, fronts, free surface."""

import numpy as np
import pytest
from gauge_beside_exact import compare_gauge

from hvisph.casefile.loader import load_case
from hvisph.output.reader import read_history
from hvisph.postprocessing.exact_solution import exact_solution
from hvisph.simulation.run import run

MIE_GRUENEISEN = tuple(
    f"bodies.{body}.material.eos={{type: mie_gruneisen, sound_speed: 5328, gamma: 2.0, s1: 1.338}}"
    for body in ("projectile", "target")
)


@pytest.fixture(scope="module", params=[(), MIE_GRUENEISEN], ids=["stiffened gas", "Mie-Grueneisen"])
def weak(request, tmp_path_factory):
    """The impact at 600 m/s with half the resolution."""
    case = load_case("plate_impact_600", overrides=request.param, resolution="20 um")
    outcome = run(case, tmp_path_factory.mktemp("weak") / "run", threads=1)
    return outcome, read_history(outcome.folder), exact_solution(case)


def compared(history, exact, name, column="stress_xx"):
    gauge = next(g for g in exact.gauges if g.name == name)
    return compare_gauge(history["time"], -history[f"gauge.{name}.{column}"], gauge.times, -gauge.values(column),
                         shortest=4e-8, smallest=6e7)  # fmt: skip


def test_precursor_and_plateau(weak):
    _, history, exact = weak
    precursor, plateau = compared(history, exact, "far").plateaus[1:3]
    assert precursor.exact == pytest.approx(0.63e9, rel=0.02)
    # The foot of the plastic shock, 0.1 us wide at this resolution, reaches into its second half.
    moments = np.linspace(0.75 * precursor.begin + 0.25 * precursor.end, 0.5 * (precursor.begin + precursor.end), 50)
    found = np.interp(moments, history["time"], -history["gauge.far.stress_xx"]).mean()
    assert found == pytest.approx(precursor.exact, rel=0.1)
    assert plateau.found == pytest.approx(plateau.exact, rel=0.015)


def test_speeds_of_both_fronts(weak):
    _, history, exact = weak
    near, far = compared(history, exact, "near"), compared(history, exact, "far")
    for there, here in zip(far.arrivals[:2], near.arrivals[:2], strict=True):
        found, speed = 5e-3 / (there.found - here.found), 5e-3 / (there.exact - here.exact)
        assert found == pytest.approx(speed, rel=0.02)


def test_free_surface(weak):
    _, history, exact = weak
    gauge = next(g for g in exact.gauges if g.name == "surface")
    late = np.linspace(2.2e-6, 2.5e-6, 100)
    found = np.interp(late, history["time"], history["gauge.surface.velocity_x"]).mean()
    assert found == pytest.approx(gauge.sample("velocity_x", late).mean(), rel=0.01)
    assert found == pytest.approx(592.5, rel=0.01)  # twice the particle velocity would be 600


def test_momentum_and_energy_are_kept(weak):
    conservation = weak[0].summary["conservation"]
    assert abs(conservation["energy_drift"]) < 1e-12
    assert abs(conservation["momentum_drift"]) < 1e-12


def test_a_strong_impact_has_one_front(tmp_path):
    overrides = ("bodies.projectile.velocity=[3.1 km/s]", "time.end=1.2 us")
    case = load_case("plate_impact_600", overrides=overrides, resolution="20 um")
    history, exact = read_history(run(case, tmp_path / "run", threads=1).folder), exact_solution(case)
    near, middle = compared(history, exact, "near"), compared(history, exact, "middle")
    assert len(middle.plateaus) == 2
    assert middle.plateaus[1].found == pytest.approx(middle.plateaus[1].exact, rel=0.015)
    assert middle.plateaus[1].exact == pytest.approx(28.65e9, rel=1e-3)
    speeds = [2.5e-3 / (getattr(middle.arrivals[0], of) - getattr(near.arrivals[0], of)) for of in ("found", "exact")]
    assert speeds[0] == pytest.approx(speeds[1], rel=0.02)
