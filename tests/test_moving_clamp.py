"""Clamps that move: the shock before a piston, the same bar on a moving wall, the balance, bad input."""

from itertools import pairwise

import numpy as np
import pytest
from small_runs import METAL, assert_same_results, final

from hvisph.case.conditions import condition_words
from hvisph.casefile.loader import load_case
from hvisph.core.errors import CaseError
from hvisph.integrators.prescribed_motion import Motion
from hvisph.setup.initial_state import begin
from hvisph.simulation.run import resume, run

PISTON, DX = 0.2e-3, 1e-5
# some of adaptive turn behind the shock of the piston, which compresses by a tenth
FORMULATIONS = [{"type": name} for name in ("riemann", "eulerian", "total_lagrangian")] + [
    {"type": "adaptive", "conversion": {"strain": 0.05}}
]


def bar(velocity, wall, end=0.4e-6, material=METAL, **further):
    """A bar of 2 mm behind 0.2 mm of the same metal that is held at the velocity `wall`, in 1D."""
    return load_case({
        "kinematics": "uniaxial_strain", "resolution": DX,
        "bodies": {"bar": {"material": material, "shape": {"type": "interval", "length": 2e-3}, "position": [1e-3],
                           "velocity": [velocity]}},
        "clamped": [{"box": {"max": [PISTON]}, "velocity": [wall]}], "time": {"end": end}, "output": {"every": end},
    } | further)  # fmt: skip


@pytest.mark.parametrize("formulation", FORMULATIONS, ids=lambda one: one["type"])
def test_the_shock_before_a_piston(formulation, tmp_path):
    """Speed, pressure and momentum behind the shock in a stiffened gas are those of its exact Hugoniot.

    U_s = s u + (s^2 u^2 + c^2)^(1/2) with s = (gamma + 1)/4 by the jump conditions.
    """
    piston, end = 500.0, 0.2e-6
    liquid = {"density": METAL["density"], "eos": METAL["eos"]}
    outcome = run(bar(0.0, piston, end, material=liquid, formulation=formulation), tmp_path / "run")
    fields = final(tmp_path / "run").fields
    x, u = fields["position"][:, 0], fields["velocity"][:, 0]
    behind = (x > 0.5e-3) & (x < 1.1e-3)
    slope = 0.75 * piston
    wave = slope + (slope**2 + 5328.0**2) ** 0.5
    pressure = 2785.0 * wave * piston
    assert np.allclose(u[behind], piston, rtol=0.01)  # 1 %: noise behind a front of a few spacings
    assert np.allclose(fields["pressure"][behind], pressure, rtol=0.01)
    free = x > PISTON + piston * end
    momentum = (fields["mass"] * u)[free].sum()
    # the front starts within the kernel: three spacings of its way
    assert momentum == pytest.approx(pressure * end, rel=3 * DX / (wave * end))
    kept = outcome.summary["conservation"]
    assert abs(kept["energy_drift"]) < 1e-12
    assert abs(kept["momentum_drift"]) < 1e-12
    assert outcome.summary["energies"]["external_work"] == pytest.approx(momentum * piston, rel=1e-9)


@pytest.mark.parametrize("formulation", FORMULATIONS, ids=lambda one: one["type"])
def test_a_moving_wall_is_one_at_rest_to_who_moves_with_it(formulation, tmp_path):
    run(bar(-300.0, 0.0, formulation=formulation), tmp_path / "rest")
    run(bar(0.0, 300.0, formulation=formulation), tmp_path / "moves")
    rest, moves = final(tmp_path / "rest"), final(tmp_path / "moves")
    shift = 300.0 * 0.4e-6
    assert np.allclose(moves.fields["position"] - shift, rest.fields["position"], rtol=0.0, atol=1e-6 * 2e-3)
    assert np.allclose(moves.fields["velocity"] - 300.0, rest.fields["velocity"], rtol=0.0, atol=1e-3)


@pytest.mark.parametrize("formulation", [FORMULATIONS[0], FORMULATIONS[2]], ids=lambda one: one["type"])
def test_a_resumed_piston_has_the_same_bits(formulation, tmp_path):
    case = bar(0.0, 500.0, end=1e-7, formulation=formulation)
    run(case, tmp_path / "whole")
    run(case.model_copy(update={"time": case.time.model_copy(update={"max_steps": 9})}), tmp_path / "part")
    resume(tmp_path / "part", max_steps=10**6)
    assert_same_results(tmp_path / "whole", tmp_path / "part")


@pytest.mark.parametrize(("change", "words"), [
    ({"clamped": [{"box": {"max": [PISTON]}, "velocity": [1.0, 2.0]}]}, "needs 1 in 1D"),
    ({"formulation": {"type": "projection"}}, "use another formulation"),
    ({"time": {"end": 1e-7, "integrator": "predictor_corrector"}}, "leapfrog"),
    ({"gravity": [-9.81]}, "against gravity"),
    ({"clamped": [{"box": {"max": [PISTON]}, "along": "y"}]}, "needs `velocity_table`"),
    ({"clamped": [{"box": {}}]}, "holds all of 'bar'"),
])  # fmt: skip
def test_bad_input(change, words):
    with pytest.raises(CaseError, match=words):
        begin(bar(10.0, 500.0, **change))


