"""Small runs that tests of the step loop share: every material model in one case, any formulation."""

from typing import get_args

import numba
import numpy as np

from hvisph.case.case import Case
from hvisph.casefile.loader import load_case
from hvisph.core.errors import CaseError
from hvisph.output.reader import list_snapshots, read_snapshot

FORMULATIONS = tuple(
    get_args(model.model_fields["type"].annotation)[0]
    for model in get_args(get_args(Case.model_fields["formulation"].annotation)[0])
    or get_args(Case.model_fields["formulation"].annotation)
)

METAL = {"density": 2785.0, "eos": {"type": "stiffened_gas", "sound_speed": 5328.0, "gamma": 2.0},
         "strength": {"type": "von_mises", "shear_modulus": 27.6e9, "yield_stress": 0.3e9}}  # fmt: skip
HARDENING = {"density": 2700.0, "eos": {"type": "mie_gruneisen", "sound_speed": 5350.0, "gamma": 2.0, "s1": 1.34},
             "strength": {"type": "linear_hardening", "shear_modulus": 26e9, "yield_stress": 0.2e9,
                          "hardening_modulus": 1e9},
             "damage": {"type": "pressure_cutoff", "pressure": -1e9}}  # fmt: skip
DAMAGED = {"density": 2770.0, "eos": {"type": "mie_gruneisen", "sound_speed": 5328.0, "gamma": 2.0, "s1": 1.338},
           "strength": {"type": "johnson_cook", "shear_modulus": 27.6e9, "a": 0.265e9, "b": 0.426e9, "n": 0.34, "c": 0.015, "m": 1.0,
                        "melt_temperature": 775.0, "heat_capacity": 875.0, "room_temperature": 294.0},
           "damage": {"type": "johnson_cook", "d1": 0.13, "d2": 0.13, "d3": -1.5, "d4": 0.011, "d5": 0.0}}  # fmt: skip
SPRING = {"density": 2785.0, "eos": {"type": "elastic", "youngs_modulus": 70e9, "poisson_ratio": 0.3},
          "strength": {"type": "elastic"}}  # fmt: skip
LIQUID = {"density": 1000.0, "eos": {"type": "linear", "bulk_modulus": 2.2e9}}
GAS = {"density": 100.0, "eos": {"type": "ideal_gas", "gamma": 1.4}}

# Two threads, or one where the machine has one core.
TWO = min(2, numba.config.NUMBA_NUM_THREADS)

# What a formulation needs beside its type.
OPTIONS = {"adaptive": {"conversion": {"strain": 0.02, "damage": True}}}

SIZES = {1: [4e-3], 2: [3e-3, 6e-3], 3: [2.5e-3, 3e-3, 3e-3]}
KINEMATICS = {1: "uniaxial_strain", 2: "plane_strain", 3: "three_d"}


def row_of(materials, dim=2, dx=0.5e-3, speed=1500.0, **further):
    """A case of one box a material, or cylinder about an axis, in a row, the first flying at the others."""
    return load_case(document_of(materials, dim, dx, speed, **further))


def document_of(materials, dim=2, dx=0.5e-3, speed=1500.0, **further):
    """The same as a mapping."""
    shape = {"type": "interval", "length": SIZES[1][0]} if dim == 1 else {"type": "box", "size": SIZES[dim]}
    if further.get("kinematics") == "axisymmetric":
        shape = {"type": "cylinder", "length": SIZES[2][0], "diameter": SIZES[2][1]}
    bodies = {
        f"body_{k}": {
            "material": material,
            "shape": shape,
            "velocity": [speed if k == 0 else 0.0] + [0.0] * (dim - 1),
        }
        for k, material in enumerate(materials)
    }
    for body in bodies.values():
        if body["material"] is GAS:
            body["internal_energy"] = 1e6
    plain = {"kinematics": KINEMATICS[dim], "resolution": dx, "bodies": bodies, "time": {"end": 1e-6}}
    return plain | further


