"""A layer's rim, its outer tenth towards any of its edges: where it is held, and what is still attached to it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hvisph.measures.debris.groups import connected_groups
from hvisph.output.snapshot import Snapshot

from .impact_geometry import own_spacings
from .target_geometry import RIM, Plate, plate_of


@dataclass(frozen=True)
class Rim:
    """A layer's rim at the start.

    Parameters
    ----------
    numbers
        Of its particles (n,), in the order of the snapshot.
    position
        Where they are (n, dim), in the axes of the shot [m].
    """

    numbers: np.ndarray
    position: np.ndarray


def rim_at_start(start: Snapshot, plate: Plate, spacing: float) -> Rim:
    """Return the rim of a layer at the start, and those of its parts that do not reach there; `spacing` is dx [m]."""
    own = np.flatnonzero(start.body == plate.body)
    position = start.fields["position"][own]
    outer = plate.beyond(plate.across(position), RIM)
    if plate.pieces > 1:
        groups = connected_groups(position, own_spacings(start, own, spacing))
        for group in range(groups.max() + 1):
            part = groups == group
            if not outer[part].any():
                alone = plate_of(plate.body, position[part], position[part, 1:].mean(axis=0), spacing)
                outer[part] = alone.beyond(alone.across(position[part]), RIM)
    return Rim(start.id[own][outer], position[outer])


def rim_between(own: np.ndarray, lateral: np.ndarray, main: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """Return which particles of a layer are its rim now, between the edges of its main bodies, shape (n,).

    Parameters
    ----------
    own
        Whether a particle is the layer's (n,).
    lateral, axis
        Coordinates from the shot line (n, dim - 1), and of that line (dim - 1,) [m].
    main
        Indices of the main bodies.
    """
    low, high = lateral[main].min(axis=0), lateral[main].max(axis=0)
    basis = tuple(map(tuple, np.eye(len(axis) + 1).tolist()))
    flat = Plate(-1, basis, 0.0, 1.0, tuple(axis.tolist()), tuple(low.tolist()), tuple(high.tolist()))
    rim, outward = own.copy(), flat.outward(lateral[own])
    rim[own] = (outward >= RIM) & (outward <= 1.0)
    return rim
