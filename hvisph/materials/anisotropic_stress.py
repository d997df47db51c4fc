"""Stress update of materials with directions: orthotropic solids and fabrics.

The axes of a particle are a unit quaternion that turns with the rotation R of the step (`materials.stress_update`),
yarns out of their sheet as material lines.
In material axes T = R_q^T (sigma + p I) R_q does not turn:

    T += (C - K0 I I) : (D_before + D_after)/2 dt,    D_before, D_after  in the axes before and after the step

Failure modes open where sigma = T - p I reaches its strength; then T is rotated back into space. T has six components
and a trace; it takes the place of the deviator. Where the pressure is cut off, or a particle has failed, T is zero.
Where a mode is open, negative pressure is zero: sigma = T then, and K0 is not subtracted.
"""

from math import sqrt

from hvisph.compiler.jit import inline
from hvisph.compiler.tensors import add, add_identity, dot_rows, multiply, no_symmetric, transpose
from hvisph.compiler.tensors3d import curl, quaternion_product, quaternion_rotation, rotate, symmetric_part

from . import tags
from .damage import orthotropic as failure
from .slots import DAMAGE_TAG, EOS_TAG, STRENGTH_TAG, parameters
from .strength import fabric, orthotropic
from .stress_update import half_tangent, spall_damage, update_stress
from .thermodynamics import damaged_pressure, effective_damage, solid_pressure

# The axes of a particle: unit quaternion w, x, y, z, and its open modes, 1 fibre, 2 matrix, 4 delamination, added up.
# These are those of a particle without directions.
NO_AXES = (1.0, 0.0, 0.0, 0.0, 0.0)
# Least square of a speed of waves over that of bulk waves; where C_ii is far below K0 nothing else is left.
_LEAST = 0.01


@inline
def update_with_axes(table, models, m, dt, rho, e, s, plastic_strain, damage, history, axes, l):
    """Advance the stress of a particle by `dt`: `update_stress`, with the axes of materials that have directions.

    Parameters as of `update_stress`, and `axes`, five numbers as `NO_AXES`; returns what it does, and the axes.
    """
    if models[m, STRENGTH_TAG] < tags.ORTHOTROPIC:
        s, plastic_strain, damage, p, c, history = update_stress(
            table, models, m, dt, rho, e, s, plastic_strain, damage, history, l
        )
        return s, plastic_strain, damage, p, c, history, axes
    row, harm = parameters(table, m), models[m, DAMAGE_TAG]
    solid, c, first = solid_pressure(models[m, EOS_TAG], rho, e, history[0], row)
    history = (first,) + history[1:]  # noqa: RUF005 numba takes no stars
    damage = spall_damage(damage, solid, dt, e, row)
    p = damaged_pressure(harm, solid, effective_damage(damage, row), row)
    q, modes = (axes[0], axes[1], axes[2], axes[3]), open_modes(axes[4])
    into = transpose(quaternion_rotation(q))
    d, turn = symmetric_part(l), multiply(0.25 * dt, curl(l))
    if models[m, STRENGTH_TAG] == tags.FABRIC:
        turn = add(turn, _yarn_turn(d, into, 0.5 * dt))
    after = rotate_axes(q, turn)
    out = quaternion_rotation(after)
    strain = multiply(0.5 * dt, add(rotate(d, into), rotate(d, transpose(out))))
    t = rotate(s, into)
    if models[m, STRENGTH_TAG] == tags.FABRIC:
        t, modes = _pull(t, strain, modes, rho, row)
        if modes[0] + modes[1] > 1.0:
            damage = 1.0
    else:
        t = orthotropic.add_strain(t, strain, failure.shear_shares(modes, row), row)
        if p > solid:
            t = no_symmetric(3)
        if harm >= tags.HASHIN:
            t = add_identity(t, row[orthotropic.BULK] * _slack(p, modes) * (strain[0] + strain[1] + strain[2]))
            t, p, modes, damage = _fail(harm, t, p, modes, damage, row)
    if damage >= 1.0:
        t, p = no_symmetric(3), max(p, 0.0)
    number = modes[0] + 2.0 * modes[1] + 4.0 * modes[2]
    return (rotate(t, out), plastic_strain, damage, p, c, history, (after[0], after[1], after[2], after[3], number))


@inline
def rotate_axes(q, a):
    """Return the unit quaternion `q` after the rotation of the half-angle vector `a`."""
    a = half_tangent(a)
    q = quaternion_product((1.0, a[0], a[1], a[2]), q)
    return multiply(1.0 / sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]), q)


