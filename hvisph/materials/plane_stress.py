"""Plane stress: the out-of-plane strain rate that keeps sigma_zz at zero.

In a thin sheet the stress through the thickness vanishes, and the thickness changes. The rate L_zz is found by the
secant method on the stress of `response.respond`, starting from the elastic solution.
"""

from hvisph.compiler.jit import inline
from hvisph.compiler.tensors3d import growth_factor, replace_zz

from .stress_update import respond
from .thermodynamics import equilibrium_state, longitudinal_speed, shear_modulus

# Secant steps at most, and the share of the longitudinal modulus that counts as no stress.
_STEPS = 12
_TOLERANCE = 1e-10


@inline
def thinning(table, models, m, dt, rho, swelling, e, s, plastic_strain, damage, l):
    """Return L_zz [1/s] for which sigma_zz = 0 after a step of `dt` [s], 0 for no step.

    `table`, `models`, `m`: packed materials and the row of this one.
    `rho`: density at the start of the step [kg/m^3].
    `swelling`: in-plane rate of volume [1/s].
    `e`: specific internal energy at its end [J/kg].
    `s`, `plastic_strain`, `damage`: deviator [Pa] (six components), plastic strain and damage at its start.
    `l`: velocity gradient [1/s] (nine components), of which that through the thickness is not read.
    """
    if dt == 0.0:
        return 0.0
    p, c = equilibrium_state(table, models, m, rho, e, damage)
    speed = longitudinal_speed(c, rho, shear_modulus(table, models, m, rho, e, p))
    modulus = rho * speed * speed
    slope = modulus * dt
    rate = -(s[2] - p) / slope - swelling * (1.5 * c * c / (speed * speed) - 0.5)
    before = 0.0
    stress_before = 0.0
    for k in range(_STEPS):
        t = respond(table, models, m, dt, rho * growth_factor(-dt * (swelling + rate)), e, s, plastic_strain, damage,
                    replace_zz(l, rate))  # fmt: skip
        stress = t[0][2] - t[3]
        if abs(stress) <= _TOLERANCE * modulus:
            break
        if k > 0 and rate != before:
            secant = (stress - stress_before) / (rate - before)
            # a sheet is never stiffer than its longitudinal modulus, and never without any stiffness
            slope = min(max(secant, 0.1 * modulus * dt), 2.0 * modulus * dt)
        before, stress_before = rate, stress
        rate -= stress / slope
    return rate
