"""What a run watches: budgets of energy and momentum, signs of failure, the columns of its history."""

from __future__ import annotations

from typing import Any

import numpy as np

from hvisph.core.errors import RunError
from hvisph.formulations import update
from hvisph.integrators.criteria import Limit
from hvisph.measure.pressure import AXIS_COLUMN, CENTRE_COLUMN, axis_particles, centre_particles
from hvisph.simulation.build import Setup

# A particle faster than this many times the fastest start (or, where all begin at rest, the fastest
# wave) has left the physics: an impact doubles the impact speed at most, at a free surface.
RUNAWAY = 10.0
# The run stands still when the step falls below this share of the first.
COLLAPSE = 1e-6


class Failure(RunError):
    """A run that stopped itself: what, where and when.

    Parameters
    ----------
    criterion
        Name of the watcher.
    message
        What happened and its likely cause.
    particle, body, position
        Permanent number, body and place [m] of the particle at fault.
    time, step
        When [s], and after how many steps.
    """

    def __init__(self, criterion: str, message: str, particle: int | None, body: str | None,
                 position: list[float] | None, time: float, step: int):  # fmt: skip
        super().__init__(message)
        self.criterion, self.particle, self.body = criterion, particle, body
        self.position, self.time, self.step = position, time, step

    def as_dict(self) -> dict[str, Any]:
        """Return the plain form for the summary."""
        found: dict[str, Any] = {"particle": self.particle, "body": self.body}
        if self.position is not None:
            found["position"] = [x if np.isfinite(x) else None for x in self.position]
        return found | {"step": self.step, "time": self.time, "criterion": self.criterion, "message": str(self)}


class Budget:
    """Energy and momentum of the whole, against the start.

    Parameters
    ----------
    setup
        The run, with its forces evaluated once.
    """

    def __init__(self, setup: Setup):
        particles, sums = setup.particles, setup.stepper.sums
        self.energy = float(sums[update.KINETIC] + sums[update.INTERNAL])
        self.momentum = sums[update.MOMENTUM : update.MOMENTUM + 3].copy()
        speed = np.sqrt((particles["velocity"] ** 2).sum(axis=1))
        self.size = float((particles["mass"] * speed).sum())
        self.impulse = np.zeros(3)  # given to the clamped particles
        free = np.ones(3)
        free[[plane.axis for plane in setup.planes]] = 0.0  # a mirror gives momentum along its normal
        self._free = free

    def record(self, sums: np.ndarray, step: float) -> None:
        """Take account of the forces on clamped particles during a step [s]."""
        self.impulse += step * sums[update.SUPPORT : update.SUPPORT + 3]

    def energy_drift(self, sums: np.ndarray) -> float | None:
        """Return the change of total energy over that at the start; None where it began with none."""
        total = float(sums[update.KINETIC] + sums[update.INTERNAL])
        return (total - self.energy) / self.energy if self.energy > 0.0 else None

    def momentum_drift(self, sums: np.ndarray) -> float | None:
        """Return the change of momentum over the sum of m |v| at the start; None where nothing moved."""
        now = sums[update.MOMENTUM : update.MOMENTUM + 3] + self.impulse
        change = float(np.linalg.norm((now - self.momentum) * self._free))
        return change / self.size if self.size > 0.0 else None


