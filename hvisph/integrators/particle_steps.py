"""Steps of the particle update: load, move, strain and store.

The functions are templates; `PARTS` lists those that a stepper binds.
"""

from collections import namedtuple
from math import pi, sqrt

from hvisph.compiler.jit import inline
from hvisph.compiler.tensors import (
    add,
    divergence,
    dot,
    double_dot,
    multiply,
    put,
    radial_part,
    row_gradient,
    row_vector,
    subtract,
)
from hvisph.compiler.tensors3d import (
    full_gradient,
    growth_factor,
    put_full_symmetric,
    replace_zz,
    row_full_symmetric,
    symmetric_part,
)
from hvisph.sph.terms.viscosity import balsara_share, relaxed_share

# State of a particle: position, velocity, density, specific internal energy, smoothing length, deviator (6), plastic
# strain, damage, history of the models (9, `materials.stress_update`), axes (5, `materials.anisotropic_stress`).
State = namedtuple("State", "x u rho e h s plastic_strain damage history axes")

# Rates of a particle: acceleration, power, velocity gradient in the plane, rate of ln(rho) in addition to its trace,
# hoop strain rate (axisymmetric).
Rates = namedtuple("Rates", "a power l density hoop")

# Quantities that `pack` of a formulation reads: position, velocity, mass in the plane, density, energy, smoothing
# length, pressure, bulk, longitudinal and shear wave speeds, deviator (6), body, radius (axisymmetric), twice the rate
# at which the torque residual per mass is returned (axial), density correction, squares of the longitudinal wave speeds
# by direction; velocity gradient of the previous evaluation, twice the time of the stage (negative in plastic flow).
Packed = namedtuple(
    "Packed", "x u mass rho e h p c c_l c_t s body ring spin density_correction waves gradient_before ahead_twice"
)

# Quantities that `show_limits` of a formulation reads: limits of normal and shear traction, failure, order of the
# lattice, whether h is within its bounds, density at rest, damage past the onset of fracture.
Limits = namedtuple("Limits", "tension shear failed order free at_rest soft")


# Smallest radius over h of an axisymmetric particle; a smaller one is replaced by it.
ON_AXIS = 0.07
# Constants of the signal speed of the hoop stress (`hoop_signal`).
HOOP_SLOPE, HOOP_OFFSET = 0.8, 0.8
# Shares of the viscosity that a particle has: all, or by a published switch.
WHOLE, BALSARA, MORRIS_MONAGHAN = 0, 1, 2


def load_state(state, i):
    """Return particle `i` of the state."""
    zero = min(max(state[i, S_DAMAGE], 0.0), 0.0)  # 0 of the same type as the others
    return State(row_vector(state, i, S_POSITION, DIM), row_vector(state, i, S_VELOCITY, DIM), state[i, S_DENSITY],
                 state[i, S_INTERNAL_ENERGY], state[i, S_SMOOTHING_LENGTH],
                 row_full_symmetric(state, i, S_DEVIATOR, DIM), state[i, S_PLASTIC_STRAIN], state[i, S_DAMAGE],
                 (state[i, S_HISTORY_VARIABLE], state[i, S_FLAW_STRAIN], state[i, S_FLAW_EXPONENT], state[i, S_FLAWS],
                  state[i, S_STRAIN_RATE]) + ((state[i, S_ONSET_DAMAGE], state[i, S_ONSET_FLOW_STRESS],
                  state[i, S_ONSET_TENSION], state[i, S_BAND_WIDTH]) if FRACTURES else (zero, zero, zero, zero))
                 if HAS_HISTORY else NO_HISTORY,
                 (state[i, S_MATERIAL_AXES], state[i, S_MATERIAL_AXES + 1], state[i, S_MATERIAL_AXES + 2],
                  state[i, S_MATERIAL_AXES + 3], state[i, S_FAILURE_MODES])
                 if ANISOTROPIC else NO_AXES)  # fmt: skip


