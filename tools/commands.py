"""Write docs/commands.md and the index of all pages for `hvisph help`: `python tools/commands.py --write`."""

from __future__ import annotations

import json
import re
import sys
from collections import Counter
from pathlib import Path

import typer

PAGE = Path(__file__).parents[1] / "docs" / "commands.md"
INDEX = PAGE.parents[1] / "hvisph" / "casefile" / "pages.json"


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


def text() -> str:
    """Return the page."""
    from hvisph.cli.main import app

    group = typer.main.get_command(app)
    context = typer.Context(group, info_name="hvisph")
    commands = {name: group.get_command(context, name) for name in group.list_commands(context)}
    rows = {}
    for name, command in commands.items():
        own = typer.Context(command, info_name=name, parent=context)
        records = [record for record in (p.get_help_record(own) for p in command.params) if record]
        rows[name] = [f"`{left.replace('|', '/')}` | {right.replace('|', '/')}" for left, right in records]
    counts = Counter(row for found in rows.values() for row in found)
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
    else:
        sys.stdout.write(text())
