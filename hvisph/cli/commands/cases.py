"""`hvisph cases`: list, print and copy the bundled cases."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hvisph.cli.options import JsonOption
from hvisph.cli.text.echo import say
from hvisph.cli.text.formatting import echo_json, table
from hvisph.core.errors import CaseError, OutputError, suggest_nearest


def cases(
    name: Annotated[
        str | None, typer.Argument(metavar="NAME", help="Case to print; all cases are listed unless given.")
    ] = None,
    copy: Annotated[
        Path | None,
        typer.Option("--copy", metavar="DIR", help="Copy the case, or all, into a folder."),
    ] = None,
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
    try:
        for path, target in targets.items():
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(path.read_bytes())
            say(str(target))
    except OSError as error:
        raise OutputError(f"cannot write {error.filename}: {(error.strerror or str(error)).lower()}") from error
