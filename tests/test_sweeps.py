"""Sweeps: the cases that they make, workers that die, and what their results say."""

import csv
import io
import json
import os
import re
import signal
import subprocess
import sys
import time
from itertools import product

import numpy as np
import pytest

from hvisph.cli.commands.pictures import report
from hvisph.core.errors import CaseError
from hvisph.core.text import format_differences, format_value
from hvisph.output.reader import list_snapshots, read_snapshot
from hvisph.sweeps.analysis import following, verdict
from hvisph.sweeps.comparison import against_experiment
from hvisph.sweeps.driver import begin, sweep
from hvisph.sweeps.folder import SweepFolder, table_rows
from hvisph.sweeps.plan import load_plan
from hvisph.sweeps.statistics import Bracket, bracket, convergence, lambert_jonas, next_values
from hvisph.visualization.sweeps import sweep_figure

SPEED = "bodies.projectile.velocity.0"
SMALL = {"resolution": "0.5 mm", "time.end": "0.3 us", "output.every": "0.1 us"}


def plan(**vary):
    """A plan on the al_al_coarse that varies something."""
    return load_plan({"case": "al_al_coarse", "set": SMALL, "vary": vary})


def values(**vary):
    """What its cases vary."""
    return [member.values for member in plan(**vary).first()]


def test_a_grid_is_every_combination_in_the_units_of_the_file():
    found = values(type="grid", values={SPEED: {"from": "2 km/s", "to": "3 km/s", "count": 3}, "time.cfl": [0.2, 0.3]})
    assert len(found) == 6
    assert [one[SPEED] for one in found[::2]] == ["2 km/s", "2.5 km/s", "3 km/s"]
    assert values(type="grid", values={SPEED: {"from": "2 km/s", "to": "2600 m/s", "count": 3}})[1][SPEED] == 2300.0


def test_a_list_comes_from_a_table_and_carries_the_experiment_along(tmp_path):
    (tmp_path / "shots.csv").write_text(f"{SPEED},experiment.hole [mm]\n2 km/s,11.5\n3 km/s,\n")
    (tmp_path / "sweep.yaml").write_text(
        "case: al_al_coarse\nset: {output.every: null}\nvary: {type: list, file: shots.csv}\n"
    )
    found = load_plan(tmp_path / "sweep.yaml").first()
    assert [one.values for one in found] == [{SPEED: "2 km/s", "experiment.hole [mm]": 11.5}, {SPEED: "3 km/s"}]


def test_a_head_that_stands_twice_is_told(tmp_path):
    (tmp_path / "shots.csv").write_text(f"{SPEED}, {SPEED}\n2 km/s,3 km/s\n")
    (tmp_path / "sweep.yaml").write_text("case: al_al_coarse\nvary: {type: list, file: shots.csv}\n")
    with pytest.raises(CaseError, match=f"line 1: the head '{SPEED}' stands there twice"):
        load_plan(tmp_path / "sweep.yaml").first()


@pytest.mark.parametrize("method", ["latin_hypercube", "sobol", "random"])
def test_a_sample_is_reproducible_and_follows_its_distributions(method):
    vary = {
        "type": "sample", "method": method, "count": 64, "seed": 3,
        "values": {SPEED: {"uniform": ["2 km/s", "4 km/s"]}, "time.cfl": {"normal": {"mean": 0.3, "sd": 0.02}},
                   "bodies.target.shape.size.0": {"choice": ["2 mm", "3 mm"]}},
    }  # fmt: skip
    found = values(**vary)
    assert found == values(**vary)
    speeds = np.array([float(one[SPEED].split()[0]) for one in found])
    assert speeds.min() >= 2.0
    assert speeds.max() <= 4.0
    if method != "random":  # one in each of 64 equal parts, and so for the quantiles of the normal one
        assert len(set(np.floor((speeds - 2.0) * 32.0))) == 64
        assert abs(np.mean([one["time.cfl"] for one in found]) - 0.3) < 0.02 / 8.0
    assert {one["bodies.target.shape.size.0"] for one in found} == {"2 mm", "3 mm"}


