"""Dry fabric: yarns in two directions that bear tension alone, over P-alpha porosity.

    sigma = -p(rho, e) I + t_1 a_1 a_1 + t_2 a_2 a_2
    dt_k/dt = E_k f (a_k . D a_k),    0 <= t_k <= X_k f,    f = rho/rho_rest

E_k and X_k are those of the cloth at rest: the fibre's times its share of the volume, half of it each way,
E_fibre rho/(2 rho_fibre). A yarn that reaches X_k breaks and bears nothing from then on; where both are broken the
cloth has failed. Out of the sheet yarns rotate as material lines, at the rate a_3 . L a_k, of which the rotation R of
the stress update is half; within the sheet by R, the mean of both yarns. Loose layers bear no hydrostatic tension. The
wave speed along yarns is sqrt(E_k/rho), 1/sqrt(2) of the fibre's. Cunniff 1992, Text. Res. J. 62, 495 (half of the
mass each way); Badel et al. 2009, Composites A 40, 997 (yarns as material lines; recalled); Herrmann 1969 (P-alpha).
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from hvisph.compiler.jit import inline
from hvisph.materials import slots, tags
from hvisph.materials.slots import DISTENSION, INVERSE_RHO0, PRESSURE_MINIMUM, SHEAR_MODULUS

E1, E2, X1, X2 = slots.STRENGTH[:4]


@dataclass(frozen=True)
class Fabric:
    """Parameters of a dry fabric."""

    moduli: tuple[float, float]  # E1, E2 of the cloth at rest [Pa]
    tensile_strength: tuple[float, float]  # X1, X2 [Pa]

    name: ClassVar[str] = "fabric"
    tag: ClassVar[int] = tags.FABRIC

    @property
    def shear_modulus(self) -> float:
        """G_eff [Pa] with which sqrt(c^2 + 4 G/(3 rho)) at rest is sqrt(c^2 + E/rho)."""
        return 0.75 * max(self.moduli)

    def is_same_about(self, axis: int) -> bool:
        """Return whether the cloth is the same about a material axis: in its plane, with yarns alike."""
        return axis == 2 and self.moduli[0] == self.moduli[1] and self.tensile_strength[0] == self.tensile_strength[1]

    def pack(self, row: np.ndarray, density: float) -> None:
        row[SHEAR_MODULUS], row[PRESSURE_MINIMUM] = self.shear_modulus, 0.0
        row[[E1, E2]], row[[X1, X2]] = self.moduli, self.tensile_strength


@inline
def packing(rho, row):
    """Return rho over the density of the cloth at rest."""
    return rho * row[INVERSE_RHO0] * row[DISTENSION]


@inline
def pull_yarn(t, strain, broken, full, modulus, strength):
    """Return a yarn's tension [Pa] after a strain, and 1 if broken; `full` is `packing`, others are at rest [Pa]."""
    trial = max(t + modulus * full * strain, 0.0)
    broken = 1.0 if trial >= strength * full else broken
    return (0.0 if broken > 0.0 else trial), broken
