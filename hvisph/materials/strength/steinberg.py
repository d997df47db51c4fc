"""Steinberg-Guinan and Steinberg-Lund strength: pressure- and temperature-dependent G and Y.

    f = 1 + A p/eta^(1/3) - B (T - 300 K) >= 0,    G = G0 f
    Steinberg-Guinan    Y = min(Y0 (1 + beta (eps + eps_i))^n, Ymax) f
    Steinberg-Lund      Y = [Y_T(rate, T) + min(Y_A (1 + beta (eps + eps_i))^n, Ymax)] f
                        rate = 1/[exp(2 U/kT (1 - Y_T/Y_P)^2)/C1 + C2/Y_T],    Y_T <= Y_P
    T >= T_m of Lindemann:  G = Y = 0

Steinberg-Guinan is independent of rate: above about 1e5 1/s and up to about 100 GPa. Steinberg-Lund
extends to 1e-4 1/s. `a_melt` is the coefficient of the melting law, not the Mie-Grueneisen a.
Steinberg, Cochran & Guinan 1980, J. Appl. Phys. 51, 1498; Steinberg & Lund 1989, J. Appl. Phys. 65,
1528.
"""

from dataclasses import dataclass
from math import exp, inf, log
from typing import ClassVar

import numpy as np

from hvisph.compiler.jit import inline
from hvisph.materials import slots, tags
from hvisph.materials.melting import Lindemann
from hvisph.materials.slots import INVERSE_RHO0

YIELD_STRESS, YIELD_LIMIT, BETA, EXPONENT, INITIAL_STRAIN = slots.STRENGTH[:5]
PRESSURE_COEFFICIENT, HEAT_COEFFICIENT = slots.STRENGTH[5], slots.STRENGTH[6]
RATE_C1, ACTIVATION, PEIERLS, DRAG = slots.STRENGTH[7:11]

_REFERENCE = 300.0  # [K], of B
_ELECTRON_VOLT_PER_KELVIN = 11604.518  # 1 eV/k [K]
_EXPONENT_LIMIT = 690.0
_HALVINGS = 60
_LEAST = 1e-3  # [Pa]; Y_T is sought above


@dataclass(frozen=True)
class SteinbergGuinan(slots.Parameters):
    """Parameters of Steinberg-Guinan strength."""

    shear_modulus: float  # G0 [Pa]
    yield_stress: float  # Y0 [Pa]
    yield_limit: float  # Ymax of work hardening [Pa]
    beta: float  # [-]
    exponent: float  # n [-]
    pressure_coefficient: float  # A [1/Pa]
    heat_coefficient: float  # B [1/K]
    melt_temperature: float  # T_m0 of Lindemann's law [K]
    gamma0: float  # Grueneisen coefficient in it [-]
    a_melt: float  # a in it [-]
    initial_strain: float = 0.0  # eps_i [-]

    name: ClassVar[str] = "steinberg_guinan"
    tag: ClassVar[int] = tags.STEINBERG_GUINAN
    converted: ClassVar[tuple[str, ...]] = ("gamma0", "a_melt")

    def pack(self, row: np.ndarray, density: float) -> None:
        super().pack(row, density)
        Lindemann(self.melt_temperature, self.gamma0, self.a_melt).pack(row)


@dataclass(frozen=True)
class SteinbergLund(SteinbergGuinan):
    """Parameters of Steinberg-Lund strength; `yield_stress` is Y_A here."""

    rate_c1: float = 0.0  # C1 [1/s]
    activation_energy: float = 0.0  # U [eV]
    peierls_stress: float = inf  # Y_P [Pa]
    drag: float = 0.0  # C2 [Pa s]

    name: ClassVar[str] = "steinberg_lund"
    tag: ClassVar[int] = tags.STEINBERG_LUND
    converted = (*SteinbergGuinan.converted, "activation_energy", "peierls_stress")

    def pack(self, row: np.ndarray, density: float) -> None:
        super().pack(row, density)
        row[ACTIVATION] = self.activation_energy * _ELECTRON_VOLT_PER_KELVIN
        row[PEIERLS] = self.peierls_stress


@inline
def shear_share(rho, p, temperature, melt, row):
    """G/G0 [-] of the current state; 0 when molten."""
    if temperature >= melt:
        return 0.0
    eta = rho * row[INVERSE_RHO0]
    pressed = row[PRESSURE_COEFFICIENT] * p / eta ** (1.0 / 3.0)
    return max(1.0 + pressed - row[HEAT_COEFFICIENT] * (temperature - _REFERENCE), 0.0)


@inline
def work_hardened(plastic_strain, row):
    """Yield stress [Pa] of work hardening alone."""
    hardened = row[YIELD_STRESS]
    strain = plastic_strain + row[INITIAL_STRAIN]
    if strain > 0.0:
        hardened *= (1.0 + row[BETA] * strain) ** row[EXPONENT]
    return min(hardened, row[YIELD_LIMIT])


@inline
def rate_of(stress, temperature, row):
    """Strain rate [1/s] at which the thermal part of the yield stress is `stress`."""
    left = 1.0 - stress / row[PEIERLS]
    wait = exp(min(2.0 * row[ACTIVATION] / temperature * left * left, _EXPONENT_LIMIT)) / row[RATE_C1]
    return 1.0 / (wait + row[DRAG] / stress)


@inline
def thermal_stress(rate, temperature, row):
    """Thermal part Y_T of the yield stress [Pa] at a strain rate [1/s], at most the Peierls stress."""
    if rate_of(row[PEIERLS], temperature, row) <= rate:
        return row[PEIERLS]
    low, high = log(_LEAST), log(row[PEIERLS])
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if rate_of(exp(middle), temperature, row) < rate:
            low = middle
        else:
            high = middle
    return exp(0.5 * (low + high))
