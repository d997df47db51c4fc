"""The command's group: an unknown command is answered with the one that was meant."""

from __future__ import annotations

from typing import Any, NoReturn

import typer
from typer.core import TyperGroup

from hvisph.casefile.renamed_keys import COMMANDS, OPTIONS
from hvisph.core.errors import suggest_nearest

# What people try, and what it is called here.
MEANT = {
    "view": "report", "picture": "plot", "draw": "plot", "show": "report", "movie": "animate", "video": "animate",
    "film": "animate", "start": "run", "restart": "resume", "continue": "resume", "validate": "check", "info": "check",
    "estimate": "check", "list": "cases", "examples": "cases", "test": "verify", "diff": "compare", "search": "help",
    "history": "watch", "monitor": "watch", "tail": "watch", "parameter": "sweep", "html": "report",
    "bisect": "ballistic-limit",
}  # fmt: skip


class Group(TyperGroup):
    """Commands with suggestions."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Return the command that the arguments begin with, or say which was probably meant."""
        name = args[0] if args else ""
        if name and not name.startswith("-") and self.get_command(ctx, name) is None:
            commands = self.list_commands(ctx)
            if name in COMMANDS:
                _refuse(f"`hvisph {name}` is now `hvisph {COMMANDS[name]}`")
            meant = MEANT.get(name.lower())
            hint = f"; did you mean '{meant}'?" if meant in commands else suggest_nearest(name[:64], commands)
            _refuse(f"there is no command '{name[:64]}'{hint}")
        command = super().resolve_command(ctx, args)
        known = {option for parameter in getattr(command[1], "params", ()) for option in parameter.opts}
        for option in (argument.partition("=")[0] for argument in args[1:]):
            if option not in known and OPTIONS.get(option) in known:
                _refuse(f"`{option}` is now `{OPTIONS[option]}`")
        return command


def _refuse(message: str) -> NoReturn:
    typer.secho(f"error: {message}", err=True)
    raise typer.Exit(2)
