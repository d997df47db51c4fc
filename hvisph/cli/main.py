"""The command `hvisph`: every command is a file of this room, and imports what it needs when it is called."""

from __future__ import annotations

import atexit
import gc
import os
import sys
from typing import Annotated, Any

import typer
from typer.models import CommandInfo

import hvisph
from hvisph.cli.text.echo import say

from .commands import (
    cases,
    check,
    compare,
    doctor,
    exact,
    explain,
    gauges,
    limits,
    materials,
    measure,
    plot,
    point,
    report,
    resume,
    run,
    schema,
    sweep,
    validate,
    verify,
    watch,
)
from .group import Group
from .guard import guarded

_USUAL, _FIRST = gc.get_threshold(), 250_000  # objects made between two collections, and before the first


def _imported(phase: str, _: dict[str, int]) -> None:
    """Leave what was there at the first collection alone from then on, and collect as usual."""
    if phase == "stop" and gc.get_threshold()[0] == _FIRST:  # not that of a loop that is compiled
        gc.callbacks.remove(_imported)
        gc.freeze()
        gc.set_threshold(*_USUAL)


# Python's collector looks through all that is imported, again and again, a sixth of the time of `check`, and twice more
# at the end, 0.2 s. Imports leave next to nothing to collect: the first collection waits for more than they make.
gc.set_threshold(_FIRST)
gc.callbacks.append(_imported)
atexit.register(gc.freeze)
# numpy's linear algebra starts its threads when it is imported, 0.06 s; matrices here are small.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# Models of cases are as this package has them: pydantic need not look through all packages for plugins.
os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")


class _App(typer.Typer):
    """All commands; of a process that is given one of them that one alone is made ready, which takes a twentieth."""

    def __call__(self, *arguments: Any, **further: Any) -> Any:
        asked = [one for one in self.registered_commands if _name(one) in sys.argv[1:2]]
        if asked and not arguments and not further.get("args"):
            self.registered_commands = asked
        return super().__call__(*arguments, **further)


def _name(command: CommandInfo) -> str:
    return command.name or command.callback.__name__.replace("_", "-")  # type: ignore[union-attr]


app = _App(
    name="hvisph",
    cls=Group,
    help="Smoothed particle hydrodynamics for solids under high-velocity impact, from a case file.",
    epilog="Start with: hvisph run quickstart",
    no_args_is_help=True,
    add_completion=False,
    # plain text and no tracebacks: both would import rich, which takes longer than all of the rest
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

for command in (
    run.run,
    resume.resume,
    watch.watch,
    check.check,
    measure.measure,
    compare.compare,
    report.report,
    plot.plot,
    plot.animate,
    gauges.gauges,
    exact.exact,
    verify.verify,
    validate.validate,
    cases.cases,
    materials.materials,
    point.point,
    explain.help,
    sweep.sweep,
    sweep.fit,
    sweep.converge,
    sweep.ballistic_limit,
    limits.correlations,
    schema.schema,
    doctor.doctor,
):
    app.command()(guarded(command))


def _version(asked: bool) -> None:
    if asked:
        say(f"hvisph {hvisph.__version__}")
        raise typer.Exit


@app.callback()
def _hvisph(
    version: Annotated[
        bool, typer.Option("--version", help="Print the version and exit.", callback=_version, is_eager=True)
    ] = False,
) -> None:
    """Smoothed particle hydrodynamics for solids under high-velocity impact, from a case file."""
