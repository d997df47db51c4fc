"""Going on from a checkpoint is as if the run had never stopped; what does not fit is refused by name."""

import json
import re

import numpy as np
import pytest
from small_runs import (
    FORMULATIONS,
    GAS,
    HARDENING,
    LIQUID,
    METAL,
    TWO,
    assert_same_results,
    cracked_bar,
    every_material,
    final,
    row_of,
    struck_laminate,
)

import hvisph
from hvisph.casefile.loader import load_case
from hvisph.core.errors import CaseError, OutputError
from hvisph.output import checkpoint_file as checkpoints
from hvisph.output.checkpoint_file import Checkpoint, list_checkpoints, read_checkpoint, write_checkpoint
from hvisph.output.reader import list_snapshots, read_history
from hvisph.simulation.clock import Clock
from hvisph.simulation.listener import Listener
from hvisph.simulation.run import run

STEPS = 21  # neither a multiple of the sorting's cadence nor at an output


class Told(Listener):
    def __init__(self):
        self.messages = []

    def message(self, text):
        self.messages.append(text)


def with_limits(case, **limits):
    return case.model_copy(update={"time": case.time.model_copy(update=limits)})


def stopped_and_resumed(case, tmp_path, steps=STEPS):
    """Run `case` in one go and in two parts; return both folders."""
    run(case, tmp_path / "whole", threads=1)
    outcome = run(with_limits(case, max_steps=steps), tmp_path / "parts", threads=1)
    assert outcome.summary["steps"] == steps
    outcome = hvisph.resume(tmp_path / "parts", max_steps=0, threads=TWO)
    assert outcome.summary["status"] == "done"
    return tmp_path / "whole", tmp_path / "parts"


def integrators(formulation):
    """What a step takes from the one before is one text, which `eulerian` and `riemann` have."""
    one = formulation in ("projection", "total_lagrangian", "adaptive")
    return ("leapfrog",) if one else ("leapfrog", "predictor_corrector")


@pytest.mark.parametrize(
    ("formulation", "integrator"), [(name, one) for name in FORMULATIONS for one in integrators(name)]
)
def test_a_resumed_run_has_the_same_bits(formulation, integrator, tmp_path):
    time = {"end": 1e-6, "integrator": integrator}
    case = every_material(formulation, time=time, output={"every": 3e-7})
    assert_same_results(*stopped_and_resumed(case, tmp_path))


MIRROR = {"symmetry": [{"axis": "y", "at": 0.0}]}
OPTIONS = {
    "variable_h": {"formulation": {"type": "eulerian", "smoothing_length": {"type": "variable"}}},
    "mirror": MIRROR,
    "mirror_adaptive_corrected": MIRROR | {"formulation": {
        "type": "adaptive", "conversion": {"strain": 0.02}, "hourglass": 0.5,
        "spatial_correction": {"type": "mixed", "factor": 7.5}}},
    "renewed": MIRROR | {"formulation": {"type": "adaptive", "conversion": {"strain": 0.08}, "reference_update_strain": 0.02}},
    "elastic": MIRROR | {"formulation": {"type": "riemann", "variant": "elastic"}},
    "retiring": {"domain": {"max": [None, 3.2e-3], "min": [None, -3.2e-3]}, "time": {"end": 2e-6}},
}  # fmt: skip


@pytest.mark.parametrize("option", OPTIONS)
def test_options_resume_with_the_same_bits(option, tmp_path):
    settings = {"formulation": {"type": "eulerian"}, "output": {"every": 2e-7, "history_every": 3}} | OPTIONS[option]
    materials = [METAL, LIQUID, GAS] if option == "variable_h" else [METAL, LIQUID]
    assert_same_results(*stopped_and_resumed(row_of(materials, **settings), tmp_path))


def test_a_fixed_step_with_held_particles_in_3d_resumes_with_the_same_bits(tmp_path):
    settings = ["time={end: 0.5 us, step: 6 ns}", "clamped=[{box: {min: [1.2 mm, null, null]}}]", "output.every=0.2us",
                "output.history_every=3", "symmetry=[{axis: y}, {axis: z}]", "formulation={type: eulerian}"]  # fmt: skip
    case = load_case("sphere_on_plate", settings, "0.7 mm")  # the loops of `test_report`
    assert_same_results(*stopped_and_resumed(case, tmp_path))


