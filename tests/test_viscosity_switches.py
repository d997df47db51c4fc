"""BAL and MON: the shares of the viscosity, alone and in a small impact."""

import math

import numpy as np
import pytest

from hvisph.casefile.loader import load_case
from hvisph.simulation.run import run
from hvisph.sph.terms.viscosity import balsara_share, relaxed_share

C, H = 5000.0, 1e-4
balsara, relaxed = balsara_share.py_func, relaxed_share.py_func


def test_balsara_takes_all_of_compression_and_nothing_of_rotation():
    compression = balsara((-1e6, 0, 0, 0, -1e6, 0, 0, 0, -1e6), C, H)
    rotation = balsara((0, -1e6, 0, 1e6, 0, 0, 0, 0, 0), C, H)
    # 1e-4 c/h = 5e3 1/s beside a divergence of 3e6 1/s leaves 1/600 of it out
    assert compression == pytest.approx(1.0, abs=2e-3)
    assert rotation == 0.0
    assert balsara((0,) * 9, C, H) == 0.0


def test_balsara_depends_on_no_frame():
    rng = np.random.default_rng(3)
    gradient = rng.normal(size=(3, 3)) * 1e6
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    turned = turn @ gradient @ turn.T
    assert balsara(turned.ravel(), C, H) == pytest.approx(balsara(gradient.ravel(), C, H), rel=1e-12)


def test_relaxed_share_is_the_exact_solution():
    # d alpha/dt = -(alpha - 0.1) C1 c/h + max(-div, 0), against many small explicit steps
    divergence, dt, start = -3e5, 2e-7, 0.7
    share = start
    for _ in range(20000):
        share += dt / 20000 * (-(share - 0.1) * 0.2 * C / H + max(-divergence, 0.0))
    # first-order steps of 1e-4 of the relaxation time
    assert relaxed(start, divergence, C, H, dt, 0.1, 0.2) == pytest.approx(share, rel=1e-4)
    assert relaxed(start, +3e5, C, H, math.inf, 0.1, 0.2) == pytest.approx(0.1)
    halves = relaxed(relaxed(start, divergence, C, H, dt / 2, 0.1, 0.2), divergence, C, H, dt / 2, 0.1, 0.2)
    assert halves == pytest.approx(relaxed(start, divergence, C, H, dt, 0.1, 0.2), rel=1e-13)


@pytest.mark.parametrize("kind", ["balsara", "morris_monaghan"])
def test_impact_with_a_switch(tmp_path, kind):
    settings = ["time.end=1.2us", f"formulation.viscosity={{type: {kind}}}", "expected=null", "output.every=null"]
    case = load_case("al_al", overrides=settings, resolution="0.5 mm")
    summary = run(case, tmp_path / "run", threads=1).summary
    # every pair balances, so what is left is round-off of some 300 steps
    assert abs(summary["conservation"]["energy_drift"]) < 1e-12
    assert summary["conservation"]["momentum_drift"] < 1e-12
    # the plane shock is at 28.6 GPa; release waves take it to 16-20 GPa at the centre, and MON rings above
    assert 13e9 < summary["measures"]["centre_pressure_peak"]["value"] < 30e9


def test_a_switch_is_refused_with_a_contact_algorithm():
    from hvisph.core.errors import CaseError

    settings = ["formulation.viscosity={type: balsara}", "formulation.contact={type: penalty}"]
    with pytest.raises(CaseError, match="formulation.viscosity.type"):
        load_case("al_al", overrides=settings)
