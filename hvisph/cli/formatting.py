"""Text for people: printable output, numbers with units, and tables."""

import errno
import json
import math
import os
import sys
import textwrap
from collections.abc import Sequence

import typer

from hvisph.core.text import Plain, sanitize

_UNREAD = {errno.EPIPE, errno.EIO}  # errors of writing after the reader of a pipe has ended, or the terminal was closed


def say(text: object = "", *, err: bool = False, red: bool = False, nl: bool = True) -> None:
    """Print `text`, in red on a terminal where asked for."""
    show(typer.style(sanitize(text), fg=typer.colors.RED) if red else sanitize(text), err=err, nl=nl)


def show(text: str, *, err: bool = False, nl: bool = True) -> None:
    """Print text with colours, without sanitizing it."""
    try:
        typer.echo(text, err=err, nl=nl)
    except OSError as error:
        if not deaf(error):
            raise


def deaf(error: OSError) -> bool:
    """Return whether `error` says that the output has no reader; further output is then discarded."""
    if error.errno not in _UNREAD:
        return False
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except (OSError, ValueError):
            os.dup2(nowhere, stream.fileno())
    os.close(nowhere)
    return True


SCREEN = 100  # columns of a terminal that tables fit into
GAP = 2  # between columns
NARROWEST = 24  # column in which words are wrapped
_PREFIXES = {"G": 1e9, "M": 1e6, "k": 1e3, "": 1.0, "m": 1e-3, "u": 1e-6, "n": 1e-9, "p": 1e-12}


def quantity(value: float, unit: str = "", digits: int = 4) -> str:
    """Return `value` [SI] with the prefix that suits it: 0.0001 m as ``0.1 mm``; as it is without a unit."""
    if not unit or unit.startswith("k") or value == 0.0 or not math.isfinite(value):  # kg/m^3 has its prefix
        return f"{value:.{digits}g} {unit}".rstrip()
    prefix, factor = _prefix_of(abs(value))
    return f"{value / factor:.{digits}g} {prefix}{unit}"


def _prefix_of(size: float) -> tuple[str, float]:
    """Return the prefix that suits a size, and its factor; the smallest one for smaller sizes."""
    # a tenth of a unit reads better than a hundred of the next smaller: 0.1 mm, not 100 um
    return next((pair for pair in _PREFIXES.items() if size >= 0.0999 * pair[1]), ("p", 1e-12))


def times(values: Sequence[float], unit: str = "s") -> list[str]:
    """Return a series of times [SI] with one prefix for all of them, which suits the least that is not 0."""
    if not unit:
        return [quantity(value) for value in values]
    smallest = min((abs(value) for value in values if value), default=1.0)
    prefix, factor = _prefix_of(smallest)
    return [f"{value / factor:.4g} {prefix}{unit}" for value in values]


def duration(seconds: float) -> str:
    """Return a wall-clock time in the two units that suit it: ``2 min 5 s``."""
    if seconds < 9.95:
        return f"{seconds:.1f} s"
    whole_seconds = round(seconds)
    for size, unit, next_size, next_unit in ((86400, "d", 3600, "h"), (3600, "h", 60, "min"), (60, "min", 1, "s")):
        if whole_seconds >= size:
            return f"{whole_seconds // size} {unit} {whole_seconds % size // next_size} {next_unit}"
    return f"{whole_seconds} s"


def size(count: float) -> str:
    """Return a number of bytes as ``12 MB``."""
    prefix, factor = next((pair for pair in _PREFIXES.items() if count >= pair[1]), ("", 1.0))
    return f"{count / factor:.3g} {prefix}B"


def table(rows: Sequence[Sequence[str]], indent: int = 2) -> str:
    """Return `rows` as text in aligned columns.

    Words in the last column are wrapped, so that lines fit a screen. Columns that are too many for it go on below,
    after the first one again.
    """
    rows = [[sanitize(cell) for cell in row] for row in rows]
    widths = _widths(rows)
    available = SCREEN - indent - sum(width + GAP for width in widths[:-1])
    if widths and widths[-1] > available >= NARROWEST:
        rows = [line for row in rows for line in _wrap(row, len(widths), available)]
        widths = _widths(rows)
    if len(widths) > 2 and indent + sum(widths) + GAP * (len(widths) - 1) > SCREEN:
        return tables(rows, indent=indent)
    return _align(rows, indent)


def tables(rows: Sequence[Sequence[str]], heads: int = 1, indent: int = 2) -> str:
    """Return `rows` as tables below each other, no wider than a screen, which all begin with `heads` columns.

    A row with fewer cells than others ends early.
    """
    widths = _widths(rows)
    head_width = indent + sum(width + GAP for width in widths[:heads])
    available = SCREEN - head_width
    blocks = _blocks(widths, heads, available)
    widest = max(widths[heads:], default=0)
    while available > widest and len(narrower := _blocks(widths, heads, available - 1)) == len(blocks):
        blocks, available = narrower, available - 1  # about as wide as each other
    groups = [[*range(heads), *block] for block in blocks]
    if len(groups) == 1:  # or the one column is wider than a screen by itself
        return _align(rows, indent)
    return "\n\n".join(table([[row[k] for k in columns if k < len(row)] for row in rows], indent) for columns in groups)


def _blocks(widths: Sequence[int], heads: int, available: int) -> list[list[int]]:
    """Return the columns from `heads` on in blocks that are no wider than `available`, single ones but for that."""
    blocks: list[list[int]] = [[]]
    occupied = 0
    for column in range(heads, len(widths)):
        if blocks[-1] and occupied + widths[column] > available:
            blocks.append([])
            occupied = 0
        blocks[-1].append(column)
        occupied += widths[column] + GAP
    return blocks


def _align(rows: Sequence[Sequence[str]], indent: int) -> str:
    widths = _widths(rows)
    lines = ((" " * GAP).join(cell.ljust(width) for cell, width in zip(row, widths, strict=False)) for row in rows)
    return "\n".join(" " * indent + line.rstrip() for line in lines)


def paragraph(text: str, indent: int = 0, hanging: int | None = None) -> str:
    """Return `text` in lines that fit a screen, those after the first indented by `hanging`."""
    first, hanging_indent = " " * indent, " " * (indent if hanging is None else hanging)
    words_only: Plain = {"break_long_words": False, "break_on_hyphens": False}
    return textwrap.fill(sanitize(text), SCREEN, initial_indent=first, subsequent_indent=hanging_indent, **words_only)


def _widths(rows: Sequence[Sequence[str]]) -> list[int]:
    return [max(len(row[k]) for row in rows if k < len(row)) for k in range(max(map(len, rows), default=0))]


def _wrap(row: Sequence[str], columns: int, available: int) -> list[list[str]]:
    """Return a row with its last cell wrapped; a row with fewer cells unchanged."""
    if len(row) < columns or len(row[-1]) <= available:
        return [list(row)]
    words = textwrap.wrap(row[-1], available, break_long_words=False, break_on_hyphens=False)
    return [[*row[:-1], words[0]], *([""] * (columns - 1) + [line] for line in words[1:])]


def echo_json(content: object) -> None:
    """Print `content` as JSON on standard output."""
    text = json.dumps(content, indent=2, ensure_ascii=False)
    show("".join(c if c == "\n" or sanitize(c) == c or c == "\\" else f"\\u{ord(c):04x}" for c in text))
