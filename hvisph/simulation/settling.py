"""Settling of bodies under gravity before the start of a run: dynamic relaxation to equilibrium.

After every step the velocities fall by exp(-k dt), k = pi c/(2 H) being the frequency of the lowest mode of a column of
height H that stands on a support, c its speed of longitudinal waves; the mode then decays as exp(-k t/2). The damped
energy does not become heat: the balances of the run start with the settled state.

Source: Otter, Cassell & Hobbs 1966 (dynamic relaxation).
"""

from math import exp, isfinite, pi

import numpy as np

from hvisph.case.case import Case
from hvisph.core.errors import RunError
from hvisph.core.particles import CLAMPED, FLAGS
from hvisph.integrators import sums as column
from hvisph.integrators.gravity import SPHERE, Gravity
from hvisph.integrators.time_step import Limit
from hvisph.setup.build import Setup

from .clock import Clock

AT_REST = 0.1  # largest remaining speed over the speed g/k of a damped fall below which bodies are at rest


def own_limit(case: Case, setup: Setup) -> Limit:
    """Return the limit of the next step by the particles of this process."""
    stepper = setup.stepper
    limit = setup.criteria.limit(stepper.lengths, stepper.signals, stepper.rates, stepper.place, setup.particles.id)
    cfl = case.time.cfl
    for time, criterion, particle in stepper.limits():
        if cfl * time < limit.dt:
            limit = Limit(cfl * time, criterion, particle, time)
    return limit


def settle(case: Case, setup: Setup) -> str:
    """Let the bodies at rest settle for `case.settle`; return the note or warning on the result.

    Bodies with a velocity or a motion are held, loads are removed; both are restored afterwards. Raises `RunError` if
    the state is not finite.
    """
    stepper, particles = setup.stepper, setup.particles
    gravity: Gravity | None = getattr(stepper, "gravity", None)
    if case.settle is None or gravity is None:
        return ""
    moves = _moving(case, setup)
    is_held = moves[particles.body]
    start_state, loads = particles.data[is_held].copy(), getattr(stepper, "loads", None)
    start_loads = None if loads is None else loads.copy()
    tags, boundaries = particles.tags.copy(), getattr(stepper, "boundaries", None)
    particles.tags[is_held, FLAGS] |= CLAMPED
    particles["velocity"][is_held] = 0.0
    if loads is not None:
        loads[:] = 0.0
    if boundaries is not None:
        boundaries.wait(True)
    motion = getattr(stepper, "motion", None)
    rigid = [] if motion is None else motion.rigid
    states = [(rigid_body, rigid_body.hold()) for rigid_body in rigid if moves[setup.bodies.index(rigid_body.name)]]
    if moves.any():  # the last rates contain their velocities
        stepper.predict(0.0)
        stepper.evaluate()
    free = (particles.tags[:, FLAGS] & CLAMPED) == 0
    rate, scale = damping_rate(setup, gravity, ~is_held)
    clock = Clock(case.settle, case.settle, case.time.step)
    limit = setup.subdomain.reduce_limit(own_limit(case, setup), 0, False)
    if particles.has_previous:
        stepper.complete(0.0, 0.0)
    step = clock.choose(limit.dt, limit.criterion, None)
    stepper.predict(step.length)
    while not clock.is_finished:
        last = clock.last(step)
        if last is not None:
            step = last
            stepper.predict(step.length)
        stepper.evaluate()
        limit = setup.subdomain.reduce_limit(own_limit(case, setup), 0, False)
        following = clock.choose(limit.dt, limit.criterion, step)
        stepper.complete(step.length, following.length)
        particles["velocity"][free] *= exp(-rate * step.length)
        for rigid_body in rigid:
            rigid_body.slow(exp(-rate * step.length))
        stepper.predict(following.length)
        clock.complete(step)
        if not (limit.dt > 0.0 and isfinite(stepper.sums[column.FASTEST])):
            raise RunError(f"settling failed after {clock.time:.4g} s: not finite; give a smaller time.cfl")
        step = following
    peak = float(stepper.sums[column.FASTEST])
    particles.tags[...], particles.data[is_held] = tags, start_state
    if boundaries is not None:
        boundaries.wait(False)
    if motion is not None:
        motion.time = case.begins
    for rigid_body, state in states:
        rigid_body.release(state)
    stepper.predict(0.0)
    stepper.evaluate()
    if loads is not None:
        loads[...] = start_loads
    ratio, unit, speed = peak / scale if scale > 0.0 else 0.0, *((" s", " m/s") if case.units == "si" else ("", ""))
    text = (
        f"settled for {case.settle:g}{unit} in {clock.steps} steps: greatest speed left {peak:.3g}{speed}, "
        f"{ratio:.2g} of the speed of a damped fall"
    )
    if ratio <= AT_REST:
        return f"note: {text}"
    longer = case.settle + 3.0 / rate * np.log(ratio / AT_REST)
    return (
        f"warning: {text}, more than {AT_REST:g}: the bodies are not at rest; settle longer, as {longer:.2g}{unit}, "
        "or support the sides"
    )


def damping_rate(setup: Setup, gravity: Gravity, rests: np.ndarray) -> tuple[float, float]:
    """Return the rate of damping [1/s] of the particles that rest (n,), and the speed g/k [m/s] of a damped fall."""
    x, share = setup.particles["position"], setup.subdomain
    field = gravity.acceleration(x)
    pull = np.sqrt((field**2).sum(axis=1))
    if gravity.kind == SPHERE:
        distance = np.sqrt(((x - np.array(gravity.vector)) ** 2).sum(axis=1))
        low, high = 0.0, share.get_maxima(float(distance[rests].max(initial=0.0)))[0]
    else:
        z = x @ -np.array(gravity.vector) / max(float(np.sqrt(np.square(gravity.vector).sum())), 1e-300)
        low, high = share.get_maxima(*(float(height[rests].max(initial=-np.inf)) for height in (-z, z))) * (-1.0, 1.0)
    length = float(setup.particles["smoothing_length"].max(initial=0.0))
    height = float(high - low + share.get_maxima(length)[0])
    speeds = [material.longitudinal_sound_speed for material in setup.substances]
    g = share.get_maxima(float(pull[rests].max(initial=0.0)))[0]
    rate = pi * min(speeds) / (2.0 * height)
    return rate, g / rate


def _moving(case: Case, setup: Setup) -> np.ndarray:
    """Return which bodies start with a velocity, or have one over time (bodies,)."""
    bodies = (case.bodies[name] for name in setup.bodies)
    motions = [(any(body.velocity), body.initial_velocity, body.rigid and body.rigid.velocity) for body in bodies]
    return np.array([any(motion) for motion in motions])
