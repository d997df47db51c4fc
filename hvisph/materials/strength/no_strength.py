"""No strength: a fluid without deviator and shear modulus."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from hvisph.materials import tags


@dataclass(frozen=True)
class NoStrength:
    """A fluid; it has no parameters."""

    name: ClassVar[str] = "none"
    tag: ClassVar[int] = tags.NO_STRENGTH

    def pack(self, row: np.ndarray, density: float) -> None:
        """Leave the shear modulus at zero."""
