"""Sets of experiments: their data, what is said of them, and coarse forms."""

import json
from pathlib import Path

import numpy as np
import pytest
from hvisph_validation.comparison import Compared, verdicts
from hvisph_validation.evaluators import evaluator_of
from hvisph_validation.evaluators.shield import ratio
from hvisph_validation.experiment_set import Criteria
from hvisph_validation.experiments import Experiments, Measured, experiment_names
from hvisph_validation.report import write_page
from hvisph_validation.results import SetResult, store, stored
from typer.testing import CliRunner

from hvisph.casefile.loader import load_case
from hvisph.cli.main import app
from hvisph.core.errors import CaseError
from hvisph.sweeps.plan import load_plan

NAMES = experiment_names()


def call(*arguments):
    return CliRunner().invoke(app, ["validate", *map(str, arguments)])


def row(shot, measured, computed, *, quantity="length", unit="mm", judged=True, **more):
    one = Measured(shot, quantity, None, measured, unit, 0.1, judged, "seen", "a paper")
    return Compared(one, computed, 0.05, **more)


@pytest.mark.parametrize("name", NAMES)
def test_every_number_belongs_to_a_shot_and_says_its_source(name):
    one = Experiments(name)
    known = evaluator_of(one.model.evaluator)
    assert one.measured
    assert all(measured.source for measured in one.measured)
    assert not [m for m in one.measured if m.judged and m.confidence == "recalled"]
    assert {m.quantity for m in one.measured} <= set(known.quantities)
    assert set(one.model.required) <= {m.quantity for m in one.measured}
    if known.each is not None:
        assert {m.shot for m in one.measured} == set(one.shots)


@pytest.mark.parametrize("name", NAMES)
def test_cases_load_at_every_resolution(name, monkeypatch):
    one = Experiments(name)
    some = list(one.shots)[:: max(1, len(one.shots) // 3)]  # loading all takes a minute
    monkeypatch.setattr(one, "shots", {shot: one.shots[shot] for shot in some})
    counts = {
        form: sum(len(load_plan(sweep).first()) for sweep in one.sweeps(form).values()) for form in ("full", "coarse")
    }
    assert counts["full"] == counts["coarse"] >= len(one.shots)


def test_the_sets_hold_what_they_should():
    taylor = Experiments("taylor")
    assert len(taylor.shots) >= 12
    assert len({values["bodies.bar.material"] for values in taylor.shots.values()}) >= 3
    verdict = [m.value for m in Experiments("shield").measured]
    assert min(verdict.count(1.0), verdict.count(0.0)) >= 12


def test_a_shield_with_cloth_is_judged_by_the_curve_of_its_own():
    # B290: the critical diameter of `test_measure_correlations`, whose mass of cloth is 1 % more
    assert ratio(load_case("validation/shield_stuffed/case")) == pytest.approx(9.5 / 11.47, rel=0.01)


def test_bias_scatter_and_worst_by_hand():
    rows = [row("a", 10.0, 11.0), row("b", 10.0, 9.8), row("c", 10.0, 30.0, judged=False)]
    (found,) = verdicts(rows, {"length": Criteria(mean=0.07, worst=0.09)})
    assert (found.mean, found.worst, found.worst_shot) == (pytest.approx(0.06), pytest.approx(0.1), "a")
    assert found.bias == pytest.approx(0.04)
    assert found.scatter == pytest.approx(0.12 / 2**0.5)
    assert found.passed is False
    (found,) = verdicts(rows, {"length": Criteria(mean=0.06 + 1e-9, worst=0.11)})
    assert found.passed is True


def test_a_shot_without_a_value_fails_its_criteria():
    rows = [row("a", 10.0, 10.0), row("b", 10.0, None, reason="failed")]
    (found,) = verdicts(rows, {"length": Criteria(mean=0.1)})
    assert found.shots == (2, 1)
    assert found.passed is False
    assert verdicts(rows, {})[0].passed is None


def test_a_shot_that_has_not_been_computed_leaves_all_open():
    rows = [row("a", 10.0, 10.0), row("b", 10.0, None, reason="waiting")]
    (found,) = verdicts(rows, {"length": Criteria(mean=0.1)})
    assert (found.shots, found.mean, found.passed) == ((2, 1), 0.0, None)
    assert verdicts([row("a", 10.0, 12.0), rows[1]], {"length": Criteria(worst=0.1)})[0].passed is False


def test_verdicts_count_what_is_undecided_as_wrong():
    def shot(name, measured, computed, ratio):
        return row(name, measured, computed, quantity="perforated", unit="-", ratio=ratio)

    rows = [shot("a", 1.0, 1.0, 1.4), shot("b", 0.0, 1.0, 0.95), shot("c", 0.0, None, 0.5), shot("d", 0.0, 0.0, 0.6)]
    (found,) = verdicts(rows, {"perforated": Criteria(right=0.5, wrong_within=0.1)})
    assert found.right == 0.5
    assert found.farthest == pytest.approx(0.05)
    assert found.passed is True
    assert verdicts(rows, {"perforated": Criteria(right=0.5, wrong_within=0.04)})[0].passed is False


def test_values_within_bounds_in_their_unit():
    rows = [row("a", 7.2, 7.05)]
    assert verdicts(rows, {"length": Criteria(between=(7.0, 7.2))})[0].passed
    assert not verdicts(rows, {"length": Criteria(between=(7.1, 7.2))})[0].passed
    assert verdicts(rows, {"length": Criteria(within=0.2)})[0].passed
    assert not verdicts(rows, {"length": Criteria(within=0.1)})[0].passed


def test_results_are_read_as_they_were_stored(tmp_path):
    rows = [row("a", 10.0, 11.0), row("b", 10.0, None, reason="failed", ratio=1.25)]
    result = SetResult(
        "j2", 8.0, rows, {"a": {"status": "done", "wall_seconds": 1.5, "message": ""}}, {"line": [[1.0, 2.0]]}
    )
    store(result, tmp_path)
    again = stored(tmp_path, "j2", 8.0)
    assert again == result
    assert stored(tmp_path, "j2", 9.0) is None


def test_what_is_no_set_is_named():
    with pytest.raises(CaseError, match="did you mean 'taylor'"):
        Experiments("tailor")
    assert call("j2", "--coarse", "--second-resolution").exit_code == 2
    assert json.loads(call("--json").stdout)[0]["name"] == NAMES[0]


def test_what_was_not_computed_is_told(tmp_path):
    for arguments, said in (
        (("j2", "--table"), "nothing of j2 with 40 particles across was begun"),
        (("--table",), "name a set"),
        (("--only", "failed"), "name a set"),
    ):
        result = call(*arguments, "--out", tmp_path)
        assert result.exit_code == 2
        assert said in str(result.exception) + result.output
    page = tmp_path / "page.md"
    result = call("--all", "--table", "--out", tmp_path, "--page", page)
    assert result.exit_code == 0
    assert result.output.count("was begun in") == len(NAMES)
    assert not list((tmp_path / "page").glob("*.json"))  # nothing that was not computed is stored


@pytest.mark.parametrize("name", ["j2", "melt", "cloud"])
def test_coarse_form(name, tmp_path):
    """All goes through: the sweep, the evaluator, the page; the same command computes nothing again."""
    where = ("--coarse", "--workers", 1, "--threads", 1, "--out", tmp_path)
    first = call(name, *where, "--quiet", "--page", tmp_path / "page.md")
    assert first.exit_code in (0, 1), first.output
    again = call(name, *where, "--table", "--json")
    (found,) = json.loads(again.stdout)
    assert all(one["status"] == "done" for one in found["shots"].values())
    judged = [one for one in found["rows"] if one["judged"]]
    assert all(one["computed"] is not None for one in judged)
    assert all(abs(one["off"]) < 0.5 for one in judged)  # coarse, yet of the right size
    assert (tmp_path / "page" / f"{name}.{found['across']:g}.json").is_file()


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in NAMES if name not in ("j2", "melt", "cloud")])
def test_coarse_form_of_the_larger_sets(name, tmp_path):
    done = call(name, "--coarse", "--out", tmp_path, "--quiet")
    assert done.exit_code in (0, 1), done.output


