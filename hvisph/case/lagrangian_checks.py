"""What a case with Total Lagrangian particles, contact or initial loads must fulfil."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from hvisph.case.model import Path, Problem
from hvisph.core.errors import nearest

if TYPE_CHECKING:
    from hvisph.case.case import Case

LAGRANGIAN = ("total_lagrangian", "adaptive")


def lagrangian_problems(case: Case) -> Iterator[Problem]:
    """Yield what is wrong with kernel types, conversion, contact and initial loads."""
    formulation = case.formulation
    kind = formulation.type
    path: Path = ("formulation",)
    contact = getattr(formulation, "contact", None)
    parted = contact is not None and contact.type == "repulsive"
    if parted and kind not in LAGRANGIAN and len(case.bodies) < 2:
        yield Problem((*path, "contact"), "there is only one body; leave it out")
    if (parted or kind in LAGRANGIAN) and formulation.smoothing_length.type == "variable":
        reason = "reference kernels are" if kind in LAGRANGIAN else "contact is"
        yield Problem((*path, "smoothing_length"), f"{reason} of a fixed smoothing length; leave it out")
    corrected = kind in LAGRANGIAN and getattr(formulation, "spatial_correction").type != "none"  # noqa: B009
    if corrected and not parted and len(case.bodies) > 1:
        reason = "where bodies meet through the kernel their corrections would mix; give contact: {type: repulsive}"
        yield Problem((*path, "spatial_correction"), reason)
    for number, load in enumerate(case.initial_loads):
        if kind not in LAGRANGIAN:
            yield Problem(
                ("initial_loads", number),
                f"has no meaning for '{kind}'; use the formulation total_lagrangian, where a body may be eulerian",
            )
        yield from _region(case, load, ("initial_loads", number))
    for name, body in case.bodies.items():
        if body.formulation is None:
            continue
        if kind not in LAGRANGIAN:
            yield Problem(
                ("bodies", name, "formulation"),
                f"beside '{kind}' no body has a formulation of its own; give the case total_lagrangian or adaptive",
            )
        elif body.formulation == "adaptive" and kind != "adaptive":
            yield Problem(
                ("bodies", name, "formulation"),
                "needs the limits of conversion; give the case the formulation adaptive",
            )
    if kind in LAGRANGIAN:
        for number, region in enumerate(getattr(formulation, "eulerian_regions", ())):
            yield from _region(case, region, (*path, "eulerian_regions", number))
    if kind == "adaptive":
        yield from _conversion(case)


def _conversion(case: Case) -> Iterator[Problem]:
    limits: Any = getattr(case.formulation, "conversion", None)
    path = ("formulation", "conversion")
    if limits.strain is None and not limits.damage:
        yield Problem(path, "names no limit; give strain, or damage: true, or use total_lagrangian")
    adaptive = [body for body in case.bodies.values() if body.formulation in (None, "adaptive")]
    if not adaptive:
        yield Problem(path, "no body is adaptive; use the formulation total_lagrangian")
    elif limits.damage and all(body.material.damage.type != "johnson_cook" for body in adaptive):
        yield Problem((*path, "damage"), "no material of an adaptive body can fail; give one johnson_cook damage")


def _region(case: Case, region: object, path: Path) -> Iterator[Problem]:
    for number, name in enumerate(getattr(region, "bodies")):  # noqa: B009 - regions of several kinds
        if name not in case.bodies:
            yield Problem((*path, "bodies", number), f"unknown body '{name[:64]}'{nearest(name, list(case.bodies))}")
    box = getattr(region, "box")  # noqa: B009
    for side in ("min", "max"):
        corner = getattr(box, side)
        if corner and len(corner) != case.dim:
            yield Problem((*path, "box", side), f"has {len(corner)} components, needs {case.dim} in {case.dim}D")
