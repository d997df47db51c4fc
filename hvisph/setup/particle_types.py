"""Kernels and impulses at the start: which particles are Total Lagrangian, which are loaded in the first step."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from hvisph.core.errors import CaseError
from hvisph.core.particles import Particles

if TYPE_CHECKING:
    from hvisph.case.case import Case
    from hvisph.case.regions import BoxRegion, Region

EULERIAN = "eulerian"


def in_region(particles: Particles, region: Region, names: list[str]) -> np.ndarray:
    """Return which particles stand in a case's region, a `box` and `bodies` (n,)."""
    inside = in_box(region.box, particles["position"])
    if region.bodies:
        inside &= np.isin(particles.body, [names.index(name) for name in region.bodies])
    return inside


def in_box(box: BoxRegion, positions: np.ndarray) -> np.ndarray:
    """Return which positions (n, dim) lie in a case's box (n,)."""
    inside = np.ones(len(positions), bool)
    for axis, corner in enumerate(box.min):
        if corner is not None:
            inside &= positions[:, axis] >= corner
    for axis, corner in enumerate(box.max):
        if corner is not None:
            inside &= positions[:, axis] <= corner
    return inside


def held_particles(clamps: Sequence[Region], name: str, positions: np.ndarray) -> np.ndarray:
    """Return which particles of the body `name` a case's clamps hold (n,)."""
    held = np.zeros(len(positions), bool)
    for clamp in clamps:
        if not clamp.bodies or name in clamp.bodies:
            held |= in_box(clamp.box, positions)
    return held


def filled_region(particles: Particles, region: Region, names: list[str], where: str) -> np.ndarray:
    """Return which particles stand in a region; raises `CaseError` where none does."""
    inside = in_region(particles, region, names)
    if not inside.any():
        raise CaseError("this region holds no particle; check its corners and bodies", where=where)
    return inside


def set_kernel_types(particles: Particles, case: Case, names: list[str]) -> None:
    """Set the kernel type of every particle, where the formulation has one."""
    if "kernel_type" not in particles.names:
        return
    kinds = [body.formulation or case.formulation.type for body in case.bodies.values()]
    particles["kernel_type"] = np.array([float(kind != EULERIAN) for kind in kinds])[particles.body]
    for number, region in enumerate(getattr(case.formulation, "eulerian_regions", ())):
        where = f"formulation.eulerian_regions.{number}"
        particles["kernel_type"][filled_region(particles, region, names, where)] = 0.0


def set_loads(stepper: Any, case: Case, names: list[str]) -> None:
    """Load the particles of the case's initial loads."""
    for load in case.initial_loads:
        stepper.loads[in_region(stepper.particles, load, names)] += load.pressure


def refuse_outside(particles: Particles, domain: BoxRegion | None, names: list[str]) -> None:
    """Raise `CaseError` where particles start outside of a case's `domain`."""
    outside = np.flatnonzero(~in_box(domain, particles["position"])) if domain is not None else np.zeros(0, int)
    if len(outside):
        body = names[int(particles.body[outside[0]])]
        raise CaseError(f"{len(outside)} particles start outside, the first of body '{body}'", where="domain")
