"""What snapshots show beside the state: pressure, sound speed and von Mises stress of every particle."""

from __future__ import annotations

import numpy as np

from hvisph.core.jit import prange, specialise
from hvisph.core.particles import Particles
from hvisph.materials import response

CHUNK = 1024


def _diagnose(state, tags, table, models, pressure, sound_speed, von_mises):
    count = np.uint64(state.shape[0])
    for chunk in prange((count + np.uint64(CHUNK - 1)) // np.uint64(CHUNK)):
        first = np.uint64(chunk) * np.uint64(CHUNK)
        for s in range(first, min(first + np.uint64(CHUNK), count)):
            p, c = equilibrium_state(
                table,
                models,
                np.uint64(tags[s, 2]),
                state[s, S_DENSITY],
                state[s, S_INTERNAL_ENERGY],
                state[s, S_DAMAGE],
            )
            pressure[s] = p
            sound_speed[s] = c
            squares = 0.0
            for f in range(np.uint64(3)):
                squares += state[s, np.uint64(S_DEVIATOR) + f] ** 2
            for f in range(np.uint64(3), np.uint64(COMPONENTS)):
                squares += 2.0 * state[s, np.uint64(S_DEVIATOR) + f] ** 2
            von_mises[s] = np.sqrt(1.5 * squares)


def diagnose(particles: Particles, table: np.ndarray, models: np.ndarray) -> dict[str, np.ndarray]:
    """Return pressure [Pa], sound speed [m/s] and von Mises stress [Pa] of the state as it stands, each (n,).

    The pressure is that of the state where it carries one, otherwise that of the equation of state.
    """
    found = {name: np.zeros(particles.count) for name in ("pressure", "sound_speed", "von_mises_stress")}
    columns = {k: v for k, v in particles.bindings().items() if k in _diagnose.__code__.co_names}
    loop = specialise(_diagnose, parallel=True, equilibrium_state=response.equilibrium_state,
                      COMPONENTS=particles["deviator"].shape[1], **columns)  # fmt: skip
    loop(particles.data, particles.tags, table, models, *found.values())
    if "pressure" in particles.offsets:  # a scheme whose pressure is no function of the state
        found["pressure"] = particles["pressure"].copy()
    return found
