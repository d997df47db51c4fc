"""Spall strength that grows with the rate: matter that expands at one rate, and plates whose pull-back was measured.

Matter without strength that expands evenly is at the tension K r t/(1 + r t) until the law's sum over time is 1, near
sigma_0 (rate/rate_0)^m. Plates of 6061-T6 struck by quartz at 0.5 km/s were pulled back by 0.98 to 1.28 GPa at 6 mm
and by 1.58 and 1.68 GPa at 1 mm: Chen, Asay, Dwivedi & Field 2006, J. Appl. Phys. 99 (as listed in A. Shargh's spall
database).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from hvisph.verification.problem import Figure, Options, Problem, Ran, Start, Trial

BULK, STRENGTH, EXPONENT, REFERENCE, SLOWEST = 75e9, 1.8e9, 0.2, 1e5, 1e4  # [Pa], [Pa], [-], [1/s], [1/s]
ACROSS = 160  # particles along the bar, of which waves from its ends reach the middle after the failure
QUARTZ = {  # linear, at the impedance of X-cut quartz
    "density": 2650.0,
    "eos": {"type": "linear", "bulk_modulus": 28e9},
    "strength": {"type": "elastic", "shear_modulus": 44e9},
}
# Flyer and plate [m], lowest and highest of the measured strengths [Pa].
PLATES = ((3.19e-3, 5.85e-3, 0.98e9, 1.28e9), (0.524e-3, 0.998e-3, 1.58e9, 1.68e9))


def _trials(options: Options) -> Iterator[Trial]:
    for rate in (3e4, 3e6):
        yield _expanding(rate)
    for flyer, plate, low, high in PLATES:
        yield _plate(flyer, plate, low, high, options.dx(1 / 300, 1 / 150))


def _expanding(rate: float) -> Trial:
    exact = _tension(rate)
    end = 1.3 * exact / BULK / rate
    length = 3.0 * (BULK / 2700.0) ** 0.5 * end
    damage = {"type": "pressure_cutoff", "pressure": -STRENGTH, "permanent": True, "spall_exponent": EXPONENT}
    case: dict[str, Any] = {
        "title": f"expansion at {rate:g} 1/s",
        "kinematics": "uniaxial_strain",
        "resolution": length / ACROSS,
        "bodies": {
            "bar": {
                "material": {"density": 2700.0, "eos": {"type": "linear", "bulk_modulus": BULK}, "damage": damage},
                "shape": {"type": "interval", "length": length},
                "position": [0.0],
                "initial_velocity": [{"type": "linear", "gradient": [[rate]]}],
            }
        },
        "gauges": {"middle": {"type": "material", "at": [0.0], "fields": ["pressure"], "every": 1}},
        "time": {"end": end},
    }

    def figures(runs: Sequence[Ran]) -> Iterator[Figure]:
        (ran,) = runs
        tension = -float(np.nanmin(ran.history["gauge.middle.pressure"]))
        yield Figure("tension at failure", tension, exact, 0.02, "Pa", why="a step adds one hundredth of it")

    return Trial(f"expansion at {rate:g} 1/s", [Start(case)], figures)


def _tension(rate: float) -> float:
    """Return the tension [Pa] at which even expansion at `rate` [1/s] fails."""
    smallest = STRENGTH * (SLOWEST / REFERENCE) ** EXPONENT
    tension = np.linspace(smallest, 10.0 * smallest, 100_001)
    grown = SLOWEST / (EXPONENT * smallest) * (tension / smallest) ** (1.0 / EXPONENT - 1.0)  # dD/dt over K
    damage = np.cumsum(grown / (rate * (1.0 - tension / BULK) ** 2)) * (tension[1] - tension[0])
    return float(np.interp(1.0, damage, tension))


def _plate(flyer: float, plate: float, low: float, high: float, share: float) -> Trial:
    case: dict[str, Any] = {
        "title": f"6061-T6, {plate * 1e3:g} mm",
        "kinematics": "uniaxial_strain",
        "resolution": share * plate,
        "bodies": {
            "flyer": {"material": QUARTZ, "shape": {"type": "interval", "length": flyer}, "velocity": [500.0]},
            "plate": {"material": "aluminium-6061-t6", "shape": {"type": "interval", "length": plate}},
        },
        "gauges": {"rear": {"type": "free_surface", "at": [0.99 * plate], "every": 1}},
        "time": {"end": 2.6e-6 * plate / 5.8e-3},
    }

    def figures(runs: Sequence[Ran]) -> Iterator[Figure]:
        (ran,) = runs
        computed = float(ran.summary["measures"]["spall_strength"]["value"] or 0.0)
        middle = 0.5 * (low + high)
        why = f"measured {low * 1e-9:g} to {high * 1e-9:g} GPa, the constants are from both plates"
        yield Figure("spall strength by pull-back", computed, middle, 0.5 * (high - low) / middle + 0.05, "Pa", why=why)

    return Trial(f"6061-T6, plate of {plate * 1e3:g} mm", [Start(case)], figures)


PROBLEM = Problem("spall", "rate-dependent spall strength: uniform expansion, and measured plates of 6061-T6", _trials)
