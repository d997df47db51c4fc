"""`hvisph correlations`, `exact`, `materials` and `point`: results without a run."""

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from hvisph.case.materials.material import Material
from hvisph.casefile.document import dump
from hvisph.casefile.loader import load_case
from hvisph.casefile.material_library import CONFIDENCE, Library, library_of
from hvisph.casefile.paths import run_name
from hvisph.cli import options
from hvisph.cli.formatting import echo_json, paragraph, quantity, say, table
from hvisph.cli.options import argument, option
from hvisph.core.errors import CaseError, suggest_nearest
from hvisph.core.measure_catalogue import axis_unit
from hvisph.postprocessing import material_sheet
from hvisph.postprocessing.exact_solution import exact_solution, write_exact
from hvisph.precheck.correlation_input import correlations_of
from hvisph.setup.material_point import COLUMNS, drive
from hvisph.setup.materials import material_of


def correlations(
    case: options.CaseArgument,
    resolution: options.ResolutionOption = None,
    settings: options.SetOption = None,
    as_json: options.JsonOption = False,
) -> None:
    """Evaluate the empirical correlations whose range covers a case: crater, hole, shields, soil, rock, explosives."""
    loaded = options.load(case, settings, resolution)
    valid, reason = correlations_of(loaded)
    if as_json:
        echo_json({"correlations": [asdict(correlation) for correlation in valid], "reason": reason})
        return
    typer.echo(loaded.title or case)
    typer.echo(correlations_text([asdict(correlation) for correlation in valid], reason))


def correlations_text(valid: list[dict[str, object]], reason: str = "") -> str:
    """Return correlations in their plain form as text."""
    if not valid:
        return f"no correlation holds here{f': {reason}' if reason else ': all are out of their range'}"
    lines = [("correlation", "", "", "")]
    for correlation in valid:
        value = correlation["value"]
        assert isinstance(value, float)
        unit, factor = (str(correlation["unit"]), 1.0) if correlation["unit"] != "m" else axis_unit("mm", [value])
        heading = f"{correlation['name']}: {correlation['quantity']}"
        lines.append((heading, f"{factor * value:.2f} {unit}", str(correlation["text"]), str(correlation["source"])))
    return table(lines)


def exact(
    case: options.CaseArgument,
    out: Path | None = option("--out DIR", "Folder to write; exact/NAME unless given.", None),
    resolution: options.ResolutionOption = None,
    settings: options.SetOption = None,
    as_json: options.JsonOption = False,
) -> None:
    """Solve a 1D case exactly: histories at its gauges, profiles at its output times, pictures."""
    loaded = options.load(case, settings, resolution)
    with options.locate_errors(case):
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
    problem = "barotropic layers" if solution.barotropic else "elastic-plastic plates"
    problem += f", waves down to {solution.tracked.weakest:.1g} of the strongest"
    say(f"exact: {problem}; {len(solution.tracked.fronts)} pieces of fronts")
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
    as_json: options.JsonOption = False,
) -> None:
    """Integrate the stress update of a material point along a strain path."""
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
        say(f"wrote {material_sheet.point_picture(record, plot, f'{model.name}, {path}, {rate:g} 1/s')}", err=True)


def _material(subject: str, body: str | None) -> Material:
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


def materials(
    name: str | None = argument("NAME", "Material to print; all materials are listed unless given.", None),
    plot: Path | None = option("--plot FILE", "Draw Hugoniot, release and strength of NAME into FILE.", None),
    compare: list[str] | None = option("--compare OTHER", "Compare with another material. Repeatable.", None),
    files: list[Path] | None = option("--file FILE", "File or folder of your own materials.", None),
    as_json: options.JsonOption = False,
) -> None:
    """List the material library, or print one material with its numbers, sources and derived values."""
    library = library_of(tuple(files or ()))
    if name is None:
        if plot or compare:
            raise CaseError("--plot and --compare need the name of a material")
        loaded = {key: library.load(key) for key in library.names()}
        if as_json:
            echo_json([material.model_dump(mode="json") for material in loaded.values()])
            return
        rows = [("name", "kg/m^3", "equation of state", "strength", "damage")]
        for key, material in loaded.items():
            rows.append((key, f"{material.density:g}", material.eos.type, material.strength.type, material.damage.type))
        say(table(rows, indent=0))
        return
    names = [library.name_of(part) for part in (name, *(compare or ()))]
    models = [library.load(part) for part in names]
    if as_json:
        content = [model.model_dump(mode="json") for model in models]
        echo_json(content[0] if len(content) == 1 else content)
    elif compare:
        say(_comparison(models))
    else:
        say(_sheet(library, names[0], models[0]))
    if plot is not None:
        say(f"wrote {material_sheet.picture(models, plot, library.notes(names[0]))}", err=True)


