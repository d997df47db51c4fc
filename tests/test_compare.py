"""`hvisph compare`: what is run and what is not, names and folders, tables, JSON, and the picture of all."""

import json
import shutil

import numpy as np
import pytest
from matplotlib.image import imread
from measure_bodies import MM, box, impact_end, snapshot
from typer.testing import CliRunner

from hvisph.cli.main import app
from hvisph.cli.results_table import comparison_tables
from hvisph.core.errors import CaseError
from hvisph.measures.compare import Row, shown_measures
from hvisph.output.hdf5 import write_hdf5
from hvisph.output.reader import list_snapshots
from hvisph.postprocessing.comparison import entries, is_run
from hvisph.postprocessing.run_data import draw_last_states
from hvisph.visualization.particles import Look, Moment, draw

BASE = """
title: Plates
kinematics: uniaxial_strain
resolution: 0.1 mm
bodies:
  projectile:
    material: aluminium-howell-ball
    shape: {type: interval, length: 10 mm}
    velocity: [3.1 km/s]
  target: {material: aluminium-howell-ball, shape: {type: interval, length: 10 mm}}
time: {end: 0.8 us}
output: {formats: [hdf5]}
"""
# 28.65 GPa is behind the shocks: a row that expects it, and one that expects what cannot be
THIN = """
base: base.yaml
formulation: {type: eulerian}
expected: {plateau_stress: {value: 28.65 GPa, tolerance: 5 %, source: jump conditions}}
"""
WRONG = """
base: base.yaml
formulation: {type: eulerian, viscosity: {type: monaghan, alpha: 1.2, beta: 2}}
expected: {plateau_stress: {value: 10 GPa, tolerance: 1 GPa, source: nobody}}
"""


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def cases(tmp_path):
    folder = tmp_path / "plates"
    folder.mkdir()
    for name, text in (("base", BASE), ("thin", THIN), ("wrong", WRONG)):
        (folder / f"{name}.yaml").write_text(text)
    return folder


def call(*arguments):
    return CliRunner().invoke(app, ["compare", *(str(argument) for argument in arguments)])


def test_a_folder_of_cases_is_run_once(cases, tmp_path):
    first = call("plates", "--threads", "1", "--json")
    assert first.exit_code == 0, first.output
    rows = {row["name"]: row for row in json.loads(first.stdout)["rows"]}
    assert list(rows) == ["thin", "wrong"]  # the base is no row
    summary = json.loads((tmp_path / "runs" / "plates" / "thin" / "summary.json").read_text())
    assert rows["thin"]["measures"] == summary["measures"]
    assert rows["thin"]["conservation"] == summary["conservation"]
    assert rows["thin"]["cost"]["steps"] == summary["steps"]
    assert rows["thin"]["published"]["plateau_stress"]["source"] == "jump conditions"
    found = rows["wrong"]["measures"]["plateau_stress"]["value"]
    assert rows["wrong"]["differences"]["plateau_stress"] == pytest.approx(found - 10e9)
    assert (rows["thin"]["missed"], rows["wrong"]["missed"]) == ([], ["plateau_stress"])

    written = [path.stat().st_mtime_ns for path in sorted((tmp_path / "runs").rglob("*"))]
    second = call("plates", "--threads", "1")
    assert second.exit_code == 0
    assert [path.stat().st_mtime_ns for path in sorted((tmp_path / "runs").rglob("*"))] == written
    assert "[1/" not in second.stdout
    assert "* beyond its tolerance" in second.stdout
    # the runs themselves, and the folder of them, give the same rows
    for sources in (["runs/plates/thin", "runs/plates/wrong"], ["runs/plates"]):
        again = json.loads(call(*sources, "--json").stdout)["rows"]
        assert [row["name"] for row in again] == ["thin", "wrong"]
        assert again[0]["measures"] == rows["thin"]["measures"]


