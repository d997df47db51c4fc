"""What snapshots show beside the state: pressure, sound speed, von Mises stress and temperature of every particle."""

from __future__ import annotations

import numpy as np

from hvisph.core.jit import prange, specialise
from hvisph.core.particles import Particles
from hvisph.materials import state
from hvisph.materials.table import fitted

CHUNK = 1024
NAMES = ("pressure", "sound_speed", "von_mises_stress", "temperature")


def _diagnose(state, tags, table, models, pressure, sound_speed, von_mises, temperature):
    count = np.uint64(state.shape[0])
    for chunk in prange((count + np.uint64(CHUNK - 1)) // np.uint64(CHUNK)):
        first = np.uint64(chunk) * np.uint64(CHUNK)
        for s in range(first, min(first + np.uint64(CHUNK), count)):
            m, rho, e = np.uint64(tags[s, 2]), state[s, S_DENSITY], state[s, S_INTERNAL_ENERGY]
            memory = state[s, S_MEMORY] if REMEMBERS else 1.0
            p, c = remembered_state(table, models, m, rho, e, state[s, S_DAMAGE], memory)
            temperature[s] = temperature_of(table, models, m, rho, e, p, memory)
            pressure[s] = p
            sound_speed[s] = c
            squares = 0.0
            for f in range(np.uint64(3)):
                squares += state[s, np.uint64(S_DEVIATOR) + f] ** 2
            for f in range(np.uint64(3), np.uint64(COMPONENTS)):
                squares += 2.0 * state[s, np.uint64(S_DEVIATOR) + f] ** 2
            von_mises[s] = np.sqrt(1.5 * squares)


def diagnose(particles: Particles, table: np.ndarray, models: np.ndarray) -> dict[str, np.ndarray]:
    """Return pressure [Pa], sound speed [m/s], von Mises stress [Pa] and temperature [K] of the state, each (n,).

    The pressure is that of the state where it carries one, otherwise that of the equation of state. The temperature is
    not a number in a material without a heat capacity, and left out where none has one.
    """
    fields = {name: np.zeros(particles.count) for name in NAMES}
    columns = {k: v for k, v in particles.bindings().items() if k in _diagnose.__code__.co_names}
    remembers = int("memory" in particles.offsets)
    loop = specialise(_diagnose, parallel=True, remembered_state=fitted(state.remembered_state, table, models),
                      temperature_of=fitted(state.temperature_of, table, models), REMEMBERS=remembers,
                      COMPONENTS=particles["deviator"].shape[1], **{"S_MEMORY": 0} | columns)  # fmt: skip
    loop(particles.data, particles.tags, table, models, *fields.values())
    if "pressure" in particles.offsets:  # a scheme whose pressure is no function of the state
        fields["pressure"] = particles["pressure"].copy()
    if np.isnan(fields["temperature"]).all():
        del fields["temperature"]
    return fields
