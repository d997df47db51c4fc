"""Fracture energy: softening after the onset of failure, by a crack band.

    onset     D = 1: Y_0 the flow stress and p_0 the tension then, at least Y_0/3 as in uniaxial tension
    after     dd = l (Y_0 d eps_p + p_0 d eps_v)/(2 G_f),   d eps_v = max(tr D, 0) dt beyond the limit of tension
              Y = (1 - d) Y_0,   p >= -(1 - d) p_0,   failed at d = 1
    return    d eps_p = (q - (1 - d) Y_0)/(3 G - l Y_0^2/(2 G_f))
    strength  Y_0 <= (6 G G_f/l)^(1/2),   p_0 <= (2 E' G_f/l)^(1/2),   E' = K + 4 G/3
    fitted    before onset, once the flow stress falls with plastic strain, dD is l/L_0 times that of the model,
              between 1/5 and 5

The stress does the work G_f on an area of crack, l wide, from onset to failure, in any mode: sum (1 - d) 2 dd = 1. The
whole volumetric strain counts, of the deviatoric strain the plastic part; a crack transmits compression. l is the
width of the band that one particle represents, L_0 that at which the constants of the model were fitted. Above the
limits `strength` a particle would release more elastic energy than the crack takes up: Y_0 and p_0 are reduced, G_f is
not (Bazant & Oh 1983, Mater. Struct. 16, 155). Band and energy after Hillerborg, Modeer & Petersson 1976, Cem. Concr.
Res. 6, 773; G_f = K_IC^2 (1 - nu^2)/E. Strain rate and temperature have no effect after the onset.
"""

from dataclasses import dataclass
from math import inf, sqrt

import numpy as np

from hvisph.compiler.jit import inline
from hvisph.materials.slots import FITTED_LENGTH, FRACTURE_COMPLIANCE, FRACTURE_MODULUS, SHEAR_MODULUS

# Places in a particle's history: measure of onset D, Y_0 [Pa], p_0 [Pa] and l [m].
ONSET, YIELD, TENSION, WIDTH = 5, 6, 7, 8
# Least and largest l/L_0 by which strain counts.
NARROWEST, WIDEST = 0.2, 5.0
BELOW = 1.0 - 1e-9  # share of the strength beyond which an element would snap back: the return then has a denominator
_UNIAXIAL = 1.0 / 3.0  # tension at onset over the flow stress, at least: the mean stress of uniaxial tension


@dataclass(frozen=True)
class FractureEnergy:
    """Parameters of the softening after onset."""

    energy: float  # G_f [J/m^2]
    fitted_length: float = 0.0  # L_0 [m]; 0 where the strain to failure holds for any width

    def pack(self, row: np.ndarray, modulus: float) -> None:
        """Write the law into the material's row of the table; `modulus` is E' = K + 4 G/3 at rest [Pa]."""
        row[FRACTURE_COMPLIANCE], row[FITTED_LENGTH], row[FRACTURE_MODULUS] = (
            0.5 / self.energy,
            self.fitted_length,
            modulus,
        )


def largest_widths(energy: float, flow: float, tension: float, shear_modulus: float, modulus: float) -> float:
    """Return l_max [m] for `flow`, `tension` [Pa], E' [Pa] and G_f [J/m^2]; 0 is no such strength."""
    in_shear = 6.0 * shear_modulus * energy / flow**2 if flow > 0.0 else inf
    in_tension = 2.0 * modulus * energy / tension**2 if tension > 0.0 else inf
    return min(in_shear, in_tension)


@inline
def largest_tension(softening, row):
    """Return the tension [Pa] beyond which an element would snap back, for `softening` l/(2 G_f) [1/Pa]."""
    return BELOW * sqrt(row[FRACTURE_MODULUS] / softening)


@inline
def strengths_at_onset(flow, p, softening, row):
    """Return Y_0 and p_0 [Pa] from the flow stress and the pressure at onset [Pa]."""
    flow = min(flow, BELOW * sqrt(3.0 * row[SHEAR_MODULUS] / softening))
    return flow, min(max(-p, _UNIAXIAL * flow), largest_tension(softening, row))


@inline
def localised_share(width, row):
    """Return the factor of plastic strain in the damage of a metal whose flow stress falls with strain."""
    return min(max(width / row[FITTED_LENGTH], NARROWEST), WIDEST)


@inline
def open_crack(d, p, rate, dt, tension, softening, stiffness):
    """Return d after `dt` [s] at `p` [Pa] and a rate of volume [1/s]; only tension beyond (1 - d) p_0 counts."""
    beyond = (d - 1.0) * tension - p
    if beyond <= 0.0:
        return d
    return min(d + softening * tension * min(dt * max(rate, 0.0), beyond / stiffness), 1.0)


@inline
def softened_pressure(p, d, tension):
    """Return the pressure [Pa] limited by the strength of a crack; `tension` is p_0, 0 before onset."""
    return max(p, (d - 1.0) * tension) if tension > 0.0 else p


def fracture_work(
    mass: np.ndarray, density: np.ndarray, d: np.ndarray, tension: np.ndarray, width: np.ndarray, energy: np.ndarray
) -> np.ndarray:
    """Return the work of fracture of particles (n,) [J]: V/l G_f (1 - (1 - d)^2) of those past onset.

    `mass`, `density`: m [kg] and density at rest [kg/m^3].
    `d`, `tension`, `width`, `energy`: d, p_0 [Pa], l [m], and G_f of the material [J/m^2], 0 where failure takes none.
    """
    past = tension > 0.0
    area = mass[past] / density[past] / width[past]
    work = np.zeros(len(mass))
    work[past] = area * energy[past] * (1.0 - (1.0 - d[past]) ** 2)
    return work
