"""Measures of files: run folders, single snapshots, other codes' files; comparison, table, schema."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import jsonschema
import numpy as np
import pytest
from measure_bodies import MM, ball, box, impact_end, impact_start, reordered, snapshot

from hvisph.core.errors import CaseError, OutputError
from hvisph.core.measure_catalogue import CATALOGUE, reported_measures
from hvisph.measures.compare import compare_expected
from hvisph.measures.measure import measure, measure_snapshot, undefined_measures
from hvisph.measures.pressure import Plateau, before_release
from hvisph.measures.result import Result, undefined_result
from hvisph.measures.tables import body_rows, rows
from hvisph.output.hdf5 import write_hdf5
from hvisph.output.vtu import write_vtu

REQUIRED = (
    "crater_diameter",
    "extension",
    "penetration",
    "centre_pressure_peak",
    "centre_tension_peak",
    "void_fraction",
)
SCHEMA = json.loads((Path(__file__).parents[1] / "schemas" / "summary.schema.json").read_text())


def history():
    time = np.linspace(0.0, 8e-6, 801)
    return {
        "time": time,
        "centre_pressure": 19e9 * np.exp(-(((time - 0.9e-6) / 0.4e-6) ** 2)),
        "axis_pressure_min": -20e9 * np.exp(-(((time - 2.3e-6) / 0.2e-6) ** 2)),
    }


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A run folder with three moments, and the history of its pressures."""
    folder = tmp_path_factory.mktemp("run")
    (folder / "snapshots").mkdir()
    dx = 0.2 * MM
    middle = replace(impact_end(dx, crater=12 * MM, front=9 * MM), time=4e-6)
    for number, snap in enumerate((impact_start(dx), middle, impact_end(dx))):
        write_hdf5(folder / "snapshots" / f"{number:06d}.h5", snap)
    columns = history()
    table = np.stack(list(columns.values()), axis=1)
    np.savetxt(folder / "history.csv", table, delimiter=",", header=",".join(columns), comments="")
    return folder


def test_run_folder_at_its_end(run):
    found = measure(run)
    assert found.time == 8e-6
    assert found["crater_diameter"].value == pytest.approx(20.2 * MM, abs=0.2 * MM)
    assert found["penetration"].value == pytest.approx(18.8 * MM, abs=0.2 * MM)
    assert found["centre_pressure_peak"].value == pytest.approx(19e9, rel=1e-3)
    assert found["centre_tension_peak"].time == pytest.approx(2.3e-6, abs=2e-8)
    assert found["residual_velocity"].value == pytest.approx(3100.0)
    assert found["momentum_transfer"].value == 0.0


def test_at_a_time_and_at_all_times(run):
    assert measure(run, at=3.1e-6).time == 4e-6
    assert measure(run, at=0.0)["centre_pressure_peak"].time == 0.0
    whole = measure(run, at="all")
    assert [moment.time for moment in whole.series] == [0.0, 4e-6, 8e-6]
    diameters = [moment["crater_diameter"].value for moment in whole.series]
    assert diameters == sorted(diameters)
    assert whole.results == measure(run).results
    assert len(json.loads(json.dumps(whole.as_dict(), allow_nan=False))["series"]) == 3


def test_single_snapshots_of_either_format_measure_alike(run, tmp_path):
    alone = measure(run / "snapshots" / "000002.h5")
    write_vtu(tmp_path / "own.vtu", impact_end(0.2 * MM))
    other = measure(tmp_path / "own.vtu")
    for name in REQUIRED:
        assert alone[name].value == other[name].value
    # axis, face and plate are found without the start: the same lengths as from the folder
    assert alone["crater_diameter"].value == pytest.approx(measure(run)["crater_diameter"].value)
    assert "history" in alone["centre_pressure_peak"].reason
    assert "initial state" in alone["momentum_transfer"].reason


def test_files_of_another_code(tmp_path):
    import meshio

    snap = impact_end(0.2 * MM)
    points = np.pad(snap.fields["position"], ((0, 0), (0, 1)))
    cells = [("vertex", np.arange(snap.count)[:, None])]
    data = {"type": snap.body + 1, "mass": snap.fields["mass"], "rho": snap.fields["density"]}
    meshio.write(tmp_path / "dump_100.vtu", meshio.Mesh(points, cells, point_data=data))
    own = measure_snapshot(snap)
    for source in (tmp_path / "dump_100.vtu", tmp_path):
        other = measure(source)
        for name in ("crater_diameter", "extension", "penetration", "void_fraction"):
            assert other[name].value == pytest.approx(own[name].value, rel=1e-6)
        assert "velocity" in other["residual_velocity"].reason


