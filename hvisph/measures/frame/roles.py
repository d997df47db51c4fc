"""Which body does what: the projectile, the layers that it meets, and those that are neither."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hvisph.output.snapshot import Snapshot

PROJECTILE, LAYER, OTHER = "projectile", "layer", "other"
STILL = 1e-6  # share of the highest speed below which a body stands still


def roles_of(start: Snapshot | None, now: Snapshot, given: Sequence[str | None] = ()) -> tuple[str, ...]:
    """Return the role of every body, in their order.

    Unless a role is given, the first body that moves at the start is the projectile, and with it those that have its
    velocity, unless all have; every other body is a layer, unless it lies behind the projectile. Where nothing moves,
    or the start is not known, the first body is the projectile and all others are layers.

    Parameters
    ----------
    start, now
        The run's first snapshot, if it is known, and the one to measure.
    given
        What the case says of each body; None where it says nothing.
    """
    count = max(len(now.bodies), int(now.body.max(initial=-1)) + 1)
    told = [*given, *[None] * count][:count]
    if PROJECTILE in told or start is None or "velocity" not in start.fields:
        roles = [PROJECTILE if body == 0 and PROJECTILE not in told else LAYER for body in range(count)]
        return tuple(role or roles[body] for body, role in enumerate(told))
    velocity = np.array([_mean(start, "velocity", body) for body in range(count)])
    speed = np.sqrt((velocity**2).sum(axis=1))
    moves = speed > STILL * speed.max(initial=0.0)
    free = [body for body in range(count) if told[body] is None]
    first = next((body for body in free if moves[body]), free[0] if free else 0)
    alike = np.sqrt(((velocity - velocity[first]) ** 2).sum(axis=1)) <= STILL * speed[first]
    if alike[free].all() or not moves[first]:  # what rests beside what rests is no part of it
        alike[:] = False
    alike[first] = True
    roles = [PROJECTILE if alike[body] else LAYER for body in range(count)]
    for body in range(count):
        if roles[body] == LAYER and moves[first] and _behind(start, body, alike, velocity[first] - velocity[body]):
            roles[body] = OTHER
    return tuple(role or roles[body] for body, role in enumerate(told))


def shot_direction(start: Snapshot, roles: Sequence[str]) -> np.ndarray:
    """Return the unit vector (dim,) along which the projectile nears the first layer; x where nothing moves."""
    along = np.eye(start.dimensions)[0]
    if "velocity" not in start.fields:
        return along
    velocity = mean_of(start, "velocity", roles, PROJECTILE)
    velocity = velocity - mean_of(start, "velocity", roles, LAYER)
    speed = float(np.sqrt((velocity**2).sum()))
    size = float(np.abs(start.fields["velocity"]).max(initial=0.0))
    return velocity / speed if speed > STILL * size else along


def mean_of(snapshot: Snapshot, field: str, roles: Sequence[str], role: str) -> np.ndarray:
    """Return the mass mean of a field over all bodies of a role; zeros where there are none."""
    chosen = members(snapshot, roles, role)
    values = snapshot.fields[field].reshape(snapshot.count, -1)[chosen]
    return np.average(values, axis=0, weights=_weights(snapshot, chosen)) if chosen.any() else np.zeros(values.shape[1])


def members(snapshot: Snapshot, roles: Sequence[str], role: str) -> np.ndarray:
    """Return whether each particle (n,) is of a body of this role."""
    return np.isin(snapshot.body, [body for body, own in enumerate(roles) if own == role])


def line_of(start: Snapshot, roles: Sequence[str]) -> np.ndarray:
    """Return where the shot line lies, lateral coordinates (dim - 1,) [m]: through the projectile, or the origin."""
    chosen = members(start, roles, PROJECTILE)
    lateral = start.fields["position"].reshape(start.count, -1)[:, 1:]
    return np.asarray(lateral[chosen].mean(axis=0)) if chosen.any() else np.zeros(lateral.shape[1])


def _mean(snapshot: Snapshot, field: str, body: int) -> np.ndarray:
    chosen = snapshot.body == body
    values = snapshot.fields[field].reshape(snapshot.count, -1)[chosen]
    return np.average(values, axis=0, weights=_weights(snapshot, chosen)) if chosen.any() else np.zeros(values.shape[1])


def _weights(snapshot: Snapshot, chosen: np.ndarray) -> np.ndarray:
    mass = snapshot.fields.get("mass")
    return np.ones(int(chosen.sum())) if mass is None else mass[chosen]


def _behind(start: Snapshot, body: int, shot: np.ndarray, along: np.ndarray) -> bool:
    """Whether a body lies wholly behind the projectile as it moves towards `along`."""
    position = start.fields["position"].reshape(start.count, -1) @ along
    own, projectile = position[start.body == body], position[shot[start.body]]
    return bool(len(own) and len(projectile) and own.max() < projectile.min())