def store(state, i, y):
    """Write particle `i` into the state."""
    put(state, i, S_POSITION, y.x)
    put(state, i, S_VELOCITY, y.u)
    state[i, S_DENSITY] = y.rho
    state[i, S_INTERNAL_ENERGY] = y.e
    state[i, S_SMOOTHING_LENGTH] = y.h
    put_full_symmetric(state, i, S_DEVIATOR, y.s, DIM)
    state[i, S_PLASTIC_STRAIN] = y.plastic_strain
    state[i, S_DAMAGE] = y.damage
    if HAS_HISTORY:
        state[i, S_HISTORY_VARIABLE], state[i, S_FLAW_STRAIN] = y.history[0], y.history[1]
        state[i, S_STRAIN_RATE] = y.history[4]
    if ANISOTROPIC:
        put(state, i, S_MATERIAL_AXES, (y.axes[0], y.axes[1], y.axes[2], y.axes[3]))
        state[i, S_FAILURE_MODES] = y.axes[4]
    if FRACTURES:
        state[i, S_ONSET_DAMAGE], state[i, S_ONSET_FLOW_STRESS] = y.history[5], y.history[6]
        state[i, S_ONSET_TENSION] = y.history[7]


def load_rates(rates, k):
    """Return row `k` of the rates."""
    return Rates(row_vector(rates, k, R_ACCELERATION, DIM), rates[k, R_POWER], row_gradient(rates, k, R_GRADIENT, DIM),
                 rates[k, R_DENSITY] if DENSITY_RATE else 0.0, rates[k, R_HOOP] if AXISYMMETRIC else 0.0)  # fmt: skip


def store_previous(state, i, u, rate):
    """Store the rates of an evaluation, and its velocity `u`, for the next step."""
    put(state, i, S_PREVIOUS_VELOCITY, u)
    put(state, i, S_PREVIOUS_ACCELERATION, rate.a)
    state[i, S_PREVIOUS_POWER] = rate.power
    put(state, i, S_PREVIOUS_GRADIENT, rate.l)
    if DENSITY_RATE:
        state[i, S_PREVIOUS_DENSITY_RATE] = rate.density
    if AXISYMMETRIC:
        state[i, S_PREVIOUS_HOOP_RATE] = rate.hoop


def move(state, i, y, rate, free, pull, u, dt):
    """Advance position, velocity and energy by a step; return the state, velocity gradient, swelling and hoop rate.

    `u` is the velocity of the evaluation, with which power and gradient were found. The step's rates are those of
    the evaluation or, with PREVIOUS, the means of them and of the one before. `free` is 0 of a particle that is held,
    `pull` the acceleration of gravity, whose work is no internal energy.
    """
    a, power, l, density, hoop = rate.a, rate.power, rate.l, rate.density, rate.hoop
    if PREVIOUS:
        previous = row_vector(state, i, S_PREVIOUS_ACCELERATION, DIM)
        a = multiply(0.5, add(a, previous))
        power = 0.5 * (power + state[i, S_PREVIOUS_POWER])
        l = multiply(0.5, add(l, row_gradient(state, i, S_PREVIOUS_GRADIENT, DIM)))
        if DENSITY_RATE:
            density = 0.5 * (density + state[i, S_PREVIOUS_DENSITY_RATE])
        if AXISYMMETRIC:
            hoop = 0.5 * (hoop + state[i, S_PREVIOUS_HOOP_RATE])
    a = multiply(free, add(a, pull) if GRAVITY else a)
    # Mean velocity of the step; the work of the forces at it is what the energy receives.
    mean = add(y.u, multiply(0.5 * dt, a))
    error = dot(rate.a, subtract(mean, u))
    if PREVIOUS:
        error = 0.5 * (error + dot(previous, subtract(mean, row_vector(state, i, S_PREVIOUS_VELOCITY, DIM))))
    y_end = State(add(y.x, multiply(dt, mean)), add(y.u, multiply(dt, a)), y.rho,
                  y.e + dt * (power - error), y.h, y.s, y.plastic_strain, y.damage,
                  y.history, y.axes)  # fmt: skip
    return y_end, l, divergence(l) - density, hoop


def isolated_density(mass, ring, h, thickness):
    """Return the least density [kg/m^3] of particles of `mass`: that of an isolated one, m W(0)."""
    density = ISOLATED_DENSITY * mass / thickness
    for _ in range(DIM):
        density /= h
    return density / (2.0 * pi * ring) if AXISYMMETRIC else density


