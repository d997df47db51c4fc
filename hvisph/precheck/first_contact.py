"""Time of the first contact of two bodies at their initial velocities."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from hvisph.geometry.contact_point import Solid, touch
from hvisph.geometry.shapes import Placed
from hvisph.setup.bodies import PlacedBody

# Pairs of bodies that are looked at; a case of more is told by its first ones.
MOST_PAIRS = 200
# Bodies that touch at the start: those of a mesh to the accuracy of its distances, and what lattices that were fitted
# to their shapes may lie within each other [spacings].
TOUCHING, WITHIN = 0.05, 0.25


def first_contact(bodies: list[PlacedBody]) -> tuple[float, str, str] | None:
    """Return the time of the first contact and the names of the two bodies that meet.

    Each pair is followed along its relative velocity, the mean of each body's, without what happens before it meets;
    bodies from a file of particles have no surface and are left out.

    Parameters
    ----------
    bodies
        The bodies where they start.

    Returns
    -------
    tuple or None
        Time [s] and two names; None where no two bodies meet.
    """
    contacts: list[tuple[float, str, str]] = []
    for count, (one, other) in enumerate(combinations(bodies, 2)):
        if count >= MOST_PAIRS:
            break
        approach = one.mean_velocity - other.mean_velocity
        speed = float(np.sqrt(approach @ approach))
        if speed == 0.0 or one.surface is None or other.surface is None:
            continue
        distance = _distance(one, other, approach / speed)
        dx = one.filling.finest
        if distance is not None and distance > -WITHIN * dx:
            contacts.append((distance / speed if distance > TOUCHING * dx else 0.0, one.name, other.name))
    return min(contacts) if contacts else None


def _distance(one: PlacedBody, other: PlacedBody, direction: np.ndarray) -> float | None:
    """Return how far `one` moves along `direction` until it touches `other` [m]; None if it never does."""
    dim = len(direction)
    if dim == 1:
        ahead, behind = (one, other) if direction[0] > 0 else (other, one)
        gap = (behind.positions - behind.spacing[:, None] / 2).min() - (
            ahead.positions + ahead.spacing[:, None] / 2
        ).max()
        return float(gap)
    # axes of which the first is the direction of approach
    basis = np.linalg.qr(np.column_stack([direction, np.eye(dim)]))[0].T[:dim]
    basis[0] = direction
    solids = []
    for body in (one, other):
        assert body.surface is not None
        turned = Placed(body.surface, np.zeros(dim), basis)
        solids.append(Solid(turned, body.positions @ basis.T, body.filling.finest))
    if solids[0].positions[:, 0].min() > solids[1].positions[:, 0].max():
        return None  # already behind it
    met = touch(*solids)
    return None if met is None else met[1] - met[0]
