"""`hvisph sweep`, `converge` and `ballistic-limit`: parameter studies."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from hvisph.cli import options
from hvisph.cli.formatting import echo_json, say, table
from hvisph.cli.guard import FAILED, INTERRUPTED, ends_like_ctrl_c
from hvisph.cli.options import argument, option, shared
from hvisph.cli.sweep_log import SweepLog, summary
from hvisph.core.errors import CaseError
from hvisph.core.text import format_differences
from hvisph.sweeps import cluster as clusters
from hvisph.sweeps.driver import SWEEPS, LocalCrew, begin, driver, existing
from hvisph.sweeps.folder import Selection, SweepFolder, rows
from hvisph.sweeps.parameters import plain, split
from hvisph.sweeps.plan import load_plan
from hvisph.sweeps.worker import Worker
from hvisph.visualization.sweeps import sweep_picture


@dataclass(frozen=True)
class WorkerOptions:
    """Workers and output of a command; each field is an option of it."""

    workers: Annotated[int | None, option("--workers N", "Worker processes; one per core unless given.", min=1)] = None
    threads: options.ThreadsOption = None
    dask: Annotated[
        str | None,
        option("--dask ADDRESS", "Address of a running Dask cluster for the workers, such as tcp://host:8786."),
    ] = None
    cluster: Annotated[str | None, option("--cluster KIND", "Queue for workers as jobs: slurm, pbs or sge.")] = None
    quiet: options.QuietOption = False
    as_json: options.JsonOption = False

    @property
    def silent(self) -> bool:
        """Whether nothing is printed during the computation."""
        return self.quiet or self.as_json

    def crew(self) -> Any:
        """Return the function that creates the workers; raises `CaseError` where there can be none."""
        if self.dask is not None and self.cluster is not None:
            raise CaseError("give either --dask or --cluster", where="--cluster")
        if self.dask is None and self.cluster is None:
            return LocalCrew
        if self.cluster is not None and self.cluster not in clusters.KINDS:
            raise CaseError(f"unknown '{self.cluster}'; allowed: {', '.join(clusters.KINDS)}", where="--cluster")
        tell = partial(say, err=True)
        if self.dask is not None:
            client = clusters.connect(self.dask)
            return lambda folder, threads, options: clusters.DaskCrew(folder, client, threads, options, tell)
        scheduler, workers = str(self.cluster), self.workers or 1

        def launch(folder: Any, threads: int, options: Any) -> Any:
            return clusters.DaskCrew(folder, clusters.launch(scheduler, workers, threads), threads, options, tell)

        return launch


@dataclass(frozen=True)
class SweepOptions(WorkerOptions):
    """Options of running, writing and showing a sweep; each field is an option of the command."""

    out: Annotated[Path | None, option("--out DIR", "Folder of the sweep; sweeps/NAME unless given.")] = None
    plot: Annotated[Path | None, option("--plot FILE", "Draw the result: png, pdf, svg.")] = None

    def refuse(self) -> None:
        """Refuse an invalid picture before anything runs; raises `CaseError`."""
        if self.plot is not None:
            options.refuse_format(self.plot, "--plot")


FitOption = Annotated[str | None, option("--fit DIR", "Folder of a material's fit, whose uncertainty is included.")]


@shared
def sweep(
    how: SweepOptions,
    source: str = argument("SWEEP", "File of a sweep, or the folder of one to continue."),
    only: str | None = option("--only WHAT", "failed, interrupted, or numbers: 3..7.", None),
    dry: bool = option("--dry-run", "List the cases and run nothing.", False),
    table: bool = option("--table", "Show the state of the sweep and run nothing.", False),
    work: bool = option("--worker", "Work on the sweep as one more worker, as in a job array.", False),
    presence: Annotated[Path | None, typer.Option("--while", hidden=True)] = None,
) -> None:
    """Run a parameter study and tabulate its measures; the command continues an interrupted study.

    Exit codes: 0 all done and as expected, 1 missed an expectation or a limit, 2 invalid input, 3 a case failed,
    130 interrupted.
    """
    selection = Selection.parse(only)
    how.refuse()
    if work:
        _work(source, how.threads, selection, presence)
    elif dry:
        _list(source, how.as_json)
    elif table:
        _show(existing(source), how)
    else:
        folder = begin(source, how.out)
        go(folder, how, only)
        _show(folder, how)


@shared
def fit(how: SweepOptions, source: str = argument("FIT", "File of a fit, or the folder of one to continue.")) -> None:
    """Fit parameters of a material to measured shots and write the material; the command continues an interrupted fit.

    Exit codes: 0 fitted, 1 a parameter is not determined or the fit not converged, 2 bad input, 3 a shot failed,
    130 interrupted.
    """
    how.refuse()
    folder = begin(source, how.out)
    if folder.sweep.vary.type != "fit":
        raise CaseError(f"{source} is a sweep of type {folder.sweep.vary.type}: use hvisph sweep", where="vary.type")
    go(folder, how)
    _show(folder, how)


@shared
def converge(
    how: SweepOptions,
    case: options.CaseArgument,
    resolutions: str = option("--resolutions LIST", "Two or more spacings, better three: 0.4mm,0.2mm,0.1mm."),
    fit: FitOption = None,
    settings: options.SetOption = None,
) -> None:
    """Run a case at several resolutions: order of convergence, value at infinite resolution, grid convergence index."""
    values = [value.strip() for value in resolutions.split(",") if value.strip()]
    if len(values) < 2:
        raise CaseError(f"'{resolutions}': at least two, such as 0.4mm,0.2mm,0.1mm", where="--resolutions")
    vary = {"type": "converge", "path": "resolution", "values": values} | ({"fit": fit} if fit else {})
    _study(how, "converge", case, settings, vary)


@shared
def ballistic_limit(
    how: SweepOptions,
    case: options.CaseArgument,
    vary: str = option("--vary PATH", "The setting, such as bodies.projectile.velocity.0."),
    bracket: str = option("--bracket A,B", "Values without and with the event: 200,900m/s."),
    tolerance: str | None = option("--tolerance WIDTH", "Final width of the bracket; 1/16 of the first.", None),
    measure: str = option("--event MEASURE", "The event: this measure above --threshold.", "perforated"),
    threshold: float = option("--threshold", "Threshold of the measure [SI].", 0.5),
    longest: str | None = option("--longest TIME", "Time to which an undecided shot continues; 4 x its end.", None),
    resolutions: str | None = option("--resolutions LIST", "A limit for each: its uncertainty by spacing.", None),
    fit: FitOption = None,
    resolution: options.ResolutionOption = None,
    settings: options.SetOption = None,
) -> None:
    """Find the ballistic limit, or the limit of another event, by bisection with all workers.

    Exit codes: 0 found, 1 no limit between the values, 2 invalid input, 3 a shot failed, 130 interrupted.
    """
    bounds = _bounds(bracket)
    width = tolerance if tolerance is not None else _sixteenth(*bounds)
    varied = {
        "type": "bisect",
        "path": vary,
        "bracket": list(bounds),
        "tolerance": width,
        "event": {"measure": measure, "threshold": threshold},
    }
    varied |= {"longest": longest} if longest else {}
    varied |= {"resolutions": [spacing.strip() for spacing in resolutions.split(",")]} if resolutions else {}
    varied |= {"fit": fit} if fit else {}
    fixed = [*(settings or ()), *([f"resolution={resolution}"] if resolution else ())]
    _study(how, "ballistic-limit", case, fixed, varied)


def _study(how: SweepOptions, command: str, case: str, settings: list[str] | None, vary: Mapping[str, object]) -> None:
    """Run a sweep that a command describes, and print its results."""
    how.refuse()
    fixed = {}
    for setting in settings or ():
        path, equals, value = setting.partition("=")
        if not equals:
            raise CaseError("a setting looks like time.end=2us", where="--set")
        fixed[path.strip()] = plain(value)
    folder = begin({"case": case, "set": fixed, "vary": vary}, how.out or SWEEPS / f"{command}-{Path(case).stem}")
    go(folder, how)
    _show(folder, how)


def _bounds(text: str) -> tuple[str, str]:
    """Return two values, the first with the unit of the second where it has none."""
    parts = [part.strip() for part in text.split(",")]
    if len(parts) != 2:
        raise CaseError(f"'{text}': two values with a comma between, such as 200,900m/s", where="--bracket")
    (low, unit), (high, common_unit) = (split("--bracket", part) for part in parts)
    return f"{low:g} {unit or common_unit}".strip(), f"{high:g} {common_unit}".strip()


def _sixteenth(low: str, high: str) -> str:
    (a, unit), (b, unit_high) = split("--bracket", low), split("--bracket", high)
    if unit != unit_high:
        raise CaseError("give --tolerance, or both values in the same unit", where="--bracket")
    return f"{abs(b - a) / 16:.12g} {unit}".strip()


def _work(source: str, threads: int | None, selection: Selection, presence: Path | None) -> None:
    code = Worker(existing(source), threads, selection, presence).work()
    if code:
        raise typer.Exit(code)


def _list(source: str, as_json: bool) -> None:
    members = load_plan(source).first()
    if as_json:
        echo_json([{"number": m.number, "hash": m.digest, "cost": m.cost, "values": m.values} for m in members])
        return
    paths = list(dict.fromkeys(path for member in members for path in member.values))
    values = [format_differences([member.values.get(path) for member in members]) for path in paths]
    rows = [["", *paths], *([str(m.number), *cells] for m, *cells in zip(members, *values, strict=True))]
    say(table(rows))
    say(f"\n{len(members)} cases, {sum(m.cost for m in members):.2g} particle-steps in all")


def go(folder: SweepFolder, how: WorkerOptions, only: str | None = None) -> None:
    """Compute the remaining cases, report the end of each, and leave the command on an interrupt."""
    under_way = driver(folder, how.workers, how.threads, only, how.crew())
    log = SweepLog(under_way, how.silent)
    try:
        with ends_like_ctrl_c(), log:
            for row in under_way.go():
                log.report_end(row)
    except KeyboardInterrupt:
        say(f"interrupted; continue with: hvisph sweep {folder.path}", err=True)
        raise typer.Exit(INTERRUPTED) from None


def _show(folder: SweepFolder, how: SweepOptions) -> None:
    """Print state and results of a sweep, and exit with its code."""
    stands = driver(folder)
    results = stands.conclude()
    table_rows = rows(folder, stands.members)
    if how.as_json:
        echo_json({"rows": table_rows, "results": results, "folder": str(folder.path)})
    elif not how.quiet:
        say(summary(stands.sweep, table_rows, results, folder.path))
    if how.plot is not None:
        sweep_picture(results, table_rows, how.plot, stands.title, stands.sweep.record)
        if not how.silent:
            say(str(how.plot))
    statuses = {row["status"] for row in table_rows}
    if statuses & {"failed", "error", "killed"}:
        raise typer.Exit(FAILED)
    fitted = results.get("fit") or {"parameters": {}, "converged": True}
    doubtful = not fitted["converged"] or not all(entry["determined"] for entry in fitted["parameters"].values())
    if doubtful or any(row["missed"] for row in table_rows) or any(s["open"] for s in results.get("limits", [])):
        raise typer.Exit(1)
