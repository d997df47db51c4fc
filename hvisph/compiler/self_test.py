"""Test of compiled code on this machine, and identification of the build."""

import hashlib
import time

import numpy as np
from llvmlite import binding

import hvisph
from hvisph.compiler.vector.api import LANES

from .jit import prange, report_compilation, specialise

COUNT = 200_000


def self_test() -> dict[str, bool | str | float | int]:
    """Compile, or take from the cache, a small loop on all threads and compare its result with NumPy's.

    Returns a dict: `passed`, `reason` (empty if passed), `cached`, `seconds` until the first result, `threads`.
    """
    import numba

    names: list[str] = []
    x = np.linspace(0.5, 2.0, COUNT)
    result = np.zeros(COUNT)
    start = time.perf_counter()
    reason = ""
    with report_compilation(names.append):
        try:
            specialise(_powers, parallel=True)(x, result)
        except Exception as error:  # whatever the compiler says is the answer
            reason = f"{type(error).__name__}: {error}"
    seconds = time.perf_counter() - start
    if not reason and not np.allclose(result, x**1.5, rtol=1e-13, atol=0.0):
        reason = "a compiled loop gives wrong numbers"
    return {
        "passed": not reason,
        "reason": reason,
        "cached": not names and not reason,
        "seconds": seconds,
        "threads": numba.get_num_threads(),
    }


def _powers(x, out):
    for k in prange(len(x)):
        out[k] = np.sqrt(x[k]) * x[k]


def build_id() -> str:
    """Return the identity of program, compiler, vectors and processor, which determines the last bits of a run."""
    import numba

    name = numba.config.CPU_NAME or binding.get_host_cpu_name()
    features = numba.config.CPU_FEATURES or binding.get_host_cpu_features().flatten()
    short = hashlib.sha256(features.encode()).hexdigest()[:8]
    return f"hvisph {hvisph.__version__}, numba {numba.__version__}, {LANES} lanes, processor {name} ({short})"