def every_material(formulation, **further):
    """A case in which every model of pressure, strength and damage works that the formulation takes."""
    settings = {"formulation": {"type": formulation} | OPTIONS.get(formulation, {})} | further
    if formulation == "projection":  # its step is a tenth of the others'
        settings["time"] = {"end": 1e-7}
        settings["output"] = {"every": 3e-8}
    taken = []
    for material in (METAL, HARDENING, DAMAGED, SPRING, LIQUID):
        try:
            row_of([METAL, material], **settings)
        except CaseError:
            continue
        taken.append(material)
    return row_of(taken, **settings)


def final(folder):
    """The last snapshot of a run."""
    return read_snapshot(list_snapshots(folder)[-1])


def assert_same_results(one, other):
    """Two runs have the same history, byte for byte, and the same numbers in all snapshots."""
    assert (one / "history.csv").read_bytes() == (other / "history.csv").read_bytes()
    names = [path.name for path in list_snapshots(one)]
    assert [path.name for path in list_snapshots(other)] == names
    for a, b in zip(map(read_snapshot, list_snapshots(one)), map(read_snapshot, list_snapshots(other)), strict=True):
        assert (a.time, a.step) == (b.time, b.step)
        for name, values in a.fields.items():
            np.testing.assert_array_equal(values, b.fields[name], err_msg=name)


def cracked_bar(formulation="riemann", plane=None, **further):
    """A cylinder about the axis, or a `plane` shape, whose ends part by 200 m/s each: cracks run through in 2 us."""
    metal = METAL | {"damage": {"type": "johnson_cook", "d1": 0.02, "fracture_energy": 10e3}}
    body = {"material": metal, "position": [0.0, 0.0], "shape": plane or {"type": "cylinder", "diameter": 4e-3, "length": 6e-3},
            "initial_velocity": [{"type": "linear", "gradient": [[7e4, 0.0], [0.0, 0.0]]}]}  # fmt: skip
    return load_case({"kinematics": "plane_strain" if plane else "axisymmetric", "resolution": 0.5e-3, "bodies": {"bar": body},
                      "formulation": {"type": formulation}, "time": {"end": 2e-6}, "output": {"every": 1e-6}} | further)  # fmt: skip


ORTHOTROPIC = {"density": 1500.0, "eos": {"type": "mie_gruneisen", "sound_speed": 3228.2, "s1": 1.5, "gamma": 1.0},
               "strength": {"type": "orthotropic", "moduli": [60e9, 30e9, 12e9], "poisson": [0.25, 0.3, 0.2],
                            "shear_moduli": [8e9, 6e9, 4e9]},
               "damage": {"type": "hashin", "fibre_tension": 1.2e9, "fibre_compression": 1e9, "matrix_tension": 6e7,
                          "matrix_compression": 2e8, "shear": 8e7, "transverse_shear": 7e7}}  # fmt: skip
CLOTH = {"density": 2700.0, "eos": {"type": "mie_gruneisen", "sound_speed": 6000.0, "s1": 1.3, "gamma": 1.0},
         "strength": {"type": "fabric", "moduli": [20e9, 10e9], "tensile_strength": [400e6, 400e6]},
         "porosity": {"distension": 3.0, "elastic_pressure": 1e6, "solid_pressure": 1e9}}  # fmt: skip


def struck_laminate(**further):
    """A quarter of a sphere that strikes a cloth on a laminate: modes open in both within 1.5 us."""
    axes = {"axes": {"one": "y", "two": "z"}}
    bodies = {
        "ball": {"material": METAL, "shape": {"type": "sphere", "diameter": 3e-3}, "velocity": [1500.0, 0.0, 0.0]},
        "cloth": {"material": CLOTH, "shape": {"type": "box", "size": [1.5e-3, 6e-3, 6e-3]}, **axes},
        "plate": {"material": ORTHOTROPIC, "shape": {"type": "box", "size": [2e-3, 6e-3, 6e-3]}, **axes},
    }
    return load_case({"kinematics": "three_d", "resolution": 0.5e-3, "symmetry": [{"axis": "y"}, {"axis": "z"}],
                      "bodies": bodies, "time": {"end": 1.5e-6}, "output": {"every": 5e-7}} | further)  # fmt: skip
