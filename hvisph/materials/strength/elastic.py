"""Elastic strength, Hooke's law for the deviator without yield; and fluids, which have no deviator."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from hvisph.materials import slots, tags
from hvisph.materials.slots import SHEAR_MODULUS


@dataclass(frozen=True)
class ElasticStrength:
    """Parameters of the elastic deviator."""

    shear_modulus: float  # G [Pa]

    name: ClassVar[str] = "elastic"
    tag: ClassVar[int] = tags.ELASTIC_STRENGTH

    def __post_init__(self) -> None:
        slots.require_positive(self, "shear_modulus")

    def pack(self, row: np.ndarray, density: float) -> None:
        """Write the parameters into the material's row of the table."""
        row[SHEAR_MODULUS] = self.shear_modulus


@dataclass(frozen=True)
class NoStrength:
    """A fluid; it has no parameters."""

    name: ClassVar[str] = "none"
    tag: ClassVar[int] = tags.NO_STRENGTH

    def pack(self, row: np.ndarray, density: float) -> None:
        """Leave the shear modulus at zero."""
