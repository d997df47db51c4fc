"""State of a material: pressure limited by tensile strength, speeds, temperature, modulus, flow stress."""

from math import inf, log, nan, sqrt

from hvisph.compiler.jit import inline, noinline
from hvisph.materials.damage.johnson_cook import borne_share
from hvisph.materials.damage.pressure_cutoff import limited_pressure
from hvisph.materials.eos.jwl import BURN_RATE
from hvisph.materials.eos.late import late_state
from hvisph.materials.strength.fabric import packing
from hvisph.materials.strength.johnson_holmquist import TENSION
from hvisph.materials.tags import FURTHER

from . import tags
from .eos import pressure_and_sound_speed
from .isentrope import temperature
from .melting import melt_temperature
from .porosity import load_pores
from .slots import (
    DAMAGE_TAG,
    DISTENSION,
    EOS_TAG,
    FAILED_FRICTION,
    INVERSE_HEAT_CAPACITY,
    KEEPS_STRESS,
    RHO0,
    SHEAR_MODULUS,
    STRENGTH_TAG,
    parameters,
)
from .strength import conditions, homologous_temperature, shear_share, yield_stress

_LEAST_RATE = 1e-300  # least strain rate in a logarithm [1/s]
# To find a density: halvings of a bracket, and how often it may be widened to hold one.
_HALVINGS, _WIDENINGS = 40, 20


@inline
def effective_damage(damage, row):
    """Return the effective damage, which reduces the stress: 0 where a failed particle keeps its stress."""
    return 0.0 if row[FAILED_FRICTION] == KEEPS_STRESS else damage


@inline
def damaged_pressure(damage_tag, p, effective, row):
    """Return the pressure [Pa] limited by the tensile strength, reduced by the `effective` damage."""
    p = limited_pressure(p, row)
    if p < 0.0:
        if effective >= 1.0:
            return 0.0
        if FURTHER and damage_tag == tags.GRADY_KIPP:
            return (1.0 - effective) * p
        if FURTHER and damage_tag == tags.CRUSHING:
            return max(p, -row[TENSION] * (1.0 - effective))
    return p


@inline
def least_pressure(damage_tag, damage, row):
    """Lowest pressure [Pa] that the material bears at its damage: -1e300 where nothing limits its tension."""
    return damaged_pressure(damage_tag, -1e300, effective_damage(damage, row), row)


@inline
def solid_pressure(tag, rho, e, history, row):
    """Pressure [Pa] before any limit, bulk sound speed [m/s], and the first history variable."""
    if FURTHER and row[DISTENSION] > 1.0:
        return load_pores(tag, rho, e, history, row)
    if FURTHER and tag == tags.LATE:
        p, c = late_state(rho, history, row)
        return p, c, history
    p, c = pressure_and_sound_speed(tag, rho, e, row)
    if FURTHER and tag == tags.JWL and row[BURN_RATE] > 0.0:
        p *= min(max(history * row[BURN_RATE], 0.0), 1.0)
    return p, c, history


@inline
def state_with_history(table, models, m, rho, e, damage, history):
    """Pressure [Pa] and bulk sound speed [m/s] of a particle with its first history variable, `history`."""
    row, damage_tag = parameters(table, m), models[m, DAMAGE_TAG]
    p, c, _ = solid_pressure(models[m, EOS_TAG], rho, e, history, row)
    if FURTHER and damage_tag == tags.CRUSHING:
        p += history
    return damaged_pressure(damage_tag, p, effective_damage(damage, row), row), c


@inline
def equilibrium_state(table, models, m, rho, e, damage):
    """Pressure [Pa] and bulk sound speed [m/s], with tension cut off and taken from failed material.

    The sound speed is that of the equation of state before any cut: the stiffer one, so
    that time steps stay on the safe side.
    """
    row = parameters(table, m)
    p, c = pressure_and_sound_speed(models[m, EOS_TAG], rho, e, row)
    return damaged_pressure(models[m, DAMAGE_TAG], p, effective_damage(damage, row), row), c


@noinline
def between_voids(tag, rho, e, p, row):
    """Density [kg/m^3] of intact material at the pressure `p` [Pa], at most zero, whose mean density is `rho`.

    Where less tension is borne than the equation of state has at `rho`, voids have opened, and what lies between them
    is as dense as `p` says.
    """
    if p > 0.0 or pressure_and_sound_speed(tag, rho, e, row)[0] >= p:
        return rho
    low, high = rho, max(rho, row[RHO0])
    for _ in range(_WIDENINGS):
        if pressure_and_sound_speed(tag, high, e, row)[0] >= p:
            break
        high *= 1.05
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if pressure_and_sound_speed(tag, middle, e, row)[0] < p:
            low = middle
        else:
            high = middle
    return high


