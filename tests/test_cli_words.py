"""Words that people try: help, suggestions, a look at a run that goes on."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

from hvisph.casefile.loader import load_case
from hvisph.cli.main import app
from hvisph.cli.watch import sparkline
from hvisph.simulation.run import run


def said(*arguments, code=0):
    """What a command prints."""
    result = CliRunner().invoke(app, list(arguments))
    assert result.exit_code == code, result.output
    return result.output


@pytest.mark.parametrize(
    ("word", "found"),
    [("jc", "strength.type: johnson_cook"), ("johnson_cook", "damage.type: johnson_cook"), ("cfl", "time.cfl"),
     ("residual_velocity", "measures.residual_velocity"), ("mirror", "symmetry"), ("bodies.shape", "bodies.NAME.shape"),
     ("copper", "copper-ofhc"), ("quickstart", "quickstart"), ("animate", "hvisph animate")],
)  # fmt: skip
def test_words_are_found(word, found):
    assert found in said("help", word)


def test_words_that_are_not_there_say_what_is_near():
    assert "near it" in said("help", "residual_velocty", code=2)
    assert "Usage" in said("help")


@pytest.mark.parametrize(
    ("tried", "meant"), [("view", "report"), ("picture", "plot"), ("movie", "animate"), ("mesure", "measure")]
)
def test_unknown_commands_suggest(tried, meant):
    assert f"did you mean '{meant}'" in said(tried, code=2)


def test_a_run_can_be_watched_and_resuming_its_end_says_so(tmp_path):
    case = load_case("quickstart", ["time.end=0.6us", "output.every=1us"], "0.5 mm")  # every beyond the end
    folder = run(case, tmp_path / "run").folder
    assert len(list(Path(folder, "snapshots").iterdir())) == 2
    text = said("watch", str(folder), "--once")
    assert "done" in text
    assert "kinetic_energy" in text
    assert "residual velocity" in text or "penetration" in text
    Path(folder, "summary.json").unlink()  # as while it goes on
    assert "running" in said("watch", str(folder), "--once")
    assert "has ended" not in said("resume", str(folder))
    assert "has ended" in said("resume", str(folder))


def test_sparklines_show_least_and_most():
    line = sparkline([0.0, 1.0, 2.0, 7.0])
    assert (line[0], line[-1]) == ("▁", "█")
    assert sparkline([float("nan")]) == ""
    assert len(sparkline(list(range(1000)))) <= 60