def test_order_of_particles_in_a_snapshot_does_not_matter():
    start, end = impact_start(0.2 * MM), impact_end(0.2 * MM)
    order = np.random.default_rng(2).permutation(end.count)
    straight, mixed = measure_snapshot(end, start), measure_snapshot(reordered(end, order), start)
    for name, result in straight.results.items():
        if result.value is None:
            assert mixed[name] == result
        else:  # sums in another order: round-off
            assert mixed[name].value == pytest.approx(result.value, rel=1e-12)


def test_values_that_are_not_finite_have_a_reason():
    snap = impact_end(0.4 * MM)
    snap.fields["velocity"][3, 0] = np.nan
    found = measure_snapshot(snap, impact_start(0.4 * MM))
    assert list(found.results) == list(undefined_measures(snap, "none").results)
    assert found["residual_velocity"].value is None
    assert "finite" in found["residual_velocity"].reason
    assert found["penetration"].value > 0.0


def test_momentum_transfer():
    start, end = impact_start(0.2 * MM), impact_end(0.2 * MM)
    share = start.fields["mass"][start.body == 0].sum() / end.fields["mass"][end.body == 1].sum()
    end.fields["velocity"][end.body == 1, 0] = 0.3 * 3100.0 * share
    assert measure_snapshot(end, start)["momentum_transfer"].value == pytest.approx(0.3)


def test_momentum_from_outside_is_not_that_of_the_shot():
    """The shot stops; edges or a floor have taken twice its momentum from the target, or have not."""
    start, end = impact_start(0.2 * MM), impact_end(0.2 * MM)
    end.fields["mass"] *= start.fields["mass"].sum() / end.fields["mass"].sum()  # none is lost
    shot = start.fields["mass"][start.body == 0].sum()
    share = shot / end.fields["mass"][end.body == 1].sum()
    for taken in (2.0, 0.0):
        end.fields["velocity"][:] = 0.0
        end.fields["velocity"][end.body == 1, 0] = (1.0 - taken) * 3100.0 * share
        found = measure_snapshot(replace(end, metadata=end.metadata | {"outer_forces": True}), start)
        assert found["momentum_transfer"].value == pytest.approx(1.0)
        impulse = found.layers[0].results["impulse"].value
        assert impulse == pytest.approx(3100.0 * shot)


@pytest.mark.parametrize("turn", [0.0, 37.0])
def test_beta_is_one_plus_the_momentum_that_rises(turn):
    start, end = impact_start(0.2 * MM), impact_end(0.2 * MM)
    x, velocity, mass = end.fields["position"], end.fields["velocity"], end.fields["mass"]
    assert measure_snapshot(start, start)["beta"].value == 1.0
    own = np.flatnonzero(end.body == 1)
    rising, falling, near = own[:40], own[40:60], own[60:80]
    x[rising, 0], x[falling, 0], x[near, 0] = -3 * MM, -3 * MM, -0.3 * MM  # 2 dx is 0.4 mm
    velocity[rising, 0], velocity[falling, 0], velocity[near, 0] = -500.0, 10.0, -500.0
    back = np.flatnonzero(end.body == 0)[:10]
    x[back, 0], velocity[back, 0] = -5 * MM, -100.0
    brought = 3100.0 * start.fields["mass"][start.body == 0].sum()
    for snap in (start, end) if turn else ():
        c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
        for name in ("position", "velocity"):
            snap.fields[name] = snap.fields[name] @ np.array([[c, s], [-s, c]])
    found = measure_snapshot(end, start)
    # sums alone: round-off
    assert found["ejecta_mass"].value == pytest.approx(mass[rising].sum(), rel=1e-12)
    assert found["ejecta_momentum"].value == pytest.approx(500.0 * mass[rising].sum(), rel=1e-12)
    target = 1.0 + 500.0 * mass[rising].sum() / brought
    assert found["beta"].variants["target"].value == pytest.approx(target, rel=1e-12)
    assert found["beta"].value == pytest.approx(target + 100.0 * mass[back].sum() / brought, rel=1e-12)


def test_one_dimension_measures_the_plateau():
    dx = 0.01 * MM
    snap = snapshot(box([-2 * MM], [0], dx), box([0], [2 * MM], dx), dx=dx, time=2e-7)
    inside = np.abs(snap.fields["position"][:, 0]) < 1 * MM
    snap.fields["pressure"][inside] = 28.65e9
    found = measure_snapshot(snap)
    assert found["plateau_stress"].value == pytest.approx(28.65e9)
    assert {found[name].value for name in REQUIRED} == {None}
    assert all(found[name].reason for name in REQUIRED)


