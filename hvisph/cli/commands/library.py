"""`hvisph help`, `cases`, `materials` and `schema`: contents of the package."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from hvisph.cli.formatting import echo_json, paragraph, quantity, say, table
from hvisph.cli.options import JsonOption, argument, option
from hvisph.core.errors import CaseError, suggest_nearest
from hvisph.output.atomic_write import write_errors

if TYPE_CHECKING:
    from hvisph.case.materials.material import Material
    from hvisph.casefile.material_library import Library


def cases(
    name: str | None = argument("NAME", "Case to print; all cases are listed unless given.", None),
    copy: Path | None = option("--copy DIR", "Copy the case, or all, into a folder.", None),
    as_json: JsonOption = False,
) -> None:
    """List the bundled cases, print one, or copy them."""
    from hvisph.casefile.paths import bundled_cases

    files = bundled_cases()
    if name is not None:
        if name not in files:
            raise CaseError(f"there is no bundled case '{name[:200]}'{suggest_nearest(name[:200], list(files))}")
        files = {name: files[name]}
    if copy is not None:
        _copy(files, copy)
    elif name is not None and not as_json:
        say(files[name].read_text(encoding="utf-8"), nl=False)
    else:
        _list(files, as_json)


def _list(files: dict[str, Path], as_json: bool) -> None:
    from hvisph.casefile.loader import load_case

    loaded = {name: load_case(path) for name, path in files.items()}
    if as_json:
        echo_json(
            [
                {"name": name, "title": case.title, "source": case.source, "path": str(files[name])}
                for name, case in loaded.items()
            ]
        )
    else:
        say(table([(name, case.title) for name, case in loaded.items()], indent=0, cut=True))


def _copy(files: dict[str, Path], folder: Path) -> None:
    targets = {path: folder / f"{name}.yaml" for name, path in files.items()}
    there = [target for target in targets.values() if target.exists()]
    if there:
        raise CaseError(f"{there[0]} exists; nothing was copied", where="--copy")
    for path, target in targets.items():
        with write_errors(target):
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(path.read_bytes())
        say(str(target))


def materials(
    name: str | None = argument("NAME", "Material to print; all materials are listed unless given.", None),
    plot: Path | None = option("--plot FILE", "Draw Hugoniot, release and strength of NAME into FILE.", None),
    compare: list[str] | None = option("--compare OTHER", "Compare with another material. Repeatable.", None),
    own: list[Path] | None = option("--file FILE", "File or folder of your own materials.", None),
    as_json: JsonOption = False,
) -> None:
    """List the material library, or print one material with its numbers, sources and derived values."""
    from hvisph.casefile.material_library import library_of

    known = library_of(tuple(own or ()))
    if name is None:
        if plot or compare:
            raise CaseError("--plot and --compare need the name of a material")
        loaded = {key: known.load(key) for key in known.names()}
        if as_json:
            echo_json([material.model_dump(mode="json") for material in loaded.values()])
            return
        rows = [("name", "kg/m^3", "equation of state", "strength", "damage")]
        for key, material in loaded.items():
            rows.append((key, f"{material.density:g}", material.eos.type, material.strength.type, material.damage.type))
        say(table(rows, indent=0))
        return
    names = [known.name_of(each) for each in (name, *(compare or ()))]
    models = [known.load(each) for each in names]
    if as_json:
        shown = [model.model_dump(mode="json") for model in models]
        echo_json(shown[0] if len(shown) == 1 else shown)
    elif compare:
        say(_comparison(models))
    else:
        say(_sheet(known, names[0], models[0]))
    if plot is not None:
        from hvisph.postprocessing.material_sheet import picture

        say(f"wrote {picture(models, plot, known.notes(names[0]))}", err=True)


def _sheet(known: Library, name: str, model: Material) -> str:
    """Return numbers, sources and derived properties as text."""
    from hvisph.casefile.document import dump
    from hvisph.casefile.material_library import CONFIDENCE
    from hvisph.postprocessing.material_sheet import compare_hugoniot, derive_properties, hugoniot, worst_bin

    notes = known.notes(name)
    left = {"name", "source"} if notes.sources else {"name"}  # sources of the numbers are listed below
    lines = ["# SI units", dump(model.model_dump(mode="json", exclude=left), width=80).rstrip()]
    if notes.aliases:
        lines.append(f"# also called {', '.join(notes.aliases)}")
    if notes.note:
        lines += [f"# {line[2:]}" for line in paragraph(notes.note, indent=2).splitlines()]
    if notes.sources:
        lines += ["", "sources of the numbers"]
        for source in notes.sources:
            doubt = CONFIDENCE[source.confidence]
            text = f"{', '.join(source.of)}: {source.text}{f' [{doubt}]' if doubt else ''}"
            lines.append(paragraph(text, indent=2, hanging=4))
    lines += ["", "what follows from them"]
    lines.append(table([(key, quantity(value, unit)) for key, (value, unit) in derive_properties(model).items()]))
    rows = hugoniot(model)
    if rows:
        lines += ["", "behind shocks, without strength"]
        shown = [("up", "Us", "pressure", "density", "temperature")]
        for u, speed, pressure, density, heat in rows:
            kelvin = f"{heat:.0f} K" if heat == heat else "unknown"
            shown.append((f"{u:g} m/s", f"{speed:.0f} m/s", quantity(pressure, "Pa"), f"{density:.0f} kg/m^3", kelvin))
        lines.append(table(shown))
    for points, whose in notes.hugoniot_points:
        beside = compare_hugoniot(model, points)
        if beside:
            words = (
                f"{whose} from {beside[0][0]:g} to {beside[-1][0]:g} m/s: the speed of its last wave is "
                f"{_format_deviation(beside)}"
            )
            if model.strength.type != "none":
                fluid = compare_hugoniot(model, points, strength=False)
                words += f"; without its strength {_format_deviation(fluid)}"
            bins = worst_bin(beside) if points == notes.hugoniot else None
            if bins is not None:
                off, where, scatter = bins
                words += (
                    f". In bins of five points it is {off:+.1f} % off at most, at {where:.0f} m/s; single "
                    f"points scatter by {scatter:.1f} % about the mean of theirs"
                )
            lines += ["", paragraph(words)]
    if notes.shocks:
        low, high = notes.shocks
        other = f"; beyond take {notes.beyond}" if notes.beyond else ""
        lines += [
            "",
            paragraph(f"within 2 % of measured shocks from {low:g} to {high:g} m/s of particle velocity{other}"),
        ]
    elif notes.beyond:
        lines += ["", paragraph(f"within 2 % of measured shocks nowhere; for shocks take {notes.beyond}")]
    return "\n".join(lines)


def _format_deviation(beside: Sequence[tuple[float, float, float]]) -> str:
    """Return how far shock speeds are off measured ones, in words."""
    apart = [100.0 * (ours / measured - 1.0) for _, measured, ours in beside]
    if not apart:
        return "unknown"
    spread = (sum(value**2 for value in apart) / len(apart)) ** 0.5
    mean = sum(apart) / len(apart)
    return f"{mean:+.1f} % off in the mean, {spread:.1f} % in root mean square, {max(apart, key=abs):+.1f} % at most"


def _comparison(models: list[Material]) -> str:
    """Return materials in columns: models, then derived properties."""
    from hvisph.postprocessing.material_sheet import derive_properties

    columns = [derive_properties(model) for model in models]
    rows = [("", *(model.name for model in models))]
    rows.append(("density", *(f"{model.density:g} kg/m^3" for model in models)))
    rows += [(part, *(getattr(model, part).type for model in models)) for part in ("eos", "strength", "damage")]
    keys = dict.fromkeys(key for each in columns for key in each)
    rows += [(key, *(quantity(*each[key]) if key in each else "" for each in columns)) for key in keys]
    return table(rows, indent=0)


NAMES = ("case", "summary", "sweep")


def schema(
    name: str | None = argument("[case|summary|sweep]", "Schema to print or write; case unless given.", None),
    write: Path | None = option("--write DIR", "Write the schema, or all, into a folder.", None),
) -> None:
    """Print a JSON schema, or write them into a folder."""
    from hvisph.casefile.paths import data_folder

    if name is not None and name not in NAMES:
        raise CaseError(f"unknown schema '{name[:64]}'{suggest_nearest(name[:64], NAMES)}")
    chosen = [f"{each}.schema.json" for each in (NAMES if name is None and write else (name or "case",))]
    texts = {file: (data_folder("schemas") / file).read_text(encoding="utf-8") for file in chosen}
    if write is None:
        say(texts[chosen[0]], nl=False)
        return
    for file, text in texts.items():
        with write_errors(write / file):
            write.mkdir(parents=True, exist_ok=True)
            (write / file).write_text(text, encoding="utf-8")
        say(str(write / file))


def help(
    context: typer.Context,
    words: list[str] | None = argument(
        "[WORD]...",
        "Place in the case file, such as time.cfl; or a value, measure, material, case, page, command, words.",
        None,
    ),
) -> None:
    """Describe a key of the case file, or find a word in keys, values, measures, materials, cases, pages, commands."""
    word = " ".join(words or ())
    if not word or context.parent is None:
        say((context.parent or context).get_help())
        return
    from hvisph.casefile.manual import explain
    from hvisph.casefile.search import nearest_names

    known = getattr(context.parent.command, "commands", {})
    commands, texts = [(name, (one.help or "").strip().splitlines()[0]) for name, one in known.items()], []
    try:
        lines = explain("" if word == "case" else word).splitlines()
    except CaseError as error:
        unknown = error
    else:
        texts = [
            "\n".join(paragraph(line.strip(), len(line) - len(line.lstrip()), 6) for line in lines if line.strip())
        ]
    if not texts or "." not in word:
        texts += filter(None, [_places(word, commands)])
    if not texts and "." in word:
        raise unknown
    if not texts:
        close = nearest_names(word, commands)
        near = f"; similar: {', '.join(close)}" if close else ""
        raise CaseError(f"nothing is called '{word[:64]}'{near}")
    say("\n\n".join(texts))


def _places(word: str, commands: Sequence[tuple[str, str]]) -> str:
    """Return the places of a word as a table; empty without any."""
    from hvisph.casefile.search import search

    places = search(word, commands)
    keys = [one.name.replace(".type: ", ".") for one in places if one.kind in ("key", "value")]
    text = table([[one.kind, one.name, _short(one.text)] for one in places], indent=0)
    return text + (f"\n\nmore: hvisph help {keys[0]}" if keys else "")


def _short(text: str, most: int = 160) -> str:
    line = " ".join(text.split())
    return line if len(line) <= most else f"{line[: most - 3]}..."
