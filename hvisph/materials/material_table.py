"""Materials as objects, and their packing into the arrays that compiled loops read."""

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from math import inf, sqrt
from typing import Any, cast

import numpy as np

from hvisph.compiler.jit import CompiledFunction, bind_constants, python_twin
from hvisph.core.errors import CaseError
from hvisph.materials import isentrope, slots, tags
from hvisph.materials.damage import GradyKipp, GradySpall, JohnsonHolmquistDamage, NoDamage, pressure_cutoff
from hvisph.materials.eos import linear

from .damage.fracture_energy import FractureEnergy
from .eos import MODULES, JonesWilkinsLee
from .eos.late import Late
from .melting import Lindemann, Simon
from .porosity import Porosity
from .slots import EquationOfState, Model
from .strength import JohnsonCook, NoStrength, Rock

ROOM_TEMPERATURE = 300.0  # [K], where a material does not say
_COLD = 0.25  # homologous temperature up to which a Johnson-Cook metal is looked at without its temperature


@dataclass(frozen=True)
class Material:
    """Material of a body."""

    name: str  # name for messages
    density: float  # reference density rho0 [kg/m^3]
    eos: EquationOfState
    strength: Model = field(default_factory=NoStrength)
    damage: Model = field(default_factory=NoDamage)
    porosity: Porosity | None = None
    heat_capacity: float = 0.0  # c_v [J/(kg K)]; that of the strength unless given
    room_temperature: float = 0.0  # [K]; likewise
    total_energy: bool = False  # temperature from the whole energy, see `isentrope`
    melting: Lindemann | Simon | None = None  # law of the melting point; constant or the strength's own unless given
    failed_friction: float = 0.0  # of failed material [-]; `slots.KEEPS_STRESS` where failing takes nothing
    rate_smoothing: int = 0  # steps over which the strain rate is smoothed; 0 for that of the step
    spall_strength: float = inf  # tension at which the material fails for good, whatever its damage [Pa]
    spall_exponent: float = 0.0  # m of `damage.pressure_cutoff` [-]; 0 for one strength at all rates
    spall_rate: float = 1e5  # of expansion, at which it has its strength [1/s]
    heat_capacities: tuple[tuple[float, float], ...] = ()  # T [K] and c_p without pressure [J/(kg K)], for c_v
    heat_of_melting: tuple[float, float] | None = None  # melting point [K] and heat of melting [J/kg], beside them
    fracture: FractureEnergy | None = None  # energy that failure takes
    # at rest, and of incipient and complete melting and vaporisation at 1 bar [J/(kg K)]; none where unknown
    entropies: tuple[float, ...] = ()
    late: bool = False  # whether its particles are to remember what late stages need

    @property
    def shear_modulus(self) -> float:
        """G [Pa], zero without strength."""
        return float(getattr(self.strength, "shear_modulus", 0.0))

    @property
    def bulk_modulus(self) -> float:
        """K [Pa] at rest, with its pores."""
        return self.density_at_rest * self.bulk_sound_speed**2

    @property
    def young_modulus(self) -> float:
        """E [Pa] at rest, zero without strength."""
        return linear.young_modulus(self.density * self.bulk_sound_speed**2, self.shear_modulus)

    @property
    def first_yield(self) -> float:
        """Yield stress at rest [Pa] of a strength that has one number for it; infinite without."""
        return float(getattr(self.strength, "yield_stress", inf))

    @property
    def density_at_rest(self) -> float:
        """Density at the start [kg/m^3]: with its pores, if it has any."""
        return self.density if self.porosity is None else self.density / self.porosity.distension

    @property
    def bulk_sound_speed(self) -> float:
        """Bulk sound speed at rest [m/s]."""
        return self.eos.ambient_sound_speed(self.density)

    @property
    def longitudinal_sound_speed(self) -> float:
        """Speed of longitudinal elastic waves at rest, sqrt(c^2 + 4G/(3 rho0)) [m/s]."""
        return sqrt(self.bulk_sound_speed**2 + 4.0 * self.shear_modulus / (3.0 * self.density))

    @property
    def has_history(self) -> bool:
        """Whether its models have history variables beside plastic strain and damage."""
        burns = isinstance(self.eos, JonesWilkinsLee) and self.eos.burn_rate > 0.0
        remembering = (GradyKipp, GradySpall, JohnsonHolmquistDamage)
        smooths = self.rate_smoothing > 0
        if self.fracture is not None or self.late:
            return True
        return burns or smooths or self.porosity is not None or isinstance(self.damage, remembering)

    @property
    def melting_point(self) -> float:
        """Melting point without pressure [K]; infinite where the material has none, or no temperature."""
        row = self.row()
        return float(row[slots.MELT_TEMPERATURE]) if row[slots.INVERSE_HEAT_CAPACITY] > 0.0 else inf

    @property
    def has_axes(self) -> bool:
        """Whether it has directions, which its particles carry."""
        return self.strength.tag >= tags.ORTHOTROPIC

    @property
    def can_fail(self) -> bool:
        """Whether damage may reach 1: a cut-off that holds its tension never does."""
        breaks = not isinstance(self.damage, NoDamage) or self.strength.tag == tags.FABRIC
        return bool(getattr(self.damage, "permanent", breaks))

    def at_temperature(self, temperature: float) -> tuple[float, float]:
        """Return density [kg/m^3] and energy [J/kg] without pressure at `temperature` [K]; `CaseError` without any."""
        if not self.whole_row[slots.INVERSE_HEAT_CAPACITY] > 0.0:
            raise CaseError("needs a heat capacity: give the material `temperature: {heat_capacity: ...}`")
        pressure = self.pressure_function()

        def energy(rho: float) -> float:
            return self.energy_at(rho, temperature)

        low, high = 0.6 * self.density, 1.1 * self.density
        if not pressure(low, energy(low)) < 0.0 < pressure(high, energy(high)):
            raise CaseError(f"the equation of state has no state of {temperature:g} K without pressure")
        for _ in range(100):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if pressure(middle, energy(middle)) < 0.0 else (low, middle)
        return high, energy(high)

    def energy_at(self, rho: float, temperature: float) -> float:
        """Return the energy [J/kg] at a density and a temperature, of a material that has a heat capacity."""
        return float(isentrope.energies(np.array(rho), temperature, self.whole_row))

    def row(self) -> np.ndarray:
        """Return the slots of the material's row of the table."""
        row = np.zeros(slots.SLOT_COUNT)
        row[slots.RHO0] = self.density
        row[slots.INVERSE_RHO0] = 1.0 / self.density
        row[slots.SOUND_SPEED_SQUARED_FLOOR] = slots.FLOOR_SHARE * self.bulk_sound_speed**2
        row[slots.PRESSURE_MINIMUM] = -np.inf
        row[slots.ROOM_TEMPERATURE] = ROOM_TEMPERATURE
        row[slots.DISTENSION] = 1.0
        row[slots.MELT_TEMPERATURE] = row[slots.MOLTEN_ENERGY] = np.inf
        row[slots.FAILED_FRICTION] = self.failed_friction
        row[slots.RATE_WEIGHT] = 1.0 / self.rate_smoothing if self.rate_smoothing else 0.0
        for model in (self.eos, self.strength, self.damage):
            model.pack(row, self.density)
        if isinstance(self.strength, Rock):
            row[slots.PRESSURE_MINIMUM] = max(row[slots.PRESSURE_MINIMUM], -self.strength.apex)
        if self.spall_strength < inf:
            row[slots.PRESSURE_MINIMUM], row[slots.FAILS_IN_TENSION] = -self.spall_strength, 1.0
            if self.spall_exponent > 0.0:
                bulk = self.density * self.bulk_sound_speed**2
                pressure_cutoff.pack_rated(row, self.spall_strength, self.spall_exponent, self.spall_rate, bulk)
        if self.fracture is not None:
            self.fracture.pack(row, self.density * self.longitudinal_sound_speed**2)
        if self.heat_capacity > 0.0:
            row[slots.INVERSE_HEAT_CAPACITY] = 1.0 / self.heat_capacity
        if self.room_temperature > 0.0:
            row[slots.ROOM_TEMPERATURE] = self.room_temperature
        if self.heat_capacities:
            given = np.array(self.heat_capacities).T
            row[slots.INVERSE_HEAT_CAPACITY] = 1.0 / np.interp(row[slots.ROOM_TEMPERATURE], given[0], given[1])
        row[slots.TOTAL_ENERGY] = float(self.total_energy)
        if self.melting is not None:
            self.melting.pack(row)
        if self.porosity is not None:
            self.porosity.pack(row)
        return row

    @cached_property
    def _without_isentrope(self) -> np.ndarray:
        grid = getattr(self.eos, "tail", np.empty(0))
        return np.concatenate([self.row(), np.zeros(isentrope.LENGTH), grid])

    @cached_property
    def whole_row(self) -> np.ndarray:
        """The material's row of the table: slots, isentrope, and the grid of a tabulated equation of state."""
        row = self._without_isentrope.copy()
        curve = _isentrope(cast("Hashable", self.eos), self.density, float(row[slots.ROOM_TEMPERATURE]))
        row[slots.CURVE : slots.CURVE + isentrope.CURVE_LENGTH] = curve.ravel()
        if self.porosity is not None:
            row[isentrope.CRUSH : isentrope.CRUSH + 2 * isentrope.CRUSH_POINTS] = self.porosity.points()
        if self.heat_capacities:
            at_rest = (self.density, self.eos.ambient_energy, float(row[slots.ROOM_TEMPERATURE]))
            start, per, tau = isentrope.heat_table(
                self.heat_capacities, self.heat_of_melting, curve, self.pressure_function(), at_rest
            )
            row[slots.HEAT_START], row[slots.HEAT_PER] = start, per
            row[isentrope.HEATS : isentrope.HEATS + isentrope.HEAT_POINTS] = tau
        if row[slots.FAILS_IN_TENSION] > 0.0 and row[slots.MELT_TEMPERATURE] < inf:
            row[slots.MOLTEN_ENERGY] = self._molten_energy(row)
        if isinstance(self.strength, JohnsonCook) and self.melting is None:
            warm = row[slots.ROOM_TEMPERATURE] + _COLD / row[slots.INVERSE_MELT_RANGE]
            densities = self.density * np.linspace(isentrope.LOWEST, isentrope.HIGHEST, isentrope.POINTS)
            row[slots.SURE_ENERGY] = isentrope.energies(densities, warm, row).min()
            row[slots.SURE_STRESS] = self.strength.yield_stress * (
                1.0 - (1.1 * _COLD) ** self.strength.thermal_exponent
            )
        return row

    def _molten_energy(self, row: np.ndarray) -> float:
        """Return the energy [J/kg] at the melting point and density at rest; infinite without a heat capacity."""
        if not row[slots.INVERSE_HEAT_CAPACITY] > 0.0:
            return inf
        return float(isentrope.energies(np.array(self.density), row[slots.MELT_TEMPERATURE], row))

    def _state(self) -> Callable[[float, float], tuple[float, float, float]]:
        """Return pressure, p_rho and p_e as a function of density and energy, in plain Python."""
        row, module = self._without_isentrope, MODULES[self.eos.name]
        values = slots.values(row)
        if hasattr(module, "state"):
            state = python_twin(module.state)

            def of_grid(rho: float, e: float, _held: np.ndarray = row) -> tuple[float, float, float]:
                p, p_rho, p_e = state(rho, e, values)  # among the values is the address of the row
                return p, p_rho, p_e

            return of_grid
        pressure, square = python_twin(module.pressure), python_twin(module.sound_speed_squared)

        def of_two(rho: float, e: float) -> tuple[float, float, float]:
            p, slope = pressure(rho, e, values), square(rho, e, 0.0, values)  # linear in the pressure
            return p, slope, (square(rho, e, p, values) - slope) / p * rho**2 if p else 0.0

        return of_two

    def pressure_function(self) -> Callable[[float, float], float]:
        """Return p(rho, e) of the equation of state in plain Python: nothing is compiled."""
        module = MODULES[self.eos.name]
        if hasattr(module, "state"):
            state = self._state()
            return lambda rho, e: float(state(rho, e)[0])
        pressure, values = python_twin(module.pressure), slots.values(self._without_isentrope)
        return lambda rho, e: float(pressure(rho, e, values))

    def pressure(self, rho: float, e: float) -> float:
        """Pressure [Pa] of the equation of state, in plain Python."""
        return float(self._state()(rho, e)[0])

    def sound_speed_squared(self, rho: float, e: float) -> float:
        """Square of the bulk sound speed [m^2/s^2], without a floor, in plain Python."""
        p, p_rho, p_e = self._state()(rho, e)
        return float(p_rho + p * p_e / rho**2)

    def temperature(self, rho: float, e: float) -> float:
        """Temperature [K], in plain Python."""
        return float(python_twin(isentrope.temperature)(rho, e, slots.values(self.whole_row)))

    def released_temperature(self, rho: float, e: float) -> float:
        """Return the temperature [K] at no pressure after an isentropic release from a state, in plain Python.

        T over that of the isentrope through the state at rest is a function of entropy alone, see `isentrope`.
        """
        ambient = float(self.whole_row[slots.ROOM_TEMPERATURE])
        curve = self.whole_row[slots.CURVE + 1 : slots.CURVE + isentrope.CURVE_LENGTH : isentrope.WIDTH]
        shares = np.linspace(isentrope.LOWEST, isentrope.HIGHEST, isentrope.POINTS)
        return self.temperature(rho, e) * ambient / float(np.interp(rho / self.density, shares, curve))


