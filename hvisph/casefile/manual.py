"""The reference manual of the case file, in Markdown, made from the models."""

from __future__ import annotations

from collections.abc import Iterator
from inspect import cleandoc

from pydantic import BaseModel

from hvisph.case.case import Case
from hvisph.case.dimensions import COMMON_UNITS, DIMENSIONS, NUMBER
from hvisph.core.measure_catalogue import CATALOGUE

from .field_text import default_text, value_text
from .material_library import library
from .model_fields import Spot, spot_of

_HEAD = """\
# The case file

Made from the models by `python -m hvisph.casefile.schema --write`; do not edit.

A case is one YAML file. Unknown keys are errors. Numbers are plain SI or carry a unit, such as
`0.1 mm`, `3.1 km/s` or `27.6 GPa`; the dimension is checked. With `units: none` the case is
non-dimensional and only plain numbers are allowed. The first line
`# yaml-language-server: $schema=../schemas/case.schema.json` gives editors completion and checks.

Any field can be set from the command line: `--set time.end=2us`,
`--set bodies.projectile.velocity.0='4 km/s'`,
`--set bodies.target.material.strength.yield_stress='0.4 GPa'`. A file may start from another one
with `base: other.yaml` and hold only what differs. In both, mappings merge key by key, anything
else is replaced, null takes a key away, and another `type` replaces the whole block.
"""


def case_manual() -> str:
    """Return the manual as Markdown text."""
    parts = [_HEAD, *_units(), "## Case", *_model(Case)]
    for name, info in Case.model_fields.items():
        if name != "expected":
            parts += _block(f"`{name}`", spot_of(info.annotation, info), 2)
    parts += [*_measures(), *_materials()]
    return "\n".join(parts).rstrip() + "\n"


def _block(title: str, spot: Spot, level: int, above: tuple[dict[str, type[BaseModel]], ...] = ()) -> Iterator[str]:
    """Yield the sections of what stands at `spot`, and of all that stands below it but not within itself."""
    while spot.item is not None and not spot.models:
        spot = spot_of(spot.item)
    if not spot.models or spot.models in above:
        return
    heading = "#" * min(level, 5)
    yield f"{heading} {title}\n"
    for tag, model in spot.models.items():
        if tag:
            yield f"{heading}# {title} `{{type: {tag}}}`\n"
        yield from _model(model)
    yield from _below(title, spot, level, (*above, spot.models))


def _below(title: str, spot: Spot, level: int, above: tuple[dict[str, type[BaseModel]], ...]) -> Iterator[str]:
    """Yield the sections of the fields below, each once however many alternatives have it."""
    seen: set[str] = set()
    for model in spot.models.values():
        for name, info in model.model_fields.items():
            if name not in seen:
                seen.add(name)
                yield from _block(f"{title[:-1]}.{name}`", spot_of(info.annotation, info), level + 1, above)


def _model(model: type[BaseModel]) -> Iterator[str]:
    yield cleandoc(model.__doc__ or "") + "\n"
    rows = [
        f"| `{name}` | {value_text(spot_of(info.annotation, info))} | {default_text(name, info)} | {info.description} |"
        for name, info in model.model_fields.items()
        if name != "type"
    ]
    if rows:
        yield "\n".join(["| key | value | default | meaning |", "| --- | --- | --- | --- |", *rows]) + "\n"


def _units() -> Iterator[str]:
    yield "## Units\n"
    yield "Any unit that [pint](https://pint.readthedocs.io) knows is understood; these are the usual ones.\n"
    rows = ["| quantity | plain numbers are in | usual units |", "| --- | --- | --- |"]
    for dimension in DIMENSIONS:
        if dimension is not NUMBER:
            units = ", ".join(f"`{unit}`" for unit, (kind, _) in COMMON_UNITS.items() if kind is dimension)
            rows.append(f"| {dimension.name.split(' ', 1)[1]} | {dimension.unit} | {units} |")
    yield "\n".join(rows) + "\n"


def _measures() -> Iterator[str]:
    yield "## `measures` and `expected`\n"
    yield (
        "`measures` lists names of this table. `expected` gives values: "
        "`crater_diameter: {value: 2.0 cm, tolerance: 0.2 cm, source: who says so}`; a tolerance may be a "
        "percentage of the value, `12 %`. A run that misses an expectation exits with code 1.\n"
    )
    rows = ["| name | meaning | dimensions |", "| --- | --- | --- |"]
    for name, measure in CATALOGUE.items():
        rows.append(f"| `{name}` | {measure.meaning} | {', '.join(f'{dim}D' for dim in measure.dims)} |")
    yield "\n".join(rows) + "\n"


def _materials() -> Iterator[str]:
    yield "## Material library\n"
    rows = ["| name | density [kg/m^3] | equation of state | strength | damage | source |"]
    rows.append("| --- | --- | --- | --- | --- | --- |")
    for name, material in library().items():
        rows.append(
            f"| `{name}` | {material.density:g} | `{material.eos.type}` | `{material.strength.type}` "
            f"| `{material.damage.type}` | {material.source} |"
        )
    yield "\n".join(rows) + "\n"
