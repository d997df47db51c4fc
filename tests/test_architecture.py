"""The rooms of the house: who may import whom, and which third-party libraries live where.

Everything follows from the sources' import statements, lazy ones within functions included.
"""

import ast
import sys
from pathlib import Path

import pytest

import hvisph

PACKAGE = Path(hvisph.__file__).parent

# What each room may import of ours, beside itself. Errors and field names of `core` are everyone's.
MAY_IMPORT = {
    "core": set(),
    "case": {"core"},
    "casefile": {"core", "case"},
    "geometry": {"core"},
    "materials": {"core"},
    "sph": {"core"},
    "formulations": {"core", "materials", "sph", "integrators"},
    "integrators": {"core", "sph"},
    "parallel": {"core"},
    "output": {"core"},
    "measures": {"core", "geometry", "output"},
    "pictures": {"core", "measures", "output"},
    "exact": {"core", "materials"},
    "simulation": {
        *("core", "case", "casefile", "geometry", "materials", "sph", "formulations", "integrators", "output"),
        *("measures", "exact", "parallel"),
    },
    "study": {
        "core",
        "case",
        "casefile",
        "materials",
        "simulation",
        "measures",
        "pictures",
        "report",
        "exact",
        "output",
    },
    "verification": {"core", "case", "casefile", "materials", "simulation", "measures", "pictures", "exact", "output"},
    "report": {"core", "case", "casefile", "measures", "pictures", "output"},
    "sweeps": {"core", "case", "casefile", "simulation", "measures", "output"},
    "validation": {
        *("core", "case", "casefile", "materials", "simulation", "sweeps", "verification", "measures", "pictures"),
        *("exact", "output"),
    },
    "cli": {
        "core",
        "case",
        "casefile",
        "simulation",
        "study",
        "sweeps",
        "report",
        "verification",
        "validation",
        "measures",
        "pictures",
        "exact",
        "parallel",
    },
}
# `measures` and `pictures` work on files alone: of `output` it may know what reads them, and how a picture is written whole.
OF_OUTPUT = {"hvisph.output." + name for name in ("names", "reader", "snapshot", "atomic")}

# The rooms of each third-party library; those not named here are anyone's.
LIBRARIES = {
    "pydantic": {"case", "casefile"},
    "pydantic_core": {"case", "casefile"},
    "yaml": {"casefile"},
    "pint": {"case"},
    "typer": {"cli"},
    "rich": {"cli"},
    "h5py": {"output", "geometry"},
    "trimesh": {"geometry"},
    "meshio": {"output", "geometry"},
    "PIL": {"pictures"},
    "pandas": {"study"},
    "matplotlib": {"pictures"},
    "jinja2": {"report"},
    "scipy": {"sweeps", "geometry", "measures", "verification"},
    "llvmlite": {"core"},
    "platformdirs": {"core"},
    "psutil": {"simulation", "cli"},
    "mpi4py": {"parallel"},
    "numba": {"core", "simulation"},
    "numpy": {*MAY_IMPORT} - {"cli", "case", "casefile"},
}
# Slow to import and seldom needed: only within functions, so that nobody pays who does not use them.
LAZY = {"PIL", "trimesh", "jinja2", "scipy", "matplotlib", "h5py", "meshio", "pint", "psutil", "mpi4py"}
# Outside `core`, numba is for the number of threads; what compiles is in `core` alone.
NUMBA_OUTSIDE_CORE = {"config", "get_num_threads", "set_num_threads", "threading_layer"}
# Rooms that must load without numba: nothing that they do needs a compiler.
WITHOUT_NUMBA = ("case", "casefile", "cli", "geometry", "output", "measures", "pictures")


def module_name(path):
    parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


SOURCES = {module_name(path): path for path in sorted(PACKAGE.rglob("*.py")) if "_data" not in path.parts}
TREES = {name: ast.parse(path.read_text(encoding="utf-8")) for name, path in SOURCES.items()}
ROOMS = sorted(path.name for path in PACKAGE.iterdir() if (path / "__init__.py").exists())


def room_of(module):
    parts = module.split(".")
    return parts[1] if len(parts) > 1 and parts[1] in ROOMS else ""