class Watch:
    """Stops a run that has failed, and says which particle and why."""

    def __init__(self, setup: Setup):
        self._setup = setup
        fastest = float(setup.stepper.sums[update.FASTEST])
        self.speed_limit = RUNAWAY * (fastest if fastest > 0.0 else float(setup.stepper.signals.max()))
        self.first: float | None = None

    def check(self, limit: Limit, time: float, step: int) -> None:
        """Raise `Failure` when the limit of the step shows that the run has failed."""
        if limit.criterion == "not_finite":
            raise self._failure("not_finite", limit.particle, time, step, "a rate is not finite")
        if self.first is None:
            self.first = limit.dt
        if limit.dt < COLLAPSE * self.first:
            raise self._failure(
                "step_collapse", limit.particle, time, step,
                f"the time step fell to {limit.dt:.3g} s, below {COLLAPSE:g} of the first, by the criterion "
                f"'{limit.criterion}'",
            )  # fmt: skip

    def check_speed(self, fastest: float, time: float, step: int) -> None:
        """Raise `Failure` when a particle has run away; `fastest` is the largest speed [m/s]."""
        if fastest <= self.speed_limit:
            return
        speed = np.sqrt((self._setup.particles["velocity"] ** 2).sum(axis=1))
        worst = int(np.argmax(np.where(np.isnan(speed), np.inf, speed)))
        raise self._failure(
            "runaway", worst, time, step,
            f"a particle moves at {speed[worst]:.4g} m/s, more than the limit of {self.speed_limit:.4g} m/s",
        )  # fmt: skip

    def _failure(self, criterion: str, index: int, time: float, step: int, what: str) -> Failure:
        particles = self._setup.particles
        body = self._setup.bodies[int(particles.body[index])]
        position = [float(x) for x in particles["position"][index]]
        place = ", ".join(f"{x:.6g}" for x in position)
        number = int(particles.id[index])
        message = (
            f"{what}: particle {number} of body '{body}' at ({place}) m, time {time:.6g} s, step {step}; "
            f"{_likely_cause(particles, index)}"
        )
        return Failure(criterion, message, number, body, position, time, step)


def _likely_cause(particles: Any, index: int) -> str:
    density, energy = float(particles["density"][index]), float(particles["internal_energy"][index])
    if not np.isfinite(density) or not np.isfinite(energy):
        return "its state is not finite: the step is too long for what happens there; try a smaller time.cfl"
    if density <= 0.0:
        return "its density is not positive: the equation of state has no answer there; try a smaller time.cfl"
    return (
        f"its density is {density:.4g} kg/m^3 and its energy {energy:.4g} J/kg; the step is too long, or the "
        "material's equation of state is beyond its range there; try a smaller time.cfl"
    )


class Observer:
    """The history: one record a step, with the pressures at the projectile's centre and on its axis."""

    BASE = ("step", "time", "dt", "criterion", "limiting_particle", "kinetic_energy", "internal_energy",
            "momentum_x", "momentum_y", "momentum_z", "energy_drift")  # fmt: skip

    def __init__(self, setup: Setup, spacing: float, axis: np.ndarray | None):
        self._setup = setup
        particles = setup.particles
        projectile = np.flatnonzero(particles.body == 0)
        position = particles["position"][projectile]
        self._watched = {
            CENTRE_COLUMN: particles.id[projectile[centre_particles(position, spacing, axis)]],
            AXIS_COLUMN: particles.id[projectile[axis_particles(position, spacing, axis)]],
        }
        self.columns = (*self.BASE, *self._watched)
        self.locate()

    def locate(self) -> None:
        """Find the watched particles again after the state was put into a new order."""
        particles = self._setup.particles
        where = np.empty(particles.count, np.int64)
        where[particles.id] = np.arange(particles.count)
        self._at = {name: where[ids] for name, ids in self._watched.items()}

    def record(self, step: int, time: float, dt: float, criterion: str, particle: int, drift: float | None) -> list[Any]:
        """Return the record of a step."""
        sums, pressures = self._setup.stepper.sums, self._setup.stepper.pressures
        return [
            step, time, dt, criterion, particle, float(sums[update.KINETIC]), float(sums[update.INTERNAL]),
            *(float(p) for p in sums[update.MOMENTUM : update.MOMENTUM + 3]),
            float("nan") if drift is None else drift,
            float(pressures[self._at[CENTRE_COLUMN]].mean()), float(pressures[self._at[AXIS_COLUMN]].min()),
        ]  # fmt: skip
