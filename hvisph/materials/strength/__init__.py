"""Strength models, and the compiled selection among them."""

from math import inf

from hvisph.compiler.jit import inline, noinline
from hvisph.materials import tags
from hvisph.materials.slots import (
    INVERSE_HEAT_CAPACITY,
    INVERSE_MELT_RANGE,
    INVERSE_RHO0,
    MELT_LAW,
    ROOM_TEMPERATURE,
    TOTAL_ENERGY,
    Model,
)
from hvisph.materials.tags import FURTHER

from . import (
    cowper_symonds,
    johnson_cook,
    johnson_holmquist,
    linear_hardening,
    rock,
    steinberg,
    von_mises,
    zerilli_armstrong,
)
from .cowper_symonds import CowperSymonds
from .elastic import ElasticStrength, NoStrength
from .fabric import Fabric
from .johnson_cook import JohnsonCook
from .johnson_holmquist import JohnsonHolmquist
from .linear_hardening import LinearHardening
from .orthotropic import Orthotropic
from .rock import Rock
from .steinberg import SteinbergGuinan, SteinbergLund
from .von_mises import VonMises
from .zerilli_armstrong import ZerilliArmstrong

REGISTRY: dict[str, type[Model]] = {
    model.name: model
    for model in (
        *(NoStrength, ElasticStrength, VonMises, LinearHardening, JohnsonCook),
        *(SteinbergGuinan, SteinbergLund, ZerilliArmstrong, CowperSymonds, Rock, JohnsonHolmquist),
        *(Orthotropic, Fabric),
    )
}


@inline
def homologous_temperature(e, temperature, melt, row):
    """Homologous temperature (T - T_room)/(T_melt - T_room), held in [0, 1]; 0 where no melting point is known."""
    if row[MELT_LAW] == 0.0:
        if row[TOTAL_ENERGY] > 0.0:
            return min(max(e, 0.0) * row[INVERSE_HEAT_CAPACITY] * row[INVERSE_MELT_RANGE], 1.0)
        return min(max(temperature - row[ROOM_TEMPERATURE], 0.0) * row[INVERSE_MELT_RANGE], 1.0)
    if melt == inf:
        return 0.0
    return min(max((temperature - row[ROOM_TEMPERATURE]) / (melt - row[ROOM_TEMPERATURE]), 0.0), 1.0)


@inline
def shear_share(tag, rho, p, temperature, melt, row):
    """Shear modulus over that at rest. Rock and ceramic that have been drawn apart bear it on what they fill."""
    if tag in (tags.STEINBERG_GUINAN, tags.STEINBERG_LUND):
        return steinberg.shear_share(rho, p, temperature, melt, row)
    if tag in (tags.ROCK, tags.JOHNSON_HOLMQUIST):
        return min(rho * row[INVERSE_RHO0], 1.0)
    return 1.0


@noinline
def _conditions_of_rare_models(tag, rho, e, p, temperature, melt, rate, damage, row):
    """Return the result of `conditions` for the rare models."""
    share = shear_share(tag, rho, p, temperature, melt, row)
    if tag in (tags.STEINBERG_GUINAN, tags.STEINBERG_LUND):
        thermal = 0.0
        if tag == tags.STEINBERG_LUND:
            thermal = share * steinberg.thermal_stress(rate, temperature, row)
        return share, thermal, share
    if tag == tags.ZERILLI_ARMSTRONG:
        return zerilli_armstrong.heat(rate, temperature, melt, row)
    if tag == tags.COWPER_SYMONDS:
        return cowper_symonds.rate_factor(rate, row), 0.0, share
    if tag == tags.ROCK:
        return 0.0, rock.yield_stress(p, e, temperature, melt, damage, row), share
    return 0.0, johnson_holmquist.yield_stress(p, rate, damage, row), share


@inline
def conditions(tag, rho, e, p, temperature, melt, homologous, rate, logged, damage, row):
    """Return the coefficients of the yield stress, constant during a return: Y = hardened(eps_p) factor + offset.

    `tag`: of the strength model.
    `rho`, `e`, `p`, `temperature`, `melt`, `homologous`: state: density, energy, pressure, temperature, melting and
        homologous temperature.
    `rate`, `logged`, `damage`: equivalent strain rate [1/s], its natural logarithm, and damage.
    `row`: the material's parameters.

    Returns factor [-], offset [Pa], and the shear modulus over that at rest [-].
    """
    if tag == tags.JOHNSON_COOK:
        return johnson_cook.rate_and_heat_factor(logged, homologous, row), 0.0, 1.0
    if FURTHER and tag > tags.JOHNSON_COOK:
        return _conditions_of_rare_models(tag, rho, e, p, temperature, melt, rate, damage, row)
    return 1.0, 0.0, 1.0


@noinline
def _further_yield(tag, plastic_strain, factor, offset, row):
    """Return the result of `yield_stress` for the rare models."""
    if tag in (tags.STEINBERG_GUINAN, tags.STEINBERG_LUND):
        return steinberg.work_hardened(plastic_strain, row) * factor + offset
    if tag == tags.ZERILLI_ARMSTRONG:
        return zerilli_armstrong.yield_stress(plastic_strain, factor, offset, row)
    if tag == tags.COWPER_SYMONDS:
        return linear_hardening.yield_stress(plastic_strain, row) * factor
    return offset


@inline
def yield_stress(tag, plastic_strain, factor, offset, row):
    """Yield stress [Pa] of a model that has one, with what `conditions` found."""
    if tag == tags.VON_MISES:
        return von_mises.yield_stress(row)
    if tag == tags.LINEAR_HARDENING:
        return linear_hardening.yield_stress(plastic_strain, row)
    if tag == tags.JOHNSON_COOK:
        return johnson_cook.yield_stress(plastic_strain, factor, row)
    if FURTHER:
        return _further_yield(tag, plastic_strain, factor, offset, row)
    return offset


@inline
def hardening(tag, increment, plastic_strain, flow, factor, offset, filled, row):
    """Growth of the yield stress [Pa] from `flow` with an increment of the plastic strain, on the share `filled`."""
    if tag == tags.JOHNSON_COOK:
        return johnson_cook.hardening(increment, plastic_strain, flow, factor * filled, row)
    return yield_stress(tag, plastic_strain + increment, factor, offset, row) * filled - flow
