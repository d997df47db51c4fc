"""What every length is measured against: the axis, the struck face, the plate's thickness, the main bodies.

The axis is the line along x through the centre that the projectile had at the start; the struck face
is the target's nearest plane to the projectile at the start, x = 0 in cases placed automatically.
They are read from the run's first snapshot. A snapshot that stands alone brings them in its metadata
(`axis`, `face`, `thickness`, `width`, as `reference` gives them); where it does not, y = 0, x = 0,
the thickness of the outermost tenth of the target's main bodies, which the impact reaches last,
and the projectile's present width take their place.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from hvisph.core.errors import OutputError
from hvisph.measures.groups import Fragment, fragments, main_body
from hvisph.output.snapshot import Snapshot

PROJECTILE, TARGET = 0, 1
RIM = 0.9  # of the way from the shot line to the target's edges: what is further out the impact leaves alone


def axis_of(position: np.ndarray, body: np.ndarray, spacing: float) -> np.ndarray:
    """Return the lateral coordinates [m] of the shot line: along x through the projectile's centre.

    Where every body lies on one side of a coordinate plane and one touches it, the case is half of
    a symmetric one, and the shot line is in that plane.

    Parameters
    ----------
    position
        All particles at the start, shape (n, dim) [m].
    body
        Index of the body of each, shape (n,).
    spacing
        dx [m].

    Returns
    -------
    numpy.ndarray
        Shape (dim - 1,) [m].
    """
    lateral = position[:, 1:]
    touch = 0.75 * spacing  # the first layer is half a spacing away
    low, high = lateral.min(axis=0), lateral.max(axis=0)
    half = ((low > 0.0) & (low <= touch)) | ((high < 0.0) & (high >= -touch))
    return np.where(half, 0.0, lateral[body == PROJECTILE].mean(axis=0))


def reference(start: Snapshot) -> dict[str, Any]:
    """Return what the metadata of later snapshots must hold for them to be measured alone.

    Parameters
    ----------
    start
        The run's first snapshot, with `spacing` in its metadata.

    Returns
    -------
    dict
        `axis` (list of dim - 1 coordinates [m]), `width` of the projectile [m] and, where there is a
        target, its `face` (x of the struck plane) and `thickness` [m].
    """
    scene = Scene(start, start)
    found: dict[str, Any] = {"axis": scene.axis.tolist(), "width": scene.width}
    return found | {"face": scene.face, "thickness": scene.thickness} if scene.has_target else found


@dataclass
class Scene:
    """One moment of a run, seen along its shot line.

    Parameters
    ----------
    now
        The moment to measure.
    start
        The run's first snapshot, where there is one.
    """

    now: Snapshot
    start: Snapshot | None = None
    _fragments: dict[int, list[Fragment]] = field(default_factory=dict, init=False, repr=False)

    @cached_property
    def position(self) -> np.ndarray:
        """Positions now, shape (n, dim) [m].

        Raises
        ------
        OutputError
            When a position is not finite: no length has a meaning then.
        """
        position = self.now.fields["position"]
        if not np.isfinite(position).all():
            number = int(self.now.id[np.flatnonzero(~np.isfinite(position).all(axis=1))[0]])
            raise OutputError(f"the position of particle {number} is not finite at t = {self.now.time:.6g} s")
        return position

    @cached_property
    def spacing(self) -> float:
        """Spacing dx [m]: as the run says, or in other codes' files the cell that a particle's mass fills."""
        if "spacing" in self.now.metadata:
            return float(self.now.metadata["spacing"])
        if {"mass", "density"} <= self.now.fields.keys():
            volume = np.median(self.now.fields["mass"] / self.now.fields["density"])
            return float(volume ** (1.0 / self.now.dimensions))
        from scipy.spatial import cKDTree

        return float(np.median(cKDTree(self.position).query(self.position, k=2)[0][:, 1]))

    @cached_property
    def support(self) -> float:
        """Reach of the kernel [m]: 2h where the files do not name it, and h is 1.4 dx where they do not tell."""
        reach = float(self.now.metadata.get("kernel_reach", 2.0))
        h = self.now.fields.get("smoothing_length")
        return reach * (float(np.median(h)) if h is not None else 1.4 * self.spacing)

    @cached_property
    def axis(self) -> np.ndarray:
        """Lateral coordinates of the shot line, shape (dim - 1,) [m]."""
        if "axis" in self.now.metadata:
            return np.atleast_1d(np.asarray(self.now.metadata["axis"], dtype=float))
        if self.start is not None:
            return axis_of(self.start.fields["position"], self.start.body, self.spacing)
        return np.zeros(self.now.dimensions - 1)

    @cached_property
    def lateral(self) -> np.ndarray:
        """Coordinates across the shot line, shape (n, dim - 1) [m]."""
        return self.position[:, 1:] - self.axis

    @cached_property
    def radius(self) -> np.ndarray:
        """Distance from the shot line, shape (n,) [m]."""
        return np.sqrt((self.lateral**2).sum(axis=1))

    @cached_property
    def has_target(self) -> bool:
        """Whether there is a second body."""
        return bool((self.now.body == TARGET).any())

    @cached_property
    def _plate(self) -> tuple[float, float]:
        """The struck face [m] and the thickness [m] of the plate before it was struck."""
        metadata = self.now.metadata
        if "face" in metadata and "thickness" in metadata:
            return float(metadata["face"]), float(metadata["thickness"])
        if self.start is not None:
            x = self._start_plate_at_the_axis(self.start)
            return float(x.min() - 0.5 * self.spacing), float(np.ptp(x) + self.spacing)
        plate = np.concatenate(self.target_sides)
        outer = plate[self.radius[plate] >= np.quantile(self.radius[plate], 0.9)]
        return 0.0, float(np.ptp(self.position[outer, 0]) + self.spacing)

    def _start_plate_at_the_axis(self, start: Snapshot) -> np.ndarray:
        position = start.fields["position"][start.body == TARGET]
        radius = np.sqrt(((position[:, 1:] - self.axis) ** 2).sum(axis=1))
        # an oblique plate is as thick as it is along the shot line; one that the line misses, as a whole
        near = position[radius <= radius.min() + 1.5 * self.spacing, 0]
        return near if len(near) else position[:, 0]

    @property
    def face(self) -> float:
        """Plane of the target's struck face before the impact, x [m]."""
        return self._plate[0]

    @property
    def thickness(self) -> float:
        """Thickness of the target along the shot line before the impact [m]."""
        return self._plate[1]

    @cached_property
    def width(self) -> float:
        """Width across the shot line that the projectile has, at the start where it is known [m]."""
        if "width" in self.now.metadata:
            return float(self.now.metadata["width"])
        source = self.start or self.now
        position = source.fields["position"][source.body == PROJECTILE]
        if source.dimensions == 1:
            return float(np.ptp(position) + self.spacing)
        return float(np.ptp(position[:, 1]) + self.spacing)

    def fragments(self, body: int) -> list[Fragment]:
        """Return the connected groups of a body, the one with most particles first."""
        if body not in self._fragments:
            _ = self.position  # says which particle has none
            self._fragments[body] = fragments(self.now, body, self.spacing)
        return self._fragments[body]

    @cached_property
    def projectile(self) -> np.ndarray:
        """Indices of the projectile's main body."""
        return self._whole(PROJECTILE)

    @cached_property
    def target_sides(self) -> list[np.ndarray]:
        """Indices of the target's main bodies: in 2D on each side of the shot line, in 3D all round it.

        A half model has one side.
        """
        plate = self.now.body == TARGET
        if self.now.dimensions != 2:
            return [self._whole(TARGET)]
        upper = self.lateral[:, 0] > 0.0
        sides = [self._main(plate & upper), self._main(plate & ~upper)]
        return [side for side in sides if len(side)]

    @cached_property
    def rim(self) -> np.ndarray:
        """Whether a particle is of the target's rim, its outer tenth towards any of its edges, shape (n,).

        What began there, where the start is known and particles have permanent numbers, as in our own files;
        else what is there now, between the edges of the main bodies: debris may have flown further. In 1D
        there is none.
        """
        found = np.zeros(self.now.count, dtype=bool)
        if self.now.dimensions == 1 or not self.has_target:
            return found
        if self.start is not None and "spacing" in self.start.metadata:
            plate = self.start.body == TARGET
            lateral = self.start.fields["position"][plate, 1:] - self.axis
            outer = self.start.id[plate][_outward(lateral, lateral) >= RIM] if plate.any() else []
            return np.isin(self.now.id, outer) & (self.now.body == TARGET)
        plate = np.flatnonzero(self.now.body == TARGET)
        outward = _outward(self.lateral[plate], self.lateral[np.concatenate(self.target_sides)])
        found[plate] = (outward >= RIM) & (outward <= 1.0)
        return found

    def _whole(self, body: int) -> np.ndarray:
        found = self.fragments(body)
        return found[0].particles if found else np.zeros(0, dtype=np.int64)

    def _main(self, chosen: np.ndarray) -> np.ndarray:
        members = np.flatnonzero(chosen)
        return members[main_body(self.position[members], self.spacing)]


def _outward(lateral: np.ndarray, plate: np.ndarray) -> np.ndarray:
    """Return how far (n,) of the way from the shot line to the edges of `plate` each particle is; 1 is on an edge.

    Both have the shape (.., dim - 1). An edge that the shot line is on is a plane of symmetry, no edge.
    """
    low, high = plate.min(axis=0), plate.max(axis=0)
    reach = np.where(lateral > 0.0, high, -low)
    share = np.divide(np.abs(lateral), reach, out=np.zeros_like(lateral), where=reach > 0.0)
    return share.max(axis=1)
