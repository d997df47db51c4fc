"""Time integrators that evaluate the forces once a step.

Both are one family. Rates f are evaluated at a stage ahead of the state,

    y* = y_n + theta dt f_(n-1),        f_n = f(y*),
    y_(n+1) = y_n + dt ((1 - w) f_n + w f_(n-1)),

with positions moved by the mean of the old and the new velocity.

Leapfrog, drift-kick-drift (theta = 1/2, w = 0): velocities a half step ahead of the drift, the
second-order scheme that conserves what a mid-point rule conserves. Predictor-corrector
(theta = 1, w = 1/2): forces at the predicted end of the step, trapezoidal correction.

Energy. The pair forces do the work f . (mean of old and new velocity), while the energy equation was
evaluated with the predicted velocity. Each particle's energy therefore receives the difference times
its own acceleration: over all pairs that is exactly the missing work, so the total of kinetic and
internal energy is kept to round-off at any time step, as by Owen 2014's compatible differencing.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Scheme:
    """A one-evaluation integrator.

    Parameters
    ----------
    name
        Name in case files.
    stage
        theta: place of the evaluation within the step.
    previous
        w: weight of the rates of the step before.
    """

    name: str
    stage: float
    previous: float

    def extra_fields(self) -> tuple[str, ...]:
        """Return the state that the scheme carries from step to step."""
        if self.previous == 0.0:
            return ()
        return ("previous_velocity", "previous_acceleration", "previous_power", "previous_gradient")


LEAPFROG = Scheme("leapfrog", 0.5, 0.0)
PREDICTOR_CORRECTOR = Scheme("predictor_corrector", 1.0, 0.5)

SCHEMES = {scheme.name: scheme for scheme in (LEAPFROG, PREDICTOR_CORRECTOR)}
