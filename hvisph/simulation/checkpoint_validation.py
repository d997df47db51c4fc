"""Validation of a checkpoint against the run: types, shapes and all indices that compiled loops use.

A readable checkpoint may be forged or belong to another run. Indices (numbers, bodies, materials, flags) must be
those of this run; other values are left to the sanity checks.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hvisph.core.particles import BODY, FLAGS, ID, MATERIAL, RETIRED, Particles
from hvisph.output.checkpoint_file import Checkpoint


def refuse_misfit(given: Checkpoint, header: dict[str, Any],
                  own: dict[str, tuple[tuple[int, ...], np.dtype]]) -> None:  # fmt: skip
    """Raise `ValueError` unless `given` has the types and shapes of `own` and `header`."""
    for name, value in header.items():
        if name != "case":
            _refuse_other_kind(value, given.header[name], name)
    if given.header["fields"] != header["fields"]:
        raise ValueError("it has other fields")
    if not (given.header["clock"]["time"] >= 0.0 and given.header["step"]["length"] > 0.0):
        raise ValueError("its time or its step is not positive")
    if given.arrays.keys() != own.keys():
        raise ValueError(f"it differs in {', '.join(sorted(given.arrays.keys() ^ own.keys()))}")
    for name, (shape, kind) in own.items():
        other = given.arrays[name]
        if other.dtype != kind or other.shape != shape:
            raise ValueError(f"'{name}' has another shape or kind: {other.shape}, not {shape}")
    numbers = given.arrays["tags"][:, ID]
    if not np.array_equal(numbers, np.arange(len(numbers))):
        raise ValueError("its particles are not in the order of their numbers, each once")


def refuse_other_particles(state: np.ndarray, tags: np.ndarray, particles: Particles, renews: bool) -> None:
    """Raise `ValueError` unless the constant data of `particles` are unchanged, row by row."""
    fixed = np.array([BODY, MATERIAL])
    flags = tags[:, FLAGS] & ~np.uint32(RETIRED)
    if (tags[:, fixed] != particles.tags[:, fixed]).any() or (flags != particles.tags[:, FLAGS]).any():
        raise ValueError("its particles are of other bodies or materials, or others are held")
    moved = Particles(particles.dim, 0, particles.names[len(Particles(particles.dim, 0).names) :])
    moved.data = state
    kept = (tags[:, FLAGS] & RETIRED) == 0
    if (moved["mass"] != np.where(kept, particles["mass"], 0.0)).any():
        raise ValueError("its particles have other masses")
    if not (moved["smoothing_length"] > 0.0).all() or not np.isfinite(moved["position"]).all():
        raise ValueError("its particles have no places or no smoothing lengths")
    if "kernel_type" in moved.offsets and not np.isin(moved["kernel_type"], (0.0, 1.0)).all():
        raise ValueError("its particles have no kind of kernel")
    if "reference_position" not in moved.offsets:
        return
    at = moved["reference_position"]
    if not np.isfinite(at).all() or (not renews and (at != particles["reference_position"]).any()):
        raise ValueError("its particles have other places in the reference configuration")


def _refuse_other_kind(own: object, given: object, path: str) -> None:
    """Raise `ValueError` unless plain values have equal types; None may stand for a number."""
    if isinstance(own, dict):
        if not isinstance(given, dict) or own.keys() != given.keys():
            raise ValueError(f"its {path} has other keys")
        for name, value in own.items():
            _refuse_other_kind(value, given[name], f"{path}.{name}")
    elif path == "series":
        if not isinstance(given, list) or not all(_is_entry(entry) for entry in given):
            raise ValueError(f"its {path} is no list of times and files")
    elif isinstance(own, list):
        if not isinstance(given, list) or len(given) != len(own):
            raise ValueError(f"its {path} has another length")
        for number, (one, other) in enumerate(zip(own, given, strict=True)):
            _refuse_other_kind(one, other, f"{path}.{number}")
    elif isinstance(own, str) != isinstance(given, str) or not (
        given is None or isinstance(given, str) or _is_number(given)
    ):
        raise ValueError(f"its {path} is of another kind")
    elif isinstance(own, int) and not isinstance(own, bool) and not (isinstance(given, int) and abs(given) < 2**62):
        raise ValueError(f"its {path} is no whole number")
    elif own is not None and given is None:
        raise ValueError(f"its {path} is missing")


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < float("inf")


def _is_entry(entry: object) -> bool:
    return isinstance(entry, list) and len(entry) == 2 and _is_number(entry[0]) and isinstance(entry[1], str)
