"""Words that people try: help, suggestions, a look at a run that goes on."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

from hvisph.casefile.loader import load_case
from hvisph.casefile.search import search
from hvisph.casefile.spellings import spellings
from hvisph.cli.commands.run import sparkline
from hvisph.cli.main import app
from hvisph.core.errors import CaseError
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
     ("copper", "copper-ofhc"), ("Whipple", "docs/howto/shield.md"), ("Al2024", "aluminium-2024-t351"),
     ("weldox 460", "steel-weldox-460e"), ("bodies.projectile.shape", "cylinder"), ("paraview", "docs/howto/paraview.md"), ("al_al_coarse", "al_al_coarse"), ("animate", "hvisph animate")],
)  # fmt: skip
def test_words_are_found(word, found):
    text = said("help", word)
    assert found in text
    assert max(map(len, text.splitlines())) <= 100


FIRST = {
    "kevlar": "kevlar-129", "paraview": "docs/howto/paraview.md", "resume": "hvisph resume", "explosive": "eos.type: jwl",
    "convergence": "docs/howto/convergence.md", "oblique": "shapes/oblique", "ogive": "shape.type: ogive", "symmetry": "symmetry",
    "crater": "crater_diameter", "hole diameter": "layer.hole_diameter", "whipple": "shapes/whipple_shield",
}  # fmt: skip


def test_the_right_place_comes_first():
    """Subjects are words that are no names here; what they lead to must exist."""
    commands = [(name, "") for name in ("ballistic-limit", "check", "resume", "sweep", "converge", "correlations")]
    for word, place in (spellings("subjects") | FIRST).items():
        assert search(word, commands)[0].name.endswith(place) or place in search(word, commands)[0].name, word
    assert len(spellings("subjects") | FIRST) >= 30


def test_a_unit_without_a_power_sign_suggests_the_one_meant():
    with pytest.raises(CaseError, match="did you mean 'g/mm\\^3'"):
        load_case("quickstart", ["bodies.plate.material.density=2.7 g/mm3"])


@pytest.mark.parametrize(
    ("path", "part"),
    [("bodies.shape", "cylinder:"), ("bodies.NAME.shape", "cylinder:"), ("bodies.shape.diameter", "Diameter"),
     ("measures.residual_velocity", "[m/s]"), ("bodies.target.material.eos", "mie_gruneisen:")],
)  # fmt: skip
def test_places_are_explained_as_the_pages_write_them(path, part):
    assert part in said("help", path)


def test_words_that_are_not_there_say_what_is_near():
    assert "similar" in said("help", "residual_velocty", code=2)
    assert "Usage" in said("help")


@pytest.mark.parametrize(
    ("tried", "meant"), [("view", "report"), ("picture", "plot"), ("movie", "animate"), ("mesure", "measure")]
)
def test_unknown_commands_suggest(tried, meant):
    assert f"did you mean '{meant}'" in said(tried, code=2)


def test_a_run_can_be_watched_and_resuming_its_end_says_so(tmp_path):
    case = load_case("al_al_coarse", ["time.end=0.6us", "output.every=1us"], "0.5 mm")  # every beyond the end
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


def test_tables_fit_a_screen():
    from hvisph.cli.formatting import SCREEN, table, tables

    long = [["name", "value", "remark"], ["one", "1", "words " * 40], ["two", "2", "short"]]
    shown = table(long).splitlines()
    assert max(map(len, shown)) <= SCREEN
    assert " ".join(line.strip() for line in shown).count("words") == 40
    wide = [["run", *(f"measure {k}" for k in range(30))], ["a", *(str(k) for k in range(30))]]
    blocks = tables(wide).split("\n\n")
    assert max(len(line) for block in blocks for line in block.splitlines()) <= SCREEN
    assert all(block.splitlines()[1].split()[0] == "a" for block in blocks)
    assert [cell for block in blocks for cell in block.splitlines()[1].split()[1:]] == [str(k) for k in range(30)]
    apart = [["layer", "a" * 60, "b" * 65, "c" * 60], ["hole", "1", "2", "3"]]  # no two columns beside each other
    assert len(table(apart).split("\n\n")) == 3


def test_what_commands_print_fits_a_screen(tmp_path):
    """Sheets of materials, fragments in 3D, histories of measures, runs side by side: 100 columns."""
    settings = [
        "time.end=0.4us",
        "output.every=0.2us",
        "symmetry=[{axis: y}, {axis: z}]",
        "formulation={type: eulerian}",
    ]
    shot = str(run(load_case("sphere_on_plate", settings, "0.7 mm"), tmp_path / "a_run_of_a_long_name").folder)
    for arguments in (
        ["measure", shot, "--fragments"], ["measure", shot, "--at", "all"], ["compare", shot, shot, "--all"], ["measure", shot],
        ["check", "al_al_coarse"], ["materials"], ["cases"],
        *(["materials", name] for name in ("iron-armco", "basalt", "alumina-ad995", "titanium-ti-6al-4v", "copper-etp")),
    ):  # fmt: skip
        lines = said(*arguments).splitlines()
        wide = [line for line in lines if len(line) > 100 and not line.startswith("warning: ")]  # sentences run on
        assert not wide, arguments


def test_many_columns_go_on_below():
    from hvisph.cli.formatting import table

    rows = [["", *(f"column {k}" for k in range(30))], *([str(j), *["1.25"] * 30] for j in range(3))]
    text = table(rows)
    assert max(map(len, text.splitlines())) <= 100
    assert all(f"column {k}" in text for k in range(30))
    assert text.count("  2  ") >= 3


def test_shapes_within_shapes_are_not_listed():
    found = [
        line for line in CliRunner().invoke(app, ["help", "sphere"]).stdout.splitlines() if line.startswith("value")
    ]
    assert [line.split()[1:3] for line in found[:2]] == [["bodies.NAME.shape.type:", "sphere"],
                                                         ["bodies.NAME.shape.type:", "hollow_sphere"]]  # fmt: skip
    assert not any("parts" in line for line in found)


def test_an_error_in_a_material_of_its_own_file_names_key_and_line(tmp_path):
    (tmp_path / "own.yaml").write_text(
        "density: 7850\neos: {type: mie_gruneisen, sound_speed: 4570, slope: 1.49, gamma: 2}\n"
    )
    (tmp_path / "case.yaml").write_text(
        "kinematics: axisymmetric\nresolution: 1 mm\nmaterials: [own.yaml]\ntime: {end: 1 us}\n"
        "bodies: {shot: {material: own, shape: {type: sphere, diameter: 9 mm}}}\n"
    )
    found = CliRunner().invoke(app, ["check", str(tmp_path / "case.yaml")])
    assert found.exit_code == 2
    assert "eos.slope: unknown key; give 's1'" in found.stderr
    assert "own.yaml, line 2" in found.stderr
