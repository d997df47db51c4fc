"""`hvisph plot`, `animate`, `gauges` and `report`: pictures and pages of runs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from hvisph.cli.formatting import say
from hvisph.cli.guard import parse_option
from hvisph.cli.options import QuietOption, argument, option
from hvisph.core.errors import CaseError, suggest_nearest

if TYPE_CHECKING:
    from hvisph.visualization.particles import Look, Moment

FieldOption = Annotated[str, option("--field NAME", "speed, pressure, damage, velocity_x, body, material ...")]
RangeOption = Annotated[
    str | None, option("--range A,B", "Limits of the colour scale [SI]; those of the shown values unless given.")
]
LogOption = Annotated[bool, option("--log", "Logarithmic colour scale.")]
ViewOption = Annotated[
    str | None, option("--view VIEW", "side, front, 3d, or yaw,pitch [degrees]; 3D cases are rotated unless given.")
]
MirrorOption = Annotated[bool, option("--mirror/--no-mirror", "Show mirror images at symmetry planes.")]
BodiesOption = Annotated[str | None, option("--bodies A,B", "Bodies to draw; all unless given.")]
ZoomOption = Annotated[str | None, option("--zoom Z", "Magnification, or left,right,bottom,top [m].")]


def plot(
    runs: list[str] = argument("RUN...", "Folders of runs, or snapshots."),
    at: str | None = option("--at TIMES", "Times, such as 2us,4us; the last unless given.", None),
    field: FieldOption = "speed",
    ends: RangeOption = None,
    log: LogOption = False,
    view: ViewOption = None,
    mirror: MirrorOption = True,
    zoom: ZoomOption = None,
    bodies: BodiesOption = None,
    out: Path | None = option("--out, -o FILE", "png, pdf or svg; plot.png in the run's folder.", None),
    quiet: QuietOption = False,
) -> None:
    """Draw all particles at one or several times, of one or several runs, in one picture."""
    from hvisph.postprocessing.run_data import shown_moments
    from hvisph.visualization.particles import view_picture

    names = bodies.split(",") if bodies else None
    moments = [moment for run in runs for moment in shown_moments(Path(run), _times(at), len(runs) > 1, names)]
    first = Path(runs[0])
    target = out or (first if first.is_dir() else first.parent) / "plot.png"
    look = _look(field, ends, log, view, mirror, zoom, moments)
    path = view_picture(moments, target, look)
    if not quiet:
        typer.echo(str(path))


def animate(
    run: str = argument("RUN", "Folder of a run."),
    out: Path = option("--out, -o FILE", "gif, mp4, or html for a player."),
    field: FieldOption = "speed",
    ends: RangeOption = None,
    log: LogOption = False,
    view: ViewOption = None,
    mirror: MirrorOption = True,
    zoom: ZoomOption = None,
    bodies: BodiesOption = None,
    seconds: float = option("--seconds", "Duration of the animation [s].", 6.0, min=0.1),
    quiet: QuietOption = False,
) -> None:
    """Draw all snapshots of a run as an animation."""
    if out.suffix.lower() in (".html", ".htm"):
        from hvisph.visualization.html.report import report

        path = report([run], out)
    else:
        from hvisph.postprocessing.run_data import shown_moments
        from hvisph.visualization.particles import animate as draw

        moments = shown_moments(Path(run), "all", False, bodies.split(",") if bodies else None)
        path = draw(moments, out, _look(field, ends, log, view, mirror, zoom, moments), seconds)
    if not quiet:
        typer.echo(str(path))


def _times(at: str | None) -> list[float] | str | None:
    """Return `--at` as times [s], ``all`` or None."""
    if at is None or at == "all":
        return at
    return [parse_option(part, "TIME", "--at", ", or all") for part in at.split(",")]


def _look(
    field: str, ends: str | None, log: bool, view: str | None, mirror: bool, zoom: str | None, moments: list[Moment]
) -> Look:
    from hvisph.visualization.camera import VIEWS
    from hvisph.visualization.particles import Look, usual_view

    turned: Any = view or usual_view(moments[0])
    if view and view not in VIEWS:
        numbers = _numbers(turned, "--view") if turned[:1] in "-+.0123456789" else ()
        if len(numbers) != 2:
            raise CaseError(f"'{turned}' is no view{suggest_nearest(turned, list(VIEWS))}", where="--view")
        turned = numbers
    limits = _numbers(ends, "--range") if ends else None
    if limits is not None and (len(limits) != 2 or not limits[0] < limits[1]):
        raise CaseError("needs a lower and a higher value, such as 0,3000", where="--range")
    enlarged: Any = _numbers(zoom, "--zoom") if zoom else None
    if enlarged is not None:
        if len(enlarged) not in (1, 4) or (len(enlarged) == 1 and enlarged[0] <= 0.0):
            raise CaseError("needs one factor above 0, or left,right,bottom,top", where="--zoom")
        enlarged = enlarged[0] if len(enlarged) == 1 else enlarged
    return Look(field, limits, log, turned, mirror, enlarged)


def _numbers(text: str, where: str) -> tuple[float, ...]:
    try:
        return tuple(float(part) for part in text.split(","))
    except ValueError:
        raise CaseError(f"'{text}': expected numbers with commas between", where=where) from None


def gauges(
    run: str = argument("RUN", "Folder of a run."),
    out: Path | None = option("--out FILE", "Picture to write; RUN/gauges.png unless given.", None),
    exact: bool = option("--exact", "Draw the exact solution as well (1D).", False),
) -> None:
    """Draw the gauges of a run: one panel per field, one line per gauge."""
    from hvisph.casefile.loader import load_case
    from hvisph.postprocessing.exact_solution import overlay
    from hvisph.visualization.curves import curves_picture

    folder = Path(run)
    made = overlay({folder.name: folder}, exact)
    for reason in made.without.values():
        raise CaseError(f"there is no exact solution to draw: {reason}", where="--exact")
    title = load_case(folder / "case.yaml").title
    say(str(curves_picture(made.panels, out or folder / "gauges.png", title=title, unitless=made.unitless)))


def report(
    runs: list[str] = argument("RUN...", "Folders of runs, or of one sweep."),
    out: Path | None = option("--out, -o FILE", "Page to write; report.html in the run's folder.", None),
    each: bool = option("--each", "For a sweep, also write a page for every run.", False),
    quiet: QuietOption = False,
) -> None:
    """Write one self-contained page: verdict, player, measures, warnings, set-up."""
    from hvisph.visualization.html.report import report as build
    from hvisph.visualization.html.sweep import is_sweep, sweep_report

    path = sweep_report(runs[0], out, each=each) if len(runs) == 1 and is_sweep(runs[0]) else build(runs, out)
    if not quiet:
        say(str(path))