@pytest.mark.parametrize("formulation", ["eulerian", "total_lagrangian"])
def test_flaws_pores_and_burn_resume_with_the_same_bits(tmp_path, formulation):
    rock = HARDENING | {"damage": {"type": "grady_kipp", "weibull_k": 1e35, "weibull_m": 9.0, "seed": 3}}
    foam = HARDENING | {"density": 2700.0, "damage": {"type": "none"},
                        "porosity": {"distension": 1.5, "elastic_pressure": 1e7, "solid_pressure": 5e8}}  # fmt: skip
    jwl = {"type": "jwl", "a": 371.2e9, "b": 3.231e9, "r1": 4.15, "r2": 0.95, "omega": 0.3, "detonation_energy": 7e9,
           "detonation": {"points": [[0.0, 0.0]], "speed": 6930.0}}  # fmt: skip
    materials = [rock, foam, {"density": 1630.0, "eos": jwl}]
    if formulation == "total_lagrangian":  # what remembers is the same; with the loops of `test_brittle_bodies`
        materials = [rock, METAL]
    case = row_of(materials, formulation={"type": formulation}, output={"every": 3e-7})
    whole, parts = stopped_and_resumed(case, tmp_path, 11)
    assert_same_results(whole, parts)
    last = final(whole)
    assert last.fields["damage"][last.body == 0].max() > 0.0  # cracked
    if len(materials) == 3:
        assert last.fields["density"][last.body == 1].max() > 1.1 * 1800.0  # crushed
        assert last.fields["pressure"][last.body == 2].max() > 1e9  # burnt


@pytest.mark.parametrize("formulation", ["riemann", "total_lagrangian"])
def test_cracks_resume_with_the_same_bits(formulation, tmp_path):
    """About the axis and in the plane, stopped while the crack opens; its area is that of work over energy, and no more than some cross-sections."""
    plane = {"type": "box", "size": [6e-3, 4e-3]}  # with the loops of `test_fracture_energy`
    case = cracked_bar(formulation) if formulation == "riemann" else cracked_bar(formulation, plane)
    whole, parts = stopped_and_resumed(case, tmp_path)
    assert_same_results(whole, parts)
    summary = json.loads((whole / "summary.json").read_text())
    area = summary["crack_area"]
    assert area == pytest.approx(summary["energies"]["fracture_work"] / 10e3, rel=1e-12)
    assert 0.5 < area / (np.pi * 2e-3**2 if formulation == "riemann" else 4e-3) < 6.0
    assert (final(whole).fields["damage"] > 0.0).any()


def test_axes_and_open_modes_resume_with_the_same_bits(tmp_path):
    whole, parts = stopped_and_resumed(struck_laminate(), tmp_path)
    assert_same_results(whole, parts)
    last = final(whole)
    for body in (1, 2):
        assert (last.fields["failure_modes"][last.body == body] > 0.0).any()


def test_a_run_extended_at_an_output_is_the_longer_run(tmp_path):
    case = row_of([METAL, LIQUID], formulation={"type": "eulerian"}, output={"every": 2e-7})
    run(case, tmp_path / "long", threads=1)
    run(with_limits(case, end=4e-7), tmp_path / "short", threads=1)
    hvisph.resume(tmp_path / "short", end="1 us", threads=1)
    assert_same_results(tmp_path / "long", tmp_path / "short")
    with pytest.raises(CaseError, match=r"time\.end: the run is at 9\.\d+e-07 s already"):
        hvisph.resume(tmp_path / "short", end=5e-7)


def test_the_clock_goes_on_from_between_two_outputs():
    clock = Clock(4.0, 1.0, time=2.5, outputs=3, allowed=0.1, allowed_by="signal")
    assert clock.extend().length == 0.1
    assert clock.outputs == 2
    assert clock.moment(clock.outputs + 1) == 3.0


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """A run with two checkpoints in it."""
    folder = tmp_path_factory.mktemp("run") / "run"
    output = {"every": 2e-7, "checkpoint_every": 1e-6}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("hvisph.simulation.checkpoint.TIME_SHARE", float("inf"))  # one every step, whatever it costs
        run(row_of([METAL, LIQUID], formulation={"type": "eulerian"}, output=output), folder, threads=1)
    return folder


@pytest.fixture
def copy(finished, tmp_path):
    import shutil

    return shutil.copytree(finished, tmp_path / "copy")


def test_the_last_two_are_kept(finished):
    newest, before = list_checkpoints(finished / "checkpoint")
    last = int(read_history(finished)["step"][-1])
    assert [int(newest.stem), int(before.stem)] == [last, last - 1]


