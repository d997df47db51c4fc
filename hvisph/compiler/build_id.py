"""What the last bits of a result hang on beside the case: program, compiler, vectors and processor."""

from __future__ import annotations

import hashlib

from llvmlite import binding

import hvisph
from hvisph.compiler.vector.api import LANES


def kind_of_machine() -> str:
    """Return in words what must be alike on processes that share a run."""
    import numba

    name = numba.config.CPU_NAME or binding.get_host_cpu_name()
    features = numba.config.CPU_FEATURES or binding.get_host_cpu_features().flatten()
    short = hashlib.sha256(features.encode()).hexdigest()[:8]
    return f"hvisph {hvisph.__version__}, numba {numba.__version__}, {LANES} lanes, processor {name} ({short})"
