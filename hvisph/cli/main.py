"""The command `hvisph`: its group of commands, with imports at their call."""

import atexit
import gc
import os
from typing import Annotated, Any, NoReturn

import typer
from typer.core import TyperGroup

import hvisph
from hvisph.casefile.spellings import spellings
from hvisph.cli.formatting import say
from hvisph.core.errors import suggest_nearest

from .commands import check, doctor, library, measure, pictures, references, run, sweep, verify
from .guard import guard_errors


class Group(TyperGroup):
    """Commands with suggestions."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Return the command of the first argument, or refuse an unknown one with the nearest name."""
        name = args[0] if args else ""
        if name and not name.startswith("-") and self.get_command(ctx, name) is None:
            commands = self.list_commands(ctx)
            if name in spellings("commands"):
                _refuse(f"`hvisph {name}` is now `hvisph {spellings('commands')[name]}`")
            meant = spellings("meant").get(name.lower())
            hint = f"; did you mean '{meant}'?" if meant in commands else suggest_nearest(name[:64], commands)
            _refuse(f"there is no command '{name[:64]}'{hint}")
        command = super().resolve_command(ctx, args)
        known = {option for parameter in getattr(command[1], "params", ()) for option in parameter.opts}
        for option in (argument.partition("=")[0] for argument in args[1:]):
            if option.startswith("-") and option not in known and spellings("options").get(option) in known:
                _refuse(f"`{option}` is now `{spellings('options')[option]}`")
        return command


def _refuse(message: str) -> NoReturn:
    typer.secho(f"error: {message}", err=True)
    raise typer.Exit(2)


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
    run.watch,
    check.check,
    measure.measure,
    measure.compare,
    pictures.report,
    pictures.plot,
    pictures.animate,
    pictures.gauges,
    references.exact,
    verify.verify,
    verify.validate,
    library.cases,
    library.materials,
    references.point,
    library.help,
    sweep.sweep,
    sweep.fit,
    sweep.converge,
    sweep.ballistic_limit,
    references.correlations,
    library.schema,
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
