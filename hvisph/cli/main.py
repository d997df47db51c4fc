"""The command `hvisph`: every command is a file of this room, and imports what it needs when it is called."""

from __future__ import annotations

import atexit
import gc
import os
from typing import Annotated

import typer

import hvisph
from hvisph.cli.text.echo import say

from .commands import (
    cases,
    check,
    compare,
    correlations,
    doctor,
    exact,
    gauges,
    help,
    materials,
    measure,
    plot,
    point,
    report,
    run,
    schema,
    sweep,
    validate,
    verify,
    watch,
)
from .group import Group
from .guard import guard_errors

atexit.register(gc.freeze)  # no collection at the end of a command, 0.2 s
# numpy's linear algebra starts its threads when it is imported, 0.06 s; matrices here are small.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# Models of cases are as this package has them: pydantic need not look through all packages for plugins.
os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")


app = typer.Typer(
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
    run.resume,
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
    help.help,
    sweep.sweep,
    sweep.fit,
    sweep.converge,
    sweep.ballistic_limit,
    correlations.correlations,
    schema.schema,
    doctor.doctor,
):
    app.command()(guard_errors(command))


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
