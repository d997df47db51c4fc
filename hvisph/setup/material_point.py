"""Material point under a prescribed strain path: the stress update in plain Python.

The energy changes by the work of the stress, de = (S:D - p tr D) dt/rho, and the density by the volume.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from hvisph.compiler.jit import python_twin
from hvisph.core.errors import CaseError
from hvisph.materials import anisotropic_stress, isentrope, thermodynamics
from hvisph.materials.damage import GradyKipp
from hvisph.materials.material_table import Material, pack
from hvisph.materials.slots import DISTENSION, INVERSE_HEAT_CAPACITY, values
from hvisph.materials.stress_update import NO_HISTORY

from .initial_fields import with_cracks

PATHS = ("shear", "uniaxial_strain", "uniaxial_stress", "cycle", "rotation")
# What `drive` records, beside the strain.
COLUMNS = ("xx", "yy", "zz", "xy", "xz", "yz", "pressure", "von_mises_stress", "plastic_strain", "damage", "density",
           "internal_energy", "temperature")  # fmt: skip
POINT_VOLUME = 1e-9  # [m^3]; flaws and cracks of brittle materials depend on it
_SECANT_STEPS = 40  # largest number, for stress-free sides


@dataclass(frozen=True)
class PointRecord:
    """History of a material point.

    `strain` (n,) is the shear integral of du_x/dy, else logarithmic, or the angle of a rotation; `values` (n, 13) are
    `COLUMNS`, with Cauchy stress positive in tension.
    """

    strain: np.ndarray
    values: np.ndarray

    def __getitem__(self, column: str) -> np.ndarray:
        """Return a column, (n,)."""
        return self.values[:, COLUMNS.index(column)]


class _Point:
    def __init__(self, material: Material, width: float = POINT_VOLUME ** (1.0 / 3.0)):
        material = with_cracks(material, POINT_VOLUME)
        self.row = material.whole_row
        self.table, self.models = pack([material])
        self.update_stress = python_twin(anisotropic_stress.update_with_axes)
        self.heat = python_twin(isentrope.temperature)
        self.rho, self.e = material.density, material.eos.ambient_energy
        self.s: tuple[float, ...] = (0.0,) * 6
        self.plastic_strain = self.damage = 0.0
        self.history: tuple[float, ...] = (*NO_HISTORY[:-1], width)
        self.axes: tuple[float, ...] = anisotropic_stress.NO_AXES
        if material.porosity is not None:
            self.history = (material.porosity.distension, *self.history[1:])
            self.rho /= material.porosity.distension
        elif material.has_history:
            self.history = (0.0, *self.history[1:])
        if isinstance(material.damage, GradyKipp):
            threshold, exponent, number = material.damage.flaws("point", 1, POINT_VOLUME)[0].tolist()
            self.history = (self.history[0], threshold, exponent, number, *self.history[4:])
        self.p = 0.0

    def try_step(self, l: np.ndarray, dt: float) -> tuple:
        """Return the result of a step at the velocity gradient `l`."""
        trace = l[0, 0] + l[1, 1] + l[2, 2]
        rho = self.rho * np.exp(-dt * trace)
        d = 0.5 * (l + l.T)
        stress = _matrix(self.s) - self.p * np.eye(3)
        e = self.e
        for _ in range(2):  # the work of the mean stress
            state = self.s, self.plastic_strain, self.damage, self.history, self.axes
            update = self.update_stress(self.table, self.models, 0, dt, rho, e, *state, tuple(l.ravel().tolist()))
            after = _matrix(update[0]) - update[3] * np.eye(3)
            e = self.e + dt * 0.5 * float(((stress + after) * d).sum()) * 2.0 / (self.rho + rho)
        return rho, e, update

    def step(self, l: np.ndarray, dt: float) -> None:
        """Advance by a step."""
        self.rho, self.e, update = self.try_step(l, dt)
        self.s, self.plastic_strain, self.damage, self.p, _, self.history, self.axes = update

    def record(self) -> list[float]:
        """Return `COLUMNS`."""
        s = _matrix(self.s)
        stress = [*(np.diag(s) - self.p), s[0, 1], s[0, 2], s[1, 2]]
        solid = self.rho * self.history[0] if self.row[DISTENSION] > 1.0 else self.rho
        t = self.heat(solid, self.e, values(self.row))
        mises = float(np.sqrt(max(1.5 * (s * s).sum() - 0.5 * np.trace(s) ** 2, 0.0)))
        return [*stress, self.p, mises, self.plastic_strain, self.damage, self.rho, self.e, t]


def _matrix(s: tuple[float, ...]) -> np.ndarray:
    return np.array([[s[0], s[3], s[4]], [s[3], s[1], s[5]], [s[4], s[5], s[2]]])


def _lateral_rate(point: _Point, rate: float, dt: float, before: float) -> float:
    """Return the lateral strain rate [1/s] of stress-free sides."""

    def stress(sideways: float) -> float:
        _, _, update = point.try_step(np.diag([rate, sideways, sideways]), dt)
        return float(update[0][1] - update[3])

    low, high = before, before + 0.05 * abs(rate)
    at_low, at_high = stress(low), stress(high)
    for _ in range(_SECANT_STEPS):
        if at_high == at_low or abs(at_high) < 1.0:
            break
        low, high, at_low = high, high - at_high * (high - low) / (at_high - at_low), at_high
        at_high = stress(high)
    return high


def has_temperature(material: Material) -> bool:
    """Return whether the material has a heat capacity, hence a temperature."""
    return bool(material.row()[INVERSE_HEAT_CAPACITY] > 0.0)


def flow_at(material: Material, temperature: float | None, strain: float, rate: float, pressure: float = 0.0) -> float:
    """Return the yield stress at temperature [K] (None for that at rest), strain, rate [1/s] and pressure [Pa]."""
    table, models = pack([material])
    e = material.eos.ambient_energy
    if temperature is not None:
        e = material.energy_at(material.density, temperature)
    flow = python_twin(thermodynamics.flow_stress)
    return float(flow(table, models, 0, material.density, e, pressure, strain, 0.0, rate)[0])


def drive(
    material: Material,
    path: str = "uniaxial_stress",
    rate: float = 1e3,
    strain: float = 0.2,
    steps: int = 400,
    axis: int = 0,
    width: float = POINT_VOLUME ** (1.0 / 3.0),
) -> PointRecord:
    """Drive a material point along a path.

    `material`: what it is made of.
    `path`: ``shear`` (du_x/dy alone), ``uniaxial_strain``, ``uniaxial_stress`` (stress-free sides), ``cycle`` (uniaxial
    stress to the strain, back to its opposite, and to 0), ``rotation`` (strained by a thousandth, then turned).
    `rate`: strain rate [1/s], above 0; in a rotation the spin.
    `strain`: strain at the end; below 0 for compression. In a rotation the angle [rad].
    `steps`: number of steps.
    `axis`: axis of an anisotropic material that lies along x: 0, 1 or 2.
    `width`: width of the crack band that the point stands for [m].
    Raises `CaseError` for an unknown path or numbers without a meaning.
    """
    if path not in PATHS:
        raise CaseError(f"unknown path '{path}'; allowed: {', '.join(PATHS)}")
    if not (rate > 0.0 and steps > 0 and strain != 0.0 and width > 0.0):
        raise CaseError("rate, steps and width must be above zero, and the strain must not be zero")
    point = _Point(material, width)
    if axis:  # turned by a third of a circle about (1, 1, 1), once or twice
        point.axes = (-0.5 * (-1.0) ** axis, -0.5, -0.5, -0.5, 0.0)
    length = 4.0 * abs(strain) if path == "cycle" else abs(strain)
    dt = length / rate / steps
    if path == "rotation":
        point.step(np.diag([1e-3, -0.5e-3, -0.5e-3]), 1.0)
    gradient: Callable[[float, float], np.ndarray] = lambda signed, _: np.diag([signed, 0.0, 0.0])  # noqa: E731
    if path == "shear":
        gradient = lambda signed, _: np.array([[0.0, signed, 0.0], [0.0] * 3, [0.0] * 3])  # noqa: E731
    elif path == "rotation":
        gradient = lambda signed, _: np.array([[0.0, -signed, 0.0], [signed, 0.0, 0.0], [0.0] * 3])  # noqa: E731
    strains, records, strain_now, sideways = [0.0], [point.record()], 0.0, -0.3 * rate * np.sign(strain)
    for k in range(steps):
        signed = rate * float(np.sign(strain))
        if path == "cycle" and steps // 4 <= k < 3 * steps // 4:
            signed = -signed
        if path in ("uniaxial_stress", "cycle"):
            sideways = _lateral_rate(point, signed, dt, sideways if sideways * signed < 0.0 else -sideways)
            point.step(np.diag([signed, sideways, sideways]), dt)
        else:
            point.step(gradient(signed, dt), dt)
        strain_now += signed * dt
        strains.append(strain_now)
        records.append(point.record())
    return PointRecord(np.array(strains), np.array(records))
