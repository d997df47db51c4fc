"""`hvisph explain` and `hvisph help`: one place of the case file, or what a word means wherever it stands."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

import typer

from hvisph.cli.text.echo import say


def explain(
    context: typer.Context,
    path: Annotated[
        str,
        typer.Argument(metavar="PATH", help="Place in the case file, such as time.cfl, or any word; empty for all."),
    ] = "",
) -> None:
    """Say what may stand at a place of the case file, or where a word stands."""
    from hvisph.casefile.explain import explain as explain_path
    from hvisph.cli.text.formatting import paragraph
    from hvisph.core.errors import CaseError

    try:
        lines = explain_path(path).splitlines()
    except CaseError as error:
        text = _places(path, _commands(context)) if len(path) > 1 else ""
        if not text:
            raise error from None
        say(text)
        return
    say("\n".join(paragraph(line.strip(), len(line) - len(line.lstrip()), 6) if line.strip() else "" for line in lines))


def help(
    context: typer.Context,
    word: Annotated[
        str, typer.Argument(metavar="[WORD]", help="A key, value, measure, material, case, page, command; any word.")
    ] = "",
) -> None:
    """Find a word among keys, values, measures, materials, cases, pages of the documentation and commands."""
    if not word or context.parent is None:
        say((context.parent or context).get_help())
        return
    from hvisph.casefile.explain import explain as explain_path
    from hvisph.casefile.search import nearest_names
    from hvisph.core.errors import CaseError

    commands = _commands(context)
    text = _places(word, commands)
    if not text:
        try:
            text = explain_path(word)
        except CaseError:
            close = nearest_names(word, commands)
            near = f"; near it: {', '.join(close)}" if close else ""
            raise CaseError(f"nothing here is called '{word[:64]}'{near}") from None
    say(text)


def _commands(context: typer.Context) -> list[tuple[str, str]]:
    """Return the names of all commands and what they do."""
    group = context.parent.command if context.parent is not None else None
    names = getattr(group, "commands", {})
    return [(name, (one.help or "").strip().splitlines()[0]) for name, one in names.items()]


def _places(word: str, commands: Sequence[tuple[str, str]]) -> str:
    """Return where a word stands, as a table; empty where nowhere."""
    from hvisph.casefile.search import search
    from hvisph.cli.text.formatting import table

    places = search(word, commands)
    keys = [one.name for one in places if one.kind == "key"]
    text = table([[one.kind, one.name, _short(one.text)] for one in places], indent=0)
    return text + (f"\n\nmore: hvisph explain {keys[0]}" if keys else "")


def _short(text: str, most: int = 160) -> str:
    line = " ".join(text.split())
    return line if len(line) <= most else f"{line[: most - 3]}..."
