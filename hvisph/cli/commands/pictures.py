"""`hvisph plot`, `animate`, `gauges` and `report`: pictures and pages of runs."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer

from hvisph.casefile.loader import load_case
from hvisph.cli.formatting import say
from hvisph.cli.options import QuietOption, argument, option, parse_option, shared
from hvisph.core.errors import CaseError, suggest_nearest
from hvisph.postprocessing.exact_solution import overlay
from hvisph.postprocessing.run_data import shown_moments
from hvisph.visualization.camera import VIEWS
from hvisph.visualization.curves import curves_picture
from hvisph.visualization.html.report import report as build
from hvisph.visualization.html.sweep import sweep_report
from hvisph.visualization.particles import Look, Moment, usual_view, view_picture
from hvisph.visualization.particles import animate as draw


@dataclass(frozen=True)
class Drawing:
    """Content, colours and view of a picture of particles; each field is an option of the command."""

    field: Annotated[str, option("--field NAME", "speed, pressure, damage, velocity_x, body, material ...")] = "speed"
    ends: Annotated[
        str | None, option("--range A,B", "Limits of the colour scale [SI]; those of the shown values unless given.")
    ] = None
    log: Annotated[bool, option("--log", "Logarithmic colour scale.")] = False
    view: Annotated[
        str | None, option("--view VIEW", "side, front, 3d, or yaw,pitch [degrees]; 3D cases are rotated unless given.")
    ] = None
    mirror: Annotated[bool, option("--mirror/--no-mirror", "Show mirror images at symmetry planes.")] = True
    zoom: Annotated[str | None, option("--zoom Z", "Magnification, or left,right,bottom,top [m].")] = None
    bodies: Annotated[str | None, option("--bodies A,B", "Bodies to draw; all unless given.")] = None
    quiet: QuietOption = False

    @property
    def names(self) -> list[str] | None:
        """Names of the bodies to draw; None for all."""
        return self.bodies.split(",") if self.bodies else None

    def look(self, moments: list[Moment]) -> Look:
        """Return colours and view of `moments`; raises `CaseError` for options without a meaning."""
        view: Any = self.view or usual_view(moments[0])
        if self.view and self.view not in VIEWS:
            numbers = _numbers(view, "--view") if view[:1] in "-+.0123456789" else ()
            if len(numbers) != 2:
                raise CaseError(f"'{view}' is no view{suggest_nearest(view, list(VIEWS))}", where="--view")
            view = numbers
        limits = _numbers(self.ends, "--range") if self.ends else None
        if limits is not None and (len(limits) != 2 or not limits[0] < limits[1]):
            raise CaseError("needs a lower and a higher value, such as 0,3000", where="--range")
        enlarged: Any = _numbers(self.zoom, "--zoom") if self.zoom else None
        if enlarged is not None:
            if len(enlarged) not in (1, 4) or (len(enlarged) == 1 and enlarged[0] <= 0.0):
                raise CaseError("needs one factor above 0, or left,right,bottom,top", where="--zoom")
            enlarged = enlarged[0] if len(enlarged) == 1 else enlarged
        return Look(self.field, limits, self.log, view, self.mirror, enlarged)


@shared
def plot(
    how: Drawing,
    runs: list[str] = argument("RUN...", "Folders of runs, or snapshots."),
    at: str | None = option("--at TIMES", "Times, such as 2us,4us; the last unless given.", None),
    out: Path | None = option("--out, -o FILE", "png, pdf or svg; plot.png in the run's folder.", None),
) -> None:
    """Draw all particles at one or several times, of one or several runs, in one picture."""
    moments = [moment for run in runs for moment in shown_moments(Path(run), _times(at), len(runs) > 1, how.names)]
    first = Path(runs[0])
    target = out or (first if first.is_dir() else first.parent) / "plot.png"
    path = view_picture(moments, target, how.look(moments))
    if not how.quiet:
        typer.echo(str(path))


@shared
def animate(
    how: Drawing,
    run: str = argument("RUN", "Folder of a run."),
    out: Path = option("--out, -o FILE", "gif, mp4, or html for a player."),
    seconds: float = option("--seconds", "Duration of the animation [s].", 6.0, min=0.1),
) -> None:
    """Draw all snapshots of a run as an animation."""
    if out.suffix.lower() in (".html", ".htm"):
        path = build([run], out)
    else:
        moments = shown_moments(Path(run), "all", False, how.names)
        path = draw(moments, out, how.look(moments), seconds)
    if not how.quiet:
        typer.echo(str(path))


def _times(at: str | None) -> list[float] | str | None:
    """Return `--at` as times [s], ``all`` or None."""
    if at is None or at == "all":
        return at
    return [parse_option(part, "TIME", "--at", ", or all") for part in at.split(",")]


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
    folder = Path(run)
    overlaid = overlay({folder.name: folder}, exact)
    for reason in overlaid.without.values():
        raise CaseError(f"there is no exact solution to draw: {reason}", where="--exact")
    title = load_case(folder / "case.yaml").title
    say(str(curves_picture(overlaid.panels, out or folder / "gauges.png", title=title, unitless=overlaid.unitless)))


def report(
    runs: list[str] = argument("RUN...", "Folders of runs, or of one sweep."),
    out: Path | None = option("--out, -o FILE", "Page to write; report.html in the run's folder.", None),
    each: bool = option("--each", "For a sweep, also write a page for every run.", False),
    quiet: QuietOption = False,
) -> None:
    """Write one self-contained page: result, animation, measures, warnings, set-up."""
    from hvisph.sweeps.driver import driver  # the other commands here need no sweeps
    from hvisph.sweeps.folder import SweepFolder, rows, table_rows

    folder = SweepFolder(runs[0])
    if len(runs) > 1 or not folder.exists:
        path = build(runs, out)
    else:
        stands = driver(folder)
        results, members, record = stands.conclude(), rows(folder, stands.members), stands.sweep.record
        table = table_rows(members, record)
        path = sweep_report(folder.path, stands.title, results, members, table, out, record=record, each=each)
    if not quiet:
        say(str(path))
