"""What the arrays of other codes are called, and in which units their numbers are.

Names are compared without case, blanks, dashes and underscores.

| quantity | names |
| --- | --- |
| velocity | velocity, vel, v (a vector), or vx vy vz, or u v w (scalars) |
| mass | mass, m |
| density | density, rho |
| internal energy | internal energy, specific internal energy, energy, e, u (a scalar without v and w) |
| smoothing length | smoothing length, h |
| pressure | pressure, p |
| sound speed | sound speed, cs, c |
| plastic strain | plastic strain, equivalent plastic strain, eps |
| von Mises stress | von mises stress, von mises, vonmises |
| temperature, damage | temperature, temp; damage, d |
| body | body, body id, mol, object, part, material, mat, type, the first of them that holds whole numbers |
| material | material, material id, mat, type |
| id | id, particle id, gid, global ids, tag |
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from hvisph.core.errors import OutputError, suggest_nearest

SCALARS = {
    "mass": ("mass", "m"),
    "density": ("density", "rho"),
    "internal_energy": ("internalenergy", "specificinternalenergy", "energy", "e", "u"),
    "smoothing_length": ("smoothinglength", "h"),
    "pressure": ("pressure", "p"),
    "sound_speed": ("soundspeed", "cs", "c"),
    "plastic_strain": ("plasticstrain", "equivalentplasticstrain", "eps"),
    "von_mises_stress": ("vonmisesstress", "vonmises"),
    "temperature": ("temperature", "temp"),
    "damage": ("damage", "d"),
}
VELOCITY = ("velocity", "vel", "v")
BODY = ("body", "bodyid", "mol", "object", "part", "material", "mat", "type")
MATERIAL = ("material", "materialid", "mat", "type")
ID = ("id", "particleid", "gid", "globalids", "tag")
# Quantities that a name may be given for.
KNOWN = ("velocity", *SCALARS, "body", "material", "id")
# Powers of length, mass and time in each quantity; those that are not here are plain numbers or temperatures.
DIMENSIONS = {
    "position": (1, 0, 0),
    "velocity": (1, 0, -1),
    "mass": (0, 1, 0),
    "density": (-3, 1, 0),
    "internal_energy": (2, 0, -2),
    "smoothing_length": (1, 0, 0),
    "pressure": (-1, 1, -2),
    "sound_speed": (1, 0, -1),
    "von_mises_stress": (-1, 1, -2),
}


def bare(name: str) -> str:
    """Return a name without case, blanks, dashes and underscores."""
    return "".join(c for c in name.lower() if c not in " _-")


@dataclass(frozen=True)
class Convention:
    """How another code's files are to be understood.

    Parameters
    ----------
    names
        The file's own name of a quantity, which then goes before the usual ones: ``{"density": "rho_0"}``.
    units
        Units of length, mass and time in SI; all others follow.
    """

    names: Mapping[str, str] = field(default_factory=dict)
    units: tuple[float, float, float] = (1.0, 1.0, 1.0)

    def __post_init__(self) -> None:
        for quantity in self.names:
            if quantity not in KNOWN:
                raise OutputError(f"'{quantity}' is no quantity that measures know{suggest_nearest(quantity, KNOWN)}")

    def aliases(self, quantity: str, usual: tuple[str, ...]) -> tuple[str, ...]:
        """Return the names of a quantity, bare: the one that was given, or the usual ones."""
        return (bare(self.names[quantity]),) if quantity in self.names else usual

    def factor(self, quantity: str) -> float:
        """Return the SI value of a quantity's unit in these files."""
        powers = DIMENSIONS.get(quantity, (0, 0, 0))
        return float(np.prod([unit**power for unit, power in zip(self.units, powers, strict=True)]))

    def refuse_own(self) -> None:
        """Raise `OutputError` where names or units are given for a file that says both itself."""
        if self.names or self.units != (1.0, 1.0, 1.0):
            raise OutputError("it is a snapshot of hvisph, which says names and units itself: give none")


SI = Convention()
