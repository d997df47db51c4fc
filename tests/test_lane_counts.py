"""Processors without AVX-512 compute with four lanes instead of eight: same laws, same twins."""

import os
import subprocess
import sys
from pathlib import Path

LAW = "test_compiled_rates_are_those_of_the_formulas[artificial_stress-2]"


def test_a_law_over_four_lanes(tmp_path):
    features = {"NUMBA_CPU_FEATURES": "-avx512f", "HVISPH_CACHE_DIR": str(tmp_path)}
    count = [sys.executable, "-c", "from hvisph.compiler.vector.lanes import LANES; print(LANES)"]
    test = [sys.executable, "-m", "pytest", "-q", "-n", "0", "-p", "no:cacheprovider", f"test_sph_laws.py::{LAW}"]
    for command, wanted in ((count, "4\n"), (test, "1 passed")):
        done = subprocess.run(
            command, cwd=Path(__file__).parent, env=os.environ | features, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stdout + done.stderr
        assert wanted in done.stdout
