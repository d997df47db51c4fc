"""Artificial conduction of energy in shock fronts, at a Prandtl number of one.

    m_a de_a/dt += 2 V_a V_b |dW/dr| (rho_a + rho_b)/4 1.2 max(u_an - u_bn, 0) (e_b - e_a)

It acts between particles of one body and reduces wall heating.

Source: Noh 1987; Price 2008. Verification: `noh`, `hugoniot` (energy beside a struck face).
"""

from __future__ import annotations

from hvisph.compiler.jit import inline

# Conductivity over the sum of densities times the increase of the wave speed: a Prandtl number of one.
CONDUCTIVITY = 0.25


@inline
def conducted_power(weight, densities, stiffening, energy_jump):
    """Return the power that a pair conducts to the own side.

    `weight`: weight of the pair, V_b |dW/dr|, 0 between bodies
    `densities`, `energy_jump`: sum of both densities; energy of the neighbour less the own one [J/kg]
    `stiffening`: increase of the wave speed in the front [m/s] (`sph.terms.riemann_solver`)
    """
    return weight * (CONDUCTIVITY * densities) * stiffening * energy_jump
