"""Reduction of the pressure of condensed matter below the reference density.

    p(eta) = f p_condensed(eta),    eta = rho/rho0 < 1
    f = eta [v + (3 - 2 v) eta + (v - 2) eta^2],    v = min(1, H/Gamma0),  H = 2/3

p_condensed is the model's own form with Gamma rho constant. f is 1 with zero slope at rho0, so
pressure and sound speed are continuous; it tends to the pressure H rho (e - e_b) of a monatomic
gas, e_b = c0^2/Gamma0 for a cold curve rho0 c0^2 (eta - 1): 14 MJ/kg in aluminium, whose cohesive
energy is 12. f = 0.998 at eta = 0.97, 0.98 at 0.9. Compare the expanded branch of PUFF (Wray 1973,
BRL CR 130). It limits the pressure of dispersed material and is no model of vaporisation: use
`tillotson` or `table` for that.
"""

from hvisph.compiler.jit import inline

MONATOMIC = 2.0 / 3.0  # H, the Grueneisen coefficient of a gas of single atoms [-]
AS_CONDENSED = -1.0  # in place of v: the model's own form at every density


def of_gas(gamma: float) -> float:
    """Return v [-] of a model whose Grueneisen coefficient is `gamma` [-]."""
    return MONATOMIC / gamma if gamma > MONATOMIC else 1.0


@inline
def left(eta, v):
    """Share f [-] of the pressure at eta = rho/rho0 < 1."""
    return eta * (v + eta * (3.0 - 2.0 * v + eta * (v - 2.0)))


@inline
def slope(eta, v):
    """df/deta [-]."""
    return v + eta * (6.0 - 4.0 * v + eta * (3.0 * v - 6.0))
