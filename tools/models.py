"""Write docs/models: a page for each kind of material model, a section for each model.

    python tools/models.py --write [--pictures]

Formula, limits and source are the docstring of the model's module; every example runs. `--pictures` draws the
pictures again.
"""

from __future__ import annotations

import sys
import textwrap
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, get_args

import numpy as np

from hvisph.case.materials.damage import Damage
from hvisph.case.materials.eos import Eos
from hvisph.case.materials.material import Material, Melting, Porosity, Temperature
from hvisph.case.materials.strength import Strength
from hvisph.casefile.material_library import library_of
from hvisph.materials import isentrope, melting, porosity
from hvisph.materials.damage import REGISTRY as DAMAGES
from hvisph.materials.damage import fracture_energy
from hvisph.materials.eos import MODULES
from hvisph.materials.strength import REGISTRY as STRENGTHS

FOLDER = Path(__file__).parents[1] / "docs" / "models"
TABLE = "tillotson-aluminium.csv"
METAL = "aluminium-6061-t6"
STEEL = "{type: mie_gruneisen, sound_speed: 4570 m/s, s1: 1.49, gamma: 1.93}"
ALUMINIUM = "{type: mie_gruneisen, sound_speed: 5240 m/s, s1: 1.4, gamma: 1.97}"
FIRM = "{type: von_mises, shear_modulus: 27.6 GPa, yield_stress: 290 MPa}"

# Materials of the examples, where the library has none or one that shows more.
MATERIALS = {
    "linear": "{density: 998, eos: {type: linear, bulk_modulus: 2.2 GPa}}",
    "elastic": "{density: 2785, eos: {type: elastic, youngs_modulus: 70 GPa, poisson_ratio: 0.33}, "
               "strength: {type: elastic}}",
    "stiffened_gas": "aluminium-howell-ball",
    "mie_gruneisen": "copper-ofhc",
    "us_up_table": "iron-armco",
    "tillotson": "aluminium-tillotson",
    "polynomial": "glass-soda-lime",
    "murnaghan": "{density: 2700, eos: {type: murnaghan, bulk_modulus: 26.7 GPa, exponent: 4}}",
    "jwl": "{density: 1630, eos: {type: jwl, a: 371.2 GPa, b: 3.231 GPa, r1: 4.15, r2: 0.95, omega: 0.3, "
           "detonation_energy: 7 GPa, detonation: {points: [[0]], speed: 6930 m/s}}}",
    "table": f"{{density: 2700, eos: {{type: table, file: {TABLE}}}}}",
    "ideal_gas": "{density: 1.2, eos: {type: ideal_gas, gamma: 1.4}}",
    "strength elastic": f"{{density: 2703, eos: {ALUMINIUM}, strength: {{type: elastic, shear_modulus: 27.6 GPa}}}}",
    "von_mises": f"{{density: 2703, eos: {ALUMINIUM}, strength: {FIRM}}}",
    "linear_hardening": f"{{density: 2703, eos: {ALUMINIUM}, strength: {{type: linear_hardening, "
                        "shear_modulus: 27.6 GPa, yield_stress: 290 MPa, hardening_modulus: 500 MPa}}",
    "johnson_cook": METAL,
    "steinberg_guinan": "copper-ofhc-steinberg",
    "zerilli_armstrong": "{density: 8930, eos: {type: mie_gruneisen, sound_speed: 3940 m/s, s1: 1.489, gamma: 2.02}, "
                         "strength: {type: zerilli_armstrong, lattice: fcc, shear_modulus: 47.7 GPa, c0: 65 MPa, "
                         "c2: 890 MPa, c3: 0.0028 1/K, c4: 1.15e-4 1/K, melt_temperature: 1356 K}, "
                         "temperature: {type: isentrope, heat_capacity: 383 J/(kg K)}}",
    "cowper_symonds": f"{{density: 7850, eos: {STEEL}, strength: {{type: cowper_symonds, shear_modulus: 80 GPa, "
                      "yield_stress: 250 MPa, hardening_modulus: 500 MPa, reference_rate: 40.4 1/s, exponent: 5}}",
    "rock": "granite",
    "strength johnson_holmquist": "glass-soda-lime",
    "strength orthotropic": "cfrp-quasi-isotropic",
    "fabric": "nextel-af62",
    "hashin": "{base: cfrp-quasi-isotropic, damage: {type: hashin, fibre_tension: 500 MPa, fibre_compression: 400 MPa, "
              "matrix_tension: 60 MPa, matrix_compression: 200 MPa, shear: 90 MPa, transverse_shear: 75 MPa}}",
    "max_stress": "cfrp-quasi-isotropic",
    "pressure_cutoff": f"{{base: {METAL}, damage: {{type: pressure_cutoff, pressure: -1.2 GPa, permanent: true}}}}",
    "damage johnson_cook": METAL,
    "grady_kipp": "basalt",
    "grady_spall": f"{{base: {METAL}, damage: {{type: grady_spall, toughness: 29 MPa m^0.5, yield_stress: 290 MPa}}}}",
    "principal_stress": f"{{base: {METAL}, damage: {{type: principal_stress, tensile_strength: 1.5 GPa}}}}",
    "cockcroft_latham": f"{{base: {METAL}, damage: {{type: cockcroft_latham, critical_work: 80 MPa}}}}",
    "damage johnson_holmquist": "glass-soda-lime",
    "porosity": f"{{base: {METAL}, porosity: {{distension: 1.3, elastic_pressure: 50 MPa, solid_pressure: 700 MPa}}}}",
    "melting": f"{{base: {METAL}, melting: {{type: lindemann, temperature: 925 K, gamma: 1.97, a: 1.5}}}}",
    "temperature": METAL,
}  # fmt: skip
INTRODUCTION = """
Every section names an example material for the case below, a plate impact in one dimension. Save the case as
`plate.yaml` and run `hvisph run plate.yaml`; `hvisph point MATERIAL --path shear` integrates a material alone.
"""
SPEEDS = {"ideal_gas": "400 m/s", "linear": "100 m/s", "grady_kipp": "60 m/s", "rock": "200 m/s"}


