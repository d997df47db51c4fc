"""`hvisph sweep`, `converge` and `limit`: many runs and what they say together."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from hvisph.cli.guard import FAILED, INTERRUPTED
from hvisph.cli.options import CaseArgument, JsonOption, QuietOption, SetOption, ThreadsOption
from hvisph.cli.say import say

if TYPE_CHECKING:
    from hvisph.sweeps.folder import SweepFolder

WorkersOption = Annotated[
    int | None, typer.Option("--workers", min=1, metavar="N", help="Worker processes; one a core unless given.")
]
SweepOutOption = Annotated[
    Path | None, typer.Option("--out", metavar="DIR", help="Folder of the sweep; sweeps/NAME unless given.")
]
PlotOption = Annotated[Path | None, typer.Option("--plot", metavar="FILE", help="Draw the result: png, pdf, svg.")]
DaskOption = Annotated[
    str | None,
    typer.Option("--dask", metavar="ADDRESS", help="Workers on a running Dask cluster, such as tcp://host:8786."),
]
ClusterOption = Annotated[
    str | None, typer.Option("--cluster", metavar="KIND", help="Workers as jobs of a queue: slurm, pbs or sge.")
]


def sweep(
    source: Annotated[
        str, typer.Argument(metavar="SWEEP", help="Sweep's file, or the folder of one that was begun, to go on with.")
    ],
    out: SweepOutOption = None,
    workers: WorkersOption = None,
    threads: ThreadsOption = None,
    only: Annotated[
        str | None, typer.Option("--only", metavar="WHAT", help="failed, interrupted, or numbers: 3..7.")
    ] = None,
    dry: Annotated[bool, typer.Option("--dry", help="List the cases and run nothing.")] = False,
    table: Annotated[bool, typer.Option("--table", help="Show how a sweep stands and run nothing.")] = False,
    work: Annotated[
        bool, typer.Option("--work", help="Be one more worker of a sweep's folder, as in a job array.")
    ] = False,
    dask: DaskOption = None,
    cluster: ClusterOption = None,
    plot: PlotOption = None,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> None:
    """Run many cases that differ from one, and tabulate what they measured; the same command goes on.

    Exit codes: 0 all done and as expected, 1 missed an expectation, 2 bad input, 3 a case failed, 130 interrupted.
    """
    from hvisph.sweeps.selection import Selection

    chosen = Selection.parse(only)
    if plot is not None:
        _refuse_plot(plot)
    if work:
        _work(source, threads, chosen)
    elif dry:
        _list(source, as_json)
    elif table:
        from hvisph.sweeps.begin import existing

        _show(existing(source), plot, quiet, as_json)
    else:
        from hvisph.sweeps.begin import begin

        folder = begin(source, out)
        _go(folder, workers, threads, chosen, only, dask, cluster, quiet or as_json)
        _show(folder, plot, quiet, as_json)


def converge(
    case: CaseArgument,
    resolutions: Annotated[
        str, typer.Option("--resolutions", metavar="LIST", help="At least two, best three: 0.4mm,0.2mm,0.1mm.")
    ],
    settings: SetOption = None,
    out: SweepOutOption = None,
    workers: WorkersOption = None,
    threads: ThreadsOption = None,
    dask: DaskOption = None,
    cluster: ClusterOption = None,
    plot: PlotOption = None,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> None:
    """Run a case at several resolutions: order of convergence, value at infinite resolution, grid convergence index."""
    values = [value.strip() for value in resolutions.split(",") if value.strip()]
    vary = {"type": "converge", "path": "resolution", "values": values}
    _study(case, settings, vary, out, f"converge-{Path(case).stem}", workers, threads, dask, cluster, plot, quiet,
           as_json)  # fmt: skip


def limit(
    case: CaseArgument,
    vary: Annotated[
        str, typer.Option("--vary", metavar="PATH", help="The setting, such as bodies.projectile.velocity.0.")
    ],
    between: Annotated[
        str, typer.Option("--between", metavar="A,B", help="A value below the limit and one above: 200,900m/s.")
    ],
    until: Annotated[
        str | None, typer.Option("--until", metavar="WIDTH", help="Width of the bracket; 1/16 of the first.")
    ] = None,
    measure: Annotated[
        str, typer.Option("--event", metavar="MEASURE", help="What begins to happen: a measure above --above.")
    ] = "perforated",
    above: Annotated[float, typer.Option("--above", help="Where it has happened [SI].")] = 0.5,
    settings: SetOption = None,
    out: SweepOutOption = None,
    workers: WorkersOption = None,
    threads: ThreadsOption = None,
    dask: DaskOption = None,
    cluster: ClusterOption = None,
    plot: PlotOption = None,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> None:
    """Find where something begins to happen, such as the ballistic limit, by bisection with all workers."""
    bounds = _bounds(between)
    width = until if until is not None else _sixteenth(*bounds)
    varied = {"type": "bisect", "path": vary, "between": list(bounds), "until": width,
              "event": {"measure": measure, "above": above}}  # fmt: skip
    _study(case, settings, varied, out, f"limit-{Path(case).stem}", workers, threads, dask, cluster, plot, quiet,
           as_json)  # fmt: skip


def _study(case: str, settings: list[str] | None, vary: dict[str, Any], out: Path | None, name: str,
           workers: int | None, threads: int | None, dask: str | None, cluster: str | None, plot: Path | None,
           quiet: bool, as_json: bool) -> None:  # fmt: skip
    """Run a sweep that a command describes, and say what came out."""
    from hvisph.sweeps.begin import SWEEPS, begin
    from hvisph.sweeps.selection import Selection
    from hvisph.sweeps.values import plain

    if plot is not None:
        _refuse_plot(plot)
    fixed = {}
    for setting in settings or ():
        path, equals, value = setting.partition("=")
        if not equals:
            from hvisph.core.errors import CaseError

            raise CaseError("a setting looks like time.end=2us", where="--set")
        fixed[path.strip()] = plain(value)
    folder = begin({"case": case, "set": fixed, "vary": vary}, out or SWEEPS / name)
    _go(folder, workers, threads, Selection(), None, dask, cluster, quiet or as_json)
    _show(folder, plot, quiet, as_json)


def _bounds(text: str) -> tuple[str, str]:
    """Return two values, the first with the unit of the second where it has none."""
    from hvisph.core.errors import CaseError
    from hvisph.sweeps.values import split

    parts = [part.strip() for part in text.split(",")]
    if len(parts) != 2:
        raise CaseError(f"'{text}': two values with a comma between, such as 200,900m/s", where="--between")
    (low, unit), (high, other) = (split("--between", part) for part in parts)
    return f"{low:g} {unit or other}".strip(), f"{high:g} {other}".strip()


def _sixteenth(low: str, high: str) -> str:
    from hvisph.sweeps.values import split

    (a, unit), (b, other) = split("--between", low), split("--between", high)
    from hvisph.core.errors import CaseError

    if unit != other:
        raise CaseError("give --until, or both values in the same unit", where="--between")
    return f"{(b - a) / 16:.12g} {unit}".strip()


def _work(source: str, threads: int | None, chosen: Any) -> None:
    from hvisph.sweeps.begin import existing
    from hvisph.sweeps.worker import Worker

    code = Worker(existing(source), threads, chosen).work()
    if code:
        raise typer.Exit(code)


def _list(source: str, as_json: bool) -> None:
    from hvisph.cli.words import echo_json, table
    from hvisph.sweeps.plan import load_plan

    members = load_plan(source).first()
    if as_json:
        echo_json([{"number": m.number, "hash": m.digest, "cost": m.cost, "values": m.values} for m in members])
        return
    paths = list(dict.fromkeys(path for member in members for path in member.values))
    rows = [["", *paths]] + [[str(m.number), *(str(m.values.get(path, "")) for path in paths)] for m in members]
    say(table(rows))
    say(f"\n{len(members)} cases, {sum(m.cost for m in members):.2g} particle-steps in all")


def _go(folder: SweepFolder, workers: int | None, threads: int | None, chosen: Any, only: str | None,
        dask: str | None, cluster: str | None, silent: bool) -> None:  # fmt: skip
    """Compute what is left, telling of each case as it ends; leave the command where it is interrupted."""
    from hvisph.cli.sweep_lines import Teller
    from hvisph.sweeps.begin import driver

    crew = _crew(dask, cluster, workers)
    shots = driver(folder, workers, threads, chosen, only, crew)
    teller = Teller(shots, silent)
    try:
        with teller:
            for row in shots.go():
                teller.ended(row)
    except KeyboardInterrupt:
        say(f"interrupted; go on with: hvisph sweep {folder.path}", err=True)
        raise typer.Exit(INTERRUPTED) from None


def _crew(dask: str | None, cluster: str | None, workers: int | None) -> Any:
    from hvisph.core.errors import CaseError

    if dask is not None and cluster is not None:
        raise CaseError("give either --dask or --cluster", where="--cluster")
    if dask is None and cluster is None:
        return None
    from hvisph.sweeps import cluster as clusters

    if cluster is not None and cluster not in clusters.KINDS:
        raise CaseError(f"unknown '{cluster}'; allowed: {', '.join(clusters.KINDS)}", where="--cluster")
    if dask is not None:
        client = clusters.connected(dask)
        return lambda folder, threads, options: clusters.DaskCrew(folder, client, threads, options)

    def launch(folder: Any, threads: int, options: Any) -> Any:
        return clusters.DaskCrew(folder, clusters.launched(str(cluster), workers or 1, threads), threads, options)

    return launch


def _show(folder: SweepFolder, plot: Path | None, quiet: bool, as_json: bool) -> None:
    """Print how a sweep stands and what it says, and leave the command with its exit code."""
    from hvisph.sweeps.begin import driver
    from hvisph.sweeps.selection import Selection
    from hvisph.sweeps.table import rows

    shots = driver(folder, None, None, Selection(), None)
    said = shots.conclude()
    shown = rows(folder, shots.members)
    if as_json:
        from hvisph.cli.words import echo_json

        echo_json({"rows": shown, "results": said, "folder": str(folder.path)})
    elif not quiet:
        from hvisph.cli.sweep_lines import summary

        say(summary(shots.sweep, shown, said, folder.path))
    if plot is not None:
        from hvisph.pictures.sweeps import sweep_picture

        sweep_picture(said, shown, plot, shots.sweep.title or shots.sweep.case)
        if not (quiet or as_json):
            say(str(plot))
    statuses = {row["status"] for row in shown}
    if statuses & {"failed", "error", "killed"}:
        raise typer.Exit(FAILED)
    if any(row["missed"] for row in shown):
        raise typer.Exit(1)


def _refuse_plot(plot: Path) -> None:
    from hvisph.cli.compare import refuse_format

    refuse_format(plot, "--plot")
