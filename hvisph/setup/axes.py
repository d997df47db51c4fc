"""Axes of anisotropic materials at the start, and the kinematics in which they have a meaning."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from hvisph.core.catalogues import KINEMATICS
from hvisph.core.errors import CaseError
from hvisph.geometry.placement import rotation_matrix
from hvisph.materials.material_table import Material

if TYPE_CHECKING:
    from hvisph.case.bodies import Body
    from hvisph.case.case import Case

_ALONG = 1e-6  # sine of the angle between directions that are the same


def material_axes(case: Case, name: str, model: Body, material: Material) -> np.ndarray:
    """Return the unit quaternion (4,) that turns x, y, z into the material axes of the body `name`.

    Raises `CaseError` without axes in 3D, and where the material is not symmetric as the case is.
    """
    where = f"bodies.{name}"
    kinematics = KINEMATICS[case.kinematics]
    _refuse_kinematics(case, where)
    if model.axes is None:
        if kinematics.dim == 3:
            fault = f"missing: '{material.name or material.strength.name}' has directions; give them, such as"
            raise CaseError(f"{fault} {{one: [0, 1, 0], two: [0, 0, 1]}} for a plate across x", where=f"{where}.axes")
        triad = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
    else:
        one, two = (np.array(direction) / np.linalg.norm(direction) for direction in (model.axes.one, model.axes.two))
        triad = np.array([one, two, np.cross(one, two)])
    if model.rotation is not None and kinematics.dim == 3:
        triad = triad @ rotation_matrix(3, model.rotation.radians, model.rotation.axis).T
    strength: Any = material.strength
    if kinematics.dim < 3:
        along = [k for k in range(3) if abs(triad[k, 0]) > 1.0 - _ALONG]
        if not (
            along
            and strength.is_same_about(along[0])
            and (kinematics.dim == 1 or _fails_alike(material.damage, along[0]))
        ):  # uniaxial strain stays so
            raise CaseError(
                f"{kinematics.words} needs a material that is the same in all directions about x, such as a "
                "quasi-isotropic laminate or a cloth with both yarns alike, axis 3 along x (E1 = E2, nu13 = nu23, "
                "G13 = G23, G12 = E1/(2 (1 + nu12)), damage none, pressure_cutoff or max_stress with 1 and 2 alike); "
                "other materials need 3D",
                where=f"{where}.axes",
            )
    for number, plane in enumerate(case.symmetry):
        normal = np.eye(3)["xyz".index(plane.axis)]
        across = np.abs(triad @ normal)
        alike = [k for k in range(3) if across[k] < _ALONG and strength.is_same_about(k)]
        if not (across.max() > 1.0 - _ALONG or (alike and _fails_alike(material.damage, alike[0]))):
            raise CaseError(
                f"the material of '{name}' is not its own image there: none of its axes lies "
                f"along {plane.axis}; turn the axes, or leave the plane out",
                where=f"symmetry.{number}",
            )
    return quaternion_of(triad.T)


def _refuse_kinematics(case: Case, where: str) -> None:
    """Raise an error where no anisotropic stress is computed."""
    axisymmetric = KINEMATICS[case.kinematics].axisymmetric
    if case.dim == 2 and not axisymmetric:
        raise CaseError(
            f"an anisotropic material in {KINEMATICS[case.kinematics].words} is not available: fibres out "
            "of the plane would turn into it; use three_d, or axisymmetric",
            where=f"{where}.material",
        )
    kind, contact = case.formulation.type, getattr(case.formulation, "contact", None)
    if kind == "projection":
        fault = "'projection' has no trace of the stress beside its own pressure, which an anisotropic"
        raise CaseError(f"{fault} material needs; use another formulation", where="formulation.type")
    if getattr(case.formulation, "variant", None) == "elastic":
        raise CaseError(
            "the elastic variant extrapolates the stress with isotropic moduli, which an anisotropic material does not "
            "have; use the default variant, or total_lagrangian",
            where="formulation.variant",
        )
    if axisymmetric and (
        kind in ("total_lagrangian", "adaptive") or (contact is not None and contact.type == "penalty")
    ):
        fault = f"'{kind}' takes the hoop stress from a deviator without trace, which an anisotropic material"
        raise CaseError(f"{fault} does not have; use riemann, eulerian or three_d", where="formulation.type")


def _fails_alike(damage: Any, axis: int) -> bool:
    """Return whether failure is the same in all directions about an axis as far as these are principal."""
    if damage.name == "hashin":
        return False
    if damage.name == "max_stress":
        i, j = (k for k in range(3) if k != axis)
        out = {0: (0, 1), 1: (0, 2), 2: (1, 2)}[axis]  # S12, S13, S23 with that axis
        same = (
            (damage.tension[i], damage.tension[j]),
            (damage.compression[i], damage.compression[j]),
            (damage.shear[out[0]], damage.shear[out[1]]),
        )
        return axis == 2 and all(a == b for a, b in same)
    return True


def quaternion_of(r: np.ndarray) -> np.ndarray:
    """Return the unit quaternion w, x, y, z (4,) of a rotation matrix (3, 3): the eigenvector of Bar-Itzhack 2000."""
    k = np.array(
        [
            [r[0, 0] + r[1, 1] + r[2, 2], r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]],
            [0.0, r[0, 0] - r[1, 1] - r[2, 2], r[0, 1] + r[1, 0], r[0, 2] + r[2, 0]],
            [0.0, 0.0, r[1, 1] - r[0, 0] - r[2, 2], r[1, 2] + r[2, 1]],
            [0.0, 0.0, 0.0, r[2, 2] - r[0, 0] - r[1, 1]],
        ]
    )
    vectors = np.linalg.eigh(k + np.triu(k, 1).T)[1]
    return np.asarray(vectors[:, 3])
