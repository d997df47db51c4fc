"""Calibration: parameters from made-up and computed shots, response surfaces, combined uncertainty, V50."""

import csv
import json
from math import exp

import numpy as np
import pytest
from scipy.stats import norm, uniform

from hvisph.case.sweep import Sweep
from hvisph.casefile.loader import load_case
from hvisph.core.errors import CaseError
from hvisph.sweeps import calibration
from hvisph.sweeps.analysis import following, verdict
from hvisph.sweeps.design import points
from hvisph.sweeps.driver import begin
from hvisph.sweeps.plan import load_plan
from hvisph.sweeps.statistics import Surrogate, combine_uncertainties, logistic_limit, sensitivity

SPEEDS = {"slow": 169, "middle": 262, "fast": 373}
A, B, N = 324.0, 114.0, 0.42  # 6061-T6 of the library
BAR = {
    "kinematics": "axisymmetric", "resolution": "1.27 mm",
    "bodies": {"bar": {
        "material": {"base": "aluminium-6061-t6", "damage": {"type": "none"}},
        "shape": {"type": "cylinder", "diameter": "7.62 mm", "length": "15.24 mm"}, "position": ["7.62 mm", 0],
        "velocity": ["-262 m/s", 0]}},
    "symmetry": [{"axis": "x"}], "time": {"end": "30 us"}, "output": {"every": "30 us", "formats": ["hdf5"]},
}  # fmt: skip
PARAMETERS = {
    "material.strength.a": {"start": "227 MPa", "bounds": ["100 MPa", "600 MPa"]},
    "material.strength.b": {"start": "148 MPa", "bounds": ["20 MPa", "400 MPa"]},
    "material.strength.n": {"start": 0.55, "bounds": [0.1, 1.0]},
}


def made_up(a, b, n, speed):
    """Length and foot of a bar whose flow stress is that at its mean strain (after Wilkins & Guinan 1973)."""
    strain = 0.5 * 2703.0 * speed**2 / (a * 1e6)
    flow = 1e6 * (a + b * strain**n)
    return {"length_ratio": exp(-2703.0 * speed**2 / (2.0 * flow)), "foot_diameter": 7.62e-3 * (1.0 + strain) ** 0.7}


def a_plan(tmp_path, **more):
    """A fit to made-up bars."""
    shots = [{"shot": name, "bodies.bar.velocity.0": f"-{speed} m/s"} for name, speed in SPEEDS.items()]
    truth = {name: made_up(A, B, N, speed) for name, speed in SPEEDS.items()}
    rows = [{"shot": name, "quantity": quantity, "value": value / (1e-3 if quantity == "foot_diameter" else 1.0),
             "unit": "mm" if quantity == "foot_diameter" else "-", "scatter": 0.01, "source": "made up"}
            for name, one in truth.items() for quantity, value in one.items()]  # fmt: skip
    (tmp_path / "bar.yaml").write_text(json.dumps(BAR))
    vary = {"type": "fit", "shots": shots, "measured": rows, "parameters": PARAMETERS,
            "material": {"name": "mine", "base": "aluminium-6061-t6"}} | more  # fmt: skip
    return load_plan({"case": str(tmp_path / "bar.yaml"), "vary": vary})


def solved(plan, monkeypatch, rounds=60):
    """Result and number of the cases of a fit whose runs are a formula."""
    known = {}
    monkeypatch.setattr(calibration, "_results", lambda folder: (known[folder], {}, {}))
    rows, members = [], plan.first()
    for _ in range(rounds):
        for member in members:
            a, b, n = (float(str(member.values.get(f"bodies.bar.material.strength.{key}", usual)).split()[0])
                       for key, usual in (("a", A), ("b", B), ("n", N)))  # fmt: skip
            folder, speed = str(member.number), SPEEDS[member.values["experiment.shot"]]
            known[folder] = {k: {"value": v} for k, v in made_up(a, b, n, speed).items()}
            rows.append({"number": member.number, "values": member.values, "status": "done", "message": "",
                         "folder": folder, "measures": {}})  # fmt: skip
        members = plan.members(following(plan.sweep.vary, plan.base.value, rows, 1), len(rows))
        if not members:
            break
    return verdict(plan.sweep.vary, plan.base.value, rows)["fit"], rows


