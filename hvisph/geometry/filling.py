"""What an arrangement returns, and the counting of particles that arrangements share."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hvisph.core.errors import CaseError

# Against round-off in length / spacing: 50.1 mm / 0.1 mm must be 501 on every machine.
ROUND_OFF = 1e-9


@dataclass(frozen=True)
class Filling:
    """The particles of one body, around the centre of its shape.

    Parameters
    ----------
    positions
        Particle centres relative to the shape's centre, shape (n, dim) [m].
    volumes
        Volume of each particle, shape (n,) [m^dim].
    size
        Full size along each axis that the particles stand for [m].
    note
        Why `size` differs from the size asked for; empty when it does not.
    """

    positions: np.ndarray
    volumes: np.ndarray
    size: tuple[float, ...]
    note: str = ""

    @property
    def count(self) -> int:
        """Number of particles."""
        return len(self.positions)


def count_across(length: float, spacing: float, what: str = "body") -> int:
    """Return how many particles at `spacing` [m] come nearest to `length` [m].

    Raises
    ------
    CaseError
        When not one particle fits.
    """
    count = math.floor(length / spacing + 0.5 + ROUND_OFF)
    if count < 1:
        raise CaseError(
            f"the {what} of {length:g} is thinner than half a particle at spacing {spacing:g}; "
            "refine the resolution or enlarge the body",
            where="resolution",
        )
    return count


def filled(positions: np.ndarray, dx: float, size: tuple[float, ...], asked: tuple[float, ...]) -> Filling:
    """Return the `Filling` of `positions` of volume dx^dim each, noting a size that had to give way.

    Raises
    ------
    CaseError
        When there is no particle.
    """
    if len(positions) == 0:
        raise CaseError(f"no particle at spacing {dx:g} fits into the body", where="resolution")
    differs = any(abs(got - want) > ROUND_OFF * want for got, want in zip(size, asked, strict=True))
    note = f"{_sizes(asked)} is filled as {_sizes(size)} at resolution {dx:g}" if differs else ""
    volumes = np.full(len(positions), dx ** positions.shape[1])
    return Filling(np.ascontiguousarray(positions), volumes, size, note)


def centred(count: int, spacing: float) -> np.ndarray:
    """Return `count` coordinates at `spacing` [m], symmetric about 0 to the last bit."""
    return (np.arange(count) - (count - 1) / 2) * spacing


def grid(axes: list[np.ndarray]) -> np.ndarray:
    """Return the points of the product of coordinate lists, the last coordinate fastest: (n, dim)."""
    mesh = np.meshgrid(*axes, indexing="ij")
    return np.stack([coordinate.ravel() for coordinate in mesh], axis=1)


def _sizes(size: tuple[float, ...]) -> str:
    return " x ".join(f"{side:.6g}" for side in size)
