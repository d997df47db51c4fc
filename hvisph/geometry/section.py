"""Half-plane sections of solids of revolution about x, and bodies cut by planes of symmetry.

A particle at (x, r) is a whole ring of the volume 2 pi r A, where A is its share of the section. Rows stand at
r = dx/2, 3 dx/2, ... from the axis, and the rings' volumes add up to that of the solid.

The cut leaves the mass unchanged. A plane through a body must be a plane of symmetry of it, and of
its particles. Particles on the far side are left out; a row in the plane itself is split: half its
mass stays, a quarter of a spacing from the plane, and the other half is in its image. So a half, a
quarter and an eighth weigh what they are called.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hvisph.core.catalogues import SECTION_ARRANGEMENTS
from hvisph.core.errors import CaseError
from hvisph.geometry.filling import fill
from hvisph.geometry.lattices import Filling, Grading, fill_graded
from hvisph.geometry.shapes import Cylinder, Ring, Shape, Tube
from hvisph.geometry.shapes.combinations import Measured

IN_PLANE = 0.05  # [spacings]: nearer than this a particle lies in the plane
SPLIT = 0.25  # [spacings]: from the plane to what stays of a row in it
OFF = 0.02  # [spacings]: how far a particle's image may be from a particle
MOST_COMPARED = 20_000


@dataclass(frozen=True)
class Mirror:
    """A plane of symmetry."""

    axis: int  # 0, 1 or 2: the plane is normal to x, y or z
    at: float  # its coordinate [m]
    sign: float = 1.0  # 1.0 where coordinates above it are kept, -1.0 below


def crosses(low: np.ndarray, high: np.ndarray, mirror: Mirror, spacing: float) -> bool:
    """Whether the plane passes through the box from `low` to `high` rather than along its face."""
    margin = IN_PLANE * spacing
    return bool(low[mirror.axis] + margin < mirror.at < high[mirror.axis] - margin)


def cut(
    positions: np.ndarray, volumes: np.ndarray, spacing: np.ndarray, mirrors: Sequence[Mirror]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the part of a body that planes of symmetry keep.

    `positions`, `volumes`, `spacing`: particles at their place, (n, dim), (n,) and (n,) [m].

    Returns positions and volumes that are kept, and their numbers among those given. Raises `CaseError` when a plane
    passes through a body that is not symmetric about it.
    """
    kept = np.arange(len(positions))
    for mirror in mirrors:
        along = mirror.sign * (positions[:, mirror.axis] - mirror.at)
        near = spacing[kept]
        if (along < 0).any() and (along > 0).any():
            _require_symmetry(positions, mirror, float(near.max()))
        inside = np.abs(along) <= IN_PLANE * near
        stays = (along > 0) | inside
        positions, volumes = positions.copy(), volumes.copy()
        positions[inside, mirror.axis] = mirror.at + mirror.sign * SPLIT * near[inside]
        volumes[inside] *= 0.5
        positions, volumes, kept = positions[stays], volumes[stays], kept[stays]
    return np.ascontiguousarray(positions), volumes, kept


