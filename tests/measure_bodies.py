"""Synthetic snapshots for the tests of the measures: bodies whose measures are known."""

from dataclasses import replace

import numpy as np

from hvisph.output.snapshot import Snapshot

MM = 1e-3


def box(low, high, dx):
    """Cell centres of a square or cubic lattice that fills the box from `low` to `high`."""
    axes = [a + dx * (np.arange(round((b - a) / dx)) + 0.5) for a, b in zip(low, high, strict=True)]
    grid = np.meshgrid(*axes, indexing="ij")
    return np.stack([c.ravel() for c in grid], axis=1)


def ball(centre, diameter, dx):
    """Nodes of a square or cubic lattice inside a disc or sphere."""
    centre = np.asarray(centre, float)
    half = 0.5 * diameter
    nodes = box(-half - 0 * centre, half + 0 * centre, dx)
    return nodes[(nodes**2).sum(axis=1) <= half**2] + centre


def snapshot(projectile, target=None, time=0.0, dx=0.1 * MM, names=("projectile", "target"), **metadata):
    """Snapshot of one or two bodies of aluminium, the projectile flying at 3.1 km/s."""
    parts = [projectile] if target is None else [projectile, target]
    position = np.concatenate(parts)
    count, dim = position.shape
    body = np.repeat(np.arange(len(parts)), [len(part) for part in parts])
    velocity = np.zeros((count, dim))
    velocity[body == 0, 0] = 3100.0
    fields = {
        "position": position,
        "velocity": velocity,
        "mass": np.full(count, 2785.0 * dx**dim),
        "density": np.full(count, 2785.0),
        "smoothing_length": np.full(count, 1.4 * dx),
        "pressure": np.zeros(count),
        "deviator": np.zeros((count, {1: 3, 2: 4, 3: 6}[dim])),
    }
    metadata = {"spacing": dx, "title": "synthetic", **metadata}
    return Snapshot(
        time=time, step=int(time * 1e9), dimensions=dim, fields=fields, body=body,
        material=np.zeros(count, int), id=np.arange(count), bodies=list(names[: len(parts)]),
        materials=["aluminium"], metadata=metadata,
    )  # fmt: skip


def reordered(snap, order):
    """Return the same particles in another order."""
    fields = {name: values[order] for name, values in snap.fields.items()}
    body, material, number = snap.body[order], snap.material[order], snap.id[order]
    return replace(snap, fields=fields, body=body, material=material, id=number)


def impact_start(dx=0.1 * MM):
    """Disc of 10 mm touching a plate of 2 mm x 50 mm."""
    return snapshot(ball([-5 * MM, 0], 10 * MM, dx), box([0, -25 * MM], [2 * MM, 25 * MM], dx), dx=dx)


def impact_end(dx=0.1 * MM, crater=20 * MM, length=7 * MM, front=19 * MM):
    """Plate with a parallel-sided crater, and a projectile that is a box of known length and front."""
    plate = box([0, -25 * MM], [2 * MM, 25 * MM], dx)
    plate = plate[np.abs(plate[:, 1]) > 0.5 * crater]
    body = box([front - length, -6 * MM], [front, 6 * MM], dx)
    return snapshot(body, plate, time=8e-6, dx=dx)
