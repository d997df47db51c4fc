"""SPH-projection: options, time step and consistency checks."""

from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal

from hvisph.case.model import SCALAR_AS_LIST, AnyCase, Problem, key
from hvisph.case.units import LENGTH, NUMBER, TIME, Acceleration, Quantity, SmoothingRatio, parse_quantity
from hvisph.core.text import Plain, recommend

from .options import NO_CONVERSION, KernelOptions

# Farahani 2009 steps by 0.1 ns at a spacing of 0.1 mm; in proportion to the spacing the physics stays [s/m].
STEP_OVER_DX = 1e-6


def default_step(data: Plain) -> float | None:
    """Return the default time step [s] of SPH-projection, None for any other case."""
    formulation, time, resolution = (data.get(key) for key in ("formulation", "time", "resolution"))
    if not isinstance(formulation, dict) or formulation.get("type") != "projection":
        return None
    if not isinstance(time, dict) or time.get("step") is not None or data.get("units") == "none":
        return None
    try:
        spacing = parse_quantity(resolution, LENGTH) if isinstance(resolution, str) else float(resolution or 0.0)
    except (TypeError, ValueError):  # refused by the check of the resolution itself
        return None
    return STEP_OVER_DX * spacing if 0.0 < spacing < 1e300 else None


class ProjectionFormulation(KernelOptions):
    """SPH-projection (Farahani 2009): density restored each step by a pressure from a Poisson equation.

    Neither equation of state nor energy: a material gives its density and its strength alone.
    """

    meaningless: ClassVar[dict[str, str]] = NO_CONVERSION | {
        "eos": "its pressure restores density and comes from no equation of state",
        "viscosity": "it has neither shocks nor an artificial viscosity to spread them",
        "artificial_stress": "its pressure keeps particles in order",
        "correction": "its Poisson equation is that of the plain kernel gradient",
        "contact": "bodies meet in the pressure's Poisson equation",
        "momentum_form": "give pressure_gradient: conjugate or original",
        "density_form": "density is restored each step",
        "density_dissipation": "density is restored each step",
    }

    type: Literal["projection"] = "projection"
    h_over_dx: SmoothingRatio = key("Initial smoothing length h over the resolution dx [-]", 1.5)
    pressure_gradient: Literal["conjugate", "original"] = key(
        "Pair pressure: `conjugate` is (P_a + P_b)/(rho_a rho_b); `original` is the paper's eq. 31, "
        "P_a/rho_a^2 + P_b/rho_b^2, which fails where bodies of different densities meet",
        "conjugate",
    )
    min_support: Annotated[float, Quantity(NUMBER, minimum=0, below=1)] = key(
        "Completeness of the kernel support below which a particle has zero pressure [-], at least 0 and "
        "below 1; 1 inside a body, 0.5 at a plane surface. The Poisson equation of small detached groups is ill-posed",
        0.3,
    )
    pressure_average: Annotated[float, Quantity(TIME, above=0)] = key(
        "Time over which the pressures of the history are averaged [s]: single values oscillate", 2e-7
    )
    body_force: Annotated[tuple[Acceleration, ...], SCALAR_AS_LIST] = key("Acceleration per dimension [m/s^2]", ())

    def problems(self, case: AnyCase) -> Iterator[Problem]:
        yield from super().problems(case)
        if case.kinematics == "plane_stress":
            reason = "plane_stress has no meaning with projection, which keeps density in the plane"
            yield "kinematics", reason
        if case.time.step is None:
            reason = "has no default for projection in a case without units; give the time step"
            yield "time.step", reason
        force = len(self.body_force)
        if force not in (0, case.dim):
            yield "formulation.body_force", f"has {force} components, needs {case.dim} in {case.dim}D"
        for name, body in case.bodies.items():
            if body.material.damage.type != "none":
                path = f"bodies.{name}.material.damage.type"
                fault = f"'{body.material.damage.type}' has no meaning with projection: its pressure restores the"
                yield path, f"{fault} density and is no stress that a material could fail by; use none"

    def warnings(self, case: AnyCase) -> Iterator[str]:
        if case.time.integrator != "leapfrog":
            name = case.time.integrator
            fault = f"time.integrator: '{name}' is not used by projection, which has a step of its own"
            yield recommend(fault, "time.integrator=leapfrog")
        densities = {body.material.density for body in case.bodies.values()}
        if self.pressure_gradient == "original" and len(densities) > 1:
            between = " and ".join(f"{density:g}" for density in (min(densities), max(densities)))
            yield recommend(
                "formulation.pressure_gradient: 'original' requires bodies of one density; between "
                f"{between} kg/m^3 it fails at the published time step, use conjugate",
                "formulation.pressure_gradient=conjugate",
            )
