"""Catalogue of kinematics: computed dimensions and assumptions for the others."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Kinematics:
    """Number of dimensions and assumptions for the others.

    Parameters
    ----------
    name
        Name in case files.
    dim
        Number of dimensions that are computed.
    words
        What people call it.
    thins
        Whether matter is free to thin and to thicken across the plane, so that no stress acts there.
    revolved
        Whether the plane is the half-plane (x, r) of solids of revolution about x, and a particle a whole ring.
    fields
        State fields that it needs beside those of every run.
    """

    name: str
    dim: int
    words: str
    thins: bool = False
    revolved: bool = False
    fields: tuple[str, ...] = ()

    @property
    def drawing_dimensions(self) -> int:
        """Number of dimensions in which bodies are drawn: solids of revolution are solids."""
        return 3 if self.revolved else self.dim


# The first of each number of dimensions holds all other strains at zero.
KINEMATICS: dict[str, Kinematics] = {
    kinematics.name: kinematics
    for kinematics in (
        Kinematics("uniaxial_strain", 1, "uniaxial strain (1D)"),
        Kinematics("plane_strain", 2, "plane strain (2D)"),
        Kinematics("plane_stress", 2, "plane stress (2D)", thins=True, fields=("thickness",)),
        Kinematics("axisymmetric", 2, "axisymmetric (x, r)", revolved=True),
        Kinematics("three_d", 3, "3D"),
    )
}


def unstrained_kinematics(dim: int) -> Kinematics:
    """Return the kinematics in `dim` dimensions without strain in the others."""
    return next(kinematics for kinematics in KINEMATICS.values() if kinematics.dim == dim)
