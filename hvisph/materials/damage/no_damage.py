"""No damage and no limit to tension."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from hvisph.materials import tags


@dataclass(frozen=True)
class NoDamage:
    """A material that never fails; it has no parameters."""

    name: ClassVar[str] = "none"
    tag: ClassVar[int] = tags.NO_DAMAGE

    def pack(self, row: np.ndarray, density: float) -> None:
        """Leave tension without a limit."""