def test_the_page_draws_what_was_stored(tmp_path):
    kept = Path(__file__).parents[1] / "docs/validation"
    result = stored(kept, "taylor", Experiments("taylor").particles("full"))
    assert result is not None
    text = write_page(tmp_path / "page.md", [result]).read_text(encoding="utf-8")
    assert "final length over initial" in text
    assert "Not computed yet" in text
    assert (tmp_path / "page" / "taylor.outlines.png").stat().st_size > 10_000


def test_fragments_have_share_place_speed_and_the_power_of_their_masses():
    """Cubes of a target of spacing 1 that fly apart as their mass to the power -1/6; the largest from behind."""
    from types import SimpleNamespace

    from hvisph_validation.evaluators.fragments import _fragments

    lattice = np.stack(np.meshgrid(*[np.arange(-8.0, 9.0)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    corners = {(4, -2, -2): 5, (-6, -6, -6): 3, (-6, 4, 4): 2}  # lowest corner and particles along an edge
    damage, velocity = np.ones(len(lattice)), np.zeros_like(lattice)
    for low, size in corners.items():
        inside = ((lattice >= low) & (lattice < np.add(low, size))).all(axis=1)
        damage[inside], velocity[inside, 1] = 0.0, 10.0 * float(size**3) ** (-1 / 6)
    fields = {"position": lattice, "velocity": velocity, "damage": damage, "mass": np.ones(len(lattice))}
    start = SimpleNamespace(count=len(lattice), id=np.arange(len(lattice)), body=np.ones(len(lattice)), fields=fields)
    turned = np.arange(len(lattice))[::-1]  # particles in another order, somewhere else
    end = SimpleNamespace(count=len(lattice), id=turned, body=start.body,
                          fields={name: values[turned] for name, values in fields.items()} | {"position": lattice[turned] + 7.0})  # fmt: skip
    found = _fragments(SimpleNamespace(ran=SimpleNamespace(first=start, last=end, dx=1.0)))
    assert found["largest_fragment"] == pytest.approx(125 / len(lattice))
    assert found["largest_place"] == pytest.approx(6.0 / (8.0 * 3**0.5))
    assert found["largest_speed"] == pytest.approx(10.0 * 125 ** (-1 / 6))
    assert found["speed_power"] == pytest.approx(-1 / 6)


def test_the_middle_of_a_wide_bracket_is_no_limit(monkeypatch):
    from hvisph_validation.evaluators import limit

    def told(points):
        monkeypatch.setattr(limit, "_speeds", lambda shots: {"plate": points})
        return limit.EVALUATOR.computed([])["plate"]["ballistic_limit", None]

    assert told([(180.0, False, 0.0), (400.0, True, 250.0)]).value is None
    assert told([(270.0, False, 0.0), (290.0, True, 90.0)]).value == 280.0
    assert "no shot went through" in told([(270.0, False, 0.0)]).reason
