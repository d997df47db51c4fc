"""Sanity checks that stop a run in an unphysical state and report particle, position, time and likely cause."""

from math import isfinite
from typing import Any

import numpy as np

from hvisph.core.errors import RunError
from hvisph.core.particles import MATERIAL
from hvisph.core.text import Plain
from hvisph.integrators import sums as column
from hvisph.integrators.boundary_forces import Boundaries
from hvisph.parallel.collectives import GlobalLimit, ParticleReport
from hvisph.setup.build import Setup

DENSITY_EVERY = 8  # steps between two checks of all densities
# Negative internal energy over the initial energy that causes no warning: after the first step of contact of bodies at
# zero energy it is 2e-5.
NEGATIVE_ENERGY_TOLERANCE = 1e-4
# Beyond the largest tension of its isentrope a liquid or metal collapses at any step.
TENSION_CAUSE = (
    ". Nothing limits the tension of its material: where its sound speed vanishes it is unstable at any step; "
    "give it a damage, such as {type: pressure_cutoff, pressure: ...}"
)

# Criteria of a step limit that mean an invalid state.
INVALID_STATES = {
    "not_finite": "a rate is not finite",
    "inverted": "a deformation gradient is inverted (J <= 0): the distortion is too large for Total Lagrangian "
    "kernels; convert particles to Eulerian ones (formulation adaptive)",
    "passed_through": "bodies pass through each other: particles from within one are within another, "
    "because the contact force is too small for this impact; increase formulation.contact.stiffness, or use riemann",
}


class Failure(RunError):  # noqa: N818 - a failed run, not an error of whoever reads about it
    """Stop of a run by a sanity check: criterion, message with the likely cause, particle, time [s] and step."""

    def __init__(
        self,
        criterion: str,
        message: str,
        particle: int | None,
        body: str | None,
        position: list[float] | None,
        time: float,
        step: int,
    ):
        super().__init__(message)
        self.criterion, self.particle, self.body = criterion, particle, body
        self.position, self.time, self.step = position, time, step

    def as_dict(self) -> Plain:
        """Return the failure as plain values for the summary."""
        facts: Plain = {"particle": self.particle, "body": self.body}
        if self.position is not None:
            facts["position"] = [x if np.isfinite(x) else None for x in self.position]
        return facts | {"step": self.step, "time": self.time, "criterion": self.criterion, "message": str(self)}


