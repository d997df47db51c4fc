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
from ..core.tensors import double_dot
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
def rotated(s_xx, s_yy, s_zz, s_xy, s_xz, s_yz, a_x, a_y, a_z):
    """Rotate a symmetric tensor by Cayley's rotation of the half-angle vector `a` (dt/2 times the spin)."""
    if a_x == 0.0 and a_y == 0.0:
        scale = 1.0 / (1.0 + a_z * a_z)
        cosine, sine = (1.0 - a_z * a_z) * scale, 2.0 * a_z * scale
        cc, ss, cs = cosine * cosine, sine * sine, cosine * sine
        return (
            cc * s_xx + ss * s_yy - 2.0 * cs * s_xy,
            ss * s_xx + cc * s_yy + 2.0 * cs * s_xy,
            s_zz,
            cs * (s_xx - s_yy) + (cc - ss) * s_xy,
            cosine * s_xz - sine * s_yz,
            sine * s_xz + cosine * s_yz,
        )
    square = a_x * a_x + a_y * a_y + a_z * a_z
    scale = 2.0 / (1.0 + square)
    diagonal = 1.0 - scale * square
    r_xx, r_yy, r_zz = (
        diagonal + scale * a_x * a_x,
        diagonal + scale * a_y * a_y,
        diagonal + scale * a_z * a_z,
    )
    r_xy, r_yx = scale * (a_x * a_y - a_z), scale * (a_x * a_y + a_z)
    r_xz, r_zx = scale * (a_x * a_z + a_y), scale * (a_x * a_z - a_y)
    r_yz, r_zy = scale * (a_y * a_z - a_x), scale * (a_y * a_z + a_x)
    t_xx, t_xy, t_xz = (
        r_xx * s_xx + r_xy * s_xy + r_xz * s_xz,
        r_xx * s_xy + r_xy * s_yy + r_xz * s_yz,
        r_xx * s_xz + r_xy * s_yz + r_xz * s_zz,
    )
    t_yx, t_yy, t_yz = (
        r_yx * s_xx + r_yy * s_xy + r_yz * s_xz,
        r_yx * s_xy + r_yy * s_yy + r_yz * s_yz,
        r_yx * s_xz + r_yy * s_yz + r_yz * s_zz,
    )
    t_zx, t_zy, t_zz = (
        r_zx * s_xx + r_zy * s_xy + r_zz * s_xz,
        r_zx * s_xy + r_zy * s_yy + r_zz * s_yz,
        r_zx * s_xz + r_zy * s_yz + r_zz * s_zz,
    )
    return (
        t_xx * r_xx + t_xy * r_xy + t_xz * r_xz,
        t_yx * r_yx + t_yy * r_yy + t_yz * r_yz,
        t_zx * r_zx + t_zy * r_zy + t_zz * r_zz,
        t_xx * r_yx + t_xy * r_yy + t_xz * r_yz,
        t_xx * r_zx + t_xy * r_zy + t_xz * r_zz,
        t_yx * r_zx + t_yy * r_zy + t_yz * r_zz,
    )


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
def respond(
    table,
    models,
    m,
    dt,
    rho,
    e,
    s_xx,
    s_yy,
    s_zz,
    s_xy,
    s_xz,
    s_yz,
    plastic_strain,
    damage,
    l_xx,
    l_xy,
    l_xz,
    l_yx,
    l_yy,
    l_yz,
    l_zx,
    l_zy,
    l_zz,
):
    """Advance a particle's stress by `dt`.

    Parameters
    ----------
    table, models, m
        Packed materials and the row of this one, uint64.
    dt
        Time step [s]; with zero an admissible deviator comes back as it was.
    rho, e
        Density [kg/m^3] and specific internal energy [J/kg] at the end of the step.
    s_xx ... s_yz
        Deviator [Pa] at its start.
    plastic_strain, damage
        Equivalent plastic strain and damage at its start.
    l_xx ... l_zz
        Velocity gradient [1/s], best at the middle of the step; l_xy = du_x/dy.

    Returns
    -------
    The deviator [Pa], plastic strain, damage, pressure [Pa] and bulk sound speed [m/s].
    """
    row = parameters(table, m)
    strength, damage_tag = models[m, STRENGTH_TAG], models[m, DAMAGE_TAG]
    felt = 0.0 if damage_tag == _FAILURE_MARK else damage
    p, c = _equilibrium(models[m, EOS_TAG], rho, e, felt, row)
    if strength == _NO_STRENGTH or felt >= 1.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, plastic_strain, damage, p, c

    shear = row[SHEAR_MODULUS]
    half = 0.5 * dt
    s_xx, s_yy, s_zz, s_xy, s_xz, s_yz = rotated(
        s_xx,
        s_yy,
        s_zz,
        s_xy,
        s_xz,
        s_yz,
        0.5 * half * (l_zy - l_yz),
        0.5 * half * (l_xz - l_zx),
        0.5 * half * (l_yx - l_xy),
    )
    third = (l_xx + l_yy + l_zz) * (1.0 / 3.0)
    d_xx, d_yy, d_zz = l_xx - third, l_yy - third, l_zz - third
    d_xy, d_xz, d_yz = 0.5 * (l_xy + l_yx), 0.5 * (l_xz + l_zx), 0.5 * (l_yz + l_zy)
    stiffness = 2.0 * shear * dt
    s_xx += stiffness * d_xx
    s_yy += stiffness * d_yy
    s_zz += stiffness * d_zz
    s_xy += stiffness * d_xy
    s_xz += stiffness * d_xz
    s_yz += stiffness * d_yz
    if strength == _ELASTIC:
        return s_xx, s_yy, s_zz, s_xy, s_xz, s_yz, plastic_strain, damage, p, c

    factor = 1.0
    strain_rate = 0.0
    homologous = 0.0
    fails = damage_tag == _JOHNSON_COOK_DAMAGE or (damage_tag == _FAILURE_MARK and damage < 1.0)
    if fails or strength == _JOHNSON_COOK:
        square = double_dot(d_xx, d_yy, d_zz, d_xy, d_xz, d_yz, d_xx, d_yy, d_zz, d_xy, d_xz, d_yz)
        strain_rate = sqrt((2.0 / 3.0) * square)
        homologous = homologous_temperature(e, row)
        if strength == _JOHNSON_COOK:
            factor = johnson_cook.rate_and_heat_factor(strain_rate, homologous, row)
    flow = yield_stress(strength, plastic_strain, factor, row)
    trial_squared = 1.5 * double_dot(s_xx, s_yy, s_zz, s_xy, s_xz, s_yz, s_xx, s_yy, s_zz, s_xy, s_xz, s_yz)
    if trial_squared > flow * flow * _ON_THE_SURFACE:
        trial = sqrt(trial_squared)
        excess = trial - flow
        increment = excess / (3.0 * shear)
        hardening = yield_stress(strength, plastic_strain + increment, factor, row) - flow
        increment *= excess / (excess + hardening)
        reached = trial - 3.0 * shear * increment
        shrink = reached / trial
        s_xx *= shrink
        s_yy *= shrink
        s_zz *= shrink
        s_xy *= shrink
        s_xz *= shrink
        s_yz *= shrink
        plastic_strain += increment
        if fails:
            damage += increment / damage_model.fracture_strain(p, reached, strain_rate, homologous, row)
            if damage >= 1.0:
                damage = 1.0
            if damage >= 1.0 and damage_tag == _JOHNSON_COOK_DAMAGE:
                s_xx = s_yy = s_zz = s_xy = s_xz = s_yz = 0.0
                if p < 0.0:
                    p = 0.0
    return s_xx, s_yy, s_zz, s_xy, s_xz, s_yz, plastic_strain, damage, p, c
