"""Stress update of all formulations: rotation, elasticity, yield, damage, pressure.

    S* = R (S + G dt dev D) R^T + G dt dev D
    S  = S* (q - 3 G d eps_p) / q   where  q = sqrt(3/2 S*:S*) > Y
    D = (L + L^T)/2,  W = (L - L^T)/2,  L_ij = du_i/dx_j

R = exp(dt W) integrates the Jaumann rate dS/dt = 2 G dev D + W.S + S.W^T over a finite step. As an exact rotation it
preserves the stress of a spinning body for any step. Half of the increment is rotated, which makes the update of second
order. R follows in closed form from the axial vector of W (Cayley's form, with the tangent of half the angle); a plane
flow needs its z component only. G is the modulus at the end of the step.

Yield returns radially (von Mises with the full deviator: S:S <= 2/3 Y^2). The plastic strain
increment solves q - 3 G x = Y(eps_p + x) by one secant from the increment without hardening:
exact for perfect plasticity and linear hardening. Where Y is concave (Johnson-Cook) it is above
the solution by second-order terms and leaves the stress on the safe side of the new yield
surface. The strain rate of the models is the equivalent deviatoric one of the step; where `rate_smoothing` N is given,
its running mean, to which a step adds 1/N.

The energy argument contains all work done on the particle, plastic work included; heating by plastic work needs no
term of its own.
"""

from math import inf, sqrt, tan

from hvisph.compiler.jit import inline, noinline
from hvisph.compiler.tensors import (
    add,
    add_identity,
    determinant,
    divergence,
    double_dot,
    matrix,
    multiply,
    no_symmetric,
)
from hvisph.compiler.tensors3d import curl, rotate, rotate_in_plane, rotation, symmetric_part
from hvisph.materials.damage import fracture_energy, grady_kipp, johnson_holmquist, pressure_cutoff, tensile
from hvisph.materials.tags import FURTHER

from . import tags
from .damage import johnson_cook as damage_model
from .damage.fracture_energy import ONSET, TENSION, WIDTH, YIELD
from .slots import (
    DAMAGE_TAG,
    DISTENSION,
    EOS_TAG,
    FAILED_FRICTION,
    FAILS_IN_TENSION,
    FITTED_LENGTH,
    FRACTURE_COMPLIANCE,
    MOLTEN_ENERGY,
    PRESSURE_MINIMUM,
    RATE_WEIGHT,
    SHEAR_MODULUS,
    SPALL_GROWTH,
    STRENGTH_TAG,
    SURE_ENERGY,
    SURE_STRESS,
    parameters,
)
from .strength import hardening, yield_stress
from .strength import johnson_holmquist as ceramic
from .thermodynamics import damaged_pressure, effective_damage, solid_pressure, strength_conditions

