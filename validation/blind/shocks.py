"""Blind problems with shocks: porous and dense materials, three impedances, a thin flyer, a gas."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from hvisph_validation.problems.porous import beside_the_face, porous

from hvisph.core.text import Plain
from hvisph.exact.plate_impact import layered_impact
from hvisph.verification.problem import (
    Figure,
    Options,
    Ran,
    Start,
    Trial,
    body_material,
    fluid,
    limit,
)
from hvisph.verification.problems.hugoniot import flat_impact
from hvisph.verification.problems.shock_tubes import GasState, tube

ALUMINIUM, COPPER = "aluminium-howell-ball-mie-gruneisen", "copper-ofhc"
LONG = 200  # particles along a plate
FLYER, FLYER_SPEED = 3, 3000.0  # particles along the thin flyer; [m/s]
# Densities [kg/m^3], bulk moduli [Pa] and thicknesses [m] of three layers, of which the first moves at 100 m/s.
LAYERS = ((8000.0, 200e9, 6e-3), (2700.0, 75e9, 4e-3), (19000.0, 300e9, 8e-3))
LAYERS_SPEED = 100.0


def shocks(options: Options) -> Iterator[Trial]:
    """Yield the trials."""
    dx = options.dx(25e-6, 50e-6)
    foam, light, powder = porous(COPPER, 1.8, 0.5e9), porous(COPPER, 4.0, 0.3e9), porous(COPPER, 1.4, 1e9)
    yield beside_the_face(flat_impact("copper foam of distension 1.8", foam, foam, 1000.0, dx, LONG))
    yield beside_the_face(flat_impact("aluminium on copper foam of 4", fluid(ALUMINIUM), light, 2500.0, dx, LONG))
    yield beside_the_face(flat_impact("copper powder of distension 1.4", powder, powder, 2500.0, dx, LONG))
    yield flat_impact("aluminium", fluid(ALUMINIUM), fluid(ALUMINIUM), 40e3, dx, LONG)
    yield flat_impact("aluminium", fluid(ALUMINIUM), fluid(ALUMINIUM), 300.0, dx, LONG)
    steel = fluid("steel-howell-ball-mie-gruneisen")
    yield flat_impact("steel on copper", steel, fluid(COPPER), 5000.0, dx, 44, 100)
    yield _three_impedances(dx)
    yield _thin_flyer(dx)
    gases = (GasState(1.0, 0.0, 20.0), GasState(1.0, 0.0, 1.0))
    yield replace(
        tube(gases, 0.08, (1.0, 0.8), options.dx(0.0025, 0.005)), name="gases of one density, pressures 20 : 1"
    )


def _three_impedances(dx: float) -> Trial:
    begins = np.cumsum([0.0, *(length for _, _, length in LAYERS)]) - LAYERS[0][2]
    middle = 0.5 * LAYERS[1][2]
    case: Plain = {
        "title": "three impedances",
        "kinematics": "uniaxial_strain",
        "resolution": dx,
        "bodies": {
            f"layer_{k}": {"material": {"density": rho, "eos": {"type": "linear", "bulk_modulus": modulus}},
                           "shape": {"type": "interval", "length": length}, "velocity": [LAYERS_SPEED * (k == 0)]}
            for k, (rho, modulus, length) in enumerate(LAYERS)
        },
        "gauges": {"middle": {"type": "material", "at": [middle], "fields": ["stress_xx"]}},
        "time": {"end": 1.8e-6},
    }  # fmt: skip

    def figures(runs: Sequence[Ran]) -> Iterator[Figure]:
        (ran,) = runs
        layers = [(body_material(ran.case, f"layer_{k}"), float(begins[k]), float(begins[k + 1]),
                   LAYERS_SPEED * (k == 0)) for k in range(len(LAYERS))]  # fmt: skip
        time = ran.history["time"]
        exact = layered_impact(layers, 2e-6).sample(middle, time, "stress")
        changes = time[1:][np.abs(np.diff(exact)) > 0.01 * exact.max()]
        for name, begin, end in zip(
            ("first shock", "reflected shock"), changes, [*changes[1:], time[-1]], strict=False
        ):
            inside = (time > begin + 0.3 * (end - begin)) & (time < begin + 0.8 * (end - begin))
            computed = -ran.history["gauge.middle.stress_xx"][inside].mean()
            yield Figure(f"stress behind the {name}", float(computed), float(exact[inside].mean()), 0.01, "Pa",
                         why="jump conditions")  # fmt: skip

    return Trial("three impedances", [Start(case)], figures)


def _thin_flyer(dx: float) -> Trial:
    """Return a flyer of few particles on its own metal: the release leaves it next to no velocity."""
    long = flat_impact("copper flyer of three particles", fluid(COPPER), fluid(COPPER), FLYER_SPEED, dx, LONG)
    (start,) = long.starts
    bodies = start.case["bodies"]
    short = bodies["projectile"] | {"shape": {"type": "interval", "length": FLYER * dx}}
    case = start.case | {"bodies": bodies | {"projectile": short}}

    def figures(runs: Sequence[Ran]) -> Iterator[Figure]:
        (ran,) = runs
        yield limit("velocity of the flyer over that of impact", abs(float(ran.mean_velocity(0)[0])) / FLYER_SPEED, 0.1,
                    why="equal impedances; a front is as thick as the flyer")  # fmt: skip
        yield limit("drift of momentum", ran.drift, 1e-12, why="round-off")

    return Trial(long.name, [Start(case)], figures)
