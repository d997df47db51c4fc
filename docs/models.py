"""Write docs/models: a page for each model of a material, made from the models themselves.

    python docs/models.py --write [--pictures]

Formula, limits and source are the docstring of the model's module, the keys those of its case model, the example a case
that runs; `--pictures` draws what changes.
"""

from __future__ import annotations

import sys
import textwrap
from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args

import numpy as np

from hvisph.case.materials.damage import Damage
from hvisph.case.materials.eos import Eos
from hvisph.case.materials.material import Material
from hvisph.case.materials.strength import Strength
from hvisph.case.materials.thermal import Melting, Porosity, Temperature
from hvisph.casefile.material_library import library_of
from hvisph.materials import isentrope, melting, porosity
from hvisph.materials.damage import REGISTRY as DAMAGES
from hvisph.materials.eos import MODULES
from hvisph.materials.strength import REGISTRY as STRENGTHS

FOLDER = Path(__file__).with_name("models")
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
           "energy_density: 7 GPa, detonation: {points: [[0]], speed: 6930 m/s}}}",
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
    "pressure_cutoff": f"{{base: {METAL}, damage: {{type: pressure_cutoff, pressure: -1.2 GPa, fails: true}}}}",
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
SPEEDS = {"ideal_gas": "400 m/s", "linear": "100 m/s", "grady_kipp": "60 m/s", "rock": "200 m/s"}


def pages() -> Iterator[tuple[str, str, str, str, list[Any]]]:
    """Yield of each page its file's name, kind, title, module's docstring and case models."""
    for kind, union in (("eos", Eos), ("strength", Strength), ("damage", Damage)):
        for model in get_args(get_args(union)[0]):
            name = model.model_fields["type"].default
            if name == "none":
                continue
            if kind == "eos":
                module = MODULES[name]
            else:
                module = sys.modules[(STRENGTHS if kind == "strength" else DAMAGES)[name].__module__]
            yield f"{kind}-{name.replace('_', '-')}", kind, f"{kind}: {{type: {name}}}", module.__doc__ or "", [model]
    yield "porosity", "porosity", "porosity", porosity.__doc__ or "", [Porosity]
    yield "melting", "melting", "melting", melting.__doc__ or "", list(get_args(get_args(Melting)[0]))
    temperatures = list(get_args(get_args(Temperature)[0]))
    yield "temperature", "temperature", "temperature", isentrope.__doc__ or "", temperatures


def material_text(name: str, kind: str) -> str:
    """Return the YAML of a page's material: a name of the library, or all of it."""
    plain = name.removeprefix(f"{kind}-").replace("-", "_")
    return MATERIALS.get(f"{kind} {plain}") or MATERIALS.get(plain) or _of_library(kind, plain)


def _of_library(kind: str, name: str) -> str:
    library = library_of()
    return next(one for one in library.names() if getattr(library.load(one), kind).type == name)


def case_text(name: str, kind: str) -> str:
    """Return the page's case: a plate impact of its material, in one dimension."""
    material = material_text(name, kind)
    plain = name.removeprefix(f"{kind}-").replace("-", "_")
    body = f"    material: &material {material}" if material.startswith("{") else f"    material: {material}"
    again = "    material: *material" if material.startswith("{") else body
    lines = [
        line
        for part in (body,)
        for line in textwrap.wrap(part, 118, subsequent_indent="      ", break_on_hyphens=False)
    ]
    heat = ["    internal_energy: 0.2 MJ/kg"] if plain == "ideal_gas" else []
    if plain == "jwl":
        return "\n".join(["kinematics: uniaxial_strain", "resolution: 0.1 mm", "bodies:", "  charge:", *lines,
                          "    shape: {type: interval, length: 20 mm}",
                          "symmetry: [{axis: x}]", "time: {end: 2.5 us}"])  # fmt: skip
    speed = SPEEDS.get(plain, "300 m/s")
    return "\n".join(["kinematics: uniaxial_strain", "resolution: 0.05 mm", "bodies:", "  flyer:", *lines, *heat,
                      "    shape: {type: interval, length: 2 mm}", f"    velocity: [{speed}]",
                      "  target:", again, *heat,
                      "    shape: {type: interval, length: 4 mm}",
                      "gauges: {rear: {type: free_surface, at: [3.9 mm], every: 1}}", "time: {end: 2 us}"])  # fmt: skip


def text(name: str, kind: str, title: str, doc: str, models: list[Any]) -> str:
    """Return a page."""
    first, _, rest = textwrap.dedent(doc).strip().partition("\n")
    parts = [f"# {title}\n", first + "\n", _prose(rest), f"![{title}]({name}.png)\n"]
    for model in models:
        fields = {key: field for key, field in model.model_fields.items() if key != "type"}
        if len(models) > 1:
            parts.append(f"## type: {model.model_fields['type'].default}\n")
            parts.append(" ".join((model.__doc__ or "").split()) + "\n")
        rows = [f"| `{key}` | {'needed' if field.is_required() else _default(field.default)} | {field.description} |"
                for key, field in fields.items()]  # fmt: skip
        parts.append("\n".join(["| key | unless given | |", "| --- | --- | --- |", *rows]) + "\n")
    using = _using(kind, models)
    if using:
        parts.append(f"In the library: {', '.join(f'`{one}`' for one in using)}.\n")
    parts.append(f"A case that runs, `{name}.yaml`:\n\n```yaml\n{case_text(name, kind)}\n```\n")
    if kind in ("strength", "damage") and not material_text(name, kind).startswith("{"):
        parts.append(f"The model alone: `hvisph point {material_text(name, kind)} --path shear --plot point.png`.\n")
    return "\n".join(parts).replace("\n\n\n", "\n\n")


def _prose(rest: str) -> str:
    """Return the docstring's paragraphs, formulas as blocks."""
    parts = []
    for part in rest.strip("\n").split("\n\n"):
        lines = part.split("\n")
        if all(line.startswith("    ") or not line.strip() for line in lines):
            parts.append("```text\n" + textwrap.dedent(part).strip("\n") + "\n```")
        else:
            parts.append("\n".join(lines))
    return "\n\n".join(parts) + "\n"


def _default(value: Any) -> str:
    if value is None or value == ():
        return ""
    return (
        f"`{str(value).lower()}`"
        if isinstance(value, bool)
        else f"`{value:g}`"
        if isinstance(value, float)
        else f"`{value}`"
    )


def _using(kind: str, models: list[Any]) -> list[str]:
    if kind not in ("eos", "strength", "damage"):
        return []
    library, wanted = library_of(), models[0].model_fields["type"].default
    return [name for name in library.names() if getattr(library.load(name), kind).type == wanted]


def material_of_page(name: str, kind: str) -> Material:
    """Return the case model of a page's material."""
    from hvisph.casefile.loader import load_case

    FOLDER.mkdir(exist_ok=True)
    place = FOLDER / f"{name}.trial.yaml"
    place.write_text(case_text(name, kind), encoding="utf-8")
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
    """Write all pages."""
    FOLDER.mkdir(exist_ok=True)
    if "--write" in sys.argv:
        write_table()
    for page in pages():
        if "--write" not in sys.argv:
            sys.stdout.write(text(*page))
            continue
        (FOLDER / f"{page[0]}.md").write_text(text(*page), encoding="utf-8")
        if "--pictures" in sys.argv:
            import model_pictures

            model_pictures.draw(material_of_page(page[0], page[1]), page[1], FOLDER / f"{page[0]}.png")


if __name__ == "__main__":
    main()
