"""Velocity of metal driven by an explosive, by the energy balance of Gurney.

The explosive of mass C shares its Gurney energy E between the metal, of mass M, and its products, whose velocity
varies linearly across them (Gurney 1943, BRL report 405; metal on both faces: Kennedy 1970, SC-RR-70-790).
Gurney velocities (2 E)^(1/2) are those of cylinder tests (Kury et al. 1965; Dobratz & Crawford 1985), recalled.
"""

from math import sqrt

from .correlations import Correlation

# (2 E)^(1/2) by material of the library [m/s].
GURNEY_VELOCITY = {
    "tnt": 2370.0,
    "composition-b": 2700.0,
    "c-4": 2660.0,
    "petn": 2930.0,
    "pbx-9404": 2900.0,
}
SOURCE = "Gurney 1943; constant of the explosive recalled"
RANGE = "final velocity, without losses at edges; metal of 0.1 to 10 times the mass of the explosive"
LIGHTEST, HEAVIEST = 0.1, 10.0
DRIVEN = "final velocity of "  # and the name of the body


def plate_velocity(gurney: float, metal: float, behind: float = 0.0) -> float:
    """Return the final velocity of a plate on one face of a slab of explosive [m/s].

    `gurney`: Gurney velocity of the explosive [m/s].
    `metal`, `behind`: mass of the plate, and of what covers the other face, over that of the explosive [-].
    """
    ratio = (1.0 + 2.0 * metal) / (1.0 + 2.0 * behind)
    products = (1.0 + ratio**3) / (3.0 * (1.0 + ratio))
    return gurney / sqrt(products + behind * ratio**2 + metal)


def shell_velocity(gurney: float, metal: float, products: float = 0.5) -> float:
    """Return the final velocity of a shell about an explosive [m/s].

    `gurney`: Gurney velocity of the explosive [m/s].
    `metal`: mass of the shell over that of the explosive [-].
    `products`: share of the products' mass that moves with the shell: 1/2 in a tube, 3/5 in a sphere [-].
    """
    return gurney / sqrt(metal + products)


def driven(name: str, velocity: float) -> Correlation:
    """Return the final velocity [m/s] of a driven body as a correlation."""
    return Correlation("Gurney", DRIVEN + name, velocity, "m/s", "", RANGE, SOURCE)
