"""`hvisph materials`: the material library."""

from __future__ import annotations

from typing import Annotated

import typer

from hvisph.cli.options import JsonOption
from hvisph.cli.say import say


def materials(
    name: Annotated[
        str | None, typer.Argument(metavar="NAME", help="Material to print; all are listed unless given.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """List the material library, or print one material."""
    from hvisph.casefile.loader import library, load_material
    from hvisph.casefile.yaml_text import dump
    from hvisph.cli.words import echo_json, table

    if name is not None:
        found = load_material(name).model_dump(mode="json")
        if as_json:
            echo_json(found)
        else:
            say("# SI units")
            say(dump(found), nl=False)
        return
    known = library()
    if as_json:
        echo_json([material.model_dump(mode="json") for material in known.values()])
        return
    rows = [("name", "kg/m^3", "equation of state", "strength", "damage")]
    for key, material in known.items():
        models = (material.eos.type, material.strength.type, material.damage.type)
        rows.append((key, f"{material.density:g}", *models))
    say(table(rows, indent=0))
