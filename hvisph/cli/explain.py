"""`hvisph explain`: one place of the case file, from the models themselves."""

from __future__ import annotations

from typing import Annotated

import typer

from hvisph.cli.say import say


def explain(
    path: Annotated[
        str, typer.Argument(metavar="PATH", help="Place in the case file, such as time.cfl; empty for all.")
    ] = "",
) -> None:
    """Say what may stand at a place of the case file."""
    from hvisph.casefile.explain import explain as explain_path

    say(explain_path(path))
