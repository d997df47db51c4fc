"""Write the schemas and the pages of the case file: `python tools/case_schema.py --write`.

They come from the models; without `--write` the schema of a case is printed.
"""

import json
import re
import sys
from collections.abc import Iterable, Iterator, Sequence
from functools import cache
from inspect import cleandoc
from pathlib import Path
from textwrap import fill

from pydantic import BaseModel

from hvisph.case.case import Case
from hvisph.case.sweep import Sweep
from hvisph.case.units import COMMON_UNITS, DIMENSIONS, NUMBER
from hvisph.casefile.manual import default_text, value_text
from hvisph.casefile.model_fields import Spot, spot_of
from hvisph.core.measure_catalogue import CATALOGUE, SECTIONS, Measure
from hvisph.core.text import Plain

DIALECT = "https://json-schema.org/draft/2020-12/schema"
IDENTIFIER = "urn:hvisph:schema:v1:"  # the version rises when a valid file becomes invalid, from release 1.0 on
BASE = {
    "type": "string",
    "description": "Another case file, relative to this one, that this one changes: mappings merge key by "
    "key, null takes a key away, another `type` replaces a block",
}
# Page, title and paths of the case whose blocks it describes; what no page names stands on the last one.
PAGES = {
    "bodies": ("Bodies", ("bodies",)),
    "shapes": ("Shapes", ("bodies.shape",)),
    "materials": ("Materials", ("bodies.material",)),
    "formulation": ("Formulation", ("formulation",)),
    "output": ("Time, gauges and output", ("time", "gauges", "output", "witness")),
    "conditions": ("Symmetry, supports and limits", ()),
}
# Pages with formulas and sources of the models of a block.
FORMULAS = {
    "bodies.material.eos": "eos",
    "bodies.material.strength": "strength",
    "bodies.material.damage": "damage",
    "bodies.material.temperature": "thermal",
    "bodies.material.melting": "thermal",
    "bodies.material.porosity": "thermal",
}
MANY = 6  # alternatives that a table does not list
VARIANT = re.compile(r"µ|\*\*|m3$|degrees|\(kg\*")  # other spellings of a unit, which the list leaves out
_HEAD = """\
# The case file

Made from the models by `python tools/case_schema.py --write`; do not edit.

A case is one YAML file. Unknown keys are errors. Numbers are plain SI or carry a unit, such as `0.1
mm`, `3.1 km/s` or `27.6 GPa`; the dimension is checked. With `units: none` the case is
non-dimensional and only plain numbers are allowed. The first line `# yaml-language-server:
$schema=../schemas/case.schema.json` gives editors completion and checks. `hvisph help PATH` prints
the same texts.

Every field can be set from the command line: `--set time.end=2us`, `--set
bodies.projectile.velocity.0='4 km/s'`. A file may start from another one with `base: other.yaml`
and contain only the differences. In both, mappings merge key by key, anything else is replaced,
null removes a key, and another `type` replaces the whole block.
"""


def case_schema() -> Plain:
    """Return the JSON schema of a case file."""
    case = Case.model_json_schema()
    definitions = case.pop("$defs")
    for definition in definitions.values():
        if "const" in definition.get("properties", {}).get("type", {}):
            definition["required"] = ["type", *definition.get("required", [])]
    definitions["Case"] = case
    # A file with a base may hold any part of a case: only its outermost keys can be checked.
    changes = {
        "type": "object",
        "properties": {"base": BASE} | {name: {} for name in case["properties"]},
        "additionalProperties": False,
    }
    return {
        "$schema": DIALECT,
        "$id": IDENTIFIER + "case",
        "title": "hvisph case file",
        "description": Case.__doc__,
        "if": {"required": ["base"]},
        "then": changes,
        "else": {"$ref": "#/$defs/Case"},
        "$defs": definitions,
    }


def schema_text() -> str:
    """Return the JSON schema as the text of `schemas/case.schema.json`."""
    return json.dumps(case_schema(), indent=1, ensure_ascii=False) + "\n"


def case_manual() -> dict[str, str]:
    """Return the pages of the manual as Markdown, by the names of their files."""
    parts = {"README.md": [_HEAD, *_index(), "## Top-level keys\n", *_case_keys(), *_units()]}
    named = [path for _, paths in PAGES.values() for path in paths]
    for page, (title, paths) in PAGES.items():
        blocks = paths or tuple(name for name in Case.model_fields if name not in (*named, "measures", "expected"))
        parts[f"{page}.md"] = [f"# {title}\n", *_Sections().page(blocks)]
    parts["measures.md"] = ["# Measures and expectations\n", *_measures()]
    return {name: "\n".join(text).rstrip() + "\n" for name, text in parts.items()}