@inline
def temperature_of(table, models, m, rho, e, p, history):
    """Temperature [K] of a particle that bears the pressure `p` [Pa]; not a number without a heat capacity.

    `history` is its first history variable. Failed material, or material at its cut-off, holds no cold tension at
    any density: its temperature is that of the matter between the voids.
    """
    row = parameters(table, m)
    if not row[INVERSE_HEAT_CAPACITY] > 0.0:
        return nan
    if FURTHER and row[DISTENSION] > 1.0:
        rho, p = rho * history, p * history
    return temperature(between_voids(models[m, EOS_TAG], rho, e, p, row), e, row)


@inline
def _of_the_solid(rho, row):
    """Density [kg/m^3] of the solid between pores: that at rest or denser, less where more than the pores opened."""
    return min(rho * row[DISTENSION], max(rho, row[RHO0]))


@inline
def shear_modulus(table, models, m, rho, e, p):
    """Shear modulus [Pa] of the current state."""
    strength = models[m, STRENGTH_TAG]
    if not FURTHER or strength <= tags.JOHNSON_COOK or strength == tags.ORTHOTROPIC:
        return table[m, SHEAR_MODULUS]
    row = parameters(table, m)
    if strength == tags.FABRIC:
        return row[SHEAR_MODULUS] * packing(rho, row)
    if FURTHER and row[DISTENSION] > 1.0:
        rho = _of_the_solid(rho, row)
    melt = melt_temperature(rho, p, row)
    return row[SHEAR_MODULUS] * shear_share(strength, rho, p, temperature(rho, e, row), melt, row)


@inline
def strength_conditions(strength, rho, e, p, rate, effective, row):
    """Homologous temperature, logarithm of the strain rate, then what `strength.conditions` returns for them."""
    t, melt = temperature(rho, e, row), melt_temperature(rho, p, row)
    homologous = homologous_temperature(e, t, melt, row)
    logged = log(max(rate, _LEAST_RATE))
    factor, offset, share = conditions(strength, rho, e, p, t, melt, homologous, rate, logged, effective, row)
    return homologous, logged, factor, offset, share


@inline
def flow_stress(table, models, m, rho, e, p, plastic_strain, damage, rate):
    """Yield stress [Pa] of the current state at the equivalent strain rate `rate` [1/s], and shear modulus [Pa].

    The yield stress is infinite for an elastic solid and for a fluid, zero for failed material that flows, that of
    friction for rubble, as far as the whole material bears it. Of porous material it is that of the solid at rest or
    denser, an upper limit.
    """
    row, strength = parameters(table, m), models[m, STRENGTH_TAG]
    effective = effective_damage(damage, row)
    shear = row[SHEAR_MODULUS]
    keeps_strength = FURTHER and strength in (tags.ROCK, tags.JOHNSON_HOLMQUIST)
    broken = strength != tags.NO_STRENGTH and effective >= 1.0 and not keeps_strength
    friction = row[FAILED_FRICTION] * max(p, 0.0) if broken else inf
    if strength in (tags.NO_STRENGTH, tags.ELASTIC_STRENGTH) or (FURTHER and strength >= tags.ORTHOTROPIC):
        return friction, shear
    if FURTHER and row[DISTENSION] > 1.0:
        rho = _of_the_solid(rho, row)
    _, _, factor, offset, share = strength_conditions(strength, rho, e, p, rate, effective, row)
    flow = yield_stress(strength, plastic_strain, factor, offset, row)
    if models[m, DAMAGE_TAG] == tags.JOHNSON_COOK_DAMAGE:
        flow *= borne_share(damage, row)
    flow = min(flow, friction)
    cracked = FURTHER and models[m, DAMAGE_TAG] == tags.GRADY_KIPP and not keeps_strength
    return (flow * (1.0 - effective) if cracked and not broken else flow), shear * share


@inline
def longitudinal_speed(c, rho, shear):
    """Speed of longitudinal waves sqrt(c^2 + 4G/(3 rho)) [m/s] at bulk sound speed `c` and shear modulus G."""
    return sqrt(c * c + (4.0 / 3.0) * shear / rho)


@inline
def shear_speed(rho, shear):
    """Speed of shear waves sqrt(G/rho) [m/s]."""
    return sqrt(shear / rho)
