"""Spheres of a second material in a body, dealt out at random, the largest first: boulders in rubble.

Diameters follow N(>D) ~ D^exponent between two limits, as many as fill a share of the body; the last one is left out
where it would fill more. Each is put wholly inside the body, at random among the places that are free of others.
"""

from hashlib import sha256

import numpy as np

from hvisph.core.errors import CaseError

from .shapes import Shape

TRIES = 4000  # places that are drawn for a sphere before it is said not to fit
AT_ONCE = 200


def draw_diameters(
    limits: tuple[float, float], exponent: float, dim: int, wanted: float, generator: np.random.Generator
) -> np.ndarray:
    """Return diameters [m], falling, whose spheres (discs in 2D) have at most the volume `wanted` [m^dim]."""
    low, high = limits
    found: list[float] = []
    filled = 0.0
    while True:
        u = generator.random()
        d = low * (1.0 - u * (1.0 - (high / low) ** exponent)) ** (1.0 / exponent) if exponent else high
        volume = ball_volume(d, dim)
        if filled + volume > wanted:
            return np.sort(np.array(found))[::-1]
        filled += volume
        found.append(d)


def ball_volume(diameter: float, dim: int) -> float:
    """Return the volume of a sphere, or the area of a disc [m^dim]."""
    return float(np.pi * diameter**dim / (6.0 if dim == 3 else 4.0))


def deal_spheres(
    shape: Shape, limits: tuple[float, float], exponent: float, share: float, seed: int, name: str
) -> tuple[np.ndarray, np.ndarray]:
    """Return centres (k, dim) and diameters (k,) [m] of spheres inside a shape, in its own coordinates.

    Raises `CaseError` where none fits the volume, or there is no free place for one.
    """
    words = np.frombuffer(sha256(name.encode()).digest()[:16], np.uint32)
    generator = np.random.Generator(np.random.PCG64([seed, *map(int, words)]))
    diameters = draw_diameters(limits, exponent, shape.dim, share * shape.volume, generator)
    if not len(diameters):
        raise CaseError(
            f"a volume of {share:g} holds no sphere of the diameters drawn; give a larger volume or smaller diameters"
        )
    low, high = shape.bounds()
    centres = np.zeros((0, shape.dim))
    for number, d in enumerate(diameters):
        for _ in range(TRIES // AT_ONCE):
            places = low + generator.random((AT_ONCE, shape.dim)) * (high - low)
            free = shape.distance(places) <= -0.5 * d
            apart = np.sqrt(((places[:, None] - centres[None]) ** 2).sum(axis=2))
            free &= (apart >= 0.5 * (d + diameters[:number])).all(axis=1)
            if free.any():
                centres = np.vstack([centres, places[np.argmax(free)]])
                break
        else:
            filled = sum(ball_volume(one, shape.dim) for one in diameters[:number]) / shape.volume
            raise CaseError(
                f"there is no free place for a sphere of {d:.3g} after {number} of {len(diameters)}, which "
                f"fill {filled:.3g}; give a smaller volume or smaller diameters"
            )
    return centres, diameters


def owner_of(positions: np.ndarray, centres: np.ndarray, diameters: np.ndarray) -> np.ndarray:
    """Return which sphere holds each point (n,); -1 for none."""
    owner = np.full(len(positions), -1)
    for number, (centre, d) in enumerate(zip(centres, diameters, strict=True)):
        owner[((positions - centre) ** 2).sum(axis=1) < 0.25 * d * d] = number
    return owner
