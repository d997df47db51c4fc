"""Equations of state, and the compiled selection among them."""

import sys
from math import sqrt

from hvisph.compiler.jit import inline, noinline
from hvisph.materials import tags
from hvisph.materials.eos.linear import Elastic
from hvisph.materials.slots import SOUND_SPEED_SQUARED_FLOOR, EquationOfState
from hvisph.materials.tags import FURTHER

from . import (
    ideal_gas,
    jwl,
    late,
    linear,
    mie_gruneisen,
    murnaghan,
    polynomial,
    stiffened_gas,
    table,
    tillotson,
    us_up_table,
)
from .grid import Grid as Grid
from .grid import read_grid as read_grid
from .ideal_gas import IdealGas
from .jwl import JonesWilkinsLee
from .late import Late
from .linear import Linear
from .mie_gruneisen import MieGrueneisen
from .murnaghan import Murnaghan
from .polynomial import Polynomial
from .stiffened_gas import StiffenedGas
from .table import Table
from .table_files import check_units as check_units
from .table_files import read_table as read_table
from .tillotson import Tillotson
from .us_up_table import UsUpTable

REGISTRY: dict[str, type[EquationOfState]] = {
    model.name: model
    for model in (
        *(Linear, Elastic, StiffenedGas, MieGrueneisen, IdealGas),
        *(Tillotson, Polynomial, Murnaghan, JonesWilkinsLee, Table, UsUpTable),
    )
}
# Where each model's functions are: `pressure` and `sound_speed_squared`, or `state` with all in one.
MODULES = {name: sys.modules[model.__module__] for name, model in REGISTRY.items()} | {Late.name: late}


@noinline
def _state_of_rare_models(tag, rho, e, row):
    """Return pressure [Pa] and squared sound speed [m^2/s^2] of the rare models."""
    if tag == tags.POLYNOMIAL:
        p, p_rho, p_e = polynomial.state(rho, e, row)
    elif tag == tags.MURNAGHAN:
        p, p_rho, p_e = murnaghan.state(rho, e, row)
    elif tag == tags.JWL:
        p, p_rho, p_e = jwl.state(rho, e, row)
    elif tag == tags.US_UP_TABLE:
        p, p_rho, p_e = us_up_table.state(rho, e, row)
    elif tag == tags.LATE:
        p, p_rho, p_e = late.state(rho, e, row)
    else:
        p, p_rho, p_e = table.state(rho, e, row)
    return p, p_rho + p * p_e / (rho * rho)


@inline
def pressure_and_sound_speed(tag, rho, e, row):
    """Pressure [Pa] and bulk sound speed [m/s] of the model `tag`, with parameters `row`.

    The square of the sound speed is held above the material's floor, a hundredth of the
    ambient one, so that unstable states of deep tension still have a time step. Values that
    are not numbers pass through.
    """
    if tag == tags.STIFFENED_GAS:
        p = stiffened_gas.pressure(rho, e, row)
        c_squared = stiffened_gas.sound_speed_squared(rho, e, p, row)
    elif tag == tags.MIE_GRUENEISEN:
        p = mie_gruneisen.pressure(rho, e, row)
        c_squared = mie_gruneisen.sound_speed_squared(rho, e, p, row)
    elif tag == tags.IDEAL_GAS:
        p = ideal_gas.pressure(rho, e, row)
        c_squared = ideal_gas.sound_speed_squared(rho, e, p, row)
    elif FURTHER and tag == tags.TILLOTSON:
        p, p_rho, p_e = tillotson.state(rho, e, row)
        c_squared = p_rho + p * p_e / (rho * rho)
    elif FURTHER and tag >= tags.POLYNOMIAL:
        p, c_squared = _state_of_rare_models(tag, rho, e, row)
    else:  # linear and elastic are one law
        p = linear.pressure(rho, e, row)
        c_squared = linear.sound_speed_squared(rho, e, p, row)
    if c_squared < row[SOUND_SPEED_SQUARED_FLOOR]:
        c_squared = row[SOUND_SPEED_SQUARED_FLOOR]
    return p, sqrt(c_squared)