# Title and introduction of every page.
PAGES = {
    "eos": ("Equations of state", "An equation of state gives the pressure from density and specific energy."),
    "strength": ("Strength models", "A strength model gives the yield stress that limits the deviatoric stress."),
    "damage": ("Damage models", "A damage model decides where a material fails, and what it carries afterwards."),
    "thermal": ("Porosity, melting, temperature", "These blocks of a material complement its equation of state."),
}
# Sections of a page from the docstrings of what its models share, with an example: heading, module, example.
SHARED = {
    "damage": (
        "Fracture energy",
        fracture_energy,
        """
A bar of 6061-T6 that is pulled apart, the toughness that of the library; `hvisph check` tells
l_max, and `summary.json` has `fracture_work` and `crack_area`.

```yaml
kinematics: axisymmetric
resolution: 0.5 mm
bodies:
  bar:
    material: {base: aluminium-6061-t6, damage: {toughness: material}}
    shape: {type: cylinder, diameter: 10 mm, length: 40 mm}
    position: [0, 0]
clamped:
  - {box: {min: [17 mm, null]}, velocity: [20 m/s, 0]}
  - {box: {max: [-17 mm, null]}, velocity: [-20 m/s, 0]}
time: {end: 200 us}
```

Limits: the width of the band stays that of a particle; rate and heat count until onset; in Total
Lagrangian bodies and standard SPH a band is three particles wide. Up to ten times the displacement
$w_f = 2 G_f/Y_0$ the energy is right (bars with a weak row: 0.87 to 1.11 of $G_f$ at 8 to 2 times;
2.7, 2.2 and 1.4 at 43, 21 and 11 times).
""",
    ),
}
NAMED = 3  # materials of the library that a section lists at most


def models() -> Iterator[tuple[str, str, str, str, list[Any]]]:
    """Yield of every model its name, kind, heading, module's docstring and case models."""
    for family_name, union in (("eos", Eos), ("strength", Strength), ("damage", Damage)):
        for model in get_args(get_args(union)[0]):
            name = model.model_fields["type"].default
            if name == "none":
                continue
            if family_name == "eos":
                module = MODULES[name]
            else:
                module = sys.modules[(STRENGTHS if family_name == "strength" else DAMAGES)[name].__module__]
            yield f"{family_name}-{name.replace('_', '-')}", family_name, name, module.__doc__ or "", [model]
    yield "porosity", "porosity", "Porosity", porosity.__doc__ or "", [Porosity]
    yield "melting", "melting", "Melting", melting.__doc__ or "", list(get_args(get_args(Melting)[0]))
    temperatures = list(get_args(get_args(Temperature)[0]))
    yield "temperature", "temperature", "Temperature", isentrope.__doc__ or "", temperatures