def test_what_another_case_wrote_is_left_alone(cases, tmp_path):
    before, *_ = entries([cases / "thin.yaml"], runs="runs")
    assert before.folder == tmp_path.joinpath("runs", "thin").relative_to(tmp_path)
    assert not is_run(before)
    assert call(cases / "thin.yaml", "--threads", "1", "--quiet").exit_code == 0
    kept = (tmp_path / "runs" / "thin" / "summary.json").read_bytes()
    result = call(cases / "thin.yaml", "--resolution", "0.25mm", "--threads", "1", "--json")
    assert result.exit_code == 0, result.output
    assert (tmp_path / "runs" / "thin" / "summary.json").read_bytes() == kept
    source = json.loads(result.stdout)["rows"][0]["source"]
    assert source.startswith("runs/thin-")
    # both are found again, each by its own case
    assert is_run(entries([cases / "thin.yaml"])[0])
    assert entries([cases / "thin.yaml"], resolution="0.25mm")[0].folder.as_posix() == source


def test_a_run_without_an_end_is_completed(cases, tmp_path):
    assert call(cases / "thin.yaml", "--threads", "1", "--quiet").exit_code == 0
    run = tmp_path / "runs" / "thin"
    whole = json.loads((run / "summary.json").read_text())
    (run / "summary.json").unlink()
    shutil.rmtree(run / "checkpoint")
    assert json.loads(call(run, "--json").stdout)["rows"][0]["status"] == "unfinished"
    result = call(cases / "thin.yaml", "--threads", "1", "--json")
    assert json.loads(result.stdout)["rows"][0]["measures"] == whole["measures"]


def test_bundled_folders_and_equal_names(cases):
    rows = entries(["published/al_al", "published/steel_al"], resolution=4e-4)
    names = [entry.name for entry in rows]
    assert "al_al/sav1" in names
    assert "steel_al/sav1" in names
    assert len(set(names)) == len(names)
    assert not any(name.endswith("base") for name in names)
    written_out = [entry.name for entry in entries(["cases/published/al_al"])]
    assert written_out == [
        name.removeprefix("al_al/") for name in names if name.startswith("al_al/") or "/" not in name
    ]
    own = next(entry for entry in rows if entry.name == "al_al/sav1")
    assert own.folder.as_posix().startswith("runs/published/al_al/sav1")
    assert own.case.resolution == 4e-4
    assert [e.name for e in entries([cases / "thin.yaml", cases / "thin.yaml"])] == [
        "plates/thin",
        "plates/thin (2)",
    ]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["nowhere"], "no case file and no bundled case 'nowhere'"),
        (["published"], "its folders do: al_al"),
        (["plates", "--field", "pressure"], "--picture"),
        (["plates", "--picture", "a.doc"], "cannot be stored as '.doc'"),
        (["plates", "--picture", "a.png", "--field", "presure"], "did you mean 'pressure'"),
        (["plates", "--resolution", "1 kg"], "--resolution"),
        (["plates/broken.yaml"], "broken.yaml, line 2"),
        (["empty"], "neither cases nor runs nor snapshots"),
    ],
)
def test_bad_input_is_refused_before_anything_runs(cases, tmp_path, arguments, message):
    (cases / "broken.yaml").write_text("base: base.yaml\nresolutoin: 1 mm\n")
    if arguments[0] == "plates":
        (cases / "broken.yaml").unlink()
    (tmp_path / "empty").mkdir()
    result = call(*arguments)
    assert result.exit_code == 2, result.output
    assert message in result.stderr
    assert not (tmp_path / "runs").exists()


def test_runs_cannot_be_changed(tmp_path):
    (tmp_path / "run" / "snapshots").mkdir(parents=True)
    (tmp_path / "run" / ".hvisph").touch()
    result = call("run", "--resolution", "1mm")
    assert (result.exit_code, "has been run" in result.stderr) == (2, True)


