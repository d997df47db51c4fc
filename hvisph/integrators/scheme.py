"""Time integrators with one evaluation of the rates a step.

Both are one family. Rates f are evaluated at a stage ahead of the state,

    y* = y_n + theta dt f_(n-1),        x* = x_n + theta dt (u_n + kappa theta dt a_(n-1)),        f_n = f(y*, x*),
    y_(n+1) = y_n + dt ((1 - w) f_n + w f_(n-1)),

with positions moved by the mean of the old and the new velocity.

Leapfrog, drift-kick-drift (theta = 1/2, w = 0): velocities a half step ahead of the drift, the
second-order scheme that conserves what a mid-point rule conserves. Predictor-corrector
(theta = 1, w = 1/2): forces at the predicted end of the step, trapezoidal correction.

Staggered (theta = 1/2, w = 0, kappa = 0): Zisis 2013 eq. 18. Density and velocity are stored at half steps, {rho,
u}_(k+1/2) = {rho, u}_(k-1/2) + dt f_k, are predicted by dt/2 f_(k-1) for the evaluation at k, and x_(k+1) = x_k + dt
u_(k+1/2). With n = k - 1/2 and x_n = x_k - dt/2 u_n it belongs to this family: x* is x_k, and x_(n+1) + dt/2 u_(n+1) is
x_(k+1). The whole state then belongs to one time, as output needs. It differs from leapfrog by dt^2/8 a in the
positions of the evaluation.

Energy. The pair forces do the work f . (mean of old and new velocity), but the energy equation is evaluated with the
predicted velocity. Each particle's energy receives the difference times its acceleration. Over all pairs this is
exactly the missing work: the sum of kinetic and internal energy is conserved to round-off for any time step (compare
the compatible differencing of Owen 2014).
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class Scheme:
    """Integrator of one evaluation: stage theta, weight w of the previous rates, share kappa of the drift."""

    name: str
    stage: float
    previous: float
    drift: float = 0.5

    def stepper_options(self) -> dict[str, float]:
        """Return the options of a stepper beside theta and w."""
        return {} if self.drift == 0.5 else {"drift": self.drift}

    def extra_fields(self, axisymmetric: bool = False) -> tuple[str, ...]:
        """Return the state fields of the scheme, for axisymmetric (`axisymmetric`) and other particles."""
        if self.previous == 0.0:
            return ()
        rates = ("previous_velocity", "previous_acceleration", "previous_power", "previous_gradient")
        return (*rates, "previous_hoop_rate") if axisymmetric else rates


LEAPFROG = Scheme("leapfrog", 0.5, 0.0)
PREDICTOR_CORRECTOR = Scheme("predictor_corrector", 1.0, 0.5)
STAGGERED = Scheme("staggered", 0.5, 0.0, 0.0)

SCHEMES = {scheme.name: scheme for scheme in (LEAPFROG, PREDICTOR_CORRECTOR, STAGGERED)}
