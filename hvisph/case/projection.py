"""What SPH-projection asks of the rest of a case: its own time step, and no choice that it cannot follow."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from hvisph.case.dimensions import LENGTH
from hvisph.case.model import Path, Problem
from hvisph.case.units import parse_quantity

if TYPE_CHECKING:
    from hvisph.case.case import Case

# Farahani 2009 steps by 0.1 ns at a spacing of 0.1 mm; in proportion to the spacing the physics stays [s/m].
STEP_OVER_DX = 1e-6


def default_step(data: dict[str, Any]) -> float | None:
    """Return the step [s] of a raw case that leaves it to SPH-projection, None for any other case."""
    formulation, time, resolution = (data.get(key) for key in ("formulation", "time", "resolution"))
    if not isinstance(formulation, dict) or formulation.get("type") != "projection":
        return None
    if not isinstance(time, dict) or time.get("step") is not None or data.get("units") == "none":
        return None
    try:
        spacing = parse_quantity(resolution, LENGTH) if isinstance(resolution, str) else float(resolution or 0.0)
    except (TypeError, ValueError):  # the resolution's own check says what is wrong with it
        return None
    return STEP_OVER_DX * spacing if 0.0 < spacing < 1e300 else None


def projection_problems(case: Case) -> Iterator[Problem]:
    """Yield what has no meaning together with SPH-projection."""
    formulation = case.formulation
    if formulation.type != "projection":
        return
    if case.kinematics == "plane_stress":
        yield Problem(("kinematics",), "plane_stress has no meaning with projection, which keeps density in the plane")
    if case.time.step is None:
        yield Problem(("time", "step"), "has no default for projection in a case without units; give the time step")
    force = len(formulation.body_force)
    if force not in (0, case.dim):
        yield Problem(("formulation", "body_force"), f"has {force} components, needs {case.dim} in {case.dim}D")
    if case.initial_loads:
        yield Problem(
            ("initial_loads",),
            "a pressure that the first step adds has no meaning with projection, which finds its own",
        )
    for name, body in case.bodies.items():
        if body.material.damage.type != "none":
            path: Path = ("bodies", name, "material", "damage", "type")
            yield Problem(
                path,
                f"'{body.material.damage.type}' has no meaning with projection: its pressure restores the "
                "density and is no stress that a material could fail by; use none",
            )


def projection_warnings(case: Case) -> Iterator[str]:
    """Yield what a user of SPH-projection should know before the run."""
    formulation = case.formulation
    if formulation.type != "projection":
        return
    if case.time.integrator != "leapfrog":
        name = case.time.integrator
        yield f"time.integrator: '{name}' is not used by projection, which has a step of its own"
    if formulation.pressure_gradient != "printed":
        return
    densities = {body.material.density for body in case.bodies.values()}
    if len(densities) > 1:
        between = " and ".join(f"{density:g}" for density in (min(densities), max(densities)))
        yield (
            "formulation.pressure_gradient: 'printed' is for bodies of one density; between "
            f"{between} kg/m^3 it fails at the published time step, use conjugate"
        )