def test_snapshots_stand_for_runs(tmp_path):
    write_hdf5(tmp_path / "first.h5", impact_end(0.4 * MM))
    write_hdf5(tmp_path / "second.h5", impact_end(0.4 * MM, crater=12 * MM))
    result = call("first.h5", "second.h5", "--json", "--picture", "both.png", "--field", "velocity")
    assert result.exit_code == 0, result.output
    rows = json.loads(result.stdout)["rows"]
    assert [row["status"] for row in rows] == ["snapshot", "snapshot"]
    narrow = [row["measures"]["crater_diameter"]["value"] for row in rows]
    assert narrow[0] - narrow[1] > 3 * MM
    assert (tmp_path / "both.png").stat().st_size > 10_000
    text = call("first.h5", "second.h5").stdout
    assert "d_cra" in text
    assert "energy drift" not in text


def test_a_failed_run_is_a_row_and_an_exit_code():
    failure = {"message": "particle 7 is too fast"}
    row = Row("a", None, "", "failed", failure, 1e-6, {}, {"energy_drift": None}, {}, {})
    assert "a: particle 7 is too fast" in comparison_tables([row])


def test_tables_show_what_rows_are_held_against():
    def made(name, published):
        measures = {
            key: {"value": 0.02, "unit": "m", "uncertainty": None}
            for key in ("crater_diameter", "crater_lip_diameter", "penetration")
        }
        return Row(name, None, "", "done", None, 8e-6, measures, {}, {}, published)

    plain = made("plain", {})
    held = made("held", {"penetration": {"value": 0.021, "tolerance": 1e-3, "source": "x"}})
    assert shown_measures([plain]) == ["crater_diameter", "crater_lip_diameter", "penetration"]
    assert shown_measures([plain, held]) == ["penetration"]
    assert held.missed == []  # on the limit, in decimals
    text = comparison_tables([plain, held])
    assert "2.00 (-0.10)" in text
    assert "2.00 (-0.10) *" not in text


def test_the_picture_of_all_has_one_scale():
    one, other = impact_end(0.4 * MM), impact_end(0.4 * MM, crater=12 * MM)
    one.fields["pressure"] = np.linspace(-2e9, 1e9, one.count)
    other.fields["pressure"] = np.linspace(-1e9, 4e9, other.count)
    figure = draw([Moment(one, name="one"), Moment(other, name="other")], Look("pressure"))
    first, second = (axes for axes in figure.axes if axes.get_title())
    assert (first.get_xlim(), first.get_ylim()) == (second.get_xlim(), second.get_ylim())
    (low, high), *_ = (axes.get_ylim() for axes in figure.axes if axes.get_label() == "<colorbar>")
    assert high == pytest.approx(-low)
    assert 3.0 < high < 4.0  # [GPa]; of both, less the outermost


@pytest.mark.parametrize("count", [1, 2, 5])
def test_pictures_of_any_number(tmp_path, count):
    write_hdf5(tmp_path / "impact.h5", impact_end(0.8 * MM))
    sources = {f"run {k}": tmp_path / "impact.h5" for k in range(count)}
    image = imread(draw_last_states(sources, tmp_path / "all.png", "body"))[..., :3]
    assert (image.min(axis=2) < 0.9).mean() > 0.02
    line = snapshot(box([-2 * MM], [0], 0.2 * MM), box([0], [2 * MM], 0.2 * MM), dx=0.2 * MM)
    write_hdf5(tmp_path / "line.h5", line)
    draw_last_states(dict.fromkeys(sources, tmp_path / "line.h5"), tmp_path / "lines.svg", "velocity")
    with pytest.raises(CaseError, match="different dimensions"):
        draw_last_states(sources | {"line": tmp_path / "line.h5"}, tmp_path / "none.png", "velocity")
    with pytest.raises(CaseError, match="40 panels"):
        draw([Moment(line)] * 41, Look("velocity"))


def test_the_last_snapshot_is_drawn(tmp_path):
    for number in (0, 1):
        write_hdf5(tmp_path / f"{number:06d}.h5", impact_end(0.8 * MM))
    assert len(list_snapshots(tmp_path)) == 2
    assert draw_last_states({"last": tmp_path}, tmp_path / "last.png", "body").is_file()
