"""`hvisph help`: description of a key, or search of a word."""

from collections.abc import Sequence
from typing import Annotated

import typer

from hvisph.cli.options import argument
from hvisph.cli.text.formatting import paragraph, say, table
from hvisph.core.errors import CaseError


def help(
    context: typer.Context,
    words: Annotated[
        list[str] | None,
        argument(
            "[WORD]...",
            "Place in the case file, such as time.cfl; or a value, measure, material, case, page, command, words.",
        ),
    ] = None,
) -> None:
    """Describe a key of the case file, or find a word in keys, values, measures, materials, cases, pages, commands."""
    word = " ".join(words or ())
    if not word or context.parent is None:
        say((context.parent or context).get_help())
        return
    from hvisph.casefile.manual import explain
    from hvisph.casefile.search import nearest_names

    commands, texts = _commands(context), []
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


def _commands(context: typer.Context) -> list[tuple[str, str]]:
    """Return the names of all commands with their descriptions."""
    group = context.parent.command if context.parent is not None else None
    names = getattr(group, "commands", {})
    return [(name, (one.help or "").strip().splitlines()[0]) for name, one in names.items()]


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