@lru_cache(maxsize=64)
def _isentrope(eos: Any, density: float, ambient: float) -> np.ndarray:
    return isentrope.tabulate_isentrope(
        Material("", density, eos).pressure_function(), density, eos.ambient_energy, ambient
    )


def pack(materials: Sequence[Material]) -> tuple[np.ndarray, np.ndarray]:
    """Pack materials for compiled loops.

    Returns parameters, float64 of shape (materials, width), columns as in `slots`; then isentropes and grids. Tags of
    equation of state, strength and damage, int64 of shape (materials, 3).
    """
    rows = [material.whole_row for material in materials]
    table = np.zeros((len(materials), max((len(row) for row in rows), default=slots.SLOT_COUNT)))
    for row, slots_of_it in zip(table, rows, strict=True):
        row[: len(slots_of_it)] = slots_of_it
    tags = [(material.eos.tag, material.strength.tag, material.damage.tag) for material in materials]
    models = np.array(tags, dtype=np.int64).reshape(len(materials), slots.MODEL_COUNT)
    return table, models


def late_material(material: Material, bulk_modulus: float, poisson_ratio: float) -> Material:
    """Return a material in a late stage, its moduli scaled; `CaseError` for a bulk modulus above its own [Pa]."""
    bulk = material.bulk_modulus
    if bulk_modulus > bulk:
        raise CaseError(f"is above that of '{material.name}', {bulk:.3g} Pa; give a lower one", where="bulk_modulus")
    strength: Any = material.strength
    if material.shear_modulus > 0.0:
        shear = 1.5 * bulk_modulus * (1.0 - 2.0 * poisson_ratio) / (1.0 + poisson_ratio)
        strength = replace(strength, shear_modulus=shear)
    return replace(material, density=material.density_at_rest, eos=Late(bulk_modulus), strength=strength,
                   damage=NoDamage(), porosity=None, spall_strength=inf, fracture=None, late=True)  # fmt: skip


def bind_models(function: CompiledFunction, table: np.ndarray, models: np.ndarray) -> CompiledFunction:
    """Return a compiled function with the common models alone if the table has no others, see `tags`."""
    common = np.array([tags.IDEAL_GAS, tags.JOHNSON_COOK, tags.JOHNSON_COOK_DAMAGE])
    further = (models > common).any() or (table[:, slots.DISTENSION] > 1.0).any()
    further |= (table[:, slots.FRACTURE_COMPLIANCE] > 0.0).any()
    return bind_constants(function, FURTHER=bool(further))