def test_constants_are_found_from_a_start_30_percent_off(tmp_path, monkeypatch):
    fit, rows = solved(a_plan(tmp_path), monkeypatch)
    values = [one["value"] for one in fit["parameters"].values()]
    assert values == pytest.approx([A, B, N], rel=0.01)  # no scatter was added: only the differences' error is left
    assert fit["converged"]
    keys = [calibration.Calibration(a_plan(tmp_path).sweep.vary, BAR)._key(r["values"]["experiment.shot"], r["values"]) for r in rows]  # fmt: skip
    assert len(set(keys)) == len(rows)  # nothing is computed twice
    document = calibration.material_document(fit, "2026-01-01", "1")
    assert document["base"] == "aluminium-6061-t6"
    assert "made up" in document["sources"][0]["text"]


def test_the_posterior_of_a_surface_holds_the_constants(tmp_path, monkeypatch):
    only_a = {"material.strength.a": PARAMETERS["material.strength.a"]}
    fit, rows = solved(a_plan(tmp_path, method="surrogate", count=20, parameters=only_a), monkeypatch)
    (one,) = fit["parameters"].values()
    assert len(rows) == 20 * len(SPEEDS)
    assert one["interval"][0] < A < one["interval"][1]
    assert abs(one["value"] - A) < 3.0 * one["deviation"]


def test_what_the_data_do_not_determine_is_said(tmp_path, monkeypatch):
    idle = {"material.strength.a": PARAMETERS["material.strength.a"],
            "material.strength.c": {"start": 0.01, "bounds": [0.0, 0.1]}}  # the made-up bar knows no rate  # fmt: skip
    fit, _ = solved(a_plan(tmp_path, parameters=idle), monkeypatch)
    assert [one["determined"] for one in fit["parameters"].values()] == [True, False]
    assert "not determined" in calibration.parameter_text("c", fit["parameters"]["material.strength.c"])


@pytest.mark.parametrize(("more", "said"), [
    ({"measured": [{"shot": "slow", "quantity": "lenght_ratio", "value": 1, "scatter": 1}]}, "did you mean 'length_ratio'"),
    ({"measured": [{"shot": "slaw", "quantity": "length_ratio", "value": 1, "scatter": 1}]}, "did you mean 'slow'"),
    ({"measured": [{"shot": "slow", "quantity": "length_ratio", "value": 1, "scatter": ""}]}, "its scatter"),
    ({"quantities": ["outline"]}, "0 measured numbers do not determine 3 parameters"),
    ({"measured": "none.csv"}, "no file 'none.csv'"),
    ({"only": ["x*"]}, "no such shot"),
    ({"parameters": {"material.strength.aa": {"start": 1, "bounds": [0, 2]}}}, "unknown key; did you mean 'a'"),
    ({"parameters": {"material.strength.a": {"start": "3 MPa", "bounds": ["5 MPa", "1 MPa"]}}}, "lower one first"),
])  # fmt: skip
def test_bad_input_is_told_before_anything_runs(tmp_path, more, said):
    with pytest.raises(CaseError, match=said):
        a_plan(tmp_path, **more).first()


