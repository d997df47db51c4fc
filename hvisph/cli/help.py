"""`hvisph help WORD`: what a word means here, wherever it stands."""

from __future__ import annotations

from typing import Annotated

import typer


def help(
    context: typer.Context,
    word: Annotated[
        str, typer.Argument(metavar="[WORD]", help="A key, value, measure, material, case, command; any word.")
    ] = "",
) -> None:
    """Find a word among keys, values, measures, materials, cases and commands."""
    above = context.parent
    if not word or above is None:
        typer.echo((above or context).get_help())
        return
    from hvisph.casefile.search import nearest_names, search
    from hvisph.cli.words import table
    from hvisph.core.errors import CaseError

    group = above.command
    names = getattr(group, "commands", {})
    commands = [(name, (one.help or "").strip().splitlines()[0]) for name, one in names.items()]
    matches = search(word, commands)
    if not matches:
        close = nearest_names(word, commands)
        raise CaseError(f"nothing here is called '{word[:64]}'" + (f"; near it: {', '.join(close)}" if close else ""))
    typer.echo(table([[one.kind, one.name, _short(one.text)] for one in matches], indent=0))
    keys = [one.name for one in matches if one.kind == "key"]
    if keys:
        typer.echo(f"\nmore: hvisph explain {keys[0]}")


def _short(text: str, most: int = 100) -> str:
    line = " ".join(text.split())
    return line if len(line) <= most else f"{line[: most - 3]}..."