def pages() -> dict[str, str]:
    """Return the pages by name."""
    parts: dict[str, list[str]] = {}
    shared: dict[tuple[str, str], list[tuple[str, str, str, list[Any]]]] = {}
    for name, group, heading, doc, case_models in models():
        page = group if group in PAGES else "thermal"
        if page not in parts:
            title, about = PAGES[page]
            keys = "Keys: [the case file](../case-file/materials.md). Made by `tools/models.py`; do not edit."
            introduction = INTRODUCTION if page == "eos" else ""
            parts[page] = [f"# {title}\n", _wrapped(" ".join(f"{about} {keys} {introduction}".split()))]
            if page == "eos":
                parts[page].append(f"```yaml\n{case_text('eos-mie-gruneisen', 'eos')}\n```\n")
        shared.setdefault((page, doc), []).append((name, group, heading, case_models))
    for (page, doc), family in shared.items():
        parts[page].append(section(doc, family))
    for page, (heading, module, example) in SHARED.items():
        first, _, tail = textwrap.dedent(module.__doc__ or "").strip().partition("\n")
        parts[page].append("\n".join([f"## {heading}\n", _prose(first, tail, ""), example.strip("\n") + "\n"]))
    return {page: "\n".join([*text, *_examples(page)]).replace("\n\n\n", "\n\n") for page, text in parts.items()}


def material_text(name: str, group: str) -> str:
    """Return the YAML of a page's material: a name of the library, or all of it."""
    stem = name.removeprefix(f"{group}-").replace("-", "_")
    return MATERIALS.get(f"{group} {stem}") or MATERIALS.get(stem) or _of_library(group, stem)


def _of_library(group: str, name: str) -> str:
    library = library_of()
    return next(entry for entry in library.names() if getattr(library.load(entry), group).type == name)


def case_text(name: str, group: str) -> str:
    """Return the page's case: a plate impact of its material, in one dimension."""
    material = material_text(name, group)
    stem = name.removeprefix(f"{group}-").replace("-", "_")
    body = f"    material: &material {material}" if material.startswith("{") else f"    material: {material}"
    reference = "    material: *material" if material.startswith("{") else body
    lines = [
        line
        for part in (body,)
        for line in textwrap.wrap(part, 100, subsequent_indent="      ", break_on_hyphens=False)
    ]
    heat = ["    internal_energy: 0.2 MJ/kg"] if stem == "ideal_gas" else []
    if stem == "jwl":
        return "\n".join(["kinematics: uniaxial_strain", "resolution: 0.1 mm", "bodies:", "  charge:", *lines,
                          "    shape: {type: interval, length: 20 mm}",
                          "symmetry: [{axis: x}]", "time: {end: 2.5 us}"])  # fmt: skip
    speed = SPEEDS.get(stem, "300 m/s")
    return "\n".join(["kinematics: uniaxial_strain", "resolution: 0.05 mm", "bodies:", "  flyer:", *lines, *heat,
                      "    shape: {type: interval, length: 2 mm}", f"    velocity: [{speed}]",
                      "  target:", reference, *heat,
                      "    shape: {type: interval, length: 4 mm}",
                      "gauges: {rear: {type: free_surface, at: [3.9 mm], every: 1}}", "time: {end: 2 us}"])  # fmt: skip


def section(doc: str, family: Sequence[tuple[str, str, str, list[Any]]]) -> str:
    """Return the section of the models with one docstring: each is name, kind, heading and case models."""
    first, _, tail = textwrap.dedent(doc).strip().partition("\n")
    records = []
    for name, group, heading, case_models in family:
        using, example = _using(group, case_models), material_text(name, group)
        text = ", ".join(f"`{case_name}`" for case_name in using[:NAMED])
        text += f" and {len(using) - NAMED} more" if len(using) > NAMED else ""
        one_of = f" with `{heading}`" if len(family) > 1 else ""
        text = f"In the library{one_of}: {text}." if using else ""
        if not example.startswith("{") and example not in using[:NAMED]:
            text += f" Example: `material: {example}`."
        records.append(text.strip())
    headings = ", ".join(heading for _, _, heading, _ in family)
    pictures = " ".join(f"![{heading}]({name}.png)" for name, _, heading, _ in family)
    return "\n".join([f"## {headings}\n", _prose(first, tail, " ".join(filter(None, records))), f"{pictures}\n"])