def _require_symmetry(positions: np.ndarray, mirror: Mirror, spacing: float) -> None:
    from scipy.spatial import cKDTree

    images = positions[:: max(1, len(positions) // MOST_COMPARED)].copy()
    images[:, mirror.axis] = 2 * mirror.at - images[:, mirror.axis]
    distance, _ = cKDTree(positions, balanced_tree=False, compact_nodes=False).query(images)
    if distance.max() > OFF * spacing:
        axis = "xyz"[mirror.axis]
        raise CaseError(
            f"the symmetry plane {axis} = {mirror.at:g} passes through this body, whose particles are not mirror "
            "images across it: put the body's middle on the plane or all of it on one side, turn it by right "
            "angles only, and use an arrangement that is symmetric (square, cubic, relaxed); or leave the plane out",
            where="symmetry",
        )


ROUND = 1e-6  # [size]: how much the distance to a solid of revolution may change round the axis


@dataclass(frozen=True)
class Section(Measured):
    """The half-plane section (x, r >= 0) of a solid of revolution about x (2D).

    Raises `CaseError` when the solid changes round the x axis.
    """

    solid: Shape

    def __post_init__(self) -> None:
        require_revolved(self.solid)

    @property
    def dim(self) -> int:
        """Number of dimensions: 2."""
        return 2

    @property
    def kind(self) -> str:
        """Name of the kind of shape, for messages."""
        return self.solid.kind

    @property
    def flat_axes(self) -> tuple[int, ...]:
        """Axes across which flat faces bound the whole shape."""
        solid = self.solid
        round_wall = isinstance(solid, Cylinder | Tube) or (isinstance(solid, Ring) and 1 in solid.section.flat_axes)
        return (*(axis for axis in solid.flat_axes if axis == 0), *((1,) if round_wall else ()))

    @property
    def wall_axes(self) -> tuple[int, ...]:
        """The radius, where the solid reaches to the axis."""
        return (1,) if self.bounds()[0][1] == 0.0 else ()

    @property
    def radial_axes(self) -> tuple[int, ...]:
        """The radius."""
        return (1,)

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the lower and the upper corner of the box around it, (2,) each [m]."""
        low, high = self.solid.bounds()
        inner = 0.0
        if isinstance(self.solid, Tube):
            inner = self.solid.inner_diameter / 2
        elif isinstance(self.solid, Ring):
            inner = max(0.0, float(self.solid.section.bounds()[0][1]) + self.solid.radius)
        return np.array([low[0], inner]), np.array([high[0], high[1]])

    def distance(self, points: np.ndarray) -> np.ndarray:
        """Return the signed distance of `points` (n, 2) [m] to the surface or the axis, negative inside: (n,) [m]."""
        in_space = np.concatenate([points, np.zeros((len(points), 1))], axis=1)
        return np.maximum(self.solid.distance(in_space), -points[:, 1])


def require_revolved(solid: Shape) -> None:
    """Raise `CaseError` unless `solid` is a solid of revolution about x."""
    low, high = solid.bounds()
    size = float((high - low).max())
    random = np.random.default_rng(0)
    x = random.uniform(low[0], high[0], 400)
    r = random.uniform(0.0, max(high[1], high[2]), 400)
    start = solid.distance(np.stack([x, r, np.zeros(400)], axis=1))
    for angle in (0.7, 1.9, 3.4, 5.1):
        turned = solid.distance(np.stack([x, r * math.cos(angle), r * math.sin(angle)], axis=1))
        if np.abs(turned - start).max() > ROUND * size:
            raise CaseError(
                f"the {solid.kind} is no solid of revolution about the x axis; take a cylinder for a plate, a tube or "
                "ring off the axis, and leave out what turns or moves it off the axis",
                where="shape",
            )


def fill_section(
    solid: Shape,
    arrangement: str | None,
    dx: float,
    *,
    exact: bool = True,
    even: tuple[int, ...] = (),
    grading: Grading | None = None,
) -> Filling:
    """Fill the half-plane section of a solid of revolution about x with rings.

    `solid`: a shape in 3D.
    `arrangement`, `dx`, `exact`, `even`: as for `hvisph.geometry.filling.fill`, in 2D.
    `grading`: how the spacing grows in a section that flat faces bound; None for an even spacing.

    Returns positions (x, r) (n, 2) [m] and volumes of whole rings [m^3]. Raises `CaseError` when the solid changes
    round the axis or cannot be filled.
    """
    section = Section(solid)
    if arrangement not in (None, *SECTION_ARRANGEMENTS):
        raise CaseError(
            f"arrangement '{arrangement}' has no meaning for rings about an axis; allowed: "
            f"{', '.join(SECTION_ARRANGEMENTS)}",
            where="arrangement",
        )
    if grading is not None:
        filling = fill_graded(section, dx, grading, even)
    else:
        filling = fill(section, arrangement, dx, exact=exact, even=even)
    rings = 2 * math.pi * filling.positions[:, 1] * filling.volumes
    return replace(filling, volumes=rings * (solid.volume / rings.sum()) if exact else rings)