def _index() -> Iterator[str]:
    yield "| page | keys |"
    yield "| --- | --- |"
    for page, (title, paths) in PAGES.items():
        yield f"| [{title}]({page}.md) | {', '.join(f'`{path}`' for path in paths) or 'all other blocks'} |"
    yield "| [Measures and expectations](measures.md) | `measures`, `expected` |\n"


class _Sections:
    """Tables of a page: blocks of the case and the blocks below them, each model once.

    The keys of a block without a `type` stand below it in the same table; a block whose `type` chooses among models
    has a section of its own.
    """

    def __init__(self) -> None:
        self.described: dict[tuple[type[BaseModel], ...], str] = {}
        self.waiting: list[str] = []  # blocks with a `type` of the tables so far

    def page(self, paths: Sequence[str]) -> Iterator[str]:
        """Yield the text of a page on the blocks at `paths`."""
        rows: list[tuple[str, ...]] = []
        for path in paths:
            if _block(path).tagged:
                self.waiting.append(path)
                continue
            if not _block(path).models:
                continue
            (model,) = _block(path).models.values()
            other = self.described.get((model,))
            rows.append((f"**`{path}`**", "", "", _about(model, f" Keys as in `{other}`." if other else "")))
            rows += [] if other else self.rows(path, model)
        if rows:
            yield _table(rows)
        while self.waiting:
            yield from self._typed(self.waiting.pop(0))

    def rows(self, path: str, model: type[BaseModel], prefix: str = "") -> Iterator[tuple[str, ...]]:
        """Yield key, value, default and meaning of every field of the block at `path`, and of the blocks in it."""
        self.described.setdefault((model,), path)
        for name, info in model.model_fields.items():
            if name == "type":
                continue
            spot, below = spot_of(info.annotation, info), f"{path}.{name}"
            inner = _inner(spot)
            long = spot.tagged and len(spot.models) > MANY
            value = "block with a `type`" if long else value_text(spot)
            other = self._known(inner) if inner.models else ""
            if other and not long and (other != below or other in self.described.values()):
                value += f", as `{other}`"
            yield f"`{prefix}{name}`", value, default_text(name, info), _escaped(info.description or "")
            if not inner.models or other:
                continue
            if inner.tagged:
                self.described[tuple(inner.models.values())] = below
                self.waiting += [] if below in self.waiting else [below]
            else:
                (block,) = inner.models.values()
                yield from self.rows(below, block, f"{prefix}{name}.")

    def _known(self, spot: Spot) -> str:
        """Return the path at which the models at a spot are described, here or on another page."""
        models = tuple(spot.models.values())
        pages = [page for _, paths in PAGES.values() for page in paths if _models_at(page) == models]
        return next(iter(pages), "") or self.described.get(models, "")

    def _typed(self, path: str) -> Iterator[str]:
        """Yield the section of a block whose `type` chooses among models; equal keys are described once."""
        yield f"## `{path}`\n"
        if path in FORMULAS:
            yield f"Formulas and sources: [models](../models/{FORMULAS[path]}.md).\n"
        models = _block(path).models
        self.described[tuple(models.values())] = path
        lines: list[tuple[str, ...]] = []
        described: dict[tuple[str, ...], str] = {}
        for tag, model in models.items():
            rows = list(self.rows(path, model))
            above: dict[str, list[str]] = {}
            for row in rows:
                if row in described:
                    above.setdefault(described[row], []).append(row[0])
            links = "; ".join(f"{', '.join(keys)} as in `{place}`" for place, keys in above.items())
            lines.append((f"**`{tag}`**", "", "", _about(model, f" {links}." if links else "")))
            lines += [row for row in rows if row not in described]
            described |= {row: tag for row in rows if row not in described}
        yield _table(lines)


def _about(model: type[BaseModel], note: str = "") -> str:
    return _escaped(" ".join((model.__doc__ or "").split())) + note


def _escaped(text: str) -> str:
    """Return a text for a cell of a table: asterisks and bars outside code mean themselves."""
    parts = enumerate(text.split("`"))
    return "`".join(part if k % 2 else part.replace("*", "\\*").replace("|", "\\|") for k, part in parts)


