"""What a material bears at most across a plane: the limits of a traction between particles.

tension  -p_min + |S|  with a pressure cut-off,  0 of a gas and of failed material,  else without limit
shear    Y / sqrt(3),  0 of failed material,  without limit where nothing yields
"""

from __future__ import annotations

from math import sqrt

from ..core.jit import compiled
from ..core.tensors import divergence, double_dot, plus_identity, stretching
from .damage import FailureMark
from .eos.ideal_gas import IdealGas
from .slots import DAMAGE_TAG, EOS_TAG, PRESSURE_MINIMUM, STRENGTH_TAG, parameters
from .strength import ElasticStrength, JohnsonCook, NoStrength, homologous_temperature, johnson_cook, yield_stress

_GAS = IdealGas.tag
_NO_STRENGTH = NoStrength.tag
_ELASTIC = ElasticStrength.tag
_JOHNSON_COOK = JohnsonCook.tag
_FAILURE_MARK = FailureMark.tag

# Stands for no limit [Pa].
UNLIMITED = 1e300
# Plastic strain beyond which the particles of a body are no lattice.
DISORDER = 0.2


@compiled
def failed(models, m, damage):
    """Whether `damage` has left the material without stress but pressure."""
    return damage >= 1.0 and models[m, DAMAGE_TAG] != _FAILURE_MARK


@compiled
def bearable_tension(table, models, m, s, damage):
    """Return the largest normal traction [Pa] at the deviator `s`, six components [Pa]."""
    if models[m, EOS_TAG] == _GAS or failed(models, m, damage):
        return sqrt(double_dot(s, s))
    least = table[m, PRESSURE_MINIMUM]
    return sqrt(double_dot(s, s)) - least if least > -UNLIMITED else UNLIMITED


@compiled
def bearable_shear(table, models, m, e, plastic_strain, damage, l):
    """Return the largest shear traction [Pa] at energy `e` [J/kg] and the full velocity gradient `l` [1/s]."""
    if failed(models, m, damage):
        return 0.0
    strength = models[m, STRENGTH_TAG]
    if strength == _NO_STRENGTH:
        return UNLIMITED
    if strength == _ELASTIC:
        return UNLIMITED
    row = parameters(table, m)
    factor = 1.0
    if strength == _JOHNSON_COOK:
        d = plus_identity(stretching(l), divergence(l) * (-1.0 / 3.0))
        rate = sqrt((2.0 / 3.0) * double_dot(d, d))
        factor = johnson_cook.rate_and_heat_factor(rate, homologous_temperature(e, row), row)
    return yield_stress(strength, plastic_strain, factor, row) / sqrt(3.0)


@compiled
def orderly(models, m, plastic_strain):
    """Return 1 of a solid that has not flowed, falling to 0 with plastic strain; 0 of a liquid."""
    if models[m, STRENGTH_TAG] == _NO_STRENGTH:
        return 0.0
    return max(1.0 - plastic_strain / DISORDER, 0.0)