def imports(module, eager=False):
    """Yield (imported module, line); with `eager`, only what is imported when the module is."""
    lazy, typing_only = set(), set()
    for node in ast.walk(TREES[module]):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            lazy |= {id(inner) for inner in ast.walk(node)}
        if isinstance(node, ast.If) and ast.unparse(node.test).endswith("TYPE_CHECKING"):
            typing_only |= {id(inner) for statement in node.body for inner in ast.walk(statement)}
    for node in ast.walk(TREES[module]):
        if eager and id(node) in lazy | typing_only:
            continue
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield alias.name, node.lineno
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            if node.level:
                package = module if SOURCES[module].name == "__init__.py" else module.rpartition(".")[0]
                above = package.split(".")[: len(package.split(".")) - node.level + 1]
                base = ".".join([*above, *([base] if base else [])])
            for alias in node.names:
                full = f"{base}.{alias.name}"
                yield (full if full in SOURCES else base), node.lineno


def ours(module, eager=False):
    return [(name, line) for name, line in imports(module, eager) if name.split(".")[0] == "hvisph"]


def test_every_room_is_in_the_table():
    assert set(ROOMS) == set(MAY_IMPORT)


@pytest.mark.parametrize("room", MAY_IMPORT)
def test_a_room_imports_only_what_it_may(room):
    wrong = [
        f"{module}, line {line}: {name}"
        for module in SOURCES
        if room_of(module) == room
        for name, line in ours(module)
        if room_of(name) and room_of(name) not in {room, *MAY_IMPORT[room]}
    ]
    assert not wrong, "\n".join(wrong)


def test_measures_and_pictures_know_only_the_reader_of_output():
    wrong = [
        f"{module}, line {line}: {name}"
        for module in SOURCES
        if room_of(module) in ("measures", "pictures")
        for name, line in ours(module)
        if room_of(name) == "output" and name not in OF_OUTPUT | {"hvisph.output"}
    ]
    assert not wrong, "\n".join(wrong)


def test_libraries_stay_in_their_rooms():
    wrong = [
        f"{module}, line {line}: {name}"
        for module in SOURCES
        for name, line in imports(module)
        if room_of(module) not in LIBRARIES.get(name.split(".")[0], {room_of(module)})
    ]
    assert not wrong, "\n".join(wrong)


def test_every_library_is_known():
    """A new dependency is a decision: it is declared here and in pyproject.toml."""
    found = {name.split(".")[0] for module in SOURCES for name, _ in imports(module)}
    foreign = {name for name in found if name not in sys.stdlib_module_names and name not in ("hvisph", "")}
    assert foreign <= set(LIBRARIES)


def test_slow_libraries_are_imported_when_used():
    wrong = [
        f"{module}, line {line}: {name}"
        for module in SOURCES
        for name, line in imports(module, eager=True)
        if name.split(".")[0] in LAZY
    ]
    assert not wrong, "\n".join(wrong)


def test_only_core_compiles():
    wrong = []
    for module, tree in TREES.items():
        if room_of(module) == "core":
            continue
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "numba":
                wrong.append(f"{module}, line {node.lineno}: from numba import")
            used = isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name)
            if used and node.value.id == "numba" and node.attr not in NUMBA_OUTSIDE_CORE:
                wrong.append(f"{module}, line {node.lineno}: numba.{node.attr}")
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize("room", WITHOUT_NUMBA)
def test_rooms_that_load_without_numba(room):
    """Follow the imports that loading a module of the room sets off, parent packages included."""
    todo = [(module, module) for module in SOURCES if room_of(module) == room]
    seen = {}
    while todo:
        module, way = todo.pop()
        if module in seen:
            continue
        seen[module] = way
        for name, _ in imports(module, eager=True):
            assert name.split(".")[0] not in ("numba", "llvmlite"), f"{way} -> {name}"
            parts = name.split(".")
            for length in range(1, len(parts) + 1):
                parent = ".".join(parts[:length])
                if parent in SOURCES and parent != "hvisph":
                    todo.append((parent, f"{way} -> {parent}"))


def test_no_module_imports_itself_by_way_of_others():
    """Lazy imports and those for types alone included: what is left out of every circle can be ordered."""
    left = {module: {name for name, _ in ours(module) if name in SOURCES and name != module} for module in SOURCES}
    while free := [module for module, needed in left.items() if not needed & left.keys()]:
        for module in free:
            del left[module]
    assert not left, f"a circle among, or above one: {sorted(left)}"
