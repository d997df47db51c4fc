"""Catalogues of kinematics, smoothing kernels, shapes and particle arrangements."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Kinematics:
    """Number of dimensions and assumptions for the others."""

    name: str  # name in case files
    dim: int  # number of dimensions that are computed
    words: str  # what people call it
    thins: bool = False  # whether matter is free to thin and to thicken across the plane, so that no stress acts there
    # whether the plane is the half-plane (x, r) of solids of revolution about x, and a particle a torus
    axisymmetric: bool = False
    fields: tuple[str, ...] = ()  # state fields that it needs beside those of every run

    @property
    def drawing_dimensions(self) -> int:
        """Number of dimensions in which bodies are drawn: solids of revolution are solids."""
        return 3 if self.axisymmetric else self.dim


# The first of each number of dimensions holds all other strains at zero.
KINEMATICS: dict[str, Kinematics] = {
    kinematics.name: kinematics
    for kinematics in (
        Kinematics("uniaxial_strain", 1, "uniaxial strain (1D)"),
        Kinematics("plane_strain", 2, "plane strain (2D)"),
        Kinematics("plane_stress", 2, "plane stress (2D)", thins=True, fields=("thickness",)),
        Kinematics("axisymmetric", 2, "axisymmetric (x, r)", axisymmetric=True),
        Kinematics("three_d", 3, "3D"),
    )
}


def unstrained_kinematics(dim: int) -> Kinematics:
    """Return the kinematics in `dim` dimensions without strain in the others."""
    return next(kinematics for kinematics in KINEMATICS.values() if kinematics.dim == dim)


# Support of the smoothing kernels over h [-]; `hvisph.sph.kernels` has their shapes.
REACH = {
    "cubic_spline": 2.0,
    "quadratic": 2.0,
    "quartic_spline": 2.5,
    "quintic_spline": 3.0,
    "gaussian": 3.0,  # cut off there
    "wendland_c2": 2.0,
    "wendland_c4": 2.0,
}
_NOSED = ("cone", "frustum", "ogive", "dome", "rounded_cylinder")
_COMBINED = ("union", "intersection", "difference", "repeat")
# The shapes of each number of dimensions.
SHAPES: dict[int, tuple[str, ...]] = {
    1: ("interval", "particles"),
    2: ("disc", "box", "annulus", "polygon", *_NOSED, *_COMBINED, "particles"),
    3: ("sphere", "box", "cylinder", "tube", "hollow_sphere", *_NOSED, "prism", "ring", "honeycomb", *_COMBINED,
        "mesh", "particles"),
}  # fmt: skip


@dataclass(frozen=True)
class Arrangement:
    """Particle arrangement in a shape; its function is in `hvisph.geometry.filling`."""

    name: str  # name in case files
    dims: tuple[int, ...]  # numbers of dimensions in which it has a meaning
    shapes: tuple[str, ...] = ()  # shapes that it is for; empty where it is for all that have to be filled


# The first that suits a shape is its default.
ARRANGEMENTS: dict[str, Arrangement] = {
    arrangement.name: arrangement
    for arrangement in (
        Arrangement("uniform", (1,)),
        Arrangement("square", (2,)),
        Arrangement("cubic", (3,)),
        Arrangement("hexagonal", (2,)),
        Arrangement("hcp", (3,)),
        Arrangement("relaxed", (2, 3)),
        Arrangement("rings", (2,), ("disc",)),
        Arrangement("lattice_two_rings", (2,), ("disc",)),
        Arrangement("from_file", (1, 2, 3), ("particles",)),
    )
}
# Those of axisymmetric cases: their first row stands half a spacing from it.
SECTION_ARRANGEMENTS = ("square", "relaxed")


def arrangements_of(dim: int, shape: str) -> tuple[str, ...]:
    """Return the arrangements that have a meaning for a shape in `dim` dimensions, its default first."""
    suiting = [a for a in ARRANGEMENTS.values() if dim in a.dims]
    if shape == "particles":  # they stand where their file says
        return tuple(a.name for a in suiting if shape in a.shapes)
    return tuple(a.name for a in suiting if not a.shapes or shape in a.shapes)
