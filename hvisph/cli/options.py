"""Options that several commands share, and the cases that they mean."""

import inspect
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import fields
from functools import wraps
from pathlib import Path
from typing import Annotated, Any, get_type_hints

import typer

from hvisph.case import units
from hvisph.case.case import Case
from hvisph.casefile.document import read_yaml
from hvisph.casefile.errors import locate_error
from hvisph.casefile.loader import find_case, load_case
from hvisph.casefile.paths import bundled_cases, run_name
from hvisph.core.errors import CaseError, suggest_nearest


def option(usage: str, help: str, default: Any = ..., **settings: Any) -> Any:
    """Return an option by its usage, such as ``--out, -o FILE``, its help and its default; `settings` are for typer.

    Without a default it is required, or has that of its parameter where it stands in an annotation.
    """
    *names, last = usage.split(", ")
    name, _, metavar = last.partition(" ")
    return typer.Option(default, *names, name, metavar=metavar or None, help=help, **settings)


def argument(metavar: str, help: str, default: Any = ..., **settings: Any) -> Any:
    """Return an argument by its name in the usage, its help and its default; see `option`."""
    return typer.Argument(default, metavar=metavar, help=help, **settings)


CaseArgument = Annotated[str, argument("CASE", "Case file, or name of a bundled case (see `hvisph cases`).")]
ResolutionOption = Annotated[
    str | None, option("--resolution LENGTH", "Particle spacing in place of the case's: 0.2mm.")
]
SetOption = Annotated[
    list[str] | None, option("--set PATH=VALUE", "Set any field of the case: time.end=2us. Repeatable.")
]
ThreadsOption = Annotated[
    int | None, option("--threads N", "Number of threads; chosen by the work of a step unless given.", min=1)
]
PictureOption = Annotated[str | None, option("--picture FILE", "Draw the set-up into this file: setup.png.")]
JsonOption = Annotated[bool, option("--json", "Print JSON only, in SI units.")]
ReportOption = Annotated[bool, option("--report", "Write the run's report.html when it ends.")]
AllOption = Annotated[bool, option("--all", "Print all measures when the run ends.")]
QuietOption = Annotated[bool, option("--quiet", "Print nothing but errors.")]
OutOption = Annotated[Path | None, option("--out DIR", "Folder of the run; runs/NAME unless given.")]


def shared(command: Callable[..., None]) -> Callable[..., None]:
    """Return a command with the options of its first argument, `how`, behind its own."""
    hints = get_type_hints(command, include_extras=True)
    kind_of_how = hints["how"]
    options = get_type_hints(kind_of_how, include_extras=True)
    arguments = [p.replace(annotation=hints[p.name]) for p in inspect.signature(command).parameters.values()][1:]
    names = {field.name: field.default for field in fields(kind_of_how)}

    @wraps(command)
    def call(**values: object) -> None:
        command(kind_of_how(**{name: values.pop(name) for name in names}), **values)

    mode = inspect.Parameter.KEYWORD_ONLY
    added = [inspect.Parameter(name, mode, default=first, annotation=options[name]) for name, first in names.items()]
    parameters = [*(p.replace(kind=mode) for p in arguments), *added]
    call.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    call.__annotations__ = {p.name: p.annotation for p in parameters}
    return call


PICTURES = (".png", ".pdf", ".svg", ".jpg", ".jpeg", ".webp", ".tif", ".tiff", ".eps", ".ps")


def load(case: str, settings: Sequence[str] | None, resolution: str | None) -> Case:
    """Return the validated case that the arguments of a command mean."""
    return load_case(case, settings or (), resolution)


def parse_option(text: str, dimension: str, option: str, remedy: str = "") -> float:
    """Return an option in SI, of a dimension of `hvisph.case.units` such as ``TIME``; `CaseError` with `remedy`."""
    try:
        return units.parse_quantity(text.strip(), getattr(units, dimension))
    except ValueError as error:
        raise CaseError(f"{error}{remedy}", where=option) from None


def refuse_format(picture: Path, option: str) -> None:
    """Refuse a picture that cannot be stored; raises `CaseError` that names the option."""
    if picture.suffix.lower() not in PICTURES:
        fault = f"{picture}: pictures cannot be stored as '{picture.suffix}'{suggest_nearest(picture.suffix, PICTURES)}"
        raise CaseError(fault, where=option)


def case_of_run(folder: Path) -> Case | None:
    """Return the effective case of a run's folder; None where there is none that this version can read."""
    with suppress(CaseError):
        return load_case(folder / "case.yaml") if (folder / "case.yaml").is_file() else None
    return None


@contextmanager
def locate_errors(case: str) -> Iterator[None]:
    """Add file and line to a `CaseError` of this block that names a field alone, as of overlapping bodies."""
    try:
        yield
    except CaseError as error:
        keys = tuple(int(key) if key.isdecimal() else key for key in error.where.split("."))
        if error.file or error.where.startswith("-") or not error.where:
            raise

        raise locate_error(keys, error.message, read_yaml(find_case(case)).places) from None


def run_folder(case: str) -> Path:
    """Return a run's default folder, ``runs/NAME`` by file or bundled name; raises `CaseError` for no name."""
    bundled = case in bundled_cases() and not Path(case).is_file()
    return Path("runs") / (case if bundled else run_name(case))
