"""Properties of the installation that determine the last bits of results: program, compiler, vectors and processor."""

from __future__ import annotations

import hashlib

from llvmlite import binding

import hvisph
from hvisph.compiler.vector.api import LANES


def build_id() -> str:
    """Return the properties that must agree on all processes of a run."""
    import numba

    name = numba.config.CPU_NAME or binding.get_host_cpu_name()
    features = numba.config.CPU_FEATURES or binding.get_host_cpu_features().flatten()
    short = hashlib.sha256(features.encode()).hexdigest()[:8]
    return f"hvisph {hvisph.__version__}, numba {numba.__version__}, {LANES} lanes, processor {name} ({short})"