def test_bad_sources(tmp_path, run):
    with pytest.raises(CaseError, match="no such"):
        measure(tmp_path / "nowhere")
    with pytest.raises(CaseError, match="no snapshot: it holds nothing"):
        measure(tmp_path)
    (tmp_path / "broken.h5").write_bytes(b"\x89HDF\r\n\x1a\nxx")
    with pytest.raises(OutputError, match="broken"):
        measure(tmp_path / "broken.h5")
    for at in ("end", float("nan"), float("inf")):
        with pytest.raises(CaseError, match="allowed"):
            measure(run, at=at)


def test_comparison_with_expected_values():
    results = {
        "extension": Result(6.6e-3, "m"),
        "penetration": undefined_result("m", "none"),
        "energy_drift": 2e-5,
    }
    expected = {
        "extension": SimpleNamespace(value=0.7e-2, tolerance=0.04e-2, source="paper"),
        "penetration": {"value": 2e-2, "tolerance": 1e-3},
        "energy_drift": {"value": 0.0, "tolerance": 1e-5},
    }
    table = compare_expected(results, expected.items())
    # 7.0 - 6.6 = 0.4 mm is on the limit, and passes although it is 0.40000000000000018
    assert [row["passed"] for row in table] == [True, False, False]
    assert table[0]["source"] == "paper"
    assert table[1]["value"] is None
    with pytest.raises(CaseError, match="did you mean 'extension'"):
        compare_expected(results, [("extention", {"value": 1.0, "tolerance": 1.0})])


@pytest.mark.parametrize(
    ("value", "spread", "text"),
    [
        (0.021, 0.0005, "2.10 ± 0.05 cm"),
        (3.8e-5, 2.5e-6, "38 ± 2.5 um"),  # the crater of a grain of dust
        (4006.1, 58.5, "4.01 ± 0.0585 km"),  # and that of an asteroid
        (0.0, 0.0, "0.00 cm"),
        (0.0, 5e-4, "0.00 ± 0.05 cm"),
        (1e-12, 0.0, "0.00 cm"),
    ],
)
def test_small_sizes_keep_their_figures(value, spread, text):
    (row,) = rows({"crater_diameter": Result(value, "m", spread)})
    assert row.value == text


@pytest.mark.parametrize(
    ("name", "unit", "value", "text"),
    [
        ("impulse", "N s", 1.05e-11, "10.5 pN s"),
        ("impulse", "N s/m", 2e-6, "2 uN s/m"),
        ("impulse", "N s", 3e-17, "0.0000 N s"),  # rounding
        ("impulse", "N s", 0.7731, "0.7731 N s"),
        ("mass_loss", "kg", 4e12, "4e+12 kg"),
        ("perforation_time", "s", 0.1875, "188 ms"),
    ],
)
def test_units_suit_the_size(name, unit, value, text):
    (row,) = rows({name: Result(value, unit)})
    assert row.value == text


def test_table_for_people():
    results = {
        "extension": Result(6.61e-3, "m", 1e-4),
        "centre_pressure_peak": Result(18.8e9, "Pa", 1e3, time=0.91e-6),
        "void_fraction": undefined_result("", "2D only"),
        "energy_drift": -7e-6,
        "momentum_drift": -0.0,
        "momentum_transfer": -4e-4,
        "plug_width": Result(8.7e-3, "m", 1e-3),
        "target_fragments": Result(3.0, ""),
        "a_new_measure": Result(12345.678, "kg"),
    }
    expected = compare_expected(results, [("extension", {"value": 7e-3, "tolerance": 1e-3, "source": "Young 2021"})])
    table = {row.name: row for row in rows(results, expected)}
    assert table["extension"].value == "0.66 ± 0.01 cm"
    assert table["extension"].expected == "0.70 ± 0.10 cm"
    assert table["extension"].passed is True
    assert table["extension"].note == "Young 2021"
    assert table["centre_pressure_peak"].value == "18.80 GPa"
    assert table["centre_pressure_peak"].note == "at 0.91 us"
    assert table["void_fraction"].value == "-"
    assert table["void_fraction"].note == "2D only"
    assert table["energy_drift"].value == "-0.00070 %"
    assert table["momentum_drift"].value == "0"  # what rounds to nothing has no sign
    assert table["momentum_transfer"].value == "0.000"
    assert table["plug_width"].value == "8.70 ± 1.00 mm"
    assert table["target_fragments"].value == "3"
    assert table["a_new_measure"].value == "1.23e+04 kg"
    assert table["a_new_measure"].passed is None
    plain = {row.name: row for row in rows(results, unitless=True)}
    assert plain["extension"].value == "0.00661 ± 0.0001"


def test_rows_of_bodies():
    body = {"mass": 0.219, "velocity": [2462.04, 0.0], "kinetic_energy": 6.71e5}
    plain = {"bodies": {"shot": body}, "whole": {"kind": "whole"}}
    assert body_rows(plain) == [("shot", "219 g/m", "(2462, 0) m/s", "671 kJ/m")]
    plain["whole"]["kind"] = "revolution"
    assert body_rows(plain) == [("shot", "219 g", "(2462, 0) m/s", "671 kJ")]
    assert body_rows(plain, unitless=True) == [("shot", "0.219", "(2462, 0)", "6.71e+05")]


