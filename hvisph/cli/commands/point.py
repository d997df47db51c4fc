"""`hvisph point`: stress update of a material point along a strain path."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from hvisph.cli.options import JsonOption
from hvisph.cli.text.echo import say
from hvisph.cli.text.formatting import echo_json, quantity, table
from hvisph.core.errors import CaseError, suggest_nearest

_PATHS = "shear, uniaxial_strain, uniaxial_stress, cycle or rotation"


def point(
    subject: Annotated[str, typer.Argument(metavar="CASE_OR_MATERIAL", help="A material's name, or a case.")],
    path: Annotated[str, typer.Option(help=f"Path of strain: {_PATHS}.")] = "uniaxial_stress",
    rate: Annotated[float, typer.Option(help="Strain rate [1/s].")] = 1e3,
    strain: Annotated[float, typer.Option(help="Final strain, negative in compression.")] = 0.2,
    steps: Annotated[int, typer.Option(help="Number of steps.")] = 400,
    body: Annotated[str | None, typer.Option(help="Body of the case; the first unless given.")] = None,
    plot: Annotated[Path | None, typer.Option(metavar="FILE", help="Draw stress and state into FILE.")] = None,
    as_json: JsonOption = False,
) -> None:
    """Integrate the stress update of a material point along a strain path."""
    from hvisph.setup.material_point import COLUMNS, drive
    from hvisph.setup.materials import material_of

    model = _material(subject, body)
    record = drive(material_of(model), path, rate, strain, steps)
    if as_json:
        echo_json({"path": path, "rate": rate, "strain": record.strain.tolist()}
                  | {name: record[name].tolist() for name in COLUMNS})  # fmt: skip
    else:
        stress = "xy" if path in ("shear", "rotation") else "xx"
        rows = [("strain", f"stress {stress}", "von Mises", "pressure", "plastic strain", "damage", "temperature")]
        for k in range(0, len(record.strain), max(1, steps // 10)):
            at = {name: float(record[name][k]) for name in COLUMNS}
            rows.append((f"{record.strain[k]:.4g}", quantity(at[stress], "Pa"), quantity(at["von_mises_stress"], "Pa"),
                         quantity(at["pressure"], "Pa"), f"{at['plastic_strain']:.4g}", f"{at['damage']:.3g}",
                         f"{at['temperature']:.0f} K"))  # fmt: skip
        say(table(rows, indent=0))
    if plot is not None:
        from hvisph.postprocessing.material_sheet import point_picture

        say(f"wrote {point_picture(record, plot, f'{model.name}, {path}, {rate:g} 1/s')}", err=True)


def _material(subject: str, body: str | None) -> Any:
    """Return the material of a name, or of a body of a case."""
    from hvisph.casefile.loader import load_case
    from hvisph.casefile.material_library import library_of

    try:
        return library_of().load(subject)
    except CaseError as error:
        try:
            case = load_case(subject)
        except CaseError:
            if Path(subject).suffix:
                raise
            raise CaseError(error.message) from None
    name = body or next(iter(case.bodies))
    if name not in case.bodies:
        raise CaseError(f"unknown body '{name[:64]}'{suggest_nearest(name, list(case.bodies))}", where="--body")
    return case.bodies[name].material
