"""Write docs/commands.md, the texts of `--help` and the index of `hvisph help`: `python tools/commands.py --write`."""

from __future__ import annotations

import json
import re
import sys
from collections import Counter
from pathlib import Path

import typer

PAGE = Path(__file__).parents[1] / "docs" / "commands.md"
INDEX = PAGE.parents[1] / "hvisph" / "casefile" / "pages.json"
HELP = PAGE.parents[1] / "hvisph" / "cli" / "help.json"


HEAD = """\
# Commands

Made by `tools/commands.py`; do not edit. `hvisph COMMAND --help` prints the same. Exit codes: 0
done, 2 invalid input, 3 a run failed; others are named below.

## Common arguments and options

| | |
| --- | --- |
{common}

## All commands

| | |
| --- | --- |
{commands}
"""
COMMON = 2  # commands that share an argument or an option which is described once


def contexts() -> dict[str, typer.Context]:
    """Return the context of every command by its name."""
    from hvisph.cli.main import app

    group = typer.main.get_command(app)
    parent = typer.Context(group, info_name="hvisph", terminal_width=78, **group.context_settings)
    return {
        name: typer.Context(group.get_command(parent, name), info_name=name, parent=parent)
        for name in group.list_commands(parent)
    }


def help_texts() -> str:
    """Return the text of `--help` of every command, as JSON."""
    return json.dumps({name: context.get_help() for name, context in contexts().items()}, indent=1) + "\n"


def text() -> str:
    """Return the page."""
    commands, rows = {}, {}
    for name, context in contexts().items():
        command = commands[name] = context.command
        records = [record for record in (p.get_help_record(context) for p in command.params) if record]
        rows[name] = [f"`{use.replace('|', '/')}` | {right.replace('|', '/')}" for use, right in records]
    counts = Counter(row for lists in rows.values() for row in lists)
    common = [row for row, count in counts.items() if count >= COMMON]
    lines = []
    for name, command in commands.items():
        arguments = [p.metavar or (p.name or "").upper() for p in command.params if p.param_type_name == "argument"]
        usage = f"**`{' '.join(['hvisph', name, *arguments]).replace('|', '/')}`**"
        shared = [row.split("`")[1].split()[0] for row in rows[name] if row in common]
        options = ", ".join(f"`{option}`" for option in shared if option.startswith("-"))
        about = " ".join((command.help or "").split()).replace("|", "/")
        more = [row.replace(" | ", ": ", 1) for row in rows[name] if row not in common]
        lines.append(f"| {usage} | {'<br>'.join([about, *more, *([f'Common: {options}'] if options else [])])} |")
    return HEAD.format(common="\n".join(f"| {row} |" for row in common), commands="\n".join(lines))


def index() -> str:
    """Return the titles and headings of all pages, as JSON."""
    pages = {}
    for path in sorted(PAGE.parent.rglob("*.md")):
        prose = re.sub(r"```.*?```", "", path.read_text(encoding="utf-8"), flags=re.DOTALL)
        pages[path.relative_to(PAGE.parent).as_posix()] = re.findall(r"^##? (.+)$", prose, re.MULTILINE)
    pages["commands.md"] = pages["commands.md"][:1]  # the commands themselves are searched
    return json.dumps(pages, indent=1, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    if sys.argv[1:] == ["--write"]:
        PAGE.write_text(text(), encoding="utf-8")
        INDEX.write_text(index(), encoding="utf-8")
        HELP.write_text(help_texts(), encoding="utf-8")
    else:
        sys.stdout.write(text())
