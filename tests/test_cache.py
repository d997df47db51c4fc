"""The cache of compiled loops: shared by many processes, read-only or absent, it never stands in the way."""

import ctypes
import dis
import json
import os
import subprocess
import sys

import pytest

from hvisph.compiler.fingerprint import ATTRIBUTE, GLOBAL, OTHER, fingerprint, read_names
from hvisph.compiler.jit import inline

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="POSIX permissions")

PROGRAM = """
import json
from hvisph.compiler.cache_folder import cache_folder
from hvisph.compiler.self_test import self_test
found = self_test()
print(json.dumps(found | {"folder": str(cache_folder())}))
"""

# The forces of Total Lagrangian particles between random rows: a loop whose sums of vectors may round in many ways.
FORCES = """
import hashlib
import json
import numpy as np
from hvisph.compiler.jit import bind, missing_loops, report_compilation, specialise
from hvisph.compiler.parallel_for import particle_loop
from hvisph.sph.neighbours import particle_layout as rates
from hvisph.sph.kernels import CUBIC_SPLINE
from hvisph.sph.kernels import scale
from hvisph.schemes.total_lagrangian import law as reference

n, random, heard = 64, np.random.default_rng(1), []
layout, width = reference.row_layout(2, True, False, True)
lists = (np.arange(n + 1, dtype=np.uint64) * 8, random.integers(0, n, 8 * n).astype(np.uint32),
         np.arange(8 * n, dtype=np.uint32), random.random((8 * n, 4)))
options = {"MIXED": 1, "HOURGLASS": 1, "PRINTED": 0, "COUPLED": 0, "AXISYMMETRIC": 0, "BY_PAIRS": 0, "slope": CUBIC_SPLINE.slope,
           "scale": specialise(scale, DIM=2, NORM=CUBIC_SPLINE.norm(2)), "DIM": 2, "WIDTH": width, "WEIGHTS": 3}
loop = particle_loop(bind(reference.accumulate, {}, options | layout.slots() | rates.slots(2)))
found, missing = np.zeros((n, rates.width(2))), missing_loops()
with report_compilation(heard.append):
    loop(n, random.random((n + 1, layout.width)), np.ones(n, np.uint8), 1, random.random(n), lists,
         (random.random((n, 2)), random.random(n)), (1.0, 2.0), 10.0, 1.0, found)
print(json.dumps({"compiled": bool(heard), "missing": [missing, missing_loops()], "bits": hashlib.sha256(found).hexdigest()}))
"""


def started(cache, program=PROGRAM, **further):
    """A process that compiles a loop, or takes it from the cache."""
    environment = os.environ | {"HVISPH_CACHE_DIR": str(cache), "NUMBA_NUM_THREADS": "1"}
    environment |= further.pop("environment", {})
    return subprocess.Popen(
        [sys.executable, "-c", program],
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        **further,
    )


def result(process):
    """What it found."""
    said, wrong = process.communicate(timeout=120)
    assert process.returncode == 0, wrong
    assert wrong == ""
    return json.loads(said)


def without_override():
    """Give up root's right to write where nobody may, for the program that is executed next."""
    if os.getuid() == 0:
        drop_from_bounding_set, override_permissions = 24, 1
        ctypes.CDLL(None).prctl(drop_from_bounding_set, override_permissions, 0, 0, 0)


def test_of_many_processes_with_a_fresh_cache_one_compiles_and_the_others_wait(tmp_path):
    found = [result(process) for process in [started(tmp_path / "cache") for _ in range(4)]]
    assert all(one["passed"] for one in found), found
    assert sorted(one["cached"] for one in found) == [False, True, True, True]
    assert not list(tmp_path.rglob("*.lock"))


def test_a_loop_gives_the_same_bits_compiled_here_or_taken_from_the_cache(tmp_path):
    fresh, cached = (result(started(tmp_path / "cache", FORCES)) for _ in range(2))
    assert (fresh["compiled"], cached["compiled"]) == (True, False)
    assert fresh["bits"] == cached["bits"]
    assert (fresh["missing"], cached["missing"]) == ([["accumulate"], []], [[], []])  # what `check` tells beforehand


