"""Gauges and exact solutions as a user meets them: `exact`, `gauges`, `compare --gauges`, and what `check` refuses."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from hvisph.cli.main import app
from hvisph.measures.compare import mean_difference

LAYERS = """\
title: two layers
units: none
kinematics: uniaxial_strain
resolution: 0.01
bodies:
  a:
    material: {name: a, density: 1.0, eos: {type: linear, cauchy_number: 1.0}}
    shape: {type: interval, length: 0.5}
    velocity: [0.5]
  b:
    material: {name: b, density: 0.5, eos: {type: linear, cauchy_number: 0.25}}
    shape: {type: interval, length: 0.5}
    velocity: [-0.5]
formulation: {type: eulerian}
time: {end: 0.2}
gauges:
  A: {type: material, at: [0.1], fields: [velocity, pressure]}
  there: {type: fixed, at: [0.1], fields: [velocity]}
"""


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def layers(tmp_path):
    (tmp_path / "layers.yaml").write_text(LAYERS)
    return "layers.yaml"


def call(*arguments):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def test_exact_and_gauges_and_compare(layers, tmp_path):
    found = call("exact", layers, "--out", "exact")
    assert found.exit_code == 0
    assert "left out, being fixed in space: there" in found.stdout
    assert {"gauge.A.csv", "gauges.png", "profiles.png"} <= {path.name for path in (tmp_path / "exact").iterdir()}

    assert call("run", layers, "--out", "fine", "--quiet", "--threads", 1).exit_code == 0
    assert call("run", layers, "--out", "coarse", "--quiet", "--threads", 1, "--resolution", 0.025).exit_code == 0
    assert call("gauges", "fine", "--exact").stdout.strip() == "fine/gauges.png"
    assert (tmp_path / "fine" / "gauges.png").stat().st_size > 10_000

    found = call("compare", "fine", "coarse", "--gauges", "both.png")
    assert found.exit_code == 0
    assert "Mean difference from the exact solution" in found.stdout
    assert "both.png" in found.stdout
    assert (tmp_path / "both.png").stat().st_size > 10_000
    told = json.loads(call("compare", "fine", "coarse", "--gauges", "both.png", "--json").stdout)["gauges"]
    assert set(told["fine"]) == {"gauge.A.velocity_x", "gauge.A.pressure"}
    fine, coarse = (told[name]["gauge.A.velocity_x"]["mean"] for name in ("fine", "coarse"))
    assert 0.0 < fine < coarse < 0.1  # of a jump of 0.6; fronts are smeared over some spacings


def test_a_run_without_exact_solution_is_drawn_alone(tmp_path):
    clamped = "clamped:\n  - box: {min: [0.45], max: [0.5]}\n"
    (tmp_path / "clamped.yaml").write_text(LAYERS + clamped)
    assert call("run", "clamped.yaml", "--out", "run", "--quiet", "--threads", 1).exit_code == 0
    found = call("compare", "run", "--gauges", "one.svg")
    assert found.exit_code == 0
    assert "run: no exact solution: clamped" in found.stdout
    assert (tmp_path / "one.svg").is_file()
    found = call("gauges", "run", "--exact")
    assert found.exit_code == 2
    assert "there is no exact solution to draw" in found.stderr


def test_what_cannot_be_drawn_is_refused(layers, tmp_path):
    found = call("compare", layers, "--gauges", "both.xyz")
    assert found.exit_code == 2
    assert "--gauges" in found.stderr
    assert {path.name for path in tmp_path.iterdir()} == {"layers.yaml"}
    assert call("gauges", "nowhere").exit_code == 2


def test_mean_difference_leaves_gaps_out():
    times = np.array([0.0, 1.0, 2.0, 3.0])
    assert mean_difference(times, np.array([1.0, np.nan, 1.0, 3.0]), np.zeros(4)) == pytest.approx((2.0 + 2.0) / 3.0)
    assert np.isnan(mean_difference(times[:1], times[:1], times[:1]))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("velocity: [-0.5]", "position: [-0.2]", ["bodies.a: overlaps 'b'", "move one", "line 6"]),
        ("velocity: [-0.5]", "gap: -0.1", ["bodies.b.gap", "must be at least 0", "line 13"]),
        ("velocity: [0.5]", "position: [2.0]", ["bodies.b.position", "list the layers from left to right"]),
        ("at: [0.1], fields: [velocity, p", "at: [3.0], fields: [velocity, p",
         ["gauges.A.at", "outside every body", "Move the gauge into a body", "line 17"]),
        ("cauchy_number: 1.0", "cauchy_number: 1.0, bulk_modulus: 2", ["bodies.a.material.eos", "leave one out", "line 7"]),
        ("[0.5]\n  b", "[3 km/s]\n  b", ["bodies.a.velocity.0", "only plain numbers are allowed", "line 9"]),
        ("units: none\n", "", ["bodies.a.material.eos.cauchy_number", "give `bulk_modulus` in Pa", "line 6"]),
        ("{name: a, density: 1.0, eos: {type: linear, cauchy_number: 1.0}}", "aluminium-howell-ball",
         ["bodies.a.material", "the library is in SI", "line 7"]),
    ],
)  # fmt: skip
def test_check_and_run_refuse_with_place_and_remedy(tmp_path, old, new, words):
    text = LAYERS.replace(old, new, 1)
    if "from left" in words[-1]:
        text = text.replace("velocity: [-0.5]", "position: [0.0]")
    (tmp_path / "bad.yaml").write_text(text)
    for command in (("check", "bad.yaml"), ("run", "bad.yaml", "--out", "out")):
        found = call(*command)
        assert found.exit_code == 2
        for word in ("bad.yaml", *words):
            assert word in found.stderr, found.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["bad.yaml"]
