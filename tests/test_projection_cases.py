"""SPH-projection from case to summary: default step, refusals, warnings, budgets, restart."""

import numpy as np
import pytest
from small_runs import LIQUID, METAL, assert_same_results, row_of

import hvisph
from hvisph.case.consistency import warnings_of
from hvisph.casefile.loader import dump_case, load_case
from hvisph.core.errors import CaseError
from hvisph.output.reader import list_snapshots, read_history, read_snapshot
from hvisph.simulation.listener import Listener
from hvisph.simulation.run import run

STEEL = METAL | {"density": 7900.0}
DAMAGED = METAL | {"damage": {"type": "pressure_cutoff", "pressure": -1e9}}


class Told(Listener):
    def __init__(self):
        self.messages = []

    def message(self, text):
        self.messages.append(text)


def two(materials=(METAL, METAL), dim=2, dx=0.5e-3, formulation=None, **further):
    return row_of(materials, dim, dx, formulation={"type": "projection"} | (formulation or {}), **further)


def al_al(**further):
    overrides = ["resolution=0.5mm", "formulation={type: projection}", "bodies.projectile.arrangement=rings"]
    return load_case("al_al", overrides=overrides + [f"{key}={value}" for key, value in further.items()])


def test_step_follows_resolution_and_stays_where_given():
    case = two(dx=0.2e-3)
    assert case.time.step == pytest.approx(0.2e-9)
    assert case.formulation.h_over_dx == 1.5
    assert load_case("al_al", overrides=["formulation={type: projection}"]).time.step == pytest.approx(1e-10)
    assert two(time={"end": 1e-6, "step": 1e-9}).time.step == 1e-9
    assert row_of((METAL, METAL)).time.step is None


def test_effective_case_loads_to_itself(tmp_path):
    case = two(formulation={"body_force": [0.0, -9.81]})
    (tmp_path / "case.yaml").write_text(dump_case(case), encoding="utf-8")
    assert load_case(tmp_path / "case.yaml") == case


@pytest.mark.parametrize(
    ("further", "where"),
    [
        ({"formulation": {"viscosity": {"type": "none"}}}, "viscosity"),
        ({"formulation": {"body_force": [1.0]}}, "body_force"),
        ({"formulation": {"min_support": 1.0}}, "min_support"),
        ({"materials": (METAL, DAMAGED)}, "damage"),
        ({"units": "none"}, "time.step"),
        ({"kinematics": "plane_stress"}, "kinematics"),
    ],
)
def test_what_has_no_meaning_is_refused_where_it_stands(further, where):
    with pytest.raises(CaseError, match=where):
        two(**further)


def test_an_integrator_is_named_as_not_used():
    case = two(time={"end": 1e-6, "integrator": "predictor_corrector"})
    assert "predictor_corrector" in warnings_of(case)[0]


def test_only_the_printed_form_between_two_densities_warns(tmp_path):
    printed = {"pressure_gradient": "original"}
    assert warnings_of(two((METAL, STEEL))) == []
    assert warnings_of(two((METAL, METAL), formulation=printed)) == []
    case = two((METAL, STEEL), formulation=printed, time={"end": 5e-9})
    told = Told()
    run(case, tmp_path / "run", threads=1, listener=told)
    assert "2785 and 7900" in warnings_of(case)[0]
    text = warnings_of(case)[0].splitlines()[0]
    assert any(text in message for message in told.messages)
    assert text in (tmp_path / "run" / "run.log").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def impact(tmp_path_factory):
    """Al-Al at 0.5 mm for 3 us, 6000 steps."""
    folder = tmp_path_factory.mktemp("impact") / "run"
    return folder, run(al_al(**{"time.end": "3us", "output.every": "1.5us"}), folder, threads=1)


def test_impact_finishes_and_keeps_its_budgets(impact):
    _, outcome = impact
    summary = outcome.summary
    assert (summary["status"], summary["steps"]) == ("done", 6000)
    kept = summary["conservation"]
    assert kept["energy_drift"] is None
    assert kept["momentum_drift"] < 1e-10  # the bound asked for; round-off is 1e-14
    # the plate takes its share within the first two microseconds: 0.81 to 0.85 from 0.4 to 0.2 mm
    assert 0.75 < kept["kinetic_energy_ratio"] < 0.9
    assert summary["measures"]["void_fraction"]["value"] < 0.1


def test_a_pressure_that_restores_the_density_is_no_tension_of_a_material(impact):
    """Nor is it to be told beside a shock's, and a model of damage, which the formulation refuses, is no remedy."""
    _, outcome = impact
    assert not [
        text for text in outcome.summary["remarks"] if "tension" in text or "damage" in text or "pressure" in text
    ]


def test_recorded_pressure_is_a_mean_and_snapshots_hold_the_pressure_itself(impact):
    folder, _ = impact
    history = read_history(folder)
    late = history["time"] > 0.5e-6
    # single values ring by tens of GPa; a mean over 0.2 us moves by little from step to step
    assert np.abs(np.diff(history["centre_pressure"][late])).max() < 1e9
    assert np.isnan(history["energy_drift"]).all()
    last = read_snapshot(list_snapshots(folder)[-1])
    assert np.abs(last.fields["pressure"]).max() > 0.0
    assert (last.fields["density"] == 2785.0).all()


def test_a_resumed_run_has_the_same_bits(tmp_path):
    case = two((METAL, LIQUID), time={"end": 4e-8}, output={"every": 2e-8})
    run(case, tmp_path / "whole", threads=1)
    limited = case.model_copy(update={"time": case.time.model_copy(update={"max_steps": 41})})
    run(limited, tmp_path / "parts", threads=1)
    hvisph.resume(tmp_path / "parts", max_steps=0, threads=1)
    assert_same_results(tmp_path / "whole", tmp_path / "parts")


def test_an_excessive_speed_stops_the_run(tmp_path):
    case = two(limits={"speed_over_initial": 1.01}, time={"end": 1e-6})
    outcome = run(case, tmp_path / "run", threads=1)
    assert outcome.exit_code == 3
    assert outcome.summary["failure"]["criterion"] == "runaway"


def test_body_force_moves_a_body_at_rest(tmp_path):
    case = two((METAL,), speed=0.0, formulation={"body_force": [0.0, -1e6]}, time={"end": 1e-7})
    outcome = run(case, tmp_path / "run", threads=1)
    last = read_snapshot(list_snapshots(tmp_path / "run")[-1])
    assert np.allclose(last.fields["velocity"], [0.0, -0.1], rtol=1e-9, atol=1e-12)
    assert outcome.summary["status"] == "done"
