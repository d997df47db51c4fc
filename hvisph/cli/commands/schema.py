"""`hvisph schema`: the JSON schemas of the case file and of the summary, for editors and programs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hvisph.cli.text.echo import say
from hvisph.core.errors import CaseError, OutputError, suggest_nearest

NAMES = ("case", "summary", "sweep")


def schema(
    name: Annotated[
        str | None,
        typer.Argument(metavar="[case|summary|sweep]", help="Schema to print or write; case unless given."),
    ] = None,
    write: Annotated[
        Path | None, typer.Option("--write", metavar="DIR", help="Write the schema, or all, into a folder.")
    ] = None,
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
    try:
        write.mkdir(parents=True, exist_ok=True)
        for file, text in texts.items():
            (write / file).write_text(text, encoding="utf-8")
            say(str(write / file))
    except OSError as error:
        raise OutputError(f"cannot write {error.filename}: {(error.strerror or str(error)).lower()}") from error
