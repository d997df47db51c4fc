"""Options that several commands share."""

import inspect
from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import partial, wraps
from pathlib import Path
from typing import Annotated, Any, get_type_hints

import typer

from hvisph.cli.formatting import say
from hvisph.cli.guard import refuse_format
from hvisph.core.errors import CaseError


def option(usage: str, help: str, default: Any = ..., **more: Any) -> Any:
    """Return an option by its usage, such as ``--out, -o FILE``, its help and its default; `more` is for typer.

    Without a default it is required, or has that of its parameter where it stands in an annotation.
    """
    *names, last = usage.split(", ")
    name, _, metavar = last.partition(" ")
    return typer.Option(default, *names, name, metavar=metavar or None, help=help, **more)


def argument(metavar: str, help: str, default: Any = ..., **more: Any) -> Any:
    """Return an argument by its name in the usage, its help and its default; see `option`."""
    return typer.Argument(default, metavar=metavar, help=help, **more)


CaseArgument = Annotated[str, argument("CASE", "Case file, or name of a bundled case (see `hvisph cases`).")]
ResolutionOption = Annotated[
    str | None, option("--resolution LENGTH", "Particle spacing in place of the case's: 0.2mm.")
]
SetOption = Annotated[
    list[str] | None, option("--set PATH=VALUE", "Set any field of the case: time.end=2us. Repeatable.")
]
ThreadsOption = Annotated[
    int | None, option("--threads N", "Number of threads; unless given, by the work of a step.", min=1)
]
PictureOption = Annotated[str | None, option("--picture FILE", "Draw the set-up into this file: setup.png.")]
JsonOption = Annotated[bool, option("--json", "Print JSON only, in SI units.")]
ReportOption = Annotated[bool, option("--report", "Write the run's report.html when it ends.")]
AllOption = Annotated[bool, option("--all", "Print all measures when the run ends.")]
QuietOption = Annotated[bool, option("--quiet", "Print nothing but errors.")]
OutOption = Annotated[Path | None, option("--out DIR", "Folder of the run; runs/NAME unless given.")]


@dataclass(frozen=True)
class Running:
    """Workers and output of a command; each field is an option of it."""

    workers: Annotated[int | None, option("--workers N", "Worker processes; one per core unless given.", min=1)] = None
    threads: ThreadsOption = None
    dask: Annotated[
        str | None,
        option("--dask ADDRESS", "Address of a running Dask cluster for the workers, such as tcp://host:8786."),
    ] = None
    cluster: Annotated[str | None, option("--cluster KIND", "Queue for workers as jobs: slurm, pbs or sge.")] = None
    quiet: QuietOption = False
    as_json: JsonOption = False

    @property
    def silent(self) -> bool:
        """Whether nothing is printed during the computation."""
        return self.quiet or self.as_json

    def crew(self) -> Any:
        """Return the function that creates the workers; raises `CaseError` where there can be none."""
        if self.dask is not None and self.cluster is not None:
            raise CaseError("give either --dask or --cluster", where="--cluster")
        if self.dask is None and self.cluster is None:
            from hvisph.sweeps.driver import LocalCrew

            return LocalCrew
        from hvisph.sweeps import cluster as clusters

        if self.cluster is not None and self.cluster not in clusters.KINDS:
            raise CaseError(f"unknown '{self.cluster}'; allowed: {', '.join(clusters.KINDS)}", where="--cluster")
        tell = partial(say, err=True)
        if self.dask is not None:
            client = clusters.connect(self.dask)
            return lambda folder, threads, options: clusters.DaskCrew(folder, client, threads, options, tell)
        kind, workers = str(self.cluster), self.workers or 1

        def launch(folder: Any, threads: int, options: Any) -> Any:
            return clusters.DaskCrew(folder, clusters.launch(kind, workers, threads), threads, options, tell)

        return launch


@dataclass(frozen=True)
class How(Running):
    """Options of running, writing and showing a sweep; each field is an option of the command."""

    out: Annotated[Path | None, option("--out DIR", "Folder of the sweep; sweeps/NAME unless given.")] = None
    plot: Annotated[Path | None, option("--plot FILE", "Draw the result: png, pdf, svg.")] = None

    def refuse(self) -> None:
        """Refuse an invalid picture before anything runs; raises `CaseError`."""
        if self.plot is not None:
            refuse_format(self.plot, "--plot")


def shared(command: Callable[..., None]) -> Callable[..., None]:
    """Return a command with the options of its first argument, `how`, behind its own."""
    hints = get_type_hints(command, include_extras=True)
    kind_of_how = hints["how"]
    options = get_type_hints(kind_of_how, include_extras=True)
    own = [one.replace(annotation=hints[one.name]) for one in inspect.signature(command).parameters.values()][1:]
    names = {one.name: one.default for one in fields(kind_of_how)}

    @wraps(command)
    def call(**given: object) -> None:
        command(kind_of_how(**{name: given.pop(name) for name in names}), **given)

    kind = inspect.Parameter.KEYWORD_ONLY
    added = [inspect.Parameter(name, kind, default=first, annotation=options[name]) for name, first in names.items()]
    parameters = [*(one.replace(kind=kind) for one in own), *added]
    call.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    call.__annotations__ = {one.name: one.annotation for one in parameters}
    return call
