"""Runs that leave the range of the physics stop, and name the particle, place, time and criterion."""

import json

import numpy as np
import pytest
from small_runs import HARDENING, METAL, row_of

from hvisph.casefile.loader import load_case
from hvisph.core.errors import CaseError
from hvisph.output.reader import read_history, read_snapshot
from hvisph.output.run_folder import RunFolder
from hvisph.setup.build import build
from hvisph.simulation.loop import Run
from hvisph.simulation.run import run, set_threads

EULERIAN = {"formulation": {"type": "eulerian"}}


def spoiled(case, folder, spoil, at_step=9, capacity=None):
    """Run `case`, let `spoil` change the state after a step, and return the outcome."""
    set_threads(1)
    with RunFolder.create(folder) as held:
        going = Run(case, build(case), held, listener=Quiet())
        complete = going.setup.stepper.complete
        going.setup.stepper.pairs.capacity = capacity or going.setup.stepper.pairs.capacity

        def complete_and_spoil(step, following):
            complete(step, following)
            if going.clock.steps == at_step:
                spoil(going.setup.particles)
                going.setup.stepper.predict(following)

        going.setup.stepper.complete = complete_and_spoil
        return going.go()


class Quiet:
    def start(self, *_):
        pass

    progress = message = finish = compiling = start


def spoil_with(name, value, number=17):
    def spoil(particles):
        particles[name][np.flatnonzero(particles.id == number)] = value

    return spoil


@pytest.mark.filterwarnings("ignore:invalid value:RuntimeWarning")  # measures of a state with infinities
@pytest.mark.parametrize(
    ("criterion", "spoil"),
    [
        ("not_finite", spoil_with("internal_energy", np.nan)),
        ("not_finite", spoil_with("velocity", np.inf)),
        ("runaway", spoil_with("velocity", 1e5)),
        ("density", spoil_with("density", -1.0)),
        ("density", spoil_with("density", 1e5)),
        ("energy_drift", spoil_with("internal_energy", 1e8)),
        ("negative_energy", spoil_with("internal_energy", -1e8)),
    ],
)
def test_each_watcher_names_what_where_and_when(criterion, spoil, tmp_path):
    case = row_of([HARDENING, METAL], output={"checkpoint_every": None}, **EULERIAN)
    outcome = spoiled(case, tmp_path / "run", spoil, at_step=7)  # densities are looked at every eighth step
    failure = outcome.summary["failure"]
    assert outcome.exit_code == 3
    assert outcome.summary["status"] == "failed"
    assert failure["criterion"] == criterion
    if criterion != "energy_drift":  # which names the particle whose energy changes fastest
        assert (failure["particle"], failure["body"]) == (17, "body_0")
    assert len(failure["position"]) == 2
    assert (criterion == "density") == ("as of 1 of " in failure["message"])
    for part in (
        f"particle {failure['particle']} of body '{failure['body']}' at (",
        f"time {failure['time']:.6g} s",
        f"step {failure['step']}",
    ):
        assert part in failure["message"]
    assert json.loads((tmp_path / "run" / "summary.json").read_text())["failure"] == failure
    after = read_snapshot(tmp_path / "run" / "snapshots" / "post_mortem.vtkhdf")
    assert after.time == pytest.approx(failure["time"], rel=0.2)
    assert read_history(tmp_path / "run")["step"][-1] >= 7  # the approach is there


def test_a_crowd_is_said_to_be_one(tmp_path, monkeypatch):
    monkeypatch.setattr("hvisph.sph.neighbours.traversal.MOST_NEIGHBOURS", 70)

    def gather(particles):
        particles["position"][particles.id < 80] = 1e-4

    case = row_of([METAL, METAL], dim=2, **EULERIAN)
    failure = spoiled(case, tmp_path / "run", gather, capacity=32).summary["failure"]
    assert failure["criterion"] == "collapse"
    assert failure["particle"] < 80


def test_a_collapsed_step_names_its_criterion(tmp_path):
    case = row_of([METAL, METAL], limits={"step_over_initial": 1e-2, "energy_drift": None}, **EULERIAN)
    failure = spoiled(case, tmp_path / "run", spoil_with("smoothing_length", 2e-6)).summary["failure"]
    assert (failure["criterion"], failure["particle"]) == ("step_collapse", 17)
    assert "below 0.01 of the first, by the criterion '" in failure["message"]


