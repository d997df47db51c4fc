"""The table of measured shocks in docs/materials.md: the library compared with measured points or fits.

`python tools/hugoniots.py --write` writes it into the page.
"""

from __future__ import annotations

import sys
import textwrap
from collections.abc import Iterator, Sequence
from pathlib import Path

from hvisph.casefile.material_library import Notes, library_of, material_names
from hvisph.postprocessing.material_sheet import compare_hugoniot, worst_bin

PAGE = Path(__file__).parents[1] / "docs" / "materials.md"
BEGIN, END = "<!-- made by tools/hugoniots.py -->", "<!-- end -->"
HEAD = """| material | compared with | up [km/s] | rms, worst [%] | bin; scatter [%] | no strength | within 2 % |
| --- | --- | --- | --- | --- | --- | --- |"""
MET = 2.0  # [%]


def rows(names: Sequence[str]) -> Iterator[str]:
    """Yield the rows of some materials."""
    for name in names:
        notes = library_of().notes(name)
        if notes.hugoniot:
            author = next(" ".join(source.text.split()) for source in notes.sources if "hugoniot" in source.of)
            yield row(name, f"{len(notes.hugoniot)} points: {author}", notes.hugoniot, notes, fit=False)
        for line in notes.lines:
            yield row(name, f"fit: {' '.join(line.source.split())}", line.points, notes, fit=True)


def row(name: str, author: str, points: Sequence[tuple[float, float]], notes: Notes, fit: bool) -> str:
    """Return a material's row beside some points."""
    model = library_of().load(name)
    low, high = (end(u for u, _ in points) / 1e3 for end in (min, max))
    comparison = compare_hugoniot(model, points)
    fluid = "none" if model.strength.type == "none" else apart(compare_hugoniot(model, points, strength=False))
    bins = None if fit else worst_bin(comparison)
    worst = max(abs(100.0 * (computed / measured - 1.0)) for _, measured, computed in comparison)
    words, judged = "", worst
    if bins is not None:
        error, where, scatter = bins
        words, judged = f"{error:+.1f} at {where / 1e3:.2g}; {scatter:.1f}", abs(error)
    verdict = "yes" if judged <= MET + 0.05 else ""
    if not verdict and notes.shocks:
        verdict = f"{notes.shocks[0] / 1e3:g} to {notes.shocks[1] / 1e3:g}"
    if notes.beyond and verdict != "yes":
        verdict = f"{verdict or 'nowhere'}; else `{notes.beyond}`"
    cells = f"| `{name}` | {author} | {low:.3g} to {high:.3g} | {apart(comparison)} | {words} | {fluid} |"
    return f"{cells} {verdict or 'no'} |"


def apart(comparison: Sequence[tuple[float, float, float]]) -> str:
    """Return how far shock speeds are off, and where most."""
    errors = [(100.0 * (computed / measured - 1.0), u) for u, measured, computed in comparison]
    rms = (sum(error**2 for error, _ in errors) / len(errors)) ** 0.5
    worst, where = max(errors, key=lambda pair: abs(pair[0]))
    return f"{rms:.1f}, {worst:+.1f} at {where / 1e3:.2g}"


def text(table: Sequence[str]) -> str:
    """Return the rows as a list of what agrees everywhere and a table of the rest."""
    differ = {line.split("`")[1] for line in table if not line.endswith("| yes |")}
    agree = dict.fromkeys(line.split("`")[1] for line in table)
    names = ", ".join(f"`{name}`" for name in agree if name not in differ)
    names_text = textwrap.fill(f"Within 2 % everywhere: {names}.", 100, break_on_hyphens=False, break_long_words=False)
    return "\n".join([names_text, "", HEAD, *(line for line in table if line.split("`")[1] in differ)])


def main() -> None:
    """Print the table, or write it into the page."""
    table = text(list(rows(material_names())))
    if "--write" not in sys.argv:
        sys.stdout.write(f"{table}\n")
        return
    before, tail = PAGE.read_text(encoding="utf-8").split(BEGIN)
    after = tail.split(END)[1]
    PAGE.write_text(f"{before}{BEGIN}\n\n{table}\n\n{END}{after}", encoding="utf-8")


if __name__ == "__main__":
    main()
