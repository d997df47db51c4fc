"""Relief of tension in pairs that are closer than their volumes allow.

    t*_n -= max(t*_n, 0) o_ab min(12 max(V_a V_b / r^(2d) - 1, 0), 1)

A lattice of particles in tension is unstable, because disorder raises its kernel sum. The term acts in bodies whose
lattice is in order, o_ab > 0, and vanishes on an even lattice.

Source: this code's own. Verification: `tension` (4 GPa in a bar and in a disordered patch).
"""

from __future__ import annotations

from hvisph.compiler.jit import inline
from hvisph.compiler.tensors import power_of_dimension

# Rate at which tension decreases with the excess of the volumes over the distance.
TENSION_GAIN = 12.0


@inline
def tension_relief(t_n, volumes, dx, inverse_r, order):
    """Return the normal traction [Pa] with its tension relieved.

    `t_n`: normal traction [Pa]
    `volumes`: product of both volumes [m^(2 dim)]
    `dx`, `inverse_r`: distance vector [m], for its dimensions, and 1 over its length
    `order`: order of the lattice, the lesser of both
    """
    relief = min(TENSION_GAIN * max(volumes * power_of_dimension(inverse_r * inverse_r, dx) - 1.0, 0.0), 1.0)
    return t_n - max(t_n, 0.0) * (order * relief)