def summary(measures):
    plain = measures.as_dict()
    return {
        "answer": plain["answer"], "layers": plain["layers"], "whole": plain["whole"],
        "projectile": plain["projectile"], "cloud": plain["cloud"], "bodies": plain["bodies"],
        "title": "synthetic", "code_version": "0.1.0", "case_hash": "0123abcd", "status": "done",
        "end_time": 8e-6, "failure": None, "particles": 12000, "steps": 2500, "threads": 2,
        "wall_seconds": 7.5, "microseconds_per_particle_step": 0.25, "measures": plain["measures"],
        "conservation": {"energy_drift": -7e-6, "momentum_drift": 1e-15},
        "expected": compare_expected(measures.results, [("extension", {"value": 7e-3, "tolerance": 1e-3})]),
    }  # fmt: skip


def test_summary_of_every_dimension_follows_its_schema(run):
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    sphere = snapshot(ball([-2 * MM, 0, 0], 4 * MM, MM), box([0, -5 * MM, -5 * MM], [2 * MM, 5 * MM, 5 * MM], MM))
    line = snapshot(box([-2 * MM], [0], 0.1 * MM), box([0], [2 * MM], 0.1 * MM))
    for found in (measure(run), measure_snapshot(sphere), measure_snapshot(line)):
        jsonschema.validate(json.loads(json.dumps(summary(found), allow_nan=False)), SCHEMA)
        # the catalogue knows every number, its unit and its place in the table
        assert list(found.results) == list(reported_measures(found.dimensions))
        for name, result in found.results.items():
            assert result.unit == CATALOGUE[name].unit_in(found.dimensions), name
            assert result.value is None or found.dimensions in CATALOGUE[name].dims, name


def test_summary_of_a_failed_run_follows_its_schema(run):
    failed = summary(undefined_measures(impact_end(), "the run failed"))
    where = {"particle": 17, "body": "target", "time": 2e-6, "criterion": "finite", "message": "not finite"}
    failed.update(status="failed", failure=where)
    jsonschema.validate(failed, SCHEMA)


@pytest.mark.parametrize(
    "spoil",
    [
        lambda s: s.update(status="fine"),
        lambda s: s.update(steps=-1),
        lambda s: s.update(stepz=1),
        lambda s: s.pop("case_hash"),
        lambda s: s.update(failure={"particle": 1}),
        lambda s: s["measures"].pop("extension"),
        lambda s: s["measures"]["extension"].update(unit="cm"),
        lambda s: s["measures"]["extension"].update(value=None),
        lambda s: s["measures"]["extension"].update(reason="a reason beside a value"),
        lambda s: s["measures"]["centre_pressure_peak"].pop("time"),
        lambda s: s["measures"]["void_fraction"].update(value=1.5),
        lambda s: s["measures"].update(new_measure={"value": 1.0}),
        lambda s: s["conservation"].pop("energy_drift"),
        lambda s: s["expected"][0].pop("passed"),
    ],
)
def test_schema_refuses(run, spoil):
    spoiled = summary(measure(run))
    spoil(spoiled)
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(spoiled, SCHEMA)


def test_schema_takes_later_measures(run):
    later = summary(measure(run))
    later["measures"]["plug_velocity"] = {"value": 463.0, "unit": "m/s", "uncertainty": None}
    jsonschema.validate(later, SCHEMA)


def test_measure_is_light_to_import():
    modules = "measure, pressure, compare, tables"
    # h5py, which reads snapshots, takes 40 ms; the modules of scipy are imported at their first use
    heavy = "{'numba', 'scipy.spatial', 'scipy.optimize', 'matplotlib', 'yaml'}"
    code = f"import sys; from hvisph.measures import {modules}; from hvisph.visualization import style; print(*{heavy} & sys.modules.keys())"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []


def test_plateau_is_that_before_its_release():
    """Three moments: it grows, is longest, and has been released to two thirds by long rarefactions."""

    def plateau_at(time, stress, count):
        return time, Plateau(Result(stress, "Pa", 1e6), Result(300.0, "m/s", 0.1), count)

    best = before_release([plateau_at(1e-6, 4.74e9, 20), plateau_at(2e-6, 4.75e9, 90), plateau_at(4e-6, 3.06e9, 300)])
    assert best.stress.value == 4.75e9
    assert best.stress.time == best.velocity.time == 2e-6
    torn = Plateau(Result(-1e9, "Pa"), Result(0.0, "m/s"), 5)
    assert before_release([(1.0, torn)]).stress.value == -1e9
