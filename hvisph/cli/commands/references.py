"""`hvisph correlations`, `exact` and `point`: results without a run."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hvisph.cli.formatting import echo_json, quantity, say, table
from hvisph.cli.guard import load, locate_errors
from hvisph.cli.options import CaseArgument, JsonOption, ResolutionOption, SetOption, argument, option
from hvisph.core.errors import CaseError, suggest_nearest
from hvisph.core.measure_catalogue import axis_unit

if TYPE_CHECKING:
    from hvisph.case.materials.material import Material


def correlations(
    case: CaseArgument, resolution: ResolutionOption = None, settings: SetOption = None, as_json: JsonOption = False
) -> None:
    """Evaluate the empirical correlations whose range covers a case: crater, hole, shields, soil, rock, explosives."""
    loaded = load(case, settings, resolution)
    from hvisph.precheck.correlation_input import correlations_of

    known, reason = correlations_of(loaded)
    if as_json:
        echo_json({"correlations": [asdict(one) for one in known], "reason": reason})
        return
    typer.echo(loaded.title or case)
    typer.echo(correlations_text([asdict(one) for one in known], reason))


def correlations_text(known: list[dict[str, object]], reason: str = "") -> str:
    """Return correlations in their plain form as text."""
    if not known:
        return f"no correlation holds here{f': {reason}' if reason else ': all are out of their range'}"
    lines = [("correlation", "", "", "")]
    for one in known:
        value = one["value"]
        assert isinstance(value, float)
        unit, factor = (str(one["unit"]), 1.0) if one["unit"] != "m" else axis_unit("mm", [value])
        what = f"{one['name']}: {one['quantity']}"
        lines.append((what, f"{factor * value:.2f} {unit}", str(one["text"]), str(one["source"])))
    return table(lines)


def exact(
    case: CaseArgument,
    out: Path | None = option("--out DIR", "Folder to write; exact/NAME unless given.", None),
    resolution: ResolutionOption = None,
    settings: SetOption = None,
    as_json: JsonOption = False,
) -> None:
    """Solve a 1D case exactly: histories at its gauges, profiles at its output times, pictures."""
    loaded = load(case, settings, resolution)
    from hvisph.casefile.paths import run_name
    from hvisph.postprocessing.exact_solution import exact_solution, write_exact

    with locate_errors(case):
        solution = exact_solution(loaded)
    folder = out or Path("exact") / run_name(case)
    files = write_exact(solution, loaded, folder)
    if as_json:
        gauges = {
            g.name: {"time": g.times.tolist()} | {c: g.values(c).tolist() for c in g.columns} for g in solution.gauges
        }
        echo_json({"folder": str(folder), "files": [path.name for path in files], "gauges": gauges})
        return
    say(loaded.title or case)
    kind = "barotropic layers" if solution.barotropic else "elastic-plastic plates"
    kind += f", waves down to {solution.tracked.weakest:.1g} of the strongest"
    say(f"exact: {kind}; {len(solution.tracked.fronts)} pieces of fronts")
    left_out = [name for name, gauge in loaded.gauges.items() if gauge.type == "fixed"]
    if left_out:
        say(f"left out, being fixed in space: {', '.join(left_out)}")
    say(f"{len(files)} files in {folder}")


_PATHS = "shear, uniaxial_strain, uniaxial_stress, cycle or rotation"


def point(
    subject: str = argument("CASE_OR_MATERIAL", "A material's name, or a case."),
    path: Annotated[str, typer.Option(help=f"Path of strain: {_PATHS}.")] = "uniaxial_stress",
    rate: float = option("--rate", "Strain rate [1/s].", 1e3),
    strain: float = option("--strain", "Final strain, negative in compression.", 0.2),
    steps: int = option("--steps", "Number of steps.", 400),
    body: str | None = option("--body", "Body of the case; the first unless given.", None),
    plot: Path | None = option("--plot FILE", "Draw stress and state into FILE.", None),
    as_json: JsonOption = False,
) -> None:
    """Integrate the stress update of a material point along a strain path."""
    from hvisph.setup.material_point import COLUMNS, drive
    from hvisph.setup.materials import material_of

    model = _material(subject, body)
    record = drive(material_of(model), path, rate, strain, steps)
    if as_json:
        echo_json(
            {"path": path, "rate": rate, "strain": record.strain.tolist()}
            | {name: record[name].tolist() for name in COLUMNS}
        )
    else:
        stress = "xy" if path in ("shear", "rotation") else "xx"
        rows: list[tuple[str, ...]] = [
            ("strain", f"stress {stress}", "von Mises", "pressure", "plastic strain", "damage", "temperature")
        ]
        for k in range(0, len(record.strain), max(1, steps // 10)):
            at = {name: float(record[name][k]) for name in COLUMNS}
            stresses = (quantity(at[name], "Pa") for name in (stress, "von_mises_stress", "pressure"))
            state = (f"{at['plastic_strain']:.4g}", f"{at['damage']:.3g}", f"{at['temperature']:.0f} K")
            rows.append((f"{record.strain[k]:.4g}", *stresses, *state))
        say(table(rows, indent=0))
    if plot is not None:
        from hvisph.postprocessing.material_sheet import point_picture

        say(f"wrote {point_picture(record, plot, f'{model.name}, {path}, {rate:g} 1/s')}", err=True)


def _material(subject: str, body: str | None) -> Material:
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
