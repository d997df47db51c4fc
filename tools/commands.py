"""Write docs/commands.md and the index of all pages for `hvisph help`: `python tools/commands.py --write`."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path

import typer

PAGE = Path(__file__).parents[1] / "docs" / "commands.md"
INDEX = PAGE.parents[1] / "hvisph" / "casefile" / "pages.json"


def text() -> str:
    """Return the page."""
    from hvisph.cli.main import app

    group = typer.main.get_command(app)
    context = typer.Context(group, info_name="hvisph")
    about = "Made from the commands themselves. `--json` prints for programs, `--quiet` nothing but errors."
    parts = [f"# Commands\n\n{about}\n"]
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        own = typer.Context(command, info_name=name, parent=context)
        parts.append(f"## hvisph {name}\n\n{_paragraphs(command.help or '')}\n")
        arguments = [p.metavar or (p.name or "").upper() for p in command.params if p.param_type_name == "argument"]
        parts.append(f"`hvisph {name} {' '.join(arguments)}`\n" if arguments else f"`hvisph {name}`\n")
        rows = [record for record in (p.get_help_record(own) for p in command.params) if record]
        if rows:
            lines = [f"| `{left.replace('|', '/')}` | {right.replace('|', '/')} |" for left, right in rows]
            parts.append("\n".join(["| | |", "| --- | --- |", *lines]) + "\n")
    return "\n".join(parts)


def index() -> str:
    """Return the titles and headings of all pages, as JSON."""
    pages = {}
    for path in sorted(PAGE.parent.rglob("*.md")):
        prose = re.sub(r"```.*?```", "", path.read_text(encoding="utf-8"), flags=re.DOTALL)
        pages[path.relative_to(PAGE.parent).as_posix()] = re.findall(r"^##? (.+)$", prose, re.MULTILINE)
    pages["commands.md"] = pages["commands.md"][:1]  # the commands themselves are searched
    return json.dumps(pages, indent=1, ensure_ascii=False) + "\n"


def _paragraphs(help_text: str) -> str:
    return "\n\n".join(" ".join(part.split()) for part in help_text.strip().split("\n\n"))


if __name__ == "__main__":
    if sys.argv[1:] == ["--write"]:
        PAGE.write_text(text(), encoding="utf-8")
        INDEX.write_text(index(), encoding="utf-8")
    else:
        sys.stdout.write(text())
