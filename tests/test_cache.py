"""The cache of compiled loops: shared by many processes, read-only or absent, it never stands in the way."""

import ctypes
import json
import os
import subprocess
import sys

import pytest

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="POSIX permissions")

PROGRAM = """
import json
from hvisph.core.jit import cache_folder
from hvisph.core.self_test import self_test
found = self_test()
print(json.dumps(found | {"folder": str(cache_folder())}))
"""


def started(cache, **further):
    """A process that compiles a loop, or takes it from the cache."""
    environment = os.environ | {"HVISPH_CACHE_DIR": str(cache), "NUMBA_NUM_THREADS": "1"}
    environment |= further.pop("environment", {})
    return subprocess.Popen(
        [sys.executable, "-c", PROGRAM],
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


def test_many_processes_share_a_fresh_cache(tmp_path):
    for found in [result(process) for process in [started(tmp_path / "cache") for _ in range(4)]]:
        assert found["passed"], found["reason"]
    assert result(started(tmp_path / "cache"))["cached"]


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
    assert not found["cached"]


def test_a_damaged_cache_is_compiled_anew(tmp_path):
    cache = tmp_path / "cache"
    assert result(started(cache))["passed"]
    for path in cache.rglob("*.nb*"):
        path.write_bytes(path.read_bytes()[:20])
    assert result(started(cache))["passed"]
