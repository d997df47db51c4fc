"""Elastic strength, Hooke's law for the deviator without yield; and fluids, which have no deviator."""

from dataclasses import dataclass
from typing import ClassVar

from hvisph.materials import slots, tags


@dataclass(frozen=True)
class ElasticStrength(slots.Parameters):
    """Parameters of the elastic deviator."""

    shear_modulus: float  # G [Pa]

    name: ClassVar[str] = "elastic"
    tag: ClassVar[int] = tags.ELASTIC_STRENGTH


@dataclass(frozen=True)
class NoStrength(slots.Parameters):
    """A fluid; it has no parameters."""

    name: ClassVar[str] = "none"
    tag: ClassVar[int] = tags.NO_STRENGTH
