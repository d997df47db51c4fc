"""How often a run writes changes nothing of what it computes; what is written lies on the way between two steps."""

import json

import numpy as np
import pytest
from small_runs import LIQUID, METAL, every_material, final, row_of

from hvisph.output.reader import list_snapshots, read_history, read_snapshot
from hvisph.simulation.clock import Clock
from hvisph.simulation.run import run


def stripped(folder):
    """The history without the records that a sparse cadence adds at moments of output: none at history_every 1."""
    return (folder / "history.csv").read_bytes()


@pytest.mark.parametrize(
    ("formulation", "further"),
    [
        ("eulerian", {}),
        ("riemann", {"time": {"end": 8e-7, "integrator": "predictor_corrector"}}),
        ("projection", {}),
        ("total_lagrangian", {}),
        ("adaptive", {}),
    ],
)
def test_the_cadence_of_output_changes_no_bit(formulation, further, tmp_path):
    results = []
    end = 1e-7 if formulation == "projection" else 8e-7
    for number, every in enumerate((None, end / 3.3, end / 17)):
        case = every_material(formulation, **({"time": {"end": end}} | further))
        case = case.model_copy(update={"output": case.output.model_copy(update={"every": every})})
        run(case, tmp_path / str(number), threads=1)
        results.append((final(tmp_path / str(number)), stripped(tmp_path / str(number))))
    for last, history in results[1:]:
        assert history == results[0][1]
        assert (last.time, last.step) == (results[0][0].time, results[0][0].step)
        for name, values in last.fields.items():
            np.testing.assert_array_equal(values, results[0][0].fields[name], err_msg=name)


@pytest.mark.parametrize("scheme", ["leapfrog", "predictor_corrector", "staggered"])
def test_what_lies_between_two_steps_keeps_the_balance_and_the_way(scheme, tmp_path):
    settings = {"formulation": {"type": "eulerian"}, "time": {"end": 6e-7, "integrator": scheme}}
    run(row_of([METAL, LIQUID], output={"every": 13.8e-9}, **settings), tmp_path / "run", threads=1)
    found = [read_snapshot(path) for path in list_snapshots(tmp_path / "run")]
    times = np.array([snapshot.time for snapshot in found])
    steps = read_history(tmp_path / "run")
    assert len(found) == 45
    assert len(np.intersect1d(times, steps["time"])) < 10  # so nearly all lie between two steps
    np.testing.assert_allclose(times[:-1], 13.8e-9 * np.arange(44), rtol=1e-12)
    mass = found[0].fields["mass"]
    energy = [mass @ (0.5 * (s.fields["velocity"] ** 2).sum(axis=1) + s.fields["internal_energy"]) for s in found]
    momentum = [mass @ s.fields["velocity"] for s in found]
    scale = (mass[:, None] * np.abs(found[0].fields["velocity"])).sum()
    assert np.ptp(energy) < 1e-13 * energy[0]  # round-off of some hundred additions
    assert np.ptp(momentum, axis=0).max() < 1e-13 * scale
    # position and velocity agree: central differences of places are the speeds, up to steps' changes of them
    place = np.array([s.fields["position"] for s in found[:-1]])
    speed = np.array([s.fields["velocity"] for s in found[:-1]])
    moved = (place[2:] - place[:-2]) / (times[2:-1] - times[:-3])[:, None, None]
    change = np.abs(np.diff(speed, axis=0)).max()
    assert np.abs(moved - speed[1:-1]).max() < change


def test_the_end_is_reached_once(tmp_path):
    """Thirteen times 0.1 us is 1.3 us but for round-off, which makes neither a step nor a snapshot."""
    assert 13 * 0.1e-6 < 1.3e-6
    settings = {"formulation": {"type": "eulerian"}, "time": {"end": 1.3e-6}, "output": {"every": 0.1e-6}}
    run(row_of([METAL, LIQUID], **settings), tmp_path / "run", threads=1)
    assert len(list_snapshots(tmp_path / "run")) == 14
    history = read_history(tmp_path / "run")
    assert history["dt"][1:].min() > 1e-4 * history["dt"].max()
    assert json.loads((tmp_path / "run" / "summary.json").read_text())["end_time"] == 1.3e-6


def test_the_clock_cuts_the_last_step_alone():
    clock, step, taken = Clock(1.0, 0.0301), None, []
    seen = []
    while not clock.is_finished:
        step = clock.choose(0.07, "signal", step)
        under_way = clock.last(step) or step
        seen += clock.output_times(under_way)
        taken.append(under_way.length)
        if clock.complete(under_way):
            seen.append(clock.time)
    np.testing.assert_allclose(taken[:-1], 0.07)
    assert clock.time == 1.0
    assert len(taken) == 15
    np.testing.assert_allclose(seen, [*0.0301 * np.arange(1, 34), 1.0])
    assert clock.outputs == 34
