"""`hvisph help`, `cases` and `schema`: contents of the package."""

from collections.abc import Sequence
from pathlib import Path

import typer

from hvisph.casefile.loader import load_case
from hvisph.casefile.manual import explain
from hvisph.casefile.paths import bundled_cases, data_folder
from hvisph.casefile.search import nearest_names, search
from hvisph.cli.formatting import echo_json, paragraph, say, table
from hvisph.cli.main import COMMANDS
from hvisph.cli.options import JsonOption, argument, option
from hvisph.core.errors import CaseError, suggest_nearest
from hvisph.core.text import shorten
from hvisph.output.atomic_write import write_errors


def cases(
    name: str | None = argument("NAME", "Case to print; all cases are listed unless given.", None),
    copy: Path | None = option("--copy DIR", "Copy the case, or all, into a folder.", None),
    as_json: JsonOption = False,
) -> None:
    """List the bundled cases, print one, or copy them."""
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
    loaded = {name: load_case(path) for name, path in files.items()}
    if as_json:
        echo_json(
            [
                {"name": name, "title": case.title, "source": case.source, "path": str(files[name])}
                for name, case in loaded.items()
            ]
        )
    else:
        say(table([(name, case.title) for name, case in loaded.items()], indent=0))


def _copy(files: dict[str, Path], folder: Path) -> None:
    targets = {path: folder / f"{name}.yaml" for name, path in files.items()}
    existing = [target for target in targets.values() if target.exists()]
    if existing:
        raise CaseError(f"{existing[0]} exists; nothing was copied", where="--copy")
    for path, target in targets.items():
        with write_errors(target):
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(path.read_bytes())
        say(str(target))


NAMES = ("case", "summary", "sweep")


def schema(
    name: str | None = argument("[case|summary|sweep]", "Schema to print or write; case unless given.", None),
    write: Path | None = option("--write DIR", "Write the schema, or all, into a folder.", None),
) -> None:
    """Print a JSON schema, or write them into a folder."""
    if name is not None and name not in NAMES:
        raise CaseError(f"unknown schema '{name[:64]}'{suggest_nearest(name[:64], NAMES)}")
    files = [f"{schema_name}.schema.json" for schema_name in (NAMES if name is None and write else (name or "case",))]
    texts = {file: (data_folder("schemas") / file).read_text(encoding="utf-8") for file in files}
    if write is None:
        say(texts[files[0]], nl=False)
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
    commands, texts = [(name, line) for name, (_, line) in COMMANDS.items()], []
    try:
        lines = explain("" if word == "case" else word).splitlines()
    except CaseError as error:
        failure = error
    else:
        texts = [
            "\n".join(paragraph(line.strip(), len(line) - len(line.lstrip()), 6) for line in lines if line.strip())
        ]
    if not texts or "." not in word:
        texts += filter(None, [_places(word, commands)])
    if not texts and "." in word:
        raise failure
    if not texts:
        close = nearest_names(word, commands)
        similar = f"; similar: {', '.join(close)}" if close else ""
        raise CaseError(f"nothing is called '{word[:64]}'{similar}")
    say("\n\n".join(texts))


def _places(word: str, commands: Sequence[tuple[str, str]]) -> str:
    """Return the places of a word as a table; empty without any."""
    places = search(word, commands)
    keys = [place.name.replace(".type: ", ".") for place in places if place.kind in ("key", "value")]
    text = table([[place.kind, place.name, shorten(" ".join(place.text.split()), 160)] for place in places], indent=0)
    return text + (f"\n\nmore: hvisph help {keys[0]}" if keys else "")