def _examples(page: str) -> list[str]:
    """Return the table of examples of a page's models that the library does not have."""
    rows = []
    for name, part, heading, _, case_models in models():
        example = material_text(name, part)
        if page == (part if part in PAGES else "thermal") and example.startswith("{") and not _using(part, case_models):
            rows.append(f"| {heading} | `material: {example}` |")
    table = ["| model | example |", "| --- | --- |", *rows]
    return ["## Examples\n", "\n".join(table) + "\n"] if rows else []


def _prose(first: str, tail: str, records: str) -> str:
    """Return the first line and the prose of a docstring as a paragraph, its formulas as a block."""
    formulas, prose = [], [first]
    for part in tail.strip("\n").split("\n\n"):
        if all(line.startswith("    ") or not line.strip() for line in part.split("\n")):
            formulas.append(textwrap.dedent(part).strip("\n"))
        else:
            prose.append(part)
    blocks = "\n".join(block for block in formulas if block)
    prose.append(records)
    return _wrapped(" ".join(" ".join(prose).split())) + (f"\n```text\n{blocks}\n```\n" if blocks else "")


def _wrapped(text: str) -> str:
    """Return a paragraph in lines of the documentation's width, none of which begins like an item of a list."""
    text = "`".join(part if k % 2 else part.replace("*", "\\*") for k, part in enumerate(text.split("`")))
    bound = text.replace(" - ", "\u00a0- ").replace(" + ", "\u00a0+ ")
    return textwrap.fill(bound, 100, break_on_hyphens=False, break_long_words=False).replace("\u00a0", " ") + "\n"


def _using(group: str, models: list[Any]) -> list[str]:
    if group not in ("eos", "strength", "damage"):
        return []
    library, tag = library_of(), models[0].model_fields["type"].default
    return [name for name in library.names() if getattr(library.load(name), group).type == tag]


def material_of_page(name: str, group: str) -> Material:
    """Return the case model of a page's material."""
    from hvisph.casefile.loader import load_case

    FOLDER.mkdir(exist_ok=True)
    place = FOLDER / f"{name}.trial.yaml"
    place.write_text(case_text(name, group), encoding="utf-8")
    try:
        return next(iter(load_case(place).bodies.values())).material
    finally:
        place.unlink()


def write_table() -> None:
    """Write Tillotson's aluminium as a small table, the file of the page on tables."""
    from hvisph.setup.materials import material_of

    solid = material_of(library_of().load("aluminium-tillotson"))
    rho = np.concatenate([np.geomspace(50.0, 2000.0, 8), np.linspace(2200.0, 6000.0, 20)])
    heat = np.concatenate([[0.0], np.geomspace(100.0, 3e4, 11)])
    cold = np.where(rho > 2700.0, 0.5 * 5277.0**2 * (rho / 2700.0 - 1.0) ** 2, 0.0)
    lines = ["density,temperature,pressure,energy"]
    for r, below in zip(rho, cold, strict=True):
        for t in heat:
            e = below + 900.0 * t
            lines.append(f"{r:.6g},{t:.6g},{solid.pressure(float(r), float(e)):.6g},{e:.6g}")
    (FOLDER / TABLE).write_text("\n".join(lines) + "\n", encoding="utf-8")


def main() -> None:
    """Print or write all pages."""
    FOLDER.mkdir(exist_ok=True)
    if "--write" in sys.argv:
        write_table()
    for page, text in pages().items():
        if "--write" in sys.argv:
            (FOLDER / f"{page}.md").write_text(text, encoding="utf-8")
        else:
            sys.stdout.write(text)
    if "--pictures" in sys.argv:
        import model_pictures

        for name, group, *_ in models():
            model_pictures.draw(material_of_page(name, group), group, FOLDER / f"{name}.png")


if __name__ == "__main__":
    main()
