"""Strength models, one a file, and the compiled choice between them."""

from __future__ import annotations

from ...core.jit import compiled
from ..slots import INVERSE_HEAT_CAPACITY, INVERSE_MELT_RANGE, ROOM_TEMPERATURE, Model
from . import johnson_cook, linear_hardening, von_mises
from .elastic import ElasticStrength
from .johnson_cook import JohnsonCook
from .linear_hardening import LinearHardening
from .none import NoStrength
from .von_mises import VonMises

REGISTRY: dict[str, type[Model]] = {
    model.name: model for model in (NoStrength, ElasticStrength, VonMises, LinearHardening, JohnsonCook)
}

_VON_MISES = VonMises.tag
_LINEAR_HARDENING = LinearHardening.tag


@compiled
def temperature(e, row):
    """Temperature [K] from the specific internal energy; the room's where no heat capacity is known."""
    return row[ROOM_TEMPERATURE] + max(e, 0.0) * row[INVERSE_HEAT_CAPACITY]


@compiled
def homologous_temperature(e, row):
    """Homologous temperature (T - T_room)/(T_melt - T_room), held in [0, 1]."""
    return min(max(e, 0.0) * row[INVERSE_HEAT_CAPACITY] * row[INVERSE_MELT_RANGE], 1.0)


@compiled
def yield_stress(tag, plastic_strain, factor, row):
    """Yield stress [Pa] of a model that has one; `factor` is Johnson-Cook's for rate and heat."""
    if tag == _VON_MISES:
        return von_mises.yield_stress(row)
    if tag == _LINEAR_HARDENING:
        return linear_hardening.yield_stress(plastic_strain, row)
    return johnson_cook.yield_stress(plastic_strain, factor, row)