@pytest.mark.slow
def test_a_computed_bar_gives_its_yield_stress_back(tmp_path):
    """Two coarse bars by the library's constants; a alone from 30 % off, through the command."""
    from typer.testing import CliRunner

    from hvisph.cli.main import app
    from hvisph.sweeps.driver import sweep

    (tmp_path / "bar.yaml").write_text(json.dumps(BAR))
    shots = [("s", "-200 m/s"), ("f", "-300 m/s")]
    cases = [{"experiment.shot": name, "bodies.bar.velocity.0": speed} for name, speed in shots]
    rows = list(sweep({"case": str(tmp_path / "bar.yaml"), "vary": {"type": "list", "cases": cases}}, tmp_path / "truth", workers=1))  # fmt: skip
    measured = [{"shot": row["values"]["experiment.shot"], "quantity": "length_ratio", "unit": "-", "scatter": 0.005,
                 "value": row["measures"]["length_ratio"]["value"]} for row in rows]  # fmt: skip
    with (tmp_path / "shots.csv").open("w") as file:
        csv.writer(file).writerows([("shot", "bodies.bar.velocity.0"), *shots])
    vary = {"type": "fit", "shots": "shots.csv", "measured": measured, "parameters": {"material.strength.a": PARAMETERS["material.strength.a"]},
            "material": {"name": "mine", "base": "aluminium-6061-t6"}}  # fmt: skip
    (tmp_path / "fit.yaml").write_text(json.dumps({"case": "bar.yaml", "vary": vary}))
    done = CliRunner().invoke(app, ["fit", str(tmp_path / "fit.yaml"), "--out", str(tmp_path / "fit"), "--workers", "1",
                                    "--plot", str(tmp_path / "fit.png")])  # fmt: skip
    assert done.exit_code == 0, done.output
    case = load_case(BAR | {"materials": [str(tmp_path / "fit" / "mine.yaml")], "bodies": {"bar": BAR["bodies"]["bar"] | {"material": "mine"}}})  # fmt: skip
    assert case.bodies["bar"].material.strength.a == pytest.approx(324e6, rel=0.01)
    assert "Fitted by hvisph" in case.bodies["bar"].material.source
    assert (tmp_path / "fit.png").stat().st_size > 0

    made = {
        "materials": [str(tmp_path / "fit" / "mine.yaml")],
        "bodies": {"bar": BAR["bodies"]["bar"] | {"material": "mine"}},
    }
    (tmp_path / "prediction.yaml").write_text(json.dumps(BAR | made))
    done = CliRunner().invoke(app, ["converge", str(tmp_path / "prediction.yaml"), "--resolutions", "2mm,1.5mm", "--fit",
                                    str(tmp_path / "fit"), "--out", str(tmp_path / "study"), "--workers", "1"])  # fmt: skip
    assert done.exit_code == 0, done.output
    found = json.loads((tmp_path / "study" / "results.json").read_text())["converge"]["final_length"]["uncertainty"]
    assert sum(found["shares"].values()) == pytest.approx(1.0)
    assert found["parts"]["material"] > 0.0
    assert "material" in done.stdout


def test_a_limit_has_its_uncertainty_by_spacing_and_material():
    """Limits of 300, 310 m/s at 1, 2 mm; 316 and 302 at 2 mm with each of two independent parameters raised."""
    fit = {"material": "aluminium-6061-t6", "correlation": [[1.0, 0.0], [0.0, 1.0]],
           "parameters": {f"material.strength.{key}": {"value": value, "deviation": 3.0, "unit": "MPa"}
                          for key, value in (("a", 324.0), ("b", 114.0))}}  # fmt: skip
    vary = {"type": "bisect", "path": "bodies.bar.velocity.0", "bracket": ["250 m/s", "350 m/s"], "tolerance": "0.5 m/s",
            "resolutions": ["1 mm", "2 mm"], "fit": fit}  # fmt: skip
    sweep = Sweep.model_validate({"case": "bar", "vary": vary})
    limits = {"1 mm": 300.0, "2 mm": 310.0, "a": 316.0, "b": 302.0}
    rows, cases = [], points(sweep.vary, BAR, None)
    while cases:
        for values in cases:
            raised = [key for key in "ab" if f"bodies.bar.material.strength.{key}" in values]
            limit = limits[raised[0] if raised else values["resolution"]]
            rows.append({"number": len(rows), "values": values, "status": "done", "message": "", "measures": {
                "perforated": {"value": float(values["bodies.bar.velocity.0"].split()[0]) > limit, "unit": ""}}})  # fmt: skip
        cases = following(sweep.vary, BAR, rows, 3)
    found = verdict(sweep.vary, BAR, rows)["limits"][0]["uncertainty"]
    assert found["parts"]["spacing"] == pytest.approx(10.0, abs=0.5)
    assert found["parts"]["material"] == pytest.approx(2.0 * (6.0**2 + 8.0**2) ** 0.5, rel=0.1)  # brackets of 0.5 m/s


