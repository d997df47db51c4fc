"""Tensile and shear strength across a plane: limits of the traction between particles.

tension  -p_least + |S|. p_least is the lowest pressure of the material at its damage: 0 for gases and failed material,
         the pressure cut-off, the residual tensile strength of crushed ceramic; without limit for other material.
shear    Y / sqrt(3), 0 for failed material; without limit where there is no yield stress.

From the onset of fracture to failure the limits are (1 - d) p_0 + |S| and (1 - d) Y_0/sqrt(3), of the weaker side of a
pair.
"""

from math import sqrt

from hvisph.compiler.jit import inline
from hvisph.compiler.tensors import add_identity, divergence, double_dot
from hvisph.compiler.tensors3d import symmetric_part
from hvisph.materials.damage.johnson_cook import SOFTENING
from hvisph.materials.tags import FURTHER

from . import tags
from .damage.fracture_energy import ONSET, TENSION, YIELD
from .slots import DAMAGE_TAG, DISTENSION, EOS_TAG, FAILED_FRICTION, FRACTURE_COMPLIANCE, RHO0, STRENGTH_TAG, parameters
from .thermodynamics import flow_stress, least_pressure

UNLIMITED = 1e300  # stands for no limit [Pa]
DISORDER = 0.2  # plastic strain beyond which the particles of a body are no lattice


@inline
def has_failed(table, models, m, damage):
    """Return whether damage has reduced the stress to pressure alone."""
    if damage < 1.0 or table[m, FAILED_FRICTION] != 0.0:
        return False
    return models[m, STRENGTH_TAG] != tags.ROCK and models[m, STRENGTH_TAG] != tags.JOHNSON_HOLMQUIST


@inline
def bearable_tension(table, models, m, s, damage):
    """Return the largest normal traction [Pa] at the deviator `s`, six components [Pa]."""
    deviator = sqrt(double_dot(s, s))
    if models[m, EOS_TAG] in (tags.IDEAL_GAS, tags.JWL):
        return deviator
    return deviator - least_pressure(models[m, DAMAGE_TAG], damage, parameters(table, m))


@inline
def bearable_shear(table, models, m, rho, e, p, s, plastic_strain, flowed, damage, l):
    """Return the largest shear traction [Pa] of the state at the full velocity gradient `l` [1/s].

    `flowed` says that its plastic strain has just grown: sound Johnson-Cook metal is on its yield surface then.
    """
    harm = models[m, DAMAGE_TAG]
    plain = harm < tags.JOHNSON_COOK_DAMAGE or (harm == tags.JOHNSON_COOK_DAMAGE and table[m, SOFTENING] == 0.0)
    plain = plain and models[m, STRENGTH_TAG] == tags.JOHNSON_COOK and not table[m, DISTENSION] > 1.0
    if plain and flowed and damage < 1.0:
        return sqrt(0.5 * double_dot(s, s))
    d = add_identity(symmetric_part(l), divergence(l) * (-1.0 / 3.0))
    rate = sqrt((2.0 / 3.0) * double_dot(d, d))
    flow = flow_stress(table, models, m, rho, e, p, plastic_strain, damage, rate)[0]
    return flow / sqrt(3.0) if flow < UNLIMITED else UNLIMITED


@inline
def acting_damage(table, m, damage, history):
    """Return the damage that reduces the yield stress: before onset the measure of onset."""
    if FURTHER and table[m, FRACTURE_COMPLIANCE] > 0.0 and history[ONSET] < 1.0:
        return history[ONSET]
    return damage


@inline
def softened_limits(table, m, tension, shear, s, damage, history):
    """Return limits of normal and shear traction [Pa], softened by fracture from its onset on, and the damage since."""
    soft = 0.0
    if FURTHER and table[m, FRACTURE_COMPLIANCE] > 0.0 and history[TENSION] > 0.0:
        left, soft = 1.0 - damage, damage
        tension = min(tension, left * history[TENSION] + sqrt(2.0 / 3.0 * double_dot(s, s)))
        shear = min(shear, left * history[YIELD] / sqrt(3.0))
    return tension, shear, soft


@inline
def orderly(models, m, plastic_strain):
    """Return 1 of a solid that has not flowed, falling to 0 with plastic strain; 0 of a liquid."""
    if models[m, STRENGTH_TAG] == tags.NO_STRENGTH:
        return 0.0
    return max(1.0 - plastic_strain / DISORDER, 0.0)


@inline
def density_at_rest(table, m):
    """Return the density [kg/m^3] at the start, with its pores."""
    return table[m, RHO0] / table[m, DISTENSION]
