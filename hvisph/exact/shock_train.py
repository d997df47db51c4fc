"""Waves from a constant piston velocity into a material with strength and phase changes.

    sigma(v) = p(rho, e) + min(4/3 G ln(rho/rho0), 2/3 Y),    e = e_s + (sigma + sigma_s)(v_s - v)/2
    up = sum over the waves of (d sigma d v)^(1/2),    Us of the last = up ahead + v ahead (d sigma/d v)^(1/2)

Compression runs along the upper hull of sigma over the specific volume v: every chord of it is a shock, and what lies
ahead of a chord is faster. A solid sends an elastic wave ahead of its plastic one, up to where that overtakes it; iron
splits once more at its transition. (sigma_s, v_s) is the corner before v, which the shock to v runs into. What
is measured beside an elastic precursor is the last wave: in the laboratory it runs into matter that moves already.

Y is that at a strain rate of `SHOCKED` and the plastic strain of the compression. Steady waves: no relaxation.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import inf, log, sqrt

import numpy as np

from hvisph.compiler.jit import python_twin
from hvisph.materials import thermodynamics
from hvisph.materials.material_table import Material, pack

SHOCKED = 1e6  # strain rate in a shock [1/s]
_FIRST, _GROWTH, _STEP = 2e-5, 1.1, 1.5e-3  # of the compression eta from point to point
_MOST = 0.9  # compression


def last_waves(material: Material, velocities: Sequence[float], strength: bool = True) -> list[float]:
    """Return the speed of the last wave [m/s] behind which matter moves with each of the particle velocities [m/s].

    Parameters
    ----------
    material
        The material, without pores.
    velocities
        Particle velocities [m/s], above zero.
    strength
        Whether its strength counts.

    Returns
    -------
    Speeds in the laboratory; not a number beyond where the material's models end.
    """
    ups, speeds = _integrate_wave(
        _stress(material, strength and material.shear_modulus > 0.0), material, max(velocities)
    )
    return [float(np.interp(up, ups, speeds, right=np.nan)) for up in velocities]


def _stress(material: Material, strength: bool) -> Callable[[float, float], float]:
    """Return the stress [Pa] of density and energy along uniaxial compression."""
    pressure, rho0 = material.pressure_function(), material.density
    if not strength:
        return pressure
    table, models = pack([material])
    flow = python_twin(thermodynamics.flow_stress)

    def stress(rho: float, e: float) -> float:
        p, strain = pressure(rho, e), log(rho / rho0)
        y, shear = flow(table, models, 0, rho, e, p, 2.0 / 3.0 * strain, 0.0, SHOCKED)
        return float(p + min(4.0 / 3.0 * shear * strain, 2.0 / 3.0 * y))

    return stress


def _integrate_wave(
    stress: Callable[[float, float], float], material: Material, highest: float
) -> tuple[list[float], list[float]]:
    """Return particle velocity and speed of the last wave [m/s] up to `highest`."""
    v0, e0 = 1.0 / material.density, material.eos.ambient_energy
    corners = [(v0, stress(material.density, e0), e0, 0.0)]  # volume, stress, energy, particle velocity
    ups, speeds = [0.0], [0.0]
    eta, step = 0.0, _FIRST
    while eta < _MOST:
        eta, step = eta + step, min(step * _GROWTH, _STEP)
        v = v0 * (1.0 - eta)
        while True:
            ahead = corners[-1]
            sigma = _stress_behind_shock(stress, v, ahead)
            slope = (sigma - ahead[1]) / (ahead[0] - v)
            if len(corners) == 1 or slope < _slope(corners[-2], ahead):
                break
            corners.pop()
        if not 0.0 < slope < inf:
            continue  # strength goes where it melts, and the stress with it
        e = ahead[2] + 0.5 * (sigma + ahead[1]) * (ahead[0] - v)
        up = ahead[3] + sqrt((sigma - ahead[1]) * (ahead[0] - v))
        if up <= ups[-1]:
            continue
        ups.append(up)
        speeds.append(ahead[3] + ahead[0] * sqrt(slope))
        corners.append((v, sigma, e, up))
        if up > highest:
            break
    speeds[0] = speeds[1]
    return ups, speeds


def _slope(ahead: tuple[float, ...], behind: tuple[float, ...]) -> float:
    return (behind[1] - ahead[1]) / (ahead[0] - behind[0])


def _stress_behind_shock(stress: Callable[[float, float], float], v: float, ahead: tuple[float, ...]) -> float:
    """Return the stress [Pa] behind a shock from the state `ahead` to the volume `v`, by secants."""

    def excess(sigma: float) -> float:
        return stress(1.0 / v, ahead[2] + 0.5 * (sigma + ahead[1]) * (ahead[0] - v)) - sigma

    first = stress(1.0 / v, ahead[2])
    second = first + excess(first)
    at_first, at_second = excess(first), excess(second)
    for _ in range(4):
        if at_second == at_first or abs(at_second) < 1e-9 * abs(second):
            break
        first, second = second, second - at_second * (second - first) / (at_second - at_first)
        at_first, at_second = at_second, excess(second)
    return second