def _table(rows: Iterable[tuple[str, ...]]) -> str:
    """Return a table of keys; rows in bold name the block or the type that the keys below belong to."""
    heads = ("key", "value", "default", "meaning")
    return "\n".join(f"| {' | '.join(row)} |" for row in [heads, ("---",) * len(heads), *rows]) + "\n"


def _inner(spot: Spot) -> Spot:
    """Return what the lists and named entries at a spot contain."""
    while spot.item is not None and not spot.models:
        spot = spot_of(spot.item)
    return spot


def _block(path: str) -> Spot:
    return _inner(_spot(path))


@cache
def _models_at(path: str) -> tuple[type[BaseModel], ...]:
    return tuple(_block(path).models.values())


def _spot(path: str) -> Spot:
    """Return the expected content at a path without names of bodies."""
    spot = Spot({"": Case})
    for key in path.split("."):
        models = _inner(spot).models.values()
        info = next(model.model_fields[key] for model in models if key in model.model_fields)
        spot = spot_of(info.annotation, info)
    return spot


def _case_keys() -> Iterator[str]:
    yield from map(_wrap, cleandoc(Case.__doc__ or "").split("\n\n"))
    yield _table(((f"`{name}`", value_text(spot_of(info.annotation, info)), default_text(name, info),
                       info.description or "") for name, info in Case.model_fields.items()))  # fmt: skip


def _wrap(text: str) -> str:
    return fill(text, 100, break_on_hyphens=False, break_long_words=False) + "\n"


def _units() -> Iterator[str]:
    yield "## Units\n"
    usual = {unit: kind for unit, (kind, _) in COMMON_UNITS.items() if not VARIANT.search(unit)}
    quantities = []
    for dimension in DIMENSIONS:
        if dimension is not NUMBER:
            units = ", ".join(f"`{unit}`" for unit, kind in usual.items() if kind is dimension)
            quantities.append(f"{dimension.name.split(' ', 1)[1]} {dimension.unit} ({units})")
    text = f"Plain numbers are in these units, usual others in parentheses: {'; '.join(quantities)}."
    yield _wrap(f"{text} Every unit known to [pint](https://pint.readthedocs.io) can be used.")


def _measures() -> Iterator[str]:
    yield (
        "`measures` lists names of this table. `expected` gives values, such as\n"
        "`crater_diameter: {value: 2.0 cm, tolerance: 0.2 cm, source: AUTHOR YEAR}`; a tolerance may be a\n"
        "percentage, `12 %`. A run that misses an expectation exits with code 1. Definitions:\n"
        "[measures](../measuring.md).\n"
    )
    rows = ["| name | meaning | dimensions |", "| --- | --- | --- |"]
    rows += [_measure_row(measure) for measure in CATALOGUE.values()]
    yield "\n".join(rows) + "\n"
    yield _wrap(
        "`hvisph measure` and `summary.json` also contain these measures of every layer, of the projectile and of the "
        "debris cloud. The value of a measure with variants is that of the first one."
    )
    rows = ["| measures of | name | meaning | dimensions |", "| --- | --- | --- | --- |"]
    for section, measures in SECTIONS.items():
        rows += [f"| {section} {_measure_row(measure)}" for measure in measures.values() if section != "run"]
    yield "\n".join(rows) + "\n"


def _measure_row(measure: Measure) -> str:
    variants = "; ".join(f"`{name}`: {meaning}" for name, meaning in measure.variants.items())
    meaning = f"{measure.meaning}; variants: {variants}" if variants else measure.meaning
    return f"| `{measure.name}` | {meaning} | {', '.join(f'{dim}D' for dim in measure.dims)} |"


def generated_files(root: Path) -> dict[Path, str]:
    """Return the files of a source tree at `root` that come from the models, with their text."""
    sweep = {"$schema": DIALECT, "$id": IDENTIFIER + "sweep", "title": "hvisph sweep", **Sweep.model_json_schema()}
    return {
        root / "schemas/case.schema.json": schema_text(),
        root / "schemas/sweep.schema.json": json.dumps(sweep, indent=1, ensure_ascii=False) + "\n",
    } | {root / "docs/case-file" / name: text for name, text in case_manual().items()}


def main(arguments: list[str]) -> int:
    """Print the schema, or write all generated files with `--write`."""
    if arguments != ["--write"]:
        sys.stdout.write(schema_text())
        return 0
    for path, text in generated_files(Path(__file__).resolve().parents[1]).items():
        path.parent.mkdir(exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
