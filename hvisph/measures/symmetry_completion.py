"""Whole model from its computed part: a half, a quarter, an eighth, or the section of a solid of revolution.

All measures refer to the whole: `Symmetry.complete` adds mirror images, so that lengths, masses, energies and counts
need no factors. The costly search for connected groups is done on the computed part, and `Symmetry.join_groups` extends
its result: a group and its image are one group if they touch the plane between them.

Only planes that cut the projectile divide the whole. A plane normal to the shot line is a rigid wall, as is one that
drives a projectile at rest; one beside the projectile is the edge of a plate, and two on one axis are those of a strip
without end; images behind those are no material.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hvisph.core.fields import transform_arrays
from hvisph.core.text import Plain, PlainMapping
from hvisph.output.snapshot import Snapshot

TOUCHING = 0.75  # [dx]; the first layer of particles is half a spacing from its plane
# Tensors and torques, which no measure of a whole model needs.
OMITTED = ("deviator", "velocity_gradient", "deformation_gradient", "torque_residual")


@dataclass(frozen=True)
class Mirror:
    """A plane of symmetry: the axis that it is normal to, and its coordinate [m]."""

    axis: int
    at: float

    def as_dict(self) -> dict[str, str | float]:
        """Return the plain form for the metadata of snapshots."""
        return {"axis": "xyz"[self.axis], "at": self.at}

    @classmethod
    def from_dict(cls, plain: PlainMapping) -> "Mirror":
        """Return the plane with the plain form `plain`."""
        return cls("xyz".index(plain["axis"]), float(plain["at"]))


@dataclass(frozen=True)
class Symmetry:
    """Symmetry of the computed part by symmetry."""

    mirrors: tuple[Mirror, ...] = ()  # the planes of symmetry; of a solid of revolution its axis, as the plane r = 0
    # whether the part is the section of a solid of revolution: particles have the mass of the whole circumference
    revolution: bool = False

    @property
    def factor(self) -> int:
        """Number of parts of the whole; masses of axisymmetric particles are those of the whole already."""
        return 1 if self.revolution else 2 ** len(self.mirrors)

    @property
    def images(self) -> int:
        """Number of copies of each particle in the completed snapshot."""
        return int(2 ** len(self.mirrors))

    @property
    def kind(self) -> str:
        """``whole``, ``planes`` or ``revolution``."""
        return "revolution" if self.revolution else "planes" if self.mirrors else "whole"

    def as_dict(self) -> Plain:
        """Return the plain form for the summary and for the metadata of snapshots."""
        planes = [mirror.as_dict() for mirror in self.mirrors]
        return {"kind": self.kind, "factor": self.factor, "planes": planes}

    @classmethod
    def from_dict(cls, plain: PlainMapping) -> "Symmetry":
        """Return the symmetry with the plain form `plain`."""
        return cls(tuple(map(Mirror.from_dict, plain["planes"])), plain["kind"] == "revolution")

    def at_moment(self, moved: Sequence[PlainMapping]) -> "Symmetry":
        """Return the whole with its planes at their present places; `moved`: `axis`, place `from` and place `at`."""
        places = {("xyz".index(plane["axis"]), float(plane["from"])): float(plane["at"]) for plane in moved}
        mirrors = [replace(mirror, at=places.get((mirror.axis, mirror.at), mirror.at)) for mirror in self.mirrors]
        return replace(self, mirrors=tuple(mirrors))

    def complete(self, snapshot: Snapshot) -> Snapshot:
        """Return the snapshot with all mirror images behind its own particles, one whole copy after the other."""
        if not self.mirrors:
            return snapshot
        count, images = snapshot.count, self.images
        signs, offsets = np.ones((images, snapshot.dimensions)), np.zeros((images, snapshot.dimensions))
        for bit, plane in enumerate(self.mirrors):
            mirrored = (np.arange(images) >> bit) & 1 == 1
            signs[mirrored, plane.axis], offsets[mirrored, plane.axis] = -1.0, 2.0 * plane.at

        def mirror(name: str, values: np.ndarray) -> np.ndarray:
            if name in ("position", "velocity"):
                vectors = values.reshape(count, -1)
                shift = offsets if name == "position" else np.zeros_like(offsets)
                return (vectors[None] * signs[:, None] + shift[:, None]).reshape(images * count, -1)
            tiled = np.tile(values, (images, *[1] * (values.ndim - 1)))
            return tiled / images if self.revolution and name == "mass" else tiled

        fields = transform_arrays(snapshot.fields, mirror, [name for name in snapshot.fields if name not in OMITTED])
        number = (snapshot.id[None] * images + np.arange(images)[:, None]).ravel()
        return replace(
            snapshot,
            fields=fields,
            body=np.tile(snapshot.body, images),
            material=np.tile(snapshot.material, images),
            id=number,
        )

    def join_groups(self, labels: np.ndarray, position: np.ndarray, reach: float | np.ndarray) -> np.ndarray:
        """Return the groups of the whole, of images * n particles as `complete` orders them, from those of the part.

        `labels` are the groups of the part's particles (n,), `position` their positions in the case's axes (n, dim),
        and `reach` the linking distance [m], or of each particle its own. A group and its image are one where a
        particle is linked to its own image: any other link across the plane implies that one.
        """
        if not self.mirrors or len(labels) == 0:
            return labels
        bits = np.arange(self.images)
        free_planes = np.zeros(int(labels.max()) + 1, dtype=np.int64)  # the planes that a group does not touch, as bits
        for number, mirror in enumerate(self.mirrors):
            nearest = np.full(len(free_planes), np.inf)
            np.minimum.at(nearest, labels, np.abs(position[:, mirror.axis] - mirror.at) - 0.5 * reach)
            if not self.revolution:
                free_planes |= np.where(nearest > 0.0, 1 << number, 0)
        keys = (labels[None] * self.images + (bits[:, None] & free_planes[labels][None])).ravel()
        occupied = np.zeros(len(free_planes) * self.images, dtype=bool)
        occupied[keys] = True
        return np.asarray((np.cumsum(occupied) - 1)[keys])


def whole_of(start: Snapshot, projectile: np.ndarray, spacing: float, planes: Sequence[Mirror] | None) -> Symmetry:
    """Return how the whole follows from the first snapshot; `projectile` (n,) are its particles, `spacing` is dx.

    Where the case's `planes` of symmetry are not known, a coordinate plane counts that all matter is on one side of and
    a particle touches.
    """
    position = start.fields["position"].reshape(start.count, -1)
    if planes is None:
        planes = [Mirror(axis, 0.0) for axis in range(1, position.shape[1]) if _half(position[:, axis], spacing)]
    shot = position[projectile]
    moving = start.fields["velocity"].reshape(start.count, -1)[projectile] if "velocity" in start.fields else None
    pushing = [] if moving is None or moving.any() else start.metadata.get("moved_planes", ())
    walls = [Mirror.from_dict({"axis": plane["axis"], "at": plane["from"]}) for plane in pushing]
    mirrors: list[Mirror] = []
    for plane in planes:
        touching = np.abs(shot[:, plane.axis] - plane.at) <= TOUCHING * spacing
        if plane in walls or not touching.any():
            continue
        # a projectile that moves along the axis, beside the plane too, strikes a wall; an imploding body does not
        mean = np.zeros(1) if moving is None else np.abs(moving.mean(axis=0))
        if (
            moving is None
            or not mean[plane.axis] > 1e-9 * mean.max(initial=0.0)
            or (abs(float(moving[touching, plane.axis].mean())) <= 0.5 * mean[plane.axis])
        ):
            mirrors.append(plane)
    axes = [mirror.axis for mirror in mirrors]
    return Symmetry(tuple(mirror for mirror in mirrors if axes.count(mirror.axis) == 1))


def _half(coordinate: np.ndarray, spacing: float) -> bool:
    low, high = coordinate.min(), coordinate.max()
    return bool((low > 0.0 and low <= TOUCHING * spacing) or (high < 0.0 and high >= -TOUCHING * spacing))
