"""Derived fields of snapshots: pressure, sound speed, von Mises stress and temperature."""

from collections.abc import Iterator, Sequence

import numpy as np

from hvisph.compiler.jit import bind
from hvisph.compiler.parallel_for import particle_loop
from hvisph.core.particles import SLAB, Particles
from hvisph.materials import thermodynamics
from hvisph.materials.damage.fracture_energy import softened_pressure
from hvisph.materials.material_table import bind_models

NAMES = ("pressure", "sound_speed", "von_mises_stress", "temperature")


def _diagnose(s, state, tags, table, models, pressure, sound_speed, von_mises, temperature):
    m, rho, e = np.uint64(tags[s, 2]), state[s, S_DENSITY], state[s, S_INTERNAL_ENERGY]
    history = state[s, S_HISTORY_VARIABLE] if HAS_HISTORY else 1.0
    p, c = state_with_history(table, models, m, rho, e, state[s, S_DAMAGE], history)
    if FRACTURES:
        p = softened_pressure(p, state[s, S_DAMAGE], state[s, S_ONSET_TENSION])
    temperature[s] = temperature_of(table, models, m, rho, e, p, history)
    pressure[s] = p
    sound_speed[s] = c
    squares = 0.0
    for f in range(np.uint64(3)):
        squares += state[s, np.uint64(S_DEVIATOR) + f] ** 2
    for f in range(np.uint64(3), np.uint64(COMPONENTS)):
        squares += 2.0 * state[s, np.uint64(S_DEVIATOR) + f] ** 2
    if ANISOTROPIC:  # stress beside the pressure has a trace
        trace = (
            state[s, np.uint64(S_DEVIATOR)] + state[s, np.uint64(S_DEVIATOR + 1)] + state[s, np.uint64(S_DEVIATOR + 2)]
        )
        squares = max(squares - trace * trace / 3.0, 0.0)
    von_mises[s] = np.sqrt(1.5 * squares)


def diagnose(
    particles: Particles, table: np.ndarray, models: np.ndarray, names: Sequence[str] = NAMES
) -> dict[str, np.ndarray]:
    """Return those of pressure, sound speed, von Mises stress and, where known, temperature in `names`, (n,) each."""
    fields = {name: np.zeros(particles.count) for name in names}
    for rows, slab in _slabs(particles, table, models):
        for name, values in fields.items():
            values[rows] = slab[name]
    if {"pressure"} <= fields.keys() & particles.offsets.keys():  # of a scheme where it is no function of the state
        fields["pressure"] = particles["pressure"].copy()
    if "temperature" in fields and np.isnan(fields["temperature"]).all():
        del fields["temperature"]
    return fields


def known_names(particles: Particles, table: np.ndarray, models: np.ndarray) -> tuple[str, ...]:
    """Return the names of the fields that `diagnose` returns: the temperature only where a particle has one."""
    has_temperature = any(not np.isnan(slab["temperature"]).all() for _, slab in _slabs(particles, table, models))
    return NAMES if has_temperature else NAMES[:-1]


def _slabs(
    particles: Particles, table: np.ndarray, models: np.ndarray
) -> Iterator[tuple[slice, dict[str, np.ndarray]]]:
    """Yield the rows of a slab of particles, and their fields."""
    options = {
        "state_with_history": bind_models(thermodynamics.state_with_history, table, models),
        "temperature_of": bind_models(thermodynamics.temperature_of, table, models),
        "HAS_HISTORY": int("history_variable" in particles.offsets),
        "ANISOTROPIC": int("material_axes" in particles.offsets),
        "FRACTURES": int("band_width" in particles.offsets),
        "softened_pressure": softened_pressure,
        "COMPONENTS": particles["deviator"].shape[1],
    }
    particle_function = bind(_diagnose, options, {"S_HISTORY_VARIABLE": 0, "S_ONSET_TENSION": 0} | particles.bindings())
    loop = particle_loop(particle_function)
    for first in range(0, particles.count, SLAB):  # rows may not be contiguous
        rows = slice(first, first + SLAB)
        state = np.ascontiguousarray(particles.data[rows])
        fields = {name: np.zeros(len(state)) for name in NAMES}
        loop(len(state), state, particles.tags[rows], table, models, *fields.values())
        yield rows, fields
