"""Rigid bodies: an elastic bar on a free mass, walls, the balance, resumed runs, bad input."""

import numpy as np
import pytest
from small_runs import METAL, SPRING, assert_same_results, final, row_of

from hvisph.casefile.loader import load_case
from hvisph.core.errors import CaseError
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


def test_a_resumed_run_has_the_same_bits(tmp_path):
    case = plane(0, "x")
    run(case, tmp_path / "whole")
    run(case.model_copy(update={"time": case.time.model_copy(update={"max_steps": 25})}), tmp_path / "part")
    resume(tmp_path / "part", max_steps=10**6)
    assert_same_results(tmp_path / "whole", tmp_path / "part")


@pytest.mark.parametrize(("who", "rigid", "further", "words"), [
    (0, "y", {}, "component along x"), (0, "z", {}, "cannot move along z"),
    (0, "x", {"formulation": {"type": "eulerian"}}, "need formulation riemann"),
    (0, "x", {"symmetry": [{"axis": "x", "at": 0.1}]}, "would meet it"), (0, "x", {"gravity": [0.0, -9.81]}, "gravity"),
])  # fmt: skip
def test_bad_input(who, rigid, further, words):
    with pytest.raises(CaseError, match=words):
        plane(who, rigid, **further)


def test_a_clamp_within_a_rigid_body_is_refused(tmp_path):
    with pytest.raises(CaseError, match="a clamp holds"):
        run(plane(1, "x", clamped=[{"box": {"min": [1e-3, None]}}]), tmp_path / "run")


def test_two_rigid_bodies_are_refused():
    both = plane(0, "x").model_dump(mode="json")
    for body in both["bodies"].values():
        body["rigid"] = "x"
    with pytest.raises(CaseError, match="two rigid bodies"):
        load_case(both)
