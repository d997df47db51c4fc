"""The stress update: rotation, elasticity, yield, damage, pressure. The only one.

    S* = R S R^T + 2 G dt (D - tr D / 3 I),    D = (L + L^T)/2,  W = (L - L^T)/2,  L_ij = du_i/dx_j
    S  = S* (q - 3 G d eps_p) / q   where  q = sqrt(3/2 S*:S*) > Y

R = (1 - dt W/2)^-1 (1 + dt W/2) of Hughes & Winget 1980 is the Jaumann rate
dS/dt = 2 G dev D + W.S + S.W^T taken over a finite step: an exact rotation, second-order in
the angle, so that a spinning body keeps the size of its stress whatever the step. The axial
vector of W gives it in closed form with one division; a flow in the plane needs only its z part.

Yield returns radially (von Mises with the full deviator: S:S <= 2/3 Y^2). The plastic strain
increment solves q - 3 G x = Y(eps_p + x) by one secant from the increment without hardening:
exact for perfect plasticity and linear hardening. Where Y is concave (Johnson-Cook) it is above
the solution by second-order terms and leaves the stress on the safe side of the new yield
surface. Johnson-Cook's rate is the equivalent deviatoric strain rate of the step.

The energy handed in holds all the work done on the particle, plastic work included: heating by
plastic work needs no term of its own.
"""

from __future__ import annotations

from math import sqrt

from ..core.jit import compiled
from ..core.tensors import (
    curl,
    divergence,
    double_dot,
    no_symmetric,
    plus,
    plus_identity,
    rotation,
    stretching,
    times,
    turned,
    turned_in_plane,
)
from .damage import FailureMark, JohnsonCookDamage
from .damage import johnson_cook as damage_model
from .damage.pressure_cutoff import limited_pressure
from .eos import pressure_and_sound_speed
from .slots import DAMAGE_TAG, EOS_TAG, SHEAR_MODULUS, STRENGTH_TAG, parameters
from .strength import (
    ElasticStrength,
    JohnsonCook,
    NoStrength,
    homologous_temperature,
    johnson_cook,
    yield_stress,
)

_NO_STRENGTH = NoStrength.tag
_ELASTIC = ElasticStrength.tag
_JOHNSON_COOK = JohnsonCook.tag
_JOHNSON_COOK_DAMAGE = JohnsonCookDamage.tag
_FAILURE_MARK = FailureMark.tag

# A deviator this close above the yield surface is on it: a return is not repeated for rounding.
_ON_THE_SURFACE = 1.0 + 1e-13


@compiled
def rotated(s, a):
    """Rotate six components by Cayley's rotation of the half-angle vector `a` (dt/2 times the spin)."""
    if a[0] == 0.0 and a[1] == 0.0:
        return turned_in_plane(s, a[2])
    return turned(s, rotation(a))


@compiled
def _equilibrium(tag, rho, e, damage, row):
    p, c = pressure_and_sound_speed(tag, rho, e, row)
    p = limited_pressure(p, row)
    if damage >= 1.0 and p < 0.0:
        p = 0.0
    return p, c


@compiled
def equilibrium_state(table, models, m, rho, e, damage):
    """Pressure [Pa] and bulk sound speed [m/s], with tension cut off and taken from failed material.

    The sound speed is that of the equation of state before any cut: the stiffer one, so
    that time steps stay on the safe side.
    """
    felt = 0.0 if models[m, DAMAGE_TAG] == _FAILURE_MARK else damage
    return _equilibrium(models[m, EOS_TAG], rho, e, felt, parameters(table, m))


@compiled
def longitudinal_speed(c, rho, table, m):
    """Speed of longitudinal waves sqrt(c^2 + 4G/(3 rho)) [m/s] at bulk sound speed `c`."""
    return sqrt(c * c + (4.0 / 3.0) * table[m, SHEAR_MODULUS] / rho)


@compiled
def shear_speed(rho, table, m):
    """Speed of shear waves sqrt(G/rho) [m/s]."""
    return sqrt(table[m, SHEAR_MODULUS] / rho)


@compiled
def respond(table, models, m, dt, rho, e, s, plastic_strain, damage, l):
    """Advance a particle's stress by `dt`.

    Parameters
    ----------
    table, models, m
        Packed materials and the row of this one, uint64.
    dt
        Time step [s]; with zero an admissible deviator comes back as it was.
    rho, e
        Density [kg/m^3] and specific internal energy [J/kg] at the end of the step.
    s
        Deviator [Pa] at its start: xx, yy, zz, xy, xz, yz.
    plastic_strain, damage
        Equivalent plastic strain and damage at its start.
    l
        Velocity gradient [1/s], best at the middle of the step: nine components row by row, xy = du_x/dy.

    Returns
    -------
    The deviator [Pa], plastic strain, damage, pressure [Pa] and bulk sound speed [m/s].
    """
    row = parameters(table, m)
    strength, damage_tag = models[m, STRENGTH_TAG], models[m, DAMAGE_TAG]
    felt = 0.0 if damage_tag == _FAILURE_MARK else damage
    p, c = _equilibrium(models[m, EOS_TAG], rho, e, felt, row)
    if strength == _NO_STRENGTH or felt >= 1.0:
        return no_symmetric(3), plastic_strain, damage, p, c

    shear = row[SHEAR_MODULUS]
    d = plus_identity(stretching(l), divergence(l) * (-1.0 / 3.0))
    # Half of the increment turns with the body, half follows: second order where strain and spin go together.
    half = times(shear * dt, d)
    s = plus(rotated(plus(s, half), times(0.25 * dt, curl(l))), half)
    if strength == _ELASTIC:
        return s, plastic_strain, damage, p, c

    factor = 1.0
    strain_rate = 0.0
    homologous = 0.0
    fails = damage_tag == _JOHNSON_COOK_DAMAGE or (damage_tag == _FAILURE_MARK and damage < 1.0)
    if fails or strength == _JOHNSON_COOK:
        strain_rate = sqrt((2.0 / 3.0) * double_dot(d, d))
        homologous = homologous_temperature(e, row)
        if strength == _JOHNSON_COOK:
            factor = johnson_cook.rate_and_heat_factor(strain_rate, homologous, row)
    flow = yield_stress(strength, plastic_strain, factor, row)
    trial_squared = 1.5 * double_dot(s, s)
    if trial_squared > flow * flow * _ON_THE_SURFACE:
        trial = sqrt(trial_squared)
        excess = trial - flow
        increment = excess / (3.0 * shear)
        hardening = yield_stress(strength, plastic_strain + increment, factor, row) - flow
        increment *= excess / (excess + hardening)
        reached = trial - 3.0 * shear * increment
        s = times(reached / trial, s)
        plastic_strain += increment
        if fails:
            damage += increment / damage_model.fracture_strain(p, reached, strain_rate, homologous, row)
            if damage >= 1.0:
                damage = 1.0
            if damage >= 1.0 and damage_tag == _JOHNSON_COOK_DAMAGE:
                s = no_symmetric(3)
                if p < 0.0:
                    p = 0.0
    return s, plastic_strain, damage, p, c