def test_the_error_of_a_surface_is_that_of_leaving_points_out():
    x = np.random.default_rng(1).random((12, 2))
    y = 3.0 * x[:, 0] + x[:, 1] + 0.3 * np.sin(9.0 * x[:, 0])
    surface = Surrogate(x, y, polynomial=True)
    degree = int(surface.kind[-1])
    left_out = []
    for k in range(len(x)):
        others = np.arange(len(x)) != k
        coefficients = np.linalg.lstsq(calibration_terms(x[others], degree), y[others], rcond=None)[0]
        left_out.append(y[k] - (calibration_terms(x[k : k + 1], degree) @ coefficients)[0])
    assert surface.error == pytest.approx(np.sqrt(np.mean(np.square(left_out))), rel=1e-9)


def calibration_terms(x, degree):
    """Terms of a polynomial surface."""
    from hvisph.sweeps.statistics import _terms

    return _terms(x, degree)


def test_slopes_and_shares_have_the_units_of_the_inputs():
    """v_r = v - 0.18 Y/MPa - 170 m/s at 400 to 600 m/s and 240 to 360 MPa: slopes 1 and -0.18, shares 99 and 1 %."""
    drawn = [uniform(400.0, 200.0), norm(300.0, 30.0)]
    x = np.column_stack([one.ppf(np.random.default_rng(2).random(40)) for one in drawn])
    found = sensitivity(x, x[:, 0] - 0.18 * x[:, 1] - 170.0, drawn)
    assert found["slope"] == pytest.approx([1.0, -0.18], abs=1e-9)
    total = 200.0**2 / 12.0 + (0.18 * 30.0) ** 2
    assert found["total"] == pytest.approx([200.0**2 / 12.0 / total, (0.18 * 30.0) ** 2 / total], abs=0.02)
    assert found["r2"] == pytest.approx(1.0)
    assert found["swing"][0] == pytest.approx(180.0)


def test_uncertainties_add_as_squares():
    found = combine_uncertainties([1.0, 2.0], [10.0, 13.0], 4.0, [13.0, 19.0], [[1.0, 0.0], [0.0, 1.0]])
    assert found["parts"] == pytest.approx({"spacing": 3.0, "time": 4.0, "material": 12.0})
    assert found["half_width"] == pytest.approx(13.0)
    assert sum(found["shares"].values()) == pytest.approx(1.0)


def test_v50_of_mixed_shots_is_the_middle_of_their_zone():
    v50, deviation = logistic_limit([180, 190, 200, 210, 220, 230], [False, False, True, False, True, True])
    assert v50 == pytest.approx(205.0, abs=0.1)  # the shots are symmetric about it
    assert 5.0 < deviation < 40.0


def test_a_shot_that_is_not_decided_goes_on(tmp_path):
    """The sphere is still in the plate after 0.2 us: the shot goes on to the longest time, and no further."""
    from hvisph.sweeps.driver import sweep

    vary = {"type": "bisect", "path": "bodies.projectile.velocity.0", "bracket": ["2 km/s", "3 km/s"], "tolerance": "1 km/s",
            "longest": "0.5 us"}  # fmt: skip
    small = {"resolution": "0.5 mm", "time.end": "0.2 us", "output.every": "0.1 us"}
    folder = begin({"case": "al_al", "set": small, "vary": vary}, tmp_path / "limit")
    list(sweep(folder.path, workers=1))
    results = json.loads((folder.path / "results.json").read_text())
    (limit,) = results["limits"]
    assert limit["undecided"] == [0, 1]
    assert "`longest`" in limit["open"]
    ends = [
        json.loads((folder.run_folder(member) / "summary.json").read_text())["end_time"] for member in folder.members()
    ]
    assert ends == pytest.approx([0.5e-6, 0.5e-6], rel=1e-2)