@inline
def open_modes(number):
    """Return 1 or 0 of fibre, matrix and delamination from their sum 1, 2, 4."""
    third = 1.0 if number >= 4.0 else 0.0
    rest = number - 4.0 * third
    second = 1.0 if rest >= 2.0 else 0.0
    return rest - 2.0 * second, second, third


@inline
def _yarn_turn(d, into, half_step):
    """Return the half-angle vector by which yarns turn beyond R: both stay in the sheet, a material surface.

    `into` turns into material axes. There R takes axis k out of the sheet at W_3k, yarns at L_3k = W_3k + D_3k.
    """
    own = rotate(d, into)
    return dot_rows(transpose(into), (half_step * own[5], -half_step * own[4], 0.0 * half_step))


@inline
def _pull(t, strain, modes, rho, row):
    """Return T of a fabric after an increment of strain, and its broken yarns."""
    full = fabric.packing(rho, row)
    first, one = fabric.pull_yarn(t[0], strain[0], modes[0], full, row[fabric.E1], row[fabric.X1])
    second, two = fabric.pull_yarn(t[1], strain[1], modes[1], full, row[fabric.E2], row[fabric.X2])
    return (first, second, 0.0, 0.0, 0.0, 0.0), (one, two, 0.0)


@inline
def _slack(p, modes):
    """Return 1 where a mode is open and the volume above that at rest: T alone is the stress then, else 0."""
    return 1.0 if p < 0.0 and modes[0] + modes[1] + modes[2] > 0.0 else 0.0


@inline
def _fail(harm, t, p, modes, damage, row):
    """Return T, pressure, open modes and damage after the criteria of a step."""
    s = add_identity(t, (_slack(p, modes) - 1.0) * p)
    reached = failure.hashin_modes(s, row) if harm == tags.HASHIN else failure.max_stress_modes(s, row)
    first = 1.0 if reached[0] >= 1.0 else modes[0]
    second = 1.0 if reached[1] >= 1.0 else modes[1]
    third = 1.0 if reached[2] >= 1.0 else modes[2]
    before = failure.shear_shares(modes, row)
    modes = (first, second, third)
    left = failure.shear_shares(modes, row)
    # stress of a share of the modulus at the same strain
    lost = (_ratio(left[0], before[0]), _ratio(left[1], before[1]), _ratio(left[2], before[2]))
    slack = _slack(p, modes)
    p = p * (1.0 - slack)
    s = (s[0], s[1], s[2], s[3] * lost[0], s[4] * lost[1], s[5] * lost[2])
    t = add_identity(failure.limit_stress(s, modes, slack, row), p)
    if first * third > 0.0 or (harm == tags.MAX_STRESS and first + second + third > 1.0):
        damage = 1.0
    return t, p, modes, damage


@inline
def _ratio(left, before):
    return left / before if before > 0.0 else 1.0


@inline
def transverse_modulus(table, models, m, shear):
    """Return rho c^2 [Pa] of the fastest shear wave, from the modulus `shear` [Pa] of `thermodynamics`.

    Yarns at the angle w to the normal of a wave pull across it with E_k cos^2 w sin^2 w, together at most (E1 + E2)/4.
    """
    if models[m, STRENGTH_TAG] == tags.ORTHOTROPIC:
        return table[m, orthotropic.SHEAR_GREATEST]
    if models[m, STRENGTH_TAG] == tags.FABRIC:
        one, two = table[m, fabric.E1], table[m, fabric.E2]
        return shear * (one + two) / (3.0 * max(one, two))
    return shear


@inline
def squared_speeds(table, models, m, rho, c, shear, axes):
    """Return M [m^2/s^2], six components: waves along n run at sqrt(n . M . n); `c` is the bulk sound speed [m/s]."""
    strength = models[m, STRENGTH_TAG]
    if strength < tags.ORTHOTROPIC:
        return add_identity(no_symmetric(3), c * c + (4.0 / 3.0) * shear / rho)
    square = c * c
    if strength == tags.FABRIC:
        per_mass = fabric.packing(rho, parameters(table, m)) / rho
        first, second, third = table[m, fabric.E1] * per_mass, table[m, fabric.E2] * per_mass, 0.0 * per_mass
    else:
        first, second, third = (
            table[m, orthotropic.R11] / rho,
            table[m, orthotropic.R22] / rho,
            table[m, orthotropic.R33] / rho,
        )
    least = _LEAST * square
    made = (max(square + first, least), max(square + second, least), max(square + third, least), 0.0, 0.0, 0.0)
    return rotate(made, quaternion_rotation((axes[0], axes[1], axes[2], axes[3])))
