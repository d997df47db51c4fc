"""Spall by pressure cut-off p >= p_min.

    p >= p_min,    p_min <= 0

    d D/dt = K r/(m s) (-p/s)^(1/m - 1)   where -p > s,    s = -p_min (r/rate_0)^m,  r = 1e4 1/s

The cut-off is recoverable: after recompression the material is as before. With `permanent: true`
the first state below p_min fails the material; molten material then fails under any tension. With
an exponent m the spall strength grows with the rate of expansion (`rated_spall`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from hvisph.compiler.jit import inline
from hvisph.core.errors import CaseError
from hvisph.materials import tags
from hvisph.materials.slots import FAILS_IN_TENSION, PRESSURE_MINIMUM


@dataclass(frozen=True)
class PressureCutoff:
    """Parameters of the pressure cut-off."""

    pressure_minimum: float  # p_min [Pa], not above zero
    permanent: bool = False  # for good, at the first state below

    name: ClassVar[str] = "pressure_cutoff"
    tag: ClassVar[int] = tags.PRESSURE_CUTOFF

    def __post_init__(self) -> None:
        require_tension(self.pressure_minimum, self.name)

    def pack(self, row: np.ndarray, density: float) -> None:
        """Write the parameters into the material's row of the table."""
        row[PRESSURE_MINIMUM] = self.pressure_minimum
        row[FAILS_IN_TENSION] = float(self.permanent)


def require_tension(pressure_minimum: float, where: str) -> None:
    """Raise `CaseError` unless the least pressure is a tension or zero."""
    if not pressure_minimum <= 0.0:
        raise CaseError(f"pressure_minimum is {pressure_minimum!r}, but must not be above zero", where=where)


@inline
def limited_pressure(p, row):
    """Pressure [Pa] after the cut-off; what is not a number passes through."""
    return row[PRESSURE_MINIMUM] if p < row[PRESSURE_MINIMUM] else p