def test_a_damaged_one_is_passed_over_and_named(copy, finished):
    newest, _ = list_checkpoints(copy / "checkpoint")
    content = bytearray(newest.read_bytes())
    content[len(content) // 2] ^= 1
    newest.write_bytes(content)
    heard = Told()
    hvisph.resume(copy, listener=heard)
    assert not any("checkpoint" in message for message in heard.messages[1:])
    assert str(newest) in heard.messages[0]
    assert "damaged" in heard.messages[0]
    assert_same_results(copy, finished)
    for path in list_checkpoints(copy / "checkpoint"):
        path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(OutputError, match=r"truncated.*no other checkpoint"):
        hvisph.resume(copy)


def test_a_finished_run_only_sums_up(copy, finished):
    summary = json.loads((copy / "summary.json").read_text())
    (copy / "summary.json").unlink()
    again = hvisph.resume(copy).summary
    for name in ("measures", "conservation", "steps", "status", "case_hash"):
        assert again[name] == summary[name]
    assert_same_results(copy, finished)


def test_without_a_checkpoint_it_begins_again(copy, finished):
    for path in list_checkpoints(copy / "checkpoint"):
        path.unlink()
    (copy / "snapshots" / "000002.vtkhdf.partial").write_bytes(b"half")
    heard = Told()
    hvisph.resume(copy, listener=heard)
    assert heard.messages[0] == "there is no checkpoint yet; beginning again"
    assert_same_results(copy, finished)
    assert not list(copy.glob("**/*.partial"))


def test_a_changed_case_is_refused_with_the_difference(copy):
    before = {path: path.read_bytes() for path in copy.rglob("*") if path.is_file()}
    file = copy / "case.yaml"
    file.write_text(re.sub(r"cfl: 0\.6", "cfl: 0.2", file.read_text()))
    with pytest.raises(CaseError, match=r"time\.cfl was 0\.6 and is 0\.2"):
        hvisph.resume(copy)
    file.write_bytes(before[file])
    assert {path: path.read_bytes() for path in copy.rglob("*") if path.is_file()} == before


def test_what_touches_no_step_may_change(copy):
    file = copy / "case.yaml"
    file.write_text(
        file.read_text().replace("title: ''", "title: better").replace("energy_drift: 0.01", "energy_drift: 0.5")
    )
    assert hvisph.resume(copy).summary["title"] == "better"


def test_another_version_is_refused_by_name(copy, monkeypatch):
    monkeypatch.setattr(checkpoints, "__version__", "9.9.9")
    with pytest.raises(CaseError, match=rf"code_version is {re.escape(hvisph.__version__)}, and this is 9\.9\.9"):
        hvisph.resume(copy)


def test_a_damaged_history_is_refused(copy):
    path = copy / "history.csv"
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join(lines[:-3]))
    with pytest.raises(OutputError, match=r"it ends with step .* damaged"):
        hvisph.resume(copy)
    path.write_text("".join([*lines[:5], lines[5][:20] + "\n", *lines[6:]]))
    with pytest.raises(OutputError, match="line 6 has not"):
        hvisph.resume(copy)


def test_not_a_run_is_said_so(tmp_path):
    with pytest.raises(CaseError, match="not the folder of a run"):
        hvisph.resume(tmp_path)
    (tmp_path / ".hvisph").touch()
    with pytest.raises(CaseError, match=r"holds no case\.yaml"):
        hvisph.resume(tmp_path)


def test_snapshots_after_the_checkpoint_go(copy, finished):
    count = len(list_snapshots(finished))
    (copy / "snapshots" / "000099.vtkhdf").write_bytes(b"stale")
    (copy / "snapshots" / "post_mortem.vtkhdf").write_bytes(b"stale")
    hvisph.resume(copy)
    assert len(list_snapshots(copy)) == count


@pytest.mark.parametrize("seed", range(5))
def test_no_damage_to_a_checkpoint_goes_undetected(seed, tmp_path):
    rng = np.random.default_rng(seed)
    arrays = {
        "state": rng.normal(size=(40, 7)),
        "carried/rows": rng.normal(size=(40, 3)),
        "tags": np.arange(9, dtype=np.uint32),
    }
    path = write_checkpoint(tmp_path, Checkpoint(7, {"a": [1.5, None]}, arrays))
    again = read_checkpoint(path)
    assert again.header == {"a": [1.5, None]}
    assert again.arrays.keys() == arrays.keys()
    for name, values in arrays.items():
        np.testing.assert_array_equal(again.arrays[name], values)
    whole = path.read_bytes()
    for _ in range(40):
        damaged = bytearray(whole)
        if rng.random() < 0.5:
            damaged = damaged[: rng.integers(len(whole))]
        else:
            damaged[rng.integers(len(whole))] ^= 1 << rng.integers(8)
        path.write_bytes(damaged)
        with pytest.raises(OutputError, match=re.escape(str(path))):
            read_checkpoint(path)
