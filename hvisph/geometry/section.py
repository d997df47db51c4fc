"""Half-plane sections of solids of revolution about x.

A particle at (x, r) is a whole ring of the volume 2 pi r A, where A is its share of the section. Rows stand at
r = dx/2, 3 dx/2, ... from the axis, and the rings' volumes add up to that of the solid.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from hvisph.core.catalogues import SECTION_ARRANGEMENTS
from hvisph.core.errors import CaseError
from hvisph.geometry.lattices import Filling
from hvisph.geometry.shapes.combinations import Measured

from .filling import fill
from .graded_spacing import Grading, fill_graded
from .shapes import Cylinder, Ring, Shape, Tube

ROUND = 1e-6  # [size]: how much the distance to a solid of revolution may change round the axis


@dataclass(frozen=True)
class Section(Measured):
    """The half-plane section (x, r >= 0) of a solid of revolution about x (2D).

    Raises
    ------
    CaseError
        When the solid changes round the x axis.
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

    Parameters
    ----------
    solid
        A shape in 3D.
    arrangement, dx, exact, even
        As for `hvisph.geometry.filling.fill`, in 2D.
    grading
        How the spacing grows in a section that flat faces bound; None for an even spacing.

    Returns
    -------
    Filling
        Positions (x, r) (n, 2) [m] and volumes of whole rings [m^3].

    Raises
    ------
    CaseError
        When the solid changes round the axis or cannot be filled.
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
