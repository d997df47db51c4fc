"""The command `hvisph`: its group of commands, each imported when it is called."""

import atexit
import gc
import json
import os
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer
from typer.core import TyperGroup

import hvisph
from hvisph.casefile.spellings import spellings
from hvisph.cli.formatting import say
from hvisph.core.errors import suggest_nearest

from .guard import guard_errors

# Commands in the order of the help: the module of `commands` that has the function, and a line for the list.
COMMANDS = {
    "run": ("run", "Run a case and write its folder."),
    "resume": ("run", "Continue a run from its newest checkpoint."),
    "watch": ("run", "Show progress and measures of a run until it ends."),
    "check": ("check", "Check a case: particles, time, pressure, warnings."),
    "measure": ("measure", "Measure a run: crater, penetration, plug, fragments."),
    "compare": ("compare", "Compare runs: measures, published values, cost."),
    "report": ("pictures", "Write a page: result, animation, measures, warnings."),
    "plot": ("pictures", "Draw the particles of one or several runs."),
    "animate": ("pictures", "Draw all snapshots of a run as an animation."),
    "gauges": ("pictures", "Draw the gauges of a run."),
    "exact": ("references", "Solve a 1D case exactly."),
    "verify": ("verify", "Run problems with an exact solution."),
    "validate": ("verify", "Compute sets of experiments."),
    "cases": ("library", "List the bundled cases, print one, or copy them."),
    "materials": ("references", "List the material library, or print one material."),
    "point": ("references", "Strain a material point along a path."),
    "help": ("library", "Describe a key of the case file, or find a word."),
    "sweep": ("sweep", "Run a parameter study and tabulate its measures."),
    "fit": ("sweep", "Fit parameters of a material to measured shots."),
    "converge": ("sweep", "Run a case at several resolutions: order, index."),
    "ballistic-limit": ("sweep", "Find the ballistic limit by bisection."),
    "correlations": ("references", "Evaluate empirical correlations for a case."),
    "schema": ("library", "Print a JSON schema, or write all into a folder."),
    "doctor": ("doctor", "Show versions, cores and cache; test a compiled loop."),
}
HELP = {"-h", "--help"}
# Plain text and no tracebacks: both would import rich, which takes longer than all of the rest.
PLAIN: dict[str, Any] = {"add_completion": False, "rich_markup_mode": None, "pretty_exceptions_enable": False}


def function_of(name: str) -> Callable[..., None] | None:
    """Return the function of a command, whose module is imported; None for an unknown name."""
    if name not in COMMANDS:
        return None
    module = import_module(f"hvisph.cli.commands.{COMMANDS[name][0]}")
    return guard_errors(getattr(module, name.replace("-", "_")))


class Group(TyperGroup):
    """Commands that are imported when called, with suggestions for unknown ones."""

    def list_commands(self, ctx: Any) -> list[str]:
        """Return the names of all commands."""
        return list(COMMANDS)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Return a command by its name; None where there is none."""
        if cmd_name not in self.commands and (function := function_of(cmd_name)) is not None:
            program = typer.Typer(**PLAIN)
            program.command(cmd_name)(function)
            self.commands[cmd_name] = typer.main.get_command(program)
        return self.commands.get(cmd_name)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write the list of commands without importing them."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, line) for name, (_, line) in COMMANDS.items()])

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Return the command of the first argument, or refuse an unknown one with the nearest name."""
        name = args[0] if args else ""
        if name and not name.startswith("-") and name not in COMMANDS:
            if name in spellings("commands"):
                _refuse(f"`hvisph {name}` is now `hvisph {spellings('commands')[name]}`")
            meant = spellings("meant").get(name.lower())
            hint = f"; did you mean '{meant}'?" if meant in COMMANDS else suggest_nearest(name[:64], list(COMMANDS))
            _refuse(f"there is no command '{name[:64]}'{hint}")
        if HELP & {*args[1:]} and name in COMMANDS:  # without importing the command
            say(json.loads(Path(__file__).with_name("help.json").read_text(encoding="utf-8"))[name])
            raise typer.Exit
        command = super().resolve_command(ctx, args)
        allowed = {option for parameter in getattr(command[1], "params", ()) for option in parameter.opts}
        for option in (argument.partition("=")[0] for argument in args[1:]):
            if option.startswith("-") and option not in allowed and spellings("options").get(option) in allowed:
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
    context_settings={"help_option_names": sorted(HELP, key=len)},
    **PLAIN,
)


def _version(requested: bool) -> None:
    if requested:
        say(f"hvisph {hvisph.__version__}")
        raise typer.Exit


@app.callback()
def _hvisph(
    version: Annotated[
        bool, typer.Option("--version", help="Print the version and exit.", callback=_version, is_eager=True)
    ] = False,
) -> None:
    """Smoothed particle hydrodynamics for solids under high-velocity impact, from a case file."""
