"""`hvisph explain`: one place of the case file, from the models themselves."""

from __future__ import annotations

from typing import Annotated

import typer


def explain(
    path: Annotated[
        str, typer.Argument(metavar="PATH", help="Place in the case file, such as time.cfl; empty for all.")
    ] = "",
) -> None:
    """Say what may stand at a place of the case file."""
    from hvisph.casefile.explain import explain as explain_path

    typer.echo(explain_path(path))
