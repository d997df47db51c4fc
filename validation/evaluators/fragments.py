"""Brittle targets broken by a sphere: the largest fragment, as a mean over random seeds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from hvisph_validation.quantity import Judge, Key, Shot, Value

from hvisph.measures.debris.groups import connected_groups
from hvisph.verification.problem import vectors

FAILED = 1.0  # damage at which a particle belongs to no fragment


def _largest(shot: Shot) -> float:
    """Return the largest fragment's share of the target's mass: particles that have not failed, linked at 2 dx."""
    end = shot.ran.last
    own = end.body == 1
    sound = own & (end.fields["damage"] < FAILED)
    if not sound.any():
        return 0.0
    mass = end.fields["mass"]
    pieces = np.bincount(connected_groups(vectors(end, "position")[sound], shot.ran.dx), weights=mass[sound])
    return float(pieces.max() / mass[own].sum())


def _together(shots: Sequence[Shot]) -> dict[str, dict[Key, Value]]:
    if not shots:
        return {}
    shares = np.array([_largest(shot) for shot in shots])
    error = float(shares.std(ddof=1) / np.sqrt(len(shares))) if len(shares) > 1 else None
    return {"basalt": {("largest_fragment", None): Value(float(shares.mean()), error)}}


def _curves(shots: Sequence[Shot]) -> dict[str, Any]:
    return {shot.name: _largest(shot) for shot in shots}


JUDGE = Judge({"largest_fragment": "largest fragment over target"}, together=_together, curves=_curves)