def test_check_and_its_picture_name_the_moving_clamp():
    assert condition_words(bar(0.0, 500.0)) == [("moving clamp", "clamped.0: 500 m/s")]
    assert [kind for kind, _ in condition_words(bar(0.0, 0.0))] == ["clamp"]


TABLE = [[0.0, 0.0], [0.05e-6, 400.0], [0.1e-6, 400.0], [0.1e-6, 250.0]]


def follow_table(**further):
    """A piston that is driven up, held and slowed by a jump."""
    return bar(0.0, 0.0, 0.2e-6, clamped=[{"box": {"max": [PISTON]}, "velocity_table": TABLE}], **further)


def test_a_table_of_velocities_is_integrated_exactly():
    motion = Motion(1, np.array([row[0] for row in TABLE]), np.array([[row[1]] for row in TABLE]))
    assert [motion.velocity(t)[0] for t in (0.0, 0.025e-6, 0.07e-6, 0.1e-6, 1.0)] == [0.0, 200.0, 400.0, 250.0, 250.0]
    way = 0.5 * 400.0 * 0.05e-6 + 400.0 * 0.05e-6 + 250.0 * 0.1e-6
    parts = np.linspace(0.0, 0.2e-6, 38)
    assert motion.displacement(0.0, 0.2e-6)[0] == pytest.approx(way, rel=1e-14)
    moved = sum(motion.displacement(a, b)[0] for a, b in pairwise(parts))
    assert moved == pytest.approx(way, rel=1e-14)


@pytest.mark.parametrize("formulation", FORMULATIONS, ids=lambda one: one["type"])
def test_a_piston_follows_its_table_and_the_energy_is_balanced(formulation, tmp_path):
    outcome = run(follow_table(formulation=formulation), tmp_path / "run")
    fields = final(tmp_path / "run").fields
    way = 0.5 * 400.0 * 0.05e-6 + 400.0 * 0.05e-6 + 250.0 * 0.1e-6
    x, u, mass = fields["position"][:, 0], fields["velocity"][:, 0], fields["mass"]
    assert x[:20] == pytest.approx(DX * (np.arange(20) + 0.5) + way, rel=1e-10)
    assert np.all(u[:20] == 250.0)
    kept, energies = outcome.summary["conservation"], outcome.summary["energies"]
    assert abs(kept["energy_drift"]) < 1e-12
    assert energies["kinetic"] == pytest.approx(0.5 * (mass * u * u).sum(), rel=1e-9)


@pytest.mark.parametrize("formulation", FORMULATIONS[::2], ids=lambda one: one["type"])
def test_a_driven_body_pushes_another_at_no_loss_of_energy(formulation, tmp_path):
    """The work on a clamped body that strikes another is what both have in the end, through either contact."""
    shape = {"type": "interval", "length": 0.5e-3}
    bodies = {"driven": {"material": METAL, "shape": shape, "position": [0.25e-3], "velocity": [100.0]},
              "struck": {"material": METAL, "shape": shape, "position": [0.76e-3]}}  # fmt: skip
    outcome = run(bar(0.0, 100.0, 0.5e-6, bodies=bodies, formulation=formulation), tmp_path / "run")
    fields, kept = final(tmp_path / "run"), outcome.summary["conservation"]
    assert abs(kept["energy_drift"]) < 1e-12
    assert abs(kept["momentum_drift"]) < 1e-12
    struck = fields.body == 1
    momentum = (fields.fields["mass"] * fields.fields["velocity"][:, 0])[struck].sum()
    assert momentum > 0.5 * fields.fields["mass"][struck].sum() * 100.0  # a wave has run through most of it


def test_a_resumed_table_has_the_same_bits(tmp_path):
    case = follow_table()
    run(case, tmp_path / "whole")
    run(case.model_copy(update={"time": case.time.model_copy(update={"max_steps": 40})}), tmp_path / "part")
    resume(tmp_path / "part", max_steps=10**6)
    assert_same_results(tmp_path / "whole", tmp_path / "part")


@pytest.mark.parametrize(("table", "words"), [
    ([[1e-6, 0.0], [0.0, 1.0]], "must rise"), ([[0.0, 1.0], [0.0, 2.0], [0.0, 3.0]], "must rise"),
])  # fmt: skip
def test_a_table_that_does_not_rise(table, words):
    with pytest.raises(CaseError, match=words):
        bar(0.0, 0.0, clamped=[{"box": {"max": [PISTON]}, "velocity_table": table}])


def test_rows_under_velocity_are_the_table():
    case = bar(0.0, 0.0, clamped=[{"box": {"max": [PISTON]}, "velocity": [[0.0, "10 m/s"], ["2 us", "0.3 km/s"]]}])
    assert case.clamped[0].velocity_table == ((0.0, 10.0), (2e-6, 300.0))
    assert load_case(case.model_dump(mode="json")) == case