def test_limits_are_the_cases(tmp_path):
    case = row_of([METAL, METAL], limits={"speed_over_initial": 1.01}, speed=800.0, time={"end": 3e-6}, **EULERIAN)
    outcome = spoiled(case, tmp_path / "low", spoil_with("velocity", 820.0))
    assert outcome.summary["failure"]["criterion"] == "runaway"
    assert ("give it a damage" in outcome.summary["failure"]["message"]) == ("damage" not in METAL)
    held = METAL | {"damage": {"type": "pressure_cutoff", "pressure": -1e9}}
    case = row_of([held, held], limits={"speed_over_initial": 1.01}, speed=800.0, time={"end": 3e-6}, **EULERIAN)
    outcome = spoiled(case, tmp_path / "held", spoil_with("velocity", 820.0))
    assert "give it a damage" not in outcome.summary["failure"]["message"]
    loose = {"speed_over_initial": None, "energy_drift": None, "density": False}
    case = row_of([METAL, METAL], limits=loose, **EULERIAN)
    assert spoiled(case, tmp_path / "off", spoil_with("internal_energy", 1e8)).summary["status"] == "done"


def test_the_range_of_mie_grueneisen_ends_at_its_pole():
    limits = build(row_of([HARDENING, METAL], **EULERIAN)).density_limits
    # D = 1 - (s - 1) mu falls to its floor of 0.1 at mu = 0.9 / (s - 1); the scan is fine to 0.001
    assert limits[0] / 2700.0 == pytest.approx(1.0 + 0.9 / 0.34, abs=2e-3)
    assert limits[1] == np.inf


def test_particles_beyond_the_domain_are_retired_and_stay_in_the_balance(tmp_path):
    settings = {"time": {"end": 3e-6}, "output": {"every": 1e-6}} | EULERIAN
    free = run(row_of([METAL, METAL], **settings), tmp_path / "free", threads=1).summary
    box = {"min": [None, -3.3e-3], "max": [None, 3.3e-3]}
    kept = run(row_of([METAL, METAL], domain=box, **settings), tmp_path / "kept", threads=1).summary
    gone = kept["conservation"]["retired_particles"]
    assert 0 < gone < 0.5 * kept["particles"]
    last = read_snapshot(tmp_path / "kept" / "snapshots" / "000003.vtkhdf")
    assert last.count == kept["particles"] - gone
    assert np.abs(last.fields["position"][:, 1]).max() < 3.6e-3
    mass = read_snapshot(tmp_path / "free" / "snapshots" / "000003.vtkhdf").fields["mass"].sum()
    assert last.fields["mass"].sum() + kept["conservation"]["retired_mass"] == pytest.approx(mass, rel=1e-12)
    for summary in (free, kept):  # round-off of some thousand additions
        assert abs(summary["conservation"]["energy_drift"]) < 1e-13
        assert summary["conservation"]["momentum_drift"] < 1e-13


@pytest.mark.parametrize(
    "further",
    [
        {},  # the default formulation
        {"formulation": {"type": "riemann", "reconstruction": "none"}},
        {"time": {"end": 1.5e-6, "integrator": "predictor_corrector"}},
        {"kinematics": "plane_stress"},
        {"formulation": {"type": "eulerian", "correction": {"type": "mixed"}}},
    ],
    ids=["riemann", "first_order", "predictor_corrector", "plane_stress", "corrected"],
)
def test_what_flies_off_is_retired_in_every_scheme(further, tmp_path):
    """A flyer that leaves the domain: no rate is spoiled by particles without mass, and the balance closes."""
    settings = {"time": {"end": 1.5e-6}, "domain": {"min": [-4e-3, None]}} | further
    summary = run(row_of([METAL, METAL], speed=-3000.0, **settings), tmp_path / "run", threads=1).summary
    assert summary["status"] == "done", summary["failure"]
    assert summary["conservation"]["retired_particles"] >= 24
    assert abs(summary["conservation"]["energy_drift"]) < 1e-13  # round-off of some thousand additions
    assert summary["conservation"]["momentum_drift"] < 1e-13


def test_a_domain_that_cuts_a_body_or_cannot_be_kept_is_refused(tmp_path):
    with pytest.raises(CaseError, match=r"domain: .* particles start outside, the first of body 'body_0'"):
        run(row_of([METAL], domain={"max": [None, 1e-3]}, **EULERIAN), tmp_path / "run")
    with pytest.raises(CaseError, match="domain: particles cannot be retired with 'total_lagrangian'"):
        row_of([METAL], domain={"max": [None, 1.0]}, formulation={"type": "total_lagrangian"})
    with pytest.raises(CaseError, match=r"domain.*min 1 must be below max 0 along y"):
        load_case("al_al_coarse", ["domain={min: [null, 1], max: [null, 0]}"])
