"""What a step costs with one material and with another: Johnson-Cook and Tillotson against stiffened gas and von Mises.

    python benchmarks/material_cost.py [--blocks 15] [--formulation riemann] [--three] [--library]

The same impact with each of them, one thread, all in one process and in turn, block by block of twenty steps of one
length: user CPU time, ratios block by block, their median.
"""

from __future__ import annotations

import argparse
import resource
from collections.abc import Iterator

import numpy as np

from hvisph.casefile.loader import load_case
from hvisph.casefile.material_library import load_material
from hvisph.setup.build import build
from hvisph.simulation.run import set_threads

GAS = "{type: stiffened_gas, sound_speed: 5328, gamma: 2.0}"
GRUENEISEN = "{type: mie_gruneisen, sound_speed: 5328, gamma: 2.0, s1: 1.338}"
TILLOTSON = ("{type: tillotson, bulk_modulus: 75.2 GPa, b_modulus: 65 GPa, a: 0.5, b: 1.63, reference_energy: 5e6, alpha: 5, "
             "beta: 5, incipient_energy: 3e6, vaporization_energy: 13.9e6}")  # fmt: skip
MISES = "{type: von_mises, shear_modulus: 27.6 GPa, yield_stress: 0.3 GPa}"
COOK = ("{type: johnson_cook, shear_modulus: 27.6 GPa, a: 265 MPa, b: 426 MPa, n: 0.34, c: 0.015, m: 1.0, "
        "melt_temperature: 775, heat_capacity: 875, room_temperature: 294}")  # fmt: skip
RISING = ("{type: isentrope, heat_capacities: [[298, 897], [600, 1034], [933, 1222], [934, 1177]], "
          "heat_of_melting: 397 kJ/kg, melting_point: 933 K}")  # fmt: skip
CONSTANT = "{type: isentrope}"
MATERIALS = {
    "stiffened gas, von Mises": (GAS, MISES),
    "Mie-Grueneisen, von Mises": (GRUENEISEN, MISES),
    "Tillotson, von Mises": (TILLOTSON, MISES),
    "stiffened gas, Johnson-Cook": (GAS, COOK),
    "Mie-Grueneisen, Johnson-Cook": (GRUENEISEN, COOK),
    "Tillotson, Johnson-Cook": (TILLOTSON, COOK),
    "Mie-Grueneisen, Johnson-Cook, heat capacity that rises": (GRUENEISEN, COOK, RISING),
}
LIBRARY = ("aluminium-6061-t6", "copper-ofhc", "steel-4340")  # with measured heat capacities
STEPS = 20


def user_seconds() -> float:
    """Return the user CPU time of this process so far [s]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_utime


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--blocks", type=int, default=15)
    parser.add_argument("--formulation", default="riemann")
    parser.add_argument("--three", action="store_true", help="a sphere in 3D in place of a disc in 2D")
    parser.add_argument("--library", action="store_true", help="metals of the library with measured heat capacities")
    arguments = parser.parse_args()
    set_threads(1)
    name = "sphere_on_plate" if arguments.three else "al_al_coarse"
    steppers, beside = {}, {}
    for label, material, base in library_metals() if arguments.library else plain_metals():
        case = load_case(name, [f"bodies.{body}.material={material}" for body in ("projectile", "target")]
                         + [f"formulation={{type: {arguments.formulation}}}", "expected={}"])  # fmt: skip
        steppers[label], beside[label] = build(case).stepper, base
        steppers[label].start()
    dt = 0.15 * case.resolution / 6000.0
    found: dict[str, list[float]] = {label: [] for label in steppers}
    for block in range(arguments.blocks + 1):
        for label, stepper in steppers.items():
            began = user_seconds()
            for _ in range(STEPS):
                stepper.complete(dt, dt)
                stepper.evaluate()
            if block:  # the first compiles
                found[label].append((user_seconds() - began) / STEPS / stepper.particles.count)
    print(f"{name}, {arguments.formulation}, {stepper.particles.count} particles")
    for label, times in found.items():
        ratio = np.median(np.array(times) / np.array(found[beside[label]]))
        print(f"{label:<56}{1e6 * np.median(times):>8.3f} us a particle-step{ratio:>8.3f}")


def plain_metals() -> Iterator[tuple[str, str, str]]:
    """Yield label and numbers of one metal in each of the models, and what it is held against."""
    least = next(iter(MATERIALS))
    for label, (eos, strength, *heat) in MATERIALS.items():
        capacity = heat[0] if heat else CONSTANT
        yield label, f"{{name: metal, density: 2700, eos: {eos}, strength: {strength}, temperature: {capacity}}}", least


def library_metals() -> Iterator[tuple[str, str, str]]:
    """Yield the same of metals of the library, whole and without damage, beside their own stiffness and first yield."""
    for metal in LIBRARY:
        made = load_material(metal)
        eos = f"{{type: stiffened_gas, sound_speed: {made.eos.sound_speed}, gamma: {made.eos.gamma}}}"
        strength = f"{{type: von_mises, shear_modulus: {made.shear_modulus}, yield_stress: {made.strength.a}}}"
        least = f"{metal}, stiffened gas, von Mises"
        yield least, f"{{base: {metal}, eos: {eos}, strength: {strength}, damage: {{type: none}}}}", least
        yield metal, metal, least
        yield f"{metal}, which cannot fail", f"{{base: {metal}, damage: {{type: none}}}}", least


if __name__ == "__main__":
    main()