def strain(y, dt, l, swelling, hoop, rho_min, table, models, m, h_low, h_high):
    """Strain a particle over `dt` at the velocity gradient `l` in the plane and its rate of volume `swelling` there.

    The circumference of an axisymmetric particle grows at the rate `hoop`; its smoothing length follows its section
    area. Density stays above `rho_min`.
    Returns the state, pressure, bulk sound speed, full velocity gradient, and growth of the thickness.
    """
    grad, growth, rho = full_gradient(l), 1.0, y.rho
    if PLANE_STRESS:
        zz = thinning(table, models, m, dt, rho, swelling, y.e, y.s, y.plastic_strain, y.damage, grad)
        grad, growth = replace_zz(grad, zz), growth_factor(dt * zz)
        rho *= growth_factor(-dt * (swelling + zz))
    elif AXISYMMETRIC:
        grad = replace_zz(grad, hoop)
        rho *= growth_factor(-dt * (swelling + hoop))
    else:
        rho *= growth_factor(-dt * swelling)
    if ISOLATED_DENSITY:  # an isolated particle keeps its density, also as it approaches the axis
        rho = max(rho, min(rho_min, y.rho) if AXISYMMETRIC else rho_min)
    h = min(max(y.h * growth_factor(dt * swelling / DIM), h_low), h_high) if VARIABLE_H else y.h
    axes = y.axes
    if ANISOTROPIC:
        s, plastic_strain, damage, p, c, history, axes = update_with_axes(
            table, models, m, dt, rho, y.e, y.s, y.plastic_strain, y.damage, y.history, axes,
            grad)  # fmt: skip
    else:
        s, plastic_strain, damage, p, c, history = update_stress(
            table, models, m, dt, rho, y.e, y.s, y.plastic_strain, y.damage, y.history, grad)  # fmt: skip
    values = history if HAS_HISTORY else NO_HISTORY
    return State(y.x, y.u, rho, y.e, h, s, plastic_strain, damage, values, axes), p, c, grad, growth


def dissipation(y_start, y, l, p, dt):
    """Return plastic work and other dissipation of a particle in a step, per mass [J/kg].

    The energy that its own pressure `p` and deviator did not do, at its strain, came from viscosity, from the fluxes
    of Riemann problems or from friction. `l` is the full velocity gradient, `p` the pressure of the evaluation.
    """
    volume = 2.0 / (y_start.rho + y.rho)
    strain = y.plastic_strain - y_start.plastic_strain
    plastic = volume * strain * sqrt(1.5 * double_dot(y.s, y.s)) if strain > 0.0 else 0.0
    bulk_work = p * (1.0 / y_start.rho - 1.0 / y.rho)
    shear_work = volume * dt * double_dot(multiply(0.5, add(y_start.s, y.s)), symmetric_part(l))
    return plastic, y.e - y_start.e - bulk_work - shear_work


@inline
def ring_radius(x, h):
    """Return the radius of the axisymmetric particle at `x` [m], bounded below near the axis."""
    return max(abs(radial_part(x)), ON_AXIS * h)


@inline
def hoop_signal(h, ring):
    """Return the factor of the signal speed of axisymmetric particles from hoop oscillation near the axis.

    Axisymmetric elastic bodies at rest are stable up to steps c dt/r of 0.86, 0.70 and 0.63 inside, where h/r is 2.4,
    4.8 and 9.6 (c of longitudinal waves), for any spacing: 1/(1.75 (1 - 0.8 r/h)). In the corner of the axis and a free
    face the limit at 2.4 is 0.63 (Poisson's ratios 0 to 0.4). At the Courant number of axisymmetric cases, 0.3, the
    step is a tenth below that.
    """
    return HOOP_SLOPE * (h / ring - HOOP_OFFSET)


def viscous_share(share, l, c, h, dt, coefficients):
    """Return the factor of the viscosity of a particle, from its full velocity gradient."""
    if SWITCH == MORRIS_MONAGHAN:
        return relaxed_share(share, divergence(l), c, h, dt, coefficients[5], coefficients[6])
    return balsara_share(l, c, h)


PARTS = (load_state, store, load_rates, store_previous, move, isolated_density, strain, dissipation, viscous_share)
