"""Duration, time step and stopping limits of a run, and the witness plane."""

from typing import Annotated, Literal

from pydantic import Field

from hvisph.core.text import Plain

from .model import Shorthand, StrictModel
from .units import LENGTH, NUMBER, PositivePressure, PositiveTime, Quantity

# Courant number unless given, by formulation and for those without an entry. Where there is a viscosity the criterion
# holds its signal, 1.2 alpha c, already, and it damps what grows at less: below DAMPED steps are as long at half of
# the number. Contact SPH allows for its dissipation in disordered lattices (docs/theory/integration.md); where
# it keeps no slopes of sound matter, in the printed form and without reconstruction, that takes more: FIRM.
# Measured in docs/performance.md.
COURANT_OF, COURANT = {"eulerian": 0.6, "total_lagrangian": 0.5, "adaptive": 0.5, "riemann": 0.42}, 0.3
DAMPED, FIRM = 1.0, 0.35


def default_courant(data: Plain) -> float | None:
    """Return the Courant number of a raw case that leaves it to its formulation, None for any other case."""
    formulation, time = data.get("formulation", {"type": "riemann"}), data.get("time")
    if not isinstance(formulation, dict) or not isinstance(time, dict):
        return None
    if time.get("cfl") is not None or time.get("step") is not None:
        return None
    if data.get("kinematics") == "axisymmetric":  # rings ring beyond 0.35: energies below zero in a ball and a bar
        return None
    viscosity = formulation.get("viscosity")
    if isinstance(viscosity, dict):
        alpha = 0.0 if viscosity.get("type") == "none" else viscosity.get("alpha", DAMPED)
        if isinstance(alpha, int | float) and alpha < DAMPED:
            return None
    kind = str(formulation.get("type", "riemann"))
    if kind == "riemann" and (formulation.get("variant") == "original" or formulation.get("reconstruction") == "none"):
        return FIRM
    return COURANT_OF.get(kind)


class Time(StrictModel):
    """Duration and time stepping."""

    end: PositiveTime = Field(
        description="Time at which the run ends [s], above 0; contact is at 0 unless there is a gap"
    )
    cfl: Annotated[float, Quantity(NUMBER, above=0, maximum=1)] = Field(
        default=COURANT,
        description="Courant number of the adaptive step [-], above 0 and at most 1; unless given 0.6 with `eulerian`, "
        "0.5 with `total_lagrangian` and `adaptive`, 0.42 with `riemann` (0.35 with variant `original` and without "
        "reconstruction), 0.3 with others, in axisymmetric cases, and where alpha of the viscosity is below 1",
    )
    step: PositiveTime | None = Field(
        default=None,
        description="Fixed time step [s]; unless given adaptive or, with projection, 0.1 ns per 0.1 mm of resolution",
    )
    integrator: Literal["leapfrog", "predictor_corrector", "staggered"] = Field(
        default="leapfrog",
        description="Time integrator, one evaluation of the forces a step; `staggered` is Zisis 2013's",
    )
    max_steps: Annotated[int, Field(strict=True, ge=1, le=10**12)] | None = Field(
        default=None, description="Number of steps at which to stop early, at least 1; none unless given"
    )


class LateStage(StrictModel):
    """Stage at a low sound speed: a bulk modulus in place of equations of state, for craters that open slowly."""

    at: PositiveTime = Field(description="Time from which on it holds [s]")
    bulk_modulus: PositivePressure | None = Field(
        default=None,
        description="K_new [Pa], at least ten times the largest pressure then; unless given the largest of 30 times "
        "it, 100 rho u^2 with the speed that 99 % of what bears pressure stays below, and 100 times the largest von "
        "Mises stress, but not above that of a material or of the stage before",
    )
    nu: Annotated[float, Quantity(NUMBER, minimum=0, below=0.5)] = Field(
        default=0.25, description="Poisson's ratio, which with K_new gives the shear modulus [-]"
    )


LateStages = Annotated[
    tuple[LateStage, ...],
    Shorthand(
        lambda value, _: [value] if isinstance(value, dict) else value,
        (),
        ({"type": "object", "required": ["at", "bulk_modulus"]},),
    ),
]


class Witness(StrictModel):
    """Plane across the shot line, for the extrapolation of the debris cloud in free flight."""

    x: Annotated[float, Quantity(LENGTH)] = Field(description="Where it is, along the shot line [m]")


class RunLimits(StrictModel):
    """Limits beyond which a run stops with a snapshot; non-finite values always stop it."""

    energy_drift: Annotated[float, Quantity(NUMBER, above=0)] | None = Field(
        default=0.01,
        description="Change of total energy over that at the start [-], above 0; null for no limit",
    )
    negative_energy: Annotated[float, Quantity(NUMBER, above=0)] | None = Field(
        default=0.01,
        description="Internal energy of the whole below that at the start and below zero, over the energy at the start "
        "[-], above 0: more stops a run; null for no limit",
    )
    speed_over_initial: Annotated[float, Quantity(NUMBER, above=1)] | None = Field(
        default=10.0,
        description="Speed of a particle over the fastest at the start, or over the speed of signals where "
        "all start at rest [-], above 1; null for no limit",
    )
    step_over_initial: Annotated[float, Quantity(NUMBER, minimum=0, below=1)] = Field(
        default=1e-6, description="Smallest time step over the first [-], at least 0 and below 1"
    )
    density: bool = Field(
        default=True, description="Whether densities outside the range of the equation of state stop the run"
    )
