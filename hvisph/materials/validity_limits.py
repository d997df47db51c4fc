"""Range of validity of a material's models: density, energy, temperature, and unlimited tension.

Density. Condensed matter: from rho0/2, below which it is no solid or liquid, to 3 rho0, where the isentrope of the
temperature ends; less where the cold sound speed reaches its floor (loss of stability), or where the Hugoniot diverges
(Mie-Grueneisen). Linear laws: within 10 % of rho0. Tables: their range. Gases and detonation products: all densities;
Tillotson's vapour, e >= e_iv, has no lower limit.
Energy. Above the energy at 1 K where a heat capacity is known, as temperatures are not lower. Tillotson: above -E0
eta^2/2, where w is limited; gases: above zero; tables: their range.
Tension. Ductile spall by Grady 1988, J. Mech. Phys. Solids 36, 353: (2 rho c^2 Y eps_c)^(1/2) with eps_c = 0.15 and
Y at rest, at most K/10; without a yield stress 3 % of K, about twice the strength of clean water.
"""

from dataclasses import dataclass
from functools import lru_cache
from math import inf, sqrt

import numpy as np

from hvisph.compiler.jit import python_twin

from . import isentrope, slots
from .eos import Elastic, IdealGas, JonesWilkinsLee, Linear, MieGrueneisen, Table, Tillotson, UsUpTable
from .material_table import Material, pack
from .thermodynamics import flow_stress

LINEAR = 0.1  # of rho0
COLDEST = 1.0  # [K], where `isentrope.temperature` is held
CRITICAL_STRAIN = 0.15
STRONGEST, WITHOUT_YIELD = 0.1, 0.03  # tension over K


@dataclass(frozen=True)
class Range:
    """Range of validity of a material's models."""

    # [kg/m^3]; the least is that of cold material
    least_density: float
    greatest_density: float
    vapour_energy: float  # energy above which there is no least density [J/kg]
    has_temperature: bool  # whether it has a temperature, which has to be above 1 K
    tension: float  # largest tension of a material with these constants [Pa]

    @property
    def words(self) -> str:
        """Density and temperature in words, in SI."""
        return self.describe()

    def describe(self, unitless: bool = False) -> str:
        """Return density and temperature in words, in SI or without units."""
        cold = " where it is cold" if self.vapour_energy < inf else ""
        parts = [f"above {self.least_density:.4g}{cold}"] if self.least_density > 0.0 else []
        parts += [f"below {self.greatest_density:.4g}"] if self.greatest_density < inf else []
        density = [f"density {' and '.join(parts)}{'' if unitless else ' kg/m^3'}"] if parts else []
        heat = [f"temperature above {COLDEST:g} K"] if self.has_temperature else []
        return ", ".join([*density, *heat]) or "energy above zero"


@lru_cache(maxsize=64)
def range_of(material: Material) -> Range:
    """Return where the models of `material` hold."""
    eos, rho0 = material.eos, material.density
    low, high = isentrope.LOWEST * rho0, isentrope.HIGHEST * rho0
    vapour = inf
    if isinstance(eos, (IdealGas, JonesWilkinsLee)):
        low, high = 0.0, inf
    elif isinstance(eos, Table):
        low, high = float(eos.grid.density[0]), float(eos.grid.density[-1])
    elif isinstance(eos, (Linear, Elastic)):
        low, high = (1.0 - LINEAR) * rho0, (1.0 + LINEAR) * rho0
    else:
        low, high = _stable(material)
    if isinstance(eos, (MieGrueneisen, UsUpTable)):
        high = min(high, eos.largest_density(rho0))
    if isinstance(eos, Tillotson):
        vapour = eos.incipient_energy
    if material.porosity is not None:
        low /= material.porosity.distension
    inverse = float(material.row()[slots.INVERSE_HEAT_CAPACITY])
    return Range(low, high, vapour, inverse > 0.0 and not material.total_energy, _tension(material))


def outside_range(
    material: Material,
    density: np.ndarray,
    energy: np.ndarray,
    temperature: np.ndarray | None = None,
    pressure: np.ndarray | None = None,
    damage: np.ndarray | None = None,
) -> np.ndarray:
    """Return which states are beyond the range of a material's models.

    `material`: what the states are of.
    `density`, `energy`: [kg/m^3] and [J/kg], each (n,).
    `temperature`: [K], (n,); not looked at unless given, nor where it is not a number.
    `pressure`, `damage`: [Pa] and [-], (n,): material that has failed, or is at its least pressure, has
        opened, and its mean density may be as low as it will.

    Returns booleans (n,).
    """
    holds, eos = range_of(material), material.eos
    thin = (density < holds.least_density) & (energy < holds.vapour_energy)
    if pressure is not None and damage is not None:
        least = float(material.row()[slots.PRESSURE_MINIMUM])
        thin &= ~((pressure <= 0.0) & ((pressure <= least) | (material.can_fail & (damage >= 1.0))))
    outside = (density > holds.greatest_density) | thin
    if holds.has_temperature and temperature is not None:
        outside |= temperature <= COLDEST
    if isinstance(eos, Tillotson):
        outside |= energy < -0.5 * eos.reference_energy * (density / material.density) ** 2
    elif isinstance(eos, IdealGas):
        outside |= energy < 0.0
    elif isinstance(eos, Table):
        grid = eos.grid
        within = np.clip(density, grid.density[0], grid.density[-1])
        outside |= energy > np.interp(within, grid.density, grid.energy[:, -1])
        outside |= energy < np.interp(within, grid.density, grid.energy[:, 0])
    return np.asarray(outside)


def _stable(material: Material) -> tuple[float, float]:
    """Return the densities [kg/m^3] about rho0 between which the cold sound speed is above its floor."""
    curve = material.whole_row[slots.CURVE : isentrope.HEATS : isentrope.WIDTH]
    densities = material.density * np.linspace(isentrope.LOWEST, isentrope.HIGHEST, isentrope.POINTS)
    middle = int(np.searchsorted(densities, material.density))
    floor = slots.FLOOR_SHARE * material.bulk_sound_speed**2
    ends = []
    for places in (range(middle, -1, -1), range(middle, isentrope.POINTS)):
        end = material.density
        for k in places:
            if not material.sound_speed_squared(float(densities[k]), float(curve[k])) > floor:
                break
            end = float(densities[k])
        ends.append(end)
    return ends[0], ends[1]


def _tension(material: Material) -> float:
    if isinstance(material.eos, (IdealGas, JonesWilkinsLee)):
        return inf
    bulk = material.density * material.bulk_sound_speed**2
    table, models = pack([material])
    y = float(
        python_twin(flow_stress)(table, models, 0, material.density, material.eos.ambient_energy, 0.0, 0.0, 0.0, 1.0)[0]
    )
    if not 0.0 < y < bulk:
        return WITHOUT_YIELD * bulk
    return min(sqrt(2.0 * bulk * y * CRITICAL_STRAIN), STRONGEST * bulk)
