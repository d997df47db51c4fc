"""Distribution of the initial state: created by the first process and sent to the owners of the particles."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from hvisph.core.errors import CaseError, RunError
from hvisph.diagnostics.budgets import observed_particles
from hvisph.parallel.subdomain import Parts
from hvisph.parallel.world import SingleProcess
from hvisph.setup.build import set_up
from hvisph.setup.initial_state import InitialState

if TYPE_CHECKING:
    from hvisph.case.case import Case

# Particles of each body with which loops are compiled.
FEW = 16


def distribute(
    world: SingleProcess, make: Callable[[], InitialState], spacing: float
) -> tuple[InitialState, Parts | None]:
    """Return the initial state of this process, and the decomposition of several processes.

    Parameters
    ----------
    world
        The processes.
    make
        Makes the whole, on the first of them.
    spacing
        dx [m].

    Raises
    ------
    CaseError
        What `make` raises, on all of them; and where there are fewer particles than processes.
    """
    if world.size == 1:
        return make(), None
    held: list[tuple[InitialState, np.ndarray]] = []

    def prepare() -> tuple[InitialState, Parts]:
        whole = make()
        particles = whole.particles
        if whole.formulation.stepper.keeps_order:  # it keeps this order, by which lists are sorted
            from hvisph.schemes.adaptive.stepper import order_of

            particles.permute(order_of(particles, whole.formulation.kernel.reach * whole.longest))
            whole = replace(whole, sequence=np.arange(particles.count, dtype=np.uint64))
        observed = observed_particles(particles, whole.planes, spacing)
        parts = Parts(world.size, particles["position"], particles.id)
        owner = parts.owner(particles["position"], particles.id)
        if np.bincount(owner, minlength=world.size).min() == 0:
            raise CaseError(f"{particles.count} particles are too few for {world.size} processes; start fewer")
        held.append((whole, owner))
        return replace(whole, particles=particles.like(0), sequence=None, observed=observed), parts

    own, parts = world.broadcast_from_first(prepare)
    whole, owner = held.pop() if held else (own, None)
    wanted = None if owner is None else [np.flatnonzero(owner == rank) for rank in range(world.size)]
    own.particles.data = world.scatter_rows(whole.particles.data, wanted)
    own.particles.tags = world.scatter_rows(whole.particles.tags, wanted)
    if own.formulation.stepper.keeps_order:
        own = replace(own, sequence=world.scatter_rows(whole.sequence, wanted))
    return own, parts


def compile_for_all(world: SingleProcess, case: Case, start: InitialState) -> None:
    """Compile the loops on the first process of each machine with a few particles, for the others to load."""

    def evaluate() -> None:
        particles = start.particles
        few = np.concatenate([np.flatnonzero(particles.body == body)[:FEW] for body in np.unique(particles.body)])
        sample = particles.like(0)
        sample.data, sample.tags = particles.data[few], particles.tags[few]
        with suppress(RunError):
            set_up(case, replace(start, particles=sample, sequence=None, boundaries=None)).stepper.start()

    world.prepare_per_machine(evaluate)