# A deviator this close above the yield surface is on it: a return is not repeated for rounding.
_ON_THE_SURFACE = 1.0 + 1e-13
_SMALL_ANGLE_SQUARED = 2.5e-3  # largest half-angle for which the series of the tangent is exact to rounding
# History variables of a particle (`history`), beside plastic strain and damage, where there are none. The first is the
# distension of porous material, the time since ignition of an explosive [s] or the bulking pressure of JH-2 [Pa]; then
# three of flaws, or Grady's limit; the smoothed strain rate [1/s]; and four of a crack (`damage.fracture_energy`).
NO_HISTORY = (1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
_PROBE = 1e-3  # plastic strain over which the slope of the flow stress is found
# The strain rates that a smoothed one is held between [1/s].
_SLOWEST, _FASTEST = 1e-6, 1e9


@inline
def half_tangent(a):
    """Return the axis with the tangent of its length, by which Cayley's rotation has the exact angle."""
    square = a[0] * a[0] + a[1] * a[1] + a[2] * a[2]
    if square < _SMALL_ANGLE_SQUARED:
        series = 1.0 + square * (1.0 / 3.0 + square * (2.0 / 15.0 + square * (17.0 / 315.0 + square * 62.0 / 2835.0)))
        return multiply(series, a)
    angle = sqrt(square)
    return multiply(tan(angle) / angle, a)


@inline
def rotate_by_half_angle(s, a):
    """Rotate six components by the half-angle vector `a` (dt/2 times the spin)."""
    a = half_tangent(a)
    if a[0] == 0.0 and a[1] == 0.0:
        return rotate_in_plane(s, a[2])
    return rotate(s, rotation(a))


@inline
def respond(table, models, m, dt, rho, e, s, plastic_strain, damage, l):
    """Advance the stress of a particle without history variables, otherwise as `update_stress`."""
    s, plastic_strain, damage, p, c, _ = update_stress(
        table, models, m, dt, rho, e, s, plastic_strain, damage, NO_HISTORY, l
    )
    return s, plastic_strain, damage, p, c


@inline
def update_stress(table, models, m, dt, rho, e, s, plastic_strain, damage, history, l):
    """Advance a particle's stress by `dt`.

    `table`, `models`, `m`: packed materials and the row of this one, uint64.
    `dt`: time step [s]; with zero an admissible deviator comes back as it was.
    `rho`, `e`: density [kg/m^3] and specific internal energy [J/kg] at the end of the step.
    `s`: deviator [Pa] at its start: xx, yy, zz, xy, xz, yz.
    `plastic_strain`, `damage`: equivalent plastic strain and damage at its start.
    `history`: nine history variables, see `NO_HISTORY`.
    `l`: velocity gradient [1/s], best at the middle of the step: nine components row by row, xy = du_x/dy.

    Returns the deviator [Pa], plastic strain, damage, pressure [Pa], bulk sound speed [m/s] and history variables.
    """
    row = parameters(table, m)
    strength, damage_tag = models[m, STRENGTH_TAG], models[m, DAMAGE_TAG]
    first = history[0]
    if FURTHER and models[m, EOS_TAG] == tags.JWL:
        first += dt
    solid, c, first = solid_pressure(models[m, EOS_TAG], rho, e, first, row)
    if FURTHER and damage_tag == tags.CRUSHING:
        solid += first
    if FURTHER and row[DISTENSION] > 1.0 and damage_tag == tags.GRADY_KIPP:  # crushing breaks
        damage = max(damage, (row[DISTENSION] - first) / (row[DISTENSION] - 1.0))
    # With a fracture energy `damage` is the measure of onset until the end, and `broken` the damage of the particle.
    breaks, softens = FURTHER and row[FRACTURE_COMPLIANCE] > 0.0, False
    broken, flow_0, tension, softening, least = damage, 0.0, 0.0, 0.0, row[PRESSURE_MINIMUM]
    if breaks:
        damage, flow_0, tension = history[ONSET], history[YIELD], history[TENSION]
        softening = history[WIDTH] * row[FRACTURE_COMPLIANCE]
        softens, least = damage >= 1.0, max(least, -fracture_energy.largest_tension(softening, row))
        broken = fracture_energy.open_crack(broken, solid, divergence(l), dt, tension, softening, rho * c * c)
    if row[SPALL_GROWTH] > 0.0:
        damage = pressure_cutoff.grow_rated_damage(damage, solid, dt, row)
    if row[FAILS_IN_TENSION] > 0.0 and (solid < least or (solid < 0.0 and e > row[MOLTEN_ENERGY])):
        damage = 1.0
    if breaks and row[FAILS_IN_TENSION] > 0.0 and solid < 0.0 and e > row[MOLTEN_ENERGY]:  # a melt takes no energy
        broken, tension = 1.0, 0.0
    limit = history[1]
    if FURTHER and damage_tag == tags.GRADY_SPALL and damage < 1.0:
        damage, limit = _spall(solid, rho, c, divergence(l), limit, row)
    history = (first, limit) + history[2:]  # noqa: RUF005 numba takes no stars
    effective = effective_damage(broken if breaks else damage, row)
    p = damaged_pressure(damage_tag, solid, effective, row)
    if breaks:
        p = fracture_energy.softened_pressure(p, broken, tension)
        history = history[:ONSET] + (damage, flow_0, tension, history[WIDTH])  # noqa: RUF005 numba takes no stars
    friction = row[FAILED_FRICTION]
    keeps_strength = FURTHER and strength in (tags.ROCK, tags.JOHNSON_HOLMQUIST)  # its own strength when broken
    if strength == tags.NO_STRENGTH or (effective >= 1.0 and friction <= 0.0 and not keeps_strength):
        if (
            FURTHER
            and strength == tags.NO_STRENGTH
            and damage < 1.0
            and damage_tag == tags.PRINCIPAL_STRESS
            and -solid >= row[tensile.TENSILE_STRENGTH]
        ):
            damage, p = 1.0, max(p, 0.0)
        return no_symmetric(3), plastic_strain, broken if breaks else damage, p, c, history

    shear, filled = row[SHEAR_MODULUS], 1.0
    if FURTHER and row[DISTENSION] > 1.0:  # the solid's state; its stress acts on its share of a section
        rho, filled = rho * first, 1.0 / first
    d = add_identity(symmetric_part(l), divergence(l) * (-1.0 / 3.0))
    homologous, logged, factor, offset = 0.0, 0.0, 1.0, 0.0
    fails = damage_tag == tags.JOHNSON_COOK_DAMAGE and damage < 1.0
    heated = fails or strength >= tags.JOHNSON_COOK
    strain_rate = sqrt((2.0 / 3.0) * double_dot(d, d)) if heated else 0.0
    smooths = heated and row[RATE_WEIGHT] > 0.0
    if smooths:
        strain_rate = _smooth_rate(strain_rate, history[4], dt, row)
        history = history[:4] + (strain_rate,) + history[5:]  # noqa: RUF005 numba takes no stars
    if FURTHER and heated:  # the modulus may vary
        homologous, logged, factor, offset, share = strength_conditions(
            strength, rho, e, p, strain_rate, effective, row
        )
        shear *= share
    if FURTHER and damage_tag == tags.GRADY_KIPP and effective < 1.0 and not keeps_strength:
        s = multiply(1.0 / (1.0 - effective), s)  # the stress of the part without cracks
    shear *= filled
    if FURTHER and models[m, EOS_TAG] == tags.LATE:  # the matter between pores bears the stress
        filled = history[1]
    if damage_tag == tags.JOHNSON_COOK_DAMAGE:
        filled *= damage_model.borne_share(damage, row)
    half = multiply(shear * dt, d)
    s = add(rotate_by_half_angle(add(s, half), multiply(0.25 * dt, curl(l))), half)
    if shear == 0.0:
        s = no_symmetric(3)
    flow, increment, share = inf, 0.0, 1.0
    rubble = effective >= 1.0 and not keeps_strength
    trial_squared = 1.5 * double_dot(s, s)
    simple = strength == tags.JOHNSON_COOK and not (rubble or smooths or softens or FURTHER)
    # Elastic at any rate: neither temperature nor logarithm are needed. No return here: lanes could not follow it.
    sure = row[SURE_STRESS] * filled
    elastic = simple and e < row[SURE_ENERGY] and trial_squared <= sure * sure
    if heated and not FURTHER and not elastic:
        homologous, logged, factor, offset, _ = strength_conditions(strength, rho, e, p, strain_rate, effective, row)
    if simple and not elastic:  # below its least yield stress no power is needed
        flow = yield_stress(strength, 0.0, factor, offset, row) * filled
    if strength != tags.ELASTIC_STRENGTH and not elastic and (flow == inf or trial_squared > flow * flow):
        flow = yield_stress(strength, plastic_strain, factor, offset, row) * filled
    if softens:
        flow = max((1.0 - broken) * flow_0, min(friction * max(p, 0.0), flow_0))
    if rubble:  # friction, but no more than what it was made of bore
        flow = min(flow, friction * max(p, 0.0))
    if trial_squared > flow * flow * _ON_THE_SURFACE:
        trial = sqrt(trial_squared)
        excess = trial - flow
        increment = excess / (3.0 * shear)
        hardened = 0.0
        if not rubble:
            hardened = hardening(strength, increment, plastic_strain, flow, factor, offset, filled, row)
        if softens:
            hardened = -softening * flow_0 * flow_0 * increment if flow <= (1.0 - broken) * flow_0 else 0.0
            hardened = max(hardened, -fracture_energy.BELOW * excess)
        increment *= excess / (excess + hardened)
        reached = trial - 3.0 * shear * increment
        if softens:
            increment, reached = min(increment, trial / (3.0 * shear)), max(reached, 0.0)
            broken = min(broken + softening * flow_0 * increment, 1.0)
        s = multiply(reached / trial, s)
        plastic_strain += increment
        if breaks and row[FITTED_LENGTH] > 0.0:
            state = (rho, e, p, plastic_strain, strain_rate, effective)
            share = _localised_share(strength, damage_tag, state, damage, reached, history[WIDTH], row)
        if fails:
            damage += increment / damage_model.fracture_strain(p, reached, logged, homologous, row) * share
            damage = min(damage, 1.0)
    if FURTHER and damage_tag > tags.JOHNSON_COOK_DAMAGE and damage < 1.0:
        flowed = (increment * share, flow, strain_rate)
        s, damage, p, first = _damage_by_stress(
            damage_tag, strength, dt, rho, s, solid, p, damage, history, flowed, row
        )
        history = (first,) + history[1:]  # noqa: RUF005 numba takes no stars
    if breaks:
        if damage >= 1.0 and not softens and broken < 1.0:
            state = (rho, e, p, plastic_strain, strain_rate, effective)
            flow_0, tension = _strengths_at_onset(strength, damage_tag, s, state, filled, softening, row)
            trial = sqrt(1.5 * double_dot(s, s))
            if trial > flow_0:
                s = multiply(flow_0 / trial, s)
                plastic_strain += (trial - flow_0) / (3.0 * shear)
        p = fracture_energy.softened_pressure(p, broken, tension)
        history = history[:ONSET] + (damage, flow_0, tension, history[WIDTH])  # noqa: RUF005 numba takes no stars
        damage = broken
    if effective_damage(damage, row) >= 1.0 and not (FURTHER and damage_tag == tags.CRUSHING):
        p = max(p, 0.0)
        if friction == 0.0 and not keeps_strength:
            s = no_symmetric(3)
    return s, plastic_strain, damage, p, c, history


@inline
def spall_damage(damage, solid, dt, e, row):
    """Return the damage after `dt` [s] of the pressure `solid` [Pa] before any limit: 1 below the cut-off."""
    if row[SPALL_GROWTH] > 0.0:
        damage = pressure_cutoff.grow_rated_damage(damage, solid, dt, row)
    if row[FAILS_IN_TENSION] > 0.0 and (solid < row[PRESSURE_MINIMUM] or (solid < 0.0 and e > row[MOLTEN_ENERGY])):
        damage = 1.0
    return damage


@inline
def _smooth_rate(rate, before, dt, row):
    """Return the strain rate [1/s] as an exponential running mean."""
    if dt > 0.0:
        before += row[RATE_WEIGHT] * (rate - before)
    return min(max(before, _SLOWEST), _FASTEST)


@inline
def _flow_at(strength, state, row):
    """Return the undamaged flow stress [Pa]; `state`: density, energy, pressure, plastic strain, rate, damage."""
    rho, e, p, plastic_strain, rate, effective = state
    _, _, factor, offset, _ = strength_conditions(strength, rho, e, p, rate, effective, row)
    return yield_stress(strength, plastic_strain, factor, offset, row)


@noinline
def _strengths_at_onset(strength, damage_tag, s, state, filled, softening, row):
    """Return Y_0 and p_0 [Pa]: a principal stress, or one that never yields, breaks at the stress that it bears."""
    if damage_tag == tags.PRINCIPAL_STRESS or strength == tags.ELASTIC_STRENGTH:
        flow = sqrt(1.5 * double_dot(s, s))
    else:
        flow = _flow_at(strength, state, row) * filled
    return fracture_energy.strengths_at_onset(flow, state[2], softening, row)


@noinline
def _localised_share(strength, damage_tag, state, damage, reached, width, row):
    """Return the factor of plastic strain in the damage: 1 while the flow stress `reached` [Pa] grows with it.

    The flow stress is looked at further along its adiabatic path, with the damage that it would have there.
    """
    rho, e, p, plastic_strain, rate, effective = state
    now = _flow_at(strength, state, row)
    later = _flow_at(strength, (rho, e + _PROBE * reached / rho, p, plastic_strain + _PROBE, rate, effective), row)
    if damage_tag == tags.JOHNSON_COOK_DAMAGE:
        homologous, logged, _, _, _ = strength_conditions(strength, rho, e, p, rate, effective, row)
        grown = _PROBE / damage_model.fracture_strain(p, reached, logged, homologous, row)
        now *= damage_model.borne_share(damage, row)
        later *= damage_model.borne_share(min(damage + grown, 1.0), row)
    return fracture_energy.localised_share(width, row) if later < now else 1.0


@noinline
def _damage_by_stress(damage_tag, strength, dt, rho, s, solid, p, damage, history, flowed, row):
    """Return deviator, damage, pressure and first history variable with the damage of a step, of the models by stress.

    `flowed` is the step's plastic strain, yield stress [Pa] and strain rate [1/s].
    """
    first = history[0]
    increment, flow, rate = flowed
    if damage_tag == tags.CRUSHING:
        if increment > 0.0:
            damage = min(damage + increment / johnson_holmquist.fracture_strain(p, row), 1.0)
            after = ceramic.yield_stress(p, rate, damage, row)
            first = johnson_holmquist.bulking(rho, first, flow, after, row)
        return s, damage, p, first
    greatest, least = _principal(s)
    if damage_tag == tags.COCKCROFT_LATHAM:
        damage = min(damage + max(greatest - p, 0.0) * increment * row[tensile.INVERSE_WORK], 1.0)
    elif damage_tag == tags.PRINCIPAL_STRESS:
        strongest = row[tensile.TENSILE_STRENGTH]
        if FURTHER and row[FRACTURE_COMPLIANCE] > 0.0:
            softening = history[WIDTH] * row[FRACTURE_COMPLIANCE]
            strongest = min(strongest, fracture_energy.largest_tension(softening, row))
        torn = greatest - solid >= strongest
        if torn or 0.5 * (greatest - least) >= row[tensile.SHEAR_STRENGTH]:
            damage = 1.0
    elif damage_tag == tags.GRADY_KIPP:
        if row[grady_kipp.BRITTLE_DUCTILE] > 0.0 and increment > 0.0:
            sheared = grady_kipp.INVARIANT * increment / grady_kipp.failure_strain(p, row)
            damage = min(damage + sheared, 1.0)
        strain = (greatest - solid) * row[grady_kipp.INVERSE_YOUNG]
        damage = grady_kipp.grow_damage(damage, strain, dt, history[1], history[2], history[3], row)
        if strength not in (tags.ROCK, tags.JOHNSON_HOLMQUIST):
            s = multiply(1.0 - damage, s)
        p = damaged_pressure(damage_tag, solid, damage, row)
    return s, damage, p, first


@inline
def _principal(s):
    """Greatest and least eigenvalue [Pa] of the deviator `s`."""
    return tensile.principal_deviators(sqrt(1.5 * double_dot(s, s)), determinant(matrix(s)))


@inline
def _spall(p, rho, c, rate, limit, row):
    """Damage 1 or 0, and Grady's limit [Pa], which is fixed when tension first passes half of it."""
    if p >= 0.0:
        return 0.0, limit
    if limit == 0.0:
        free = tensile.spall_strength(rho, c, rate, row)
        if -p < 0.5 * free:
            return 0.0, 0.0
        limit = free
    return (1.0 if -p >= limit else 0.0), limit