def _sheet(library: Library, name: str, model: Material) -> str:
    """Return numbers, sources and derived properties as text."""
    notes = library.notes(name)
    omitted = {"name", "source"} if notes.sources else {"name"}  # sources of the numbers are listed below
    lines = ["# SI units", dump(model.model_dump(mode="json", exclude=omitted), width=80).rstrip()]
    if notes.aliases:
        lines.append(f"# also called {', '.join(notes.aliases)}")
    if notes.note:
        lines += [f"# {line[2:]}" for line in paragraph(notes.note, indent=2).splitlines()]
    if notes.sources:
        lines += ["", "sources of the numbers"]
        for source in notes.sources:
            doubt = CONFIDENCE[source.confidence]
            text = f"{', '.join(source.of)}: {source.text}{f' [{doubt}]' if doubt else ''}"
            lines.append(paragraph(text, indent=2, hanging=4))
    lines += ["", "derived values"]
    derived = material_sheet.derive_properties(model)
    lines.append(table([(key, quantity(value, unit)) for key, (value, unit) in derived.items()]))
    rows = material_sheet.hugoniot(model)
    if rows:
        lines += ["", "states behind shocks, without strength"]
        states = [("up", "Us", "pressure", "density", "temperature")]
        for u, speed, pressure, density, heat in rows:
            kelvin = f"{heat:.0f} K" if heat == heat else "unknown"
            states.append((f"{u:g} m/s", f"{speed:.0f} m/s", quantity(pressure, "Pa"), f"{density:.0f} kg/m^3", kelvin))
        lines.append(table(states))
    for points, author in notes.hugoniot_points:
        pairs = material_sheet.compare_hugoniot(model, points)
        if pairs:
            words = (
                f"compared with {author} from {pairs[0][0]:g} to {pairs[-1][0]:g} m/s: the computed shock speed "
                f"(that of the last wave) is {_format_deviation(pairs)}"
            )
            if model.strength.type != "none":
                fluid = material_sheet.compare_hugoniot(model, points, strength=False)
                words += f"; without strength {_format_deviation(fluid)}"
            bins = material_sheet.worst_bin(pairs) if points == notes.hugoniot else None
            if bins is not None:
                error, place, scatter = bins
                words += (
                    f". Averaged over bins of five points it is {error:+.1f} % off at most, at {place:.0f} m/s; single "
                    f"points scatter by {scatter:.1f} % about the mean of their bin"
                )
            lines += ["", paragraph(words)]
    if notes.shocks:
        low, high = notes.shocks
        alternative = f"; outside use {notes.beyond}" if notes.beyond else ""
        lines += [
            "",
            paragraph(f"within 2 % of measured shocks from {low:g} to {high:g} m/s of particle velocity{alternative}"),
        ]
    elif notes.beyond:
        lines += ["", paragraph(f"within 2 % of measured shocks nowhere; for shocks use {notes.beyond}")]
    return "\n".join(lines)


def _format_deviation(comparison: Sequence[tuple[float, float, float]]) -> str:
    """Return how far shock speeds are off measured ones, in words."""
    errors = [100.0 * (computed / measured - 1.0) for _, measured, computed in comparison]
    if not errors:
        return "unknown"
    spread = (sum(value**2 for value in errors) / len(errors)) ** 0.5
    mean = sum(errors) / len(errors)
    return f"{mean:+.1f} % off in the mean, {spread:.1f} % in root mean square, {max(errors, key=abs):+.1f} % at most"


def _comparison(models: list[Material]) -> str:
    """Return materials in columns: models, then derived properties."""
    columns = [material_sheet.derive_properties(model) for model in models]
    rows = [("", *(model.name for model in models))]
    rows.append(("density", *(f"{model.density:g} kg/m^3" for model in models)))
    rows += [(part, *(getattr(model, part).type for model in models)) for part in ("eos", "strength", "damage")]
    keys = dict.fromkeys(key for column in columns for key in column)
    rows += [(key, *(quantity(*column[key]) if key in column else "" for column in columns)) for key in keys]
    return table(rows, indent=0)
