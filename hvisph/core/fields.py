"""The catalogue of state fields: name, rank, unit and meaning of every per-particle array.

Vectors have as many components as there are dimensions, gradients the square of it
(row-major: xx, xy, xz, yx, ...). Symmetric tensors are stored in the order
xx, yy, zz, xy, xz, yz, cut to 3 components in 1D, 4 in 2D and 6 in 3D, so that
the out-of-plane stress is always there.
"""

from __future__ import annotations

from dataclasses import dataclass

SYMMETRIC_COMPONENTS = ("xx", "yy", "zz", "xy", "xz", "yz")
SYMMETRIC_LENGTH = {1: 3, 2: 4, 3: 6}


@dataclass(frozen=True)
class Field:
    """One quantity that particles carry.

    Parameters
    ----------
    name
        Name at every interface: Python, files, history.
    rank
        ``scalar``, ``vector``, ``symmetric`` or ``gradient``.
    unit
        SI unit, as pint reads it.
    meaning
        One line for the manual and for the attributes of files.
    """

    name: str
    rank: str
    unit: str
    meaning: str

    def components(self, dim: int) -> int:
        """Return how many numbers a particle stores for this field in `dim` dimensions."""
        return {"scalar": 1, "vector": dim, "symmetric": SYMMETRIC_LENGTH[dim], "gradient": dim * dim}[self.rank]


CATALOGUE: dict[str, Field] = {
    field.name: field
    for field in (
        Field("position", "vector", "m", "current position"),
        Field("velocity", "vector", "m/s", "velocity"),
        Field("mass", "scalar", "kg", "mass (per metre of depth in 2D, per square metre in 1D)"),
        Field("density", "scalar", "kg/m^3", "density"),
        Field("internal_energy", "scalar", "J/kg", "specific internal energy"),
        Field("smoothing_length", "scalar", "m", "smoothing length h"),
        Field("deviator", "symmetric", "Pa", "deviatoric part of the Cauchy stress"),
        Field("plastic_strain", "scalar", "", "equivalent plastic strain"),
        Field("damage", "scalar", "", "damage, 0 intact to 1 failed"),
        Field("pressure", "scalar", "Pa", "pressure, positive in compression"),
        Field("sound_speed", "scalar", "m/s", "bulk sound speed"),
        Field("von_mises_stress", "scalar", "Pa", "equivalent (von Mises) stress"),
        Field("temperature", "scalar", "K", "temperature"),
        Field("previous_velocity", "vector", "m/s", "velocity at the last evaluation of the forces"),
        Field("previous_acceleration", "vector", "m/s^2", "acceleration at the last evaluation"),
        Field("previous_power", "scalar", "W/kg", "rate of internal energy at the last evaluation"),
        Field("previous_gradient", "gradient", "1/s", "velocity gradient at the last evaluation"),
        Field("viscosity_alpha", "scalar", "", "own viscosity coefficient of the Morris-Monaghan switch"),
    )
}