def test_a_read_only_cache_is_used(tmp_path):
    cache = tmp_path / "cache"
    assert result(started(cache))["passed"]
    paths = [cache, *cache.rglob("*")]
    for path in paths:
        path.chmod(0o555 if path.is_dir() else 0o444)
    found = result(started(cache, preexec_fn=without_override))
    for path in paths:
        path.chmod(0o755 if path.is_dir() else 0o644)
    assert found["passed"], found["reason"]
    assert found["cached"]
    assert found["folder"].startswith(str(cache))


def test_an_empty_read_only_cache_does_without(tmp_path):
    cache, elsewhere = tmp_path / "cache", tmp_path / "elsewhere"
    for folder in (cache, elsewhere):
        folder.mkdir()
        folder.chmod(0o555)
    found = result(started(cache, preexec_fn=without_override, environment={"TMPDIR": str(elsewhere)}))
    assert found["passed"], found["reason"]
    assert not found["folder"].startswith(str(tmp_path))


def test_a_damaged_cache_is_compiled_anew(tmp_path):
    cache = tmp_path / "cache"
    assert result(started(cache))["passed"]
    for path in cache.rglob("*.loop"):
        path.write_bytes(path.read_bytes()[:20])
    assert result(started(cache))["passed"]


def test_a_folder_that_others_could_have_made_is_not_used(tmp_path):
    shared, nowhere = tmp_path / "tmp", tmp_path / "nowhere"
    shared.mkdir()
    nowhere.mkdir()
    nowhere.chmod(0o555)
    private = shared / f"hvisph-cache-{os.getuid()}"
    environment = {"TMPDIR": str(shared)}

    assert result(started(nowhere, preexec_fn=without_override, environment=environment))["folder"] == str(private)
    assert private.stat().st_mode & 0o777 == 0o700
    private.chmod(0o777)
    assert result(started(nowhere, preexec_fn=without_override, environment=environment))["folder"] == "None"
    private.chmod(0o700)
    private.rename(shared / "elsewhere")
    private.symlink_to(shared / "elsewhere")
    assert result(started(nowhere, preexec_fn=without_override, environment=environment))["folder"] == "None"


FACTOR = 2.0


def doubled(x):
    """Return twice x."""
    return FACTOR * x


def of(text, **names):
    """Fingerprint of the function f of a source text."""
    space = {"__name__": "some.module", "doubled": doubled} | names
    exec(text, space)
    return fingerprint(space["f"])


def test_a_loop_is_known_by_its_code_and_by_all_that_it_calls(monkeypatch):
    text = "def f(x):\n    return doubled(x) + A\n"
    first = of(text, A=1.0)
    assert of(text, A=1.0) == first
    assert of("\n\n# moved down\ndef f(x):\n    'Said.'\n\n    return doubled(x) + A  # why\n", A=1.0) == first
    assert of(text, A=1.5) != first
    assert of("def f(x):\n    return doubled(x) - A\n", A=1.0) != first
    assert of(text, A=1.0, doubled=lambda x: x + x) != first
    assert of(text, A=inline(doubled)) == of(text, A=doubled)
    assert of("def f(x):\n    return m.doubled(x)\n", m=sys.modules[__name__]) != of(
        "def f(x):\n    return m.of(x)\n", m=sys.modules[__name__]
    )
    monkeypatch.setattr(sys.modules[__name__], "FACTOR", 3.0)
    assert of(text, A=1.0) != first


def test_reading_of_names_is_that_of_dis():
    def one(x, *rest):
        return os.sep + fingerprint.__name__ + [len(os.path.join(x, y)) for y in rest].count(x)

    kinds = {"LOAD_GLOBAL": GLOBAL, "LOAD_NAME": GLOBAL, "LOAD_ATTR": ATTRIBUTE, "LOAD_METHOD": ATTRIBUTE}
    many = compile("a = " + "+".join(f"n{k}.m{k}" for k in range(300)), "", "exec")  # more than fit a byte
    for code in (one.__code__, many, fingerprint.__code__):
        steps = [step for step in dis.get_instructions(code) if step.opname != "EXTENDED_ARG"]
        told = [(kinds.get(step.opname, OTHER), step.argval if step.opname in kinds else "") for step in steps]
        assert list(read_names(code)) == told