@pytest.mark.parametrize(
    ("vary", "said"),
    [
        ({"type": "grid", "values": {"bodies.target.shape.sise.0": [1]}}, "did you mean 'size'"),
        ({"type": "grid", "values": {SPEED: ["2 km"]}}, "case 0"),
        ({"type": "grid", "values": {SPEED: {"from": "2 km/s", "to": "much", "count": 2}}}, "no number"),
        (
            {"type": "bisect", "path": SPEED, "bracket": ["2 km/s", "2 km/s"], "tolerance": "1 m/s"},
            "two values that differ",
        ),
        ({"type": "list", "file": "absent.csv"}, "cannot be read"),
        ({"type": "list"}, "either"),
        ({"type": "grid", "values": {SPEED: {"from": 1, "to": 2, "count": 1}}}, r"velocity.0.count: input should be"),
        ({"type": "grid", "values": {SPEED: 3}}, r"velocity.0: expected a list, found a number$"),
        ({"type": "sample", "count": 2, "values": {SPEED: {"gauss": 1}}}, "expected one of uniform, normal, choice"),
        ({"type": "sample", "count": 2, "values": {SPEED: {"normal": {"mean": 1}}}}, r"velocity.0.normal.sd: missing"),
        ({"type": "sample", "count": 2, "values": {SPEED: 3}}, "expected a distribution, such as"),
        ({"type": "grud"}, "did you mean 'grid'"),
        ({"type": "converge", "values": ["0.5 mm", "500 um", "0.4 mm"]}, "has 0.5 mm twice"),
    ],
)
def test_what_is_wrong_is_said_before_anything_runs(vary, said, tmp_path):
    with pytest.raises(CaseError, match=said):
        begin({"case": "al_al_coarse", "set": SMALL, "vary": vary}, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_names_of_measures_are_checked_before_anything_runs():
    """A shot whose event is no measure would be continued in vain, and a column that is none be left out."""
    bisect = {"type": "bisect", "path": SPEED, "bracket": ["1 km/s", "2 km/s"], "tolerance": "1 km/s"}
    for wrong, where in (
        ({"vary": bisect | {"event": {"measure": "perforate"}}}, "vary.event.measure: unknown 'perforate'"),
        ({"vary": bisect | {"residual": "residual"}}, "vary.residual: unknown 'residual'"),
        ({"vary": bisect, "record": ["penetration", "penetratio"]}, "record.1: unknown 'penetratio'"),
    ):
        with pytest.raises(CaseError, match=where):
            load_plan({"case": "al_al_coarse"} | wrong)


def test_many_cases_load_quickly_enough_to_be_listed():
    found = values(type="grid", values={SPEED: {"from": "2 km/s", "to": "3 km/s", "count": 500}})
    assert len(found) == 500


# NASA's tutorial on spatial convergence: order 1.786170, 0.971300, index 0.103083 %.
def test_a_list_is_held_against_the_experiment():
    def shot(number, measured, computed):
        return {"number": number, "values": {"experiment.shot": f"A{number}", "experiment.hole_diameter": measured},
                "measures": {"hole_diameter": {"value": computed, "unit": "m"}}}  # fmt: skip

    shots = [shot(0, "10 mm", 9e-3), shot(1, 0.02, 21e-3), shot(2, "none", 3e-3), shot(3, "1 cm", None)]
    found = against_experiment(shots)
    assert list(found) == ["hole_diameter"]
    one = found["hole_diameter"]
    assert (one["unit"], one["cases"], one["measured"], one["computed"]) == ("m", [0, 1], [0.01, 0.02], [9e-3, 21e-3])
    assert one["mean"] == pytest.approx(-0.025)
    assert one["worst"] == pytest.approx(-0.1)
    axes = sweep_figure({"experiment": found}, []).axes
    assert "-2.5 %" in axes[0].get_title()
    assert axes[0].get_xlabel() == "measured [mm]"


def test_pictures_draw_what_is_recorded():
    measures = {name: {"value": 1.0, "unit": "m"} for name in ("penetration", "crater_diameter")}
    shots = [{"status": "done", "values": {SPEED: speed}, "measures": measures} for speed in ("2 km/s", "3 km/s")]
    assert len(sweep_figure({}, shots).axes) == 2
    assert [axes.get_ylabel() for axes in sweep_figure({}, shots, ["penetration"]).axes] == ["penetration [cm]"]


def test_mappings_are_written_as_in_a_case_and_pictures_tell_two_settings_apart():
    shapes = [{"type": "disc", "diameter": "10 mm"}, {"type": "disc", "diameter": "8 mm"}]
    assert format_differences(shapes) == ["{diameter: 10 mm}", "{diameter: 8 mm}"]
    assert format_differences([shapes[0], "x"]) == ["{type: disc, diameter: 10 mm}", "x"]
    assert format_value({"a": [1, None, True]}) == "{a: [1, null, true]}"
    measured = {"penetration": {"value": 1.0, "unit": "m"}}
    rows = [{"number": k, "values": {"body": shape, SPEED: speed}, "status": "done", "message": "", "measures": measured,
             "energy_drift": 0.0, "wall_seconds": 1.0, "folder": ""}
            for k, (shape, speed) in enumerate(product(shapes, ("2 km/s", "3 km/s")))]  # fmt: skip
    assert any({"{type: disc, diameter: 8 mm}", "3 km/s"} <= set(map(str, row)) for row in table_rows(rows, None))
    (axes,) = sweep_figure({}, rows).axes
    assert len(axes.lines) == 2  # a line a speed
    for row in rows:
        row["values"] = {SPEED: row["values"][SPEED], "body": row["values"]["body"]}
    (axes,) = sweep_figure({}, rows).axes
    assert (axes.get_xlabel(), axes.lines[0].get_xdata().tolist()) == (f"{SPEED} [km/s]", [2.0, 3.0])


def test_order_extrapolation_and_index_of_known_series():
    found = convergence((0.97050, 0.96854, 0.96178), (1, 2, 4))
    assert found.order == pytest.approx(1.786170, abs=1e-6)
    assert found.extrapolated == pytest.approx(0.97130, abs=1e-6)
    assert found.index == pytest.approx(0.00103083, abs=1e-8)
    spacings = (0.4, 0.1, 0.15)
    found = convergence([1 + 0.3 * h**1.7 for h in spacings], spacings)
    assert found.order == pytest.approx(1.7, abs=1e-6)
    assert found.extrapolated == pytest.approx(1.0, abs=1e-9)


def test_noise_has_no_order():
    assert convergence((1.0, 1.1, 1.3), (1, 2, 4), (0.2, 0.2, 0.2)).verdict == "not resolved"
    assert convergence((1.0, 1.1, 1.05), (1, 2, 4)).verdict == "not converging"
    assert convergence((1.0, 1.1), (1, 2)).verdict == "too few"
    assert convergence((1.0, 1.0, 1.0), (1, 2, 4)).verdict == "exact"


def test_a_bracket_shrinks_by_all_workers_and_a_mixed_zone_stays():
    found = bracket([200.0, 900.0], [False, True])
    assert next_values(found, 3, 10.0) == [375.0, 550.0, 725.0]
    assert next_values(bracket([400.0, 409.0], [False, True]), 3, 10.0) == []
    mixed = bracket([300.0, 400.0, 350.0, 500.0], [False, False, True, True])
    assert mixed.mixed
    assert (mixed.above, mixed.below, mixed.limit) == (350.0, 400.0, 375.0)
    assert next_values(mixed, 3, 10.0) == []


def test_the_curve_of_residual_velocities_is_found():
    v = np.array([300.0, 320.0, 350.0, 400.0, 500.0])
    found = lambert_jonas(v, 0.8 * (v**2.3 - 280.0**2.3) ** (1 / 2.3), Bracket(270.0, 300.0, False))
    assert (found.a, found.p, found.limit) == pytest.approx((0.8, 2.3, 280.0), rel=1e-6)


def test_a_bisection_finds_a_made_up_limit():
    vary = {"type": "bisect", "path": SPEED, "bracket": ["200 m/s", "900 m/s"], "tolerance": "10 m/s",
            "parameters": {"bodies.target.shape.size.0": ["2 mm", "3 mm"]}}  # fmt: skip
    made = plan(**vary)
    limits = {"2 mm": 431.0, "3 mm": 613.0}
    rows = []
    members = made.first()
    while members:
        for member in members:
            speed = float(member.values[SPEED].split()[0])
            through = speed > limits[member.values["bodies.target.shape.size.0"]]
            rows.append({"number": member.number, "values": member.values, "status": "done", "message": "",
                         "measures": {"perforated": {"value": through, "uncertainty": None, "unit": ""}}})  # fmt: skip
        members = made.members(following(made.sweep.vary, made.base.value, rows, 3), len(rows))
    for found in verdict(made.sweep.vary, made.base.value, rows)["limits"]:
        limit = limits[found["parameters"]["bodies.target.shape.size.0"]]
        assert found["below"] < limit < found["above"]
        assert found["above"] - found["below"] <= 10.0
    assert len(rows) == 2 * (2 + 3 * 4)  # 700 m/s in four rounds of a quarter each: 2.7 m/s


def told(between, outcomes):
    """What a bisection over the plate's thickness says, and what it would try next, of shots at these values [mm]."""
    vary = {"type": "bisect", "path": "bodies.target.shape.size.0", "bracket": between, "tolerance": "0.5 mm"}
    made = plan(**vary)
    rows = [{"number": number, "values": {vary["path"]: f"{value} mm"}, "status": "done", "message": "",
             "measures": {"perforated": {"value": yes, "uncertainty": None, "unit": ""}}}
            for number, (value, yes) in enumerate(outcomes, 1)]  # fmt: skip
    (found,) = verdict(made.sweep.vary, made.base.value, rows)["limits"]
    return found, [one[vary["path"]] for one in following(made.sweep.vary, made.base.value, rows, 1)]


def test_a_limit_may_lie_where_values_fall():
    found, tried = told(["8 mm", "2 mm"], [(8, 0.0), (2, 1.0)])
    assert (found["below"], found["above"], found["mixed"], found["open"]) == (8.0, 2.0, False, "")
    assert tried == ["5 mm"]
    assert told(["8 mm", "2 mm"], [(8, 0.0), (2, 1.0), (5.4, 0.0), (5, 1.0)])[1] == []


@pytest.mark.parametrize(("between", "outcomes", "why"), [
    (["2 mm", "8 mm"], [(2, 1.0), (8, 0.0)], "the other way round"),
    (["8 mm", "2 mm"], [(8, 1.0), (2, 1.0)], "at every value that was tried: begin at a higher one"),
    (["8 mm", "2 mm"], [(8, 0.0), (2, 0.0)], "at no value that was tried: end at a lower one"),
    (["2 mm", "8 mm"], [(2, 1.0), (8, 1.0)], "begin at a lower one"),
    (["8 mm", "2 mm"], [(8, 0.0), (2, None)], "shot 2 undecided: give a later `longest`"),
    (["8 mm", "2 mm"], [], "no shot is done"),
])  # fmt: skip
def test_a_limit_that_was_not_found_says_what_to_do(between, outcomes, why):
    found, tried = told(between, outcomes)
    assert why in found["open"]
    assert tried == []


def test_a_limit_that_was_not_found_is_no_success(tmp_path):
    from typer.testing import CliRunner

    from hvisph.cli.main import app

    settings = [word for path, value in SMALL.items() for word in ("--set", f"{path}={value}")]
    done = CliRunner().invoke(app, ["ballistic-limit", "al_al_coarse", "--vary", SPEED, "--bracket", "2,3km/s", *settings,
                                    "--event", "penetration", "--threshold", "1", "--out", str(tmp_path / "sweep"),
                                    "--workers", "1", "--threads", "1"])  # fmt: skip
    assert done.exit_code == 1
    assert "No limit: it happens at no value that was tried: end at a higher one" in done.stdout


def alone(folder, member, tmp_path):
    """The last state of the same case, run alone."""
    from hvisph.simulation.run import run

    return run(folder.plan().case(member.values), tmp_path / f"alone{member.number}").folder


def same(one, other):
    """Whether two runs ended in the same bits."""
    a, b = (read_snapshot(list_snapshots(folder)[-1]) for folder in (one, other))
    return all(np.array_equal(a.fields[name], b.fields[name], equal_nan=True) for name in a.fields)


def test_killed_workers_lose_nothing(tmp_path):
    vary = {"type": "grid", "values": {SPEED: {"from": "2 km/s", "to": "4 km/s", "count": 4}}}
    settings = SMALL | {"time.end": "1.5 us", "output.every": "0.5 us", "output.checkpoint_every": 0.02}
    folder = begin(
        {"case": "al_al_coarse", "set": settings, "vary": vary, "record": ["penetration"]}, tmp_path / "sweep"
    )
    command = [sys.executable, "-m", "hvisph", "sweep", str(folder.path), "--worker", "--threads", "1"]
    for _ in range(2):
        begun = len(list((folder.path / "claims").glob("*.jsonl")))
        worker = subprocess.Popen(command)
        while len(list((folder.path / "claims").glob("*.jsonl"))) <= begun and worker.poll() is None:
            time.sleep(0.02)
        os.kill(worker.pid, signal.SIGKILL)
        worker.wait()
    rows = list(sweep(folder.path, workers=2))

    assert {row["status"] for row in rows} == {"done"}
    with (folder.path / "table.csv").open() as file:
        table = list(csv.DictReader(file))
    assert [row["status"] for row in table] == ["done"] * 4
    assert "penetration [m]" in table[0]
    assert "crater_diameter [m]" not in table[0]
    members = folder.members()
    report([str(folder.path)], each=False, out=None, quiet=True)
    page = (folder.path / "report.html").read_text(encoding="utf-8")
    assert "4 of 4 cases are done" in page
    assert page.count("data:image/png") == 4
    assert "<a href=" not in page  # no run has a page of its own yet
    report([str(folder.path)], each=True, out=None, quiet=True)
    page = (folder.path / "report.html").read_text(encoding="utf-8")
    links = set(re.findall(r'<a href="([^"]+)"', page))
    assert len(links) == 4
    assert all((folder.path / link).is_file() for link in links)
    assert page.count("data-sort") >= 4 * 4
    assert same(folder.run_folder(members[3]), alone(folder, members[3], tmp_path))
    assert list(sweep(folder.path)) == []  # nothing is left, and nothing is computed again


@pytest.mark.skipif(sys.platform == "win32", reason="POSIX signals")
def test_a_command_starts_its_workers_and_replaces_one_that_is_killed(tmp_path):
    vary = {"type": "grid", "values": {SPEED: {"from": "2 km/s", "to": "4 km/s", "count": 3}}}
    settings = SMALL | {"time.end": "1.5 us", "output.every": "0.5 us", "output.checkpoint_every": 0.02}
    folder = begin({"case": "al_al_coarse", "set": settings, "vary": vary}, tmp_path / "sweep")
    command = subprocess.Popen([sys.executable, "-m", "hvisph", "sweep", str(folder.path), "--workers", "2", "--quiet"])

    def starts():
        lines = [line for file in (folder.path / "claims").glob("*.jsonl") for line in file.read_text().splitlines()]
        return [event for event in map(json.loads, filter(None, lines)) if event["event"] == "start"]

    while len(starts()) < 2 and command.poll() is None:
        time.sleep(0.02)
    worker = starts()[0]["pid"]
    os.kill(worker, signal.SIGKILL)

    assert command.wait() == 0
    assert len({event["pid"] for event in starts()}) > 1
    assert [folder.standing(member).status for member in folder.members()] == ["done"] * 3
    assert same(folder.run_folder(folder.members()[2]), alone(folder, folder.members()[2], tmp_path))


@pytest.mark.skipif(sys.platform == "win32", reason="POSIX signals")
def test_a_command_that_is_asked_to_end_takes_its_workers_along(tmp_path):
    vary = {"type": "list", "cases": [{"time.end": "1 ms"}]}
    folder = begin({"case": "al_al_coarse", "set": SMALL | {"output.every": None}, "vary": vary}, tmp_path / "sweep")
    command = subprocess.Popen([sys.executable, "-m", "hvisph", "sweep", str(folder.path), "--workers", "1", "--quiet"],
                               stderr=subprocess.PIPE, text=True)  # fmt: skip
    run_log = folder.run_folder(folder.members()[0]) / "run.log"
    while not run_log.exists() and command.poll() is None:
        time.sleep(0.02)
    command.send_signal(signal.SIGTERM)
    assert "continue with" in command.communicate()[1]
    assert command.returncode == 130
    assert folder.standing(folder.members()[0]).status == "interrupted"  # by a worker that has ended: nobody holds it
    assert "interrupted at" in run_log.read_text()


def test_a_case_that_cannot_run_is_a_row_and_not_the_end(tmp_path):
    vary = {"type": "list", "cases": [{"time.cfl": 0.25},
                                      {"bodies.projectile.position": ["0.5 mm", "0 mm"]}]}  # fmt: skip
    folder = begin({"case": "al_al_coarse", "set": SMALL, "vary": vary, "keep": "summary"}, tmp_path / "sweep")
    rows = sorted(sweep(folder.path, workers=1), key=lambda row: row["number"])
    assert [row["status"] for row in rows] == ["done", "error"]
    assert "overlap" in rows[1]["message"]
    assert json.loads((folder.path / "results.json").read_text())["failures"][0]["number"] == 1
    assert not list_snapshots(rows[0]["folder"])


def test_the_table_of_a_sweep_follows_a_resumed_case(tmp_path):
    """`hvisph resume` of a case up to a later end left the measures of the first end in the table."""
    from typer.testing import CliRunner

    from hvisph.cli.main import app

    made = {"case": "al_al_coarse", "set": SMALL, "vary": {"type": "grid", "values": {SPEED: ["2 km/s"]}}}
    (row,) = sweep(begin(made | {"record": ["penetration"]}, tmp_path / "sweep").path, workers=1)
    before = (tmp_path / "sweep" / "table.csv").read_text()
    done = CliRunner().invoke(app, ["resume", row["folder"], "--end", "0.5us", "--quiet"])
    assert done.exit_code == 0
    (now,) = csv.DictReader(io.StringIO((tmp_path / "sweep" / "table.csv").read_text()))
    (then,) = csv.DictReader(io.StringIO(before))
    assert float(now["penetration [m]"]) > 1.2 * float(then["penetration [m]"])  # 0.5 us for 0.3


def test_a_sweep_of_other_cases_is_not_overwritten(tmp_path):
    one = {"case": "al_al_coarse", "set": SMALL, "vary": {"type": "grid", "values": {SPEED: ["2 km/s"]}}}
    begin(one, tmp_path / "sweep")
    more = one | {"vary": {"type": "grid", "values": {SPEED: ["2 km/s", "3 km/s"]}}}
    assert begin(more, tmp_path / "sweep").members() == SweepFolder(tmp_path / "sweep").members()
    assert len(SweepFolder(tmp_path / "sweep").members()) == 2
    with pytest.raises(CaseError, match="other cases"):
        begin(one | {"vary": {"type": "grid", "values": {SPEED: ["2.5 km/s"]}}}, tmp_path / "sweep")


def test_what_a_begun_sweep_does_not_have_is_told(tmp_path):
    begin(
        {"case": "al_al_coarse", "set": SMALL, "vary": {"type": "grid", "values": {SPEED: ["2 km/s"]}}},
        tmp_path / "one",
    )
    for only, said in (("3", "numbers go from 0 to 0"), ("3..1", "holds no number"), ("some", "neither failed")):
        with pytest.raises(CaseError, match=said):
            next(sweep(tmp_path / "one", only=only))
    with pytest.raises(CaseError, match="continues in its folder"):
        begin(tmp_path / "one", tmp_path / "elsewhere")
    assert begin(tmp_path / "one", tmp_path / "one").exists
    assert not (tmp_path / "elsewhere").exists()


def test_correlations_stand_beside_a_limit(tmp_path):
    from hvisph.sweeps.comparison import beside_limit

    case = {
        "kinematics": "axisymmetric", "resolution": "0.5 mm", "time": {"end": "1 us"},
        "bodies": {"shot": {"material": "aluminium-2024-t351", "shape": {"type": "sphere", "diameter": "5 mm"}, "velocity": ["3 km/s", 0]},
                   "plate": {"material": "aluminium-6061-t6", "shape": {"type": "cylinder", "diameter": "30 mm", "length": "6 mm"}}},
    }  # fmt: skip
    vary = {"type": "bisect", "path": "bodies.shot.velocity.0", "bracket": ["1 km/s", "7 km/s"], "tolerance": "1 km/s"}
    (tmp_path / "case.yaml").write_text(json.dumps(case))
    made = load_plan({"case": str(tmp_path / "case.yaml"), "vary": vary})
    limit = {"parameters": {}, "path": vary["path"], "unit": "km/s", "limit": 2.5, "shots": [{"value": 3.0}]}
    (one,) = beside_limit(made, limit)["correlations"]
    # Cour-Palais: 1.8 times the depth of the crater is the plate's thickness
    depth = 5.24 * 0.5 ** (19 / 18) * 95.0**-0.25 * (2785.0 / 2703.0) ** 0.5 * (one["value"] / 5050.0) ** (2 / 3)
    assert 1.8 * depth == pytest.approx(0.6, rel=0.02)  # speeds are looked at every 25 m/s
    assert "recht_ipson" not in beside_limit(made, limit)

    case["bodies"]["shot"]["shape"] = {"type": "cylinder", "diameter": "5 mm", "length": "10 mm"}
    (tmp_path / "case.yaml").write_text(json.dumps(case))
    beside = beside_limit(load_plan({"case": str(tmp_path / "case.yaml"), "vary": vary}), limit)
    share = 10.0 * 2785.0 / (10.0 * 2785.0 + 6.0 * 2703.0)
    assert beside["recht_ipson"]["residuals"] == [pytest.approx(share * np.sqrt(3000.0**2 - 2500.0**2), rel=5e-3)]
    assert beside_limit(made, limit | {"limit": None}) == {}
