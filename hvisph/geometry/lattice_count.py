"""Result of a lattice, and particle counts shared by lattices."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hvisph.core.errors import CaseError

# Against round-off in length / spacing: 50.1 mm / 0.1 mm must be 501 on every machine.
ROUND_OFF = 1e-9


@dataclass(frozen=True)
class Filling:
    """The particles of one body, around the origin of its shape."""

    positions: np.ndarray  # particle centres in the shape's coordinates, shape (n, dim) [m]
    volumes: np.ndarray  # volume of each particle, shape (n,) [m^dim]
    size: tuple[float, ...]  # full size along each axis that the particles stand for [m]
    # spacing of the particles, which their smoothing length follows: one for all, or shape (n,) [m]
    spacing: float | np.ndarray
    # what gave way: sizes in a nominal filling, spacing and masses in an exact one; empty if nothing did
    note: str = ""

    @property
    def count(self) -> int:
        """Number of particles."""
        return len(self.positions)

    @property
    def finest(self) -> float:
        """Least spacing [m]."""
        return float(np.min(self.spacing))


def count_across(length: float, spacing: float, what: str = "body", even: bool = False) -> int:
    """Return how many particles, or how many in pairs, at `spacing` [m] come nearest to `length` [m].

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
    return 2 * max(1, math.floor(length / spacing / 2 + 0.5 + ROUND_OFF)) if even else count


def make_filling(positions: np.ndarray, dx: float, size: tuple[float, ...], asked: tuple[float, ...]) -> Filling:
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
    return Filling(np.ascontiguousarray(positions), volumes, size, dx, note)


def centre_coordinates(count: int, spacing: float) -> np.ndarray:
    """Return `count` coordinates at `spacing` [m], symmetric about 0 to the last bit."""
    return (np.arange(count) - (count - 1) / 2) * spacing


def cover(low: float, high: float, spacing: float, even: bool = False) -> np.ndarray:
    """Return coordinates at `spacing` [m] centred between `low` and `high`, as many as come nearest to fill it."""
    return (low + high) / 2 + centre_coordinates(count_across(high - low, spacing, even=even), spacing)


def _sizes(size: tuple[float, ...]) -> str:
    return " x ".join(f"{side:.6g}" for side in size)
