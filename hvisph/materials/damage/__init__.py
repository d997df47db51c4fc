"""Damage and spall models."""

from hvisph.materials.damage.pressure_cutoff import NoDamage
from hvisph.materials.slots import Model

from .grady_kipp import GradyKipp
from .johnson_cook import JohnsonCookDamage
from .johnson_holmquist import JohnsonHolmquistDamage
from .orthotropic import Hashin, MaxStress
from .pressure_cutoff import PressureCutoff
from .tensile import CockcroftLatham, GradySpall, PrincipalStress

REGISTRY: dict[str, type[Model]] = {
    model.name: model
    for model in (
        *(NoDamage, PressureCutoff, JohnsonCookDamage, GradyKipp),
        *(GradySpall, PrincipalStress, CockcroftLatham, JohnsonHolmquistDamage),
        *(Hashin, MaxStress),
    )
}

__all__ = [
    "REGISTRY",
    "CockcroftLatham",
    "GradyKipp",
    "GradySpall",
    "Hashin",
    "JohnsonCookDamage",
    "JohnsonHolmquistDamage",
    "MaxStress",
    "NoDamage",
    "PressureCutoff",
    "PrincipalStress",
]
