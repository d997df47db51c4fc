"""`hvisph doctor`: test of the installation."""

import os
import platform
import sys
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, version
from tempfile import TemporaryDirectory

import typer

import hvisph
from hvisph.casefile.loader import load_case
from hvisph.cli.formatting import duration, echo_json, say, size, table
from hvisph.cli.guard import FAILED
from hvisph.cli.options import JsonOption, option
from hvisph.compiler.cache_folder import cache_folder
from hvisph.compiler.self_test import self_test
from hvisph.core.catalogues import KINEMATICS
from hvisph.core.memory import free_memory
from hvisph.core.text import Plain
from hvisph.precheck.estimate import available_threads
from hvisph.simulation.run import run

PACKAGES = ("numpy", "numba", "llvmlite", "scipy", "h5py", "meshio", "pydantic", "pint", "rich", "typer")
# Materials of two bodies: of common models, of further ones, of those with history variables, an explosive.
# One loop of each kinematics and formulation serves all materials of such a class.
PAIRS = (
    ("aluminium-6061-t6", "steel-4340"),
    ("tungsten", "tantalum"),
    ("granite", "tungsten"),
    ("composition-b", "copper-ofhc"),
)
FIBRES = ("kevlar-129", "aluminium-6061-t6")  # in the kinematics that have materials with directions
DIRECTIONS: dict[str, Plain] = {"axisymmetric": {}, "three_d": {"axes": {"one": [0, 1, 0], "two": [0, 0, 1]}}}


def doctor(
    compile_loops: bool = option(
        "--compile", "Compile contact SPH and standard SPH for all materials of the library: minutes.", False
    ),
    as_json: JsonOption = False,
) -> None:
    """Show versions, cores, memory and cache, and test a compiled loop."""
    if compile_loops:
        _compile_common(not as_json)
    facts = _facts()
    if as_json:
        echo_json(facts)
    else:
        say(_words(facts))
    if not facts["self_test"]["passed"]:
        raise typer.Exit(FAILED)


def common_cases() -> Iterator[tuple[str, Plain]]:
    """Yield title and case of each pair of materials, by each common formulation and kinematics."""
    solids: dict[str, Plain] = {
        "axisymmetric": {"type": "cylinder", "diameter": 8e-3, "length": 8e-3},
        "uniaxial_strain": {"type": "interval", "length": 8e-3},
    }
    for kinematics in ("axisymmetric", "plane_strain", "three_d", "uniaxial_strain"):
        dim = KINEMATICS[kinematics].dim
        shape = solids.get(kinematics, {"type": "box", "size": [8e-3] * dim})
        for formulation in ("riemann", "eulerian"):
            for pair in (*PAIRS, FIBRES) if kinematics in DIRECTIONS else PAIRS:
                still = [0.0] * (dim - 1)
                bodies = {
                    name: {"material": name, "shape": shape, "velocity": [speed, *still]}
                    for name, speed in zip(pair, (500.0, 0.0), strict=True)
                }
                if pair == FIBRES:
                    bodies[pair[0]] |= DIRECTIONS[kinematics]
                case = {
                    "kinematics": kinematics,
                    "resolution": 1e-3,
                    "bodies": bodies,
                    "formulation": {"type": formulation},
                    "time": {"end": 1e-6, "max_steps": 1},
                }
                yield f"{kinematics}, {formulation}: {' on '.join(pair)}", case


def _compile_common(tell: bool) -> None:
    """Compute one step of each of the common cases."""
    for title, case in common_cases():
        if tell:
            say(f"compiling {title}")
        with TemporaryDirectory() as folder:
            run(load_case(case), folder, force=True)


def _facts() -> Plain:
    import psutil

    versions = {}
    for package in PACKAGES:
        try:
            versions[package] = version(package)
        except PackageNotFoundError:
            versions[package] = "not installed"
    folder = cache_folder()
    return {
        "hvisph": hvisph.__version__,
        "python": platform.python_version(),
        "platform": platform.platform(),
        "executable": sys.executable,
        "versions": versions,
        "cores": psutil.cpu_count(logical=False) or psutil.cpu_count(),
        "threads": available_threads(),
        "memory_bytes": psutil.virtual_memory().total,
        "free_memory_bytes": free_memory(),
        "cache_folder": str(folder) if folder is not None else None,
        "cache_writable": folder is not None and os.access(folder, os.W_OK),
        "self_test": self_test(),
    }


def _words(facts: Plain) -> str:
    test = facts["self_test"]
    cache = facts["cache_folder"] or "none: loops are compiled anew in every run; set HVISPH_CACHE_DIR"
    if facts["cache_folder"] and not facts["cache_writable"]:
        cache += " (read-only)"
    result = "passed" if test["passed"] else f"FAILED: {test['reason']}"
    origin = "from the cache" if test["cached"] else "compiled"
    rows = [
        ("hvisph", facts["hvisph"]),
        ("python", f"{facts['python']} ({facts['executable']})"),
        ("platform", facts["platform"]),
        ("packages", ", ".join(f"{name} {version}" for name, version in facts["versions"].items())),
        ("cores", f"{facts['cores']}, {facts['threads']} threads usable"),
        ("memory", f"{size(facts['memory_bytes'])}, {size(facts['free_memory_bytes'])} free"),
        ("cache", cache),
        ("self test", f"{result} ({origin} in {duration(test['seconds'])}, {test['threads']} threads)"),
    ]
    return table(rows, indent=0)
