"""Fragmentation: detached connected components of a body, treated as bodies in contact."""

from __future__ import annotations

import numpy as np

from hvisph.schemes.stepper import Stepper
from hvisph.setup.build import Setup
from hvisph.sph.neighbours.connected_components import label_components

# Steps between two looks, a multiple of those between two sortings of the state.
LOOK_EVERY = 64


def tell_pieces(setup: Setup, steps: int) -> None:
    """Find the connected components of bodies when due, on the first process, and renumber contact bodies."""
    stepper, share, particles = setup.stepper, setup.subdomain, setup.particles
    if not isinstance(stepper, Stepper) or stepper.pieces is None or steps % LOOK_EVERY:
        return
    if steps == 0:
        stepper.pieces = particles.body.copy()  # as the particles stand now
    pieces = stepper.pieces
    tags = np.stack([particles.id, particles.body, pieces], axis=1)
    tags, lengths = share.gather_rows(tags), share.gather_rows(particles["smoothing_length"])
    position = share.gather_rows(particles["position"])
    reach = stepper.formulation.kernel.reach
    if share.world.size == 1:
        told_apart = label_components(position, lengths, reach, tags[:, 1], tags[:, 2], tags[:, 0])
    else:
        whole = None
        if share.world.first:
            whole = np.zeros(len(tags), np.uint32)
            whole[tags[:, 0]] = label_components(position, lengths, reach, tags[:, 1], tags[:, 2], tags[:, 0])
        told_apart = share.dealt(whole)
    if share.get_maxima(float((told_apart != pieces).any()))[0]:
        stepper.split(told_apart)