class SanityChecks:
    """Checks that raise `Failure` for unphysical states; `weight`: largest work of gravity [J]."""

    def __init__(self, setup: Setup, limits: Any, weight: float = 0.0):
        self._setup, self._limits = setup, limits
        fastest = float(setup.stepper.sums[column.FASTEST])
        signal = float(setup.subdomain.get_maxima(setup.stepper.signals.max(initial=0.0))[0])
        scale = fastest if fastest > 0.0 else signal
        if weight > 0.0:  # settled bodies may move at any speed later
            scale = max(fastest, signal)
        self.speed_limit = np.inf if limits.speed_over_initial is None else limits.speed_over_initial * scale
        self.first: float | None = None
        self._energy = float(setup.stepper.sums[column.KINETIC] + abs(setup.stepper.sums[column.INTERNAL])) + weight
        self._floor = min(0.0, float(setup.stepper.sums[column.INTERNAL]))
        self._warned = False
        self._drifting: list[str] = []

    def check_step(self, limit: GlobalLimit, time: float, step: int) -> None:
        """Check the step limit: rates are finite and the step is not much shorter than the first one."""
        if limit.criterion in INVALID_STATES:
            particle, text = self._setup.subdomain.look_up(limit.number), INVALID_STATES[limit.criterion]
            raise self._failure(limit.criterion, particle, time, step, text)
        if self.first is None:
            self.first = limit.dt
        smallest = self._limits.step_over_initial
        if limit.dt < smallest * self.first:
            text = f"the time step fell to {limit.dt:.3g} s, below {smallest:g} of the first, by the criterion "
            particle = self._setup.subdomain.look_up(limit.number)
            raise self._failure("step_collapse", particle, time, step, f"{text}'{limit.criterion}'")

    def check_state(self, drift: float | None, time: float, step: int) -> None:
        """Check the state after a step: finite, bounded speeds and densities, total energy conserved."""
        sums = self._setup.stepper.sums
        if not all(map(isfinite, sums[: column.FASTEST + 1].tolist())):
            particle = self._first_of(np.logical_not(np.isfinite(self._setup.particles.data).all(axis=1)))
            if particle:
                raise self._failure("not_finite", particle, time, step, "a value of the state is not finite")
        if not sums[column.FASTEST] <= self.speed_limit:
            speed = np.sqrt((self._setup.particles["velocity"] ** 2).sum(axis=1))
            fastest, top = sums[column.FASTEST], self.speed_limit
            text = f"a particle moves at {fastest:.4g} m/s, more than the limit of {top:.4g} m/s"
            raise self._failure("runaway", self._setup.subdomain.worst(speed), time, step, text)
        if self._limits.density and step % DENSITY_EVERY == 0:
            self._check_density(time, step)
        deficit, allowed = self._missing_energy(), self._limits.negative_energy
        if allowed is not None and deficit > allowed:
            particles = self._setup.particles
            coldest = self._setup.subdomain.worst(-particles["mass"] * particles["internal_energy"])
            text = f"the internal energy of the whole is below zero by {100.0 * deficit:.3g} % of that at the start, "
            text += f"more than {100.0 * allowed:g} %; it is lowest in"
            raise self._failure("negative_energy", coldest, time, step, text)
        top = self._limits.energy_drift
        if top is not None and drift is not None and not abs(drift) <= top:
            stepper = self._setup.stepper
            power = stepper.rates[stepper.place, self._setup.particles.dim]  # after the acceleration
            hottest = self._setup.subdomain.worst(np.abs(power))
            text = f"total energy has changed by {100.0 * drift:+.3g} % since the start, more than {100.0 * top:g} %; "
            raise self._failure("energy_drift", hottest, time, step, f"{text}energy changes fastest in")

    def warning(self, time: float) -> str:
        """Return a warning on the state after a step, each once; empty if there is none."""
        boundaries: Boundaries | None = getattr(self._setup.stepper, "boundaries", None)
        drifting = [] if boundaries is None else boundaries.drifting()
        if new := [name for name in drifting if name not in self._drifting]:
            self._drifting += new
            return (
                f"warning: {', '.join(new)}: the matter beside it has moved at more than 1e-3 of the speed of sound "
                "for ten transit times: an edge bears the initial stress only, and a lasting load drives the body "
                "through it; support the body there"
            )
        deficit = self._missing_energy()
        if self._warned or not deficit > NEGATIVE_ENERGY_TOLERANCE:
            return ""
        self._warned = True
        return (
            f"warning: the total internal energy became negative at t = {time:.6g} s, by "
            f"{100.0 * deficit:.2g} % of the initial energy: later results are not reliable"
        )

    def _missing_energy(self) -> float:
        """Return the energy below zero, or below the initial one, relative to the energy."""
        if not (self._setup.stepper.has_energy and self._energy > 0.0):
            return 0.0
        return (self._floor - float(self._setup.stepper.sums[column.INTERNAL])) / self._energy

    def _check_density(self, time: float, step: int) -> None:
        particles, limits = self._setup.particles, self._setup.density_limits
        density, share = particles["density"], self._setup.subdomain
        highest, lowest = density.max(initial=0.0), density.min(initial=np.inf)
        fine = lowest > 0.0 and highest < limits.min()
        if not share.get_maxima(float(not fine))[0]:
            return
        bounds = limits[particles.material]
        outside = ~((density > 0.0) & (density < bounds))
        worst, count = self._first_of(outside), int(share.total(np.array([outside.sum()]))[0])
        if worst:
            material = int(share.gather_values(np.array([worst.number]), particles.tags)[0, MATERIAL])
            text = (
                f"a density of {worst.density:.4g} kg/m^3 is outside the range of the equation of state of '"
                f"{self._setup.materials[material]}', 0 to {limits[material]:.4g} kg/m^3, as of {count} of "
                f"{share.count} particles (if these are few, in a jet or a spike, limits.density: false removes this "
                "limit)"
            )
            raise self._failure("density", worst, time, step, text)

    def _first_of(self, mask: Any) -> ParticleReport | None:
        """Return the particle of smallest number of a `mask` (n,), bool, of all processes."""
        return self._setup.subdomain.worst(np.where(mask, 1.0, -np.inf))

    def describe_collapse(self, error: RunError, time: float, step: int) -> Failure:
        """Return the failure of an evaluation with too many neighbours, at the most crowded particle."""
        position = self._setup.particles["position"]
        edge = self._setup.stepper.support
        finite = np.isfinite(position).all(axis=1) & (np.abs(position) < 1e15 * edge).all(axis=1)
        particle = self._first_of(~finite)
        if particle:
            return self._failure("not_finite", particle, time, step, "a position is not finite")
        cells = np.floor(position / edge).astype(np.int64)
        _, member, crowd = np.unique(cells, axis=0, return_inverse=True, return_counts=True)
        crowded = self._setup.subdomain.worst(crowd[member.ravel()].astype(float))
        return self._failure("collapse", crowded, time, step, str(error))

    def _failure(self, criterion: str, particle: ParticleReport | None, time: float, step: int, fault: str) -> Failure:
        assert particle is not None  # there are particles
        body = self._setup.bodies[particle.body]
        place = ", ".join(f"{x:.6g}" for x in particle.position)
        message = (
            f"{fault}: particle {particle.number} of body '{body}' at ({place}) m, time {time:.6g} s, step {step}; "
            f"{_likely_cause(particle, self._setup.bears_any_tension[particle.body], criterion)}"
        )
        return Failure(criterion, message, particle.number, body, particle.position, time, step)


def _likely_cause(particle: ParticleReport, bears_any_tension: bool, criterion: str) -> str:
    density, energy = particle.density, particle.energy
    if not np.isfinite(density) or not np.isfinite(energy):
        return "its state is not finite: the step is too long there; try a smaller time.cfl"
    if density <= 0.0:
        return "its density is not positive: the equation of state has no solution there; try a smaller time.cfl"
    state = f"its density is {density:.4g} kg/m^3 and its energy {energy:.4g} J/kg; "
    if criterion == "negative_energy":
        return state + (
            "pair forces extract more work from the material than its energy: too few particles across a body (an "
            "elastic ring needs 6 or more), or the step is too long; try a smaller spacing, then a smaller time.cfl"
        )
    return (
        f"{state}the step is too long, or the material's equation of state is beyond its range there; "
        "try a smaller time.cfl" + (TENSION_CAUSE if bears_any_tension else "")
    )
