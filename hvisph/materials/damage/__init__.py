"""Damage and spall models, one a file."""

from __future__ import annotations

from ..slots import Model
from .johnson_cook import FailureMark, JohnsonCookDamage
from .none import NoDamage
from .pressure_cutoff import PressureCutoff

REGISTRY: dict[str, type[Model]] = {model.name: model for model in (NoDamage, PressureCutoff, JohnsonCookDamage)}

__all__ = ["REGISTRY", "FailureMark", "JohnsonCookDamage", "NoDamage", "PressureCutoff"]
