"""Import order of the packages, their third-party libraries, names and sizes.

Imports follow from the sources' import statements, lazy ones within functions included.
"""

import ast
import re
import sys
from collections import Counter
from pathlib import Path

import pytest

import hvisph

PACKAGE = Path(hvisph.__file__).parent

# What each package may import of hvisph, beside itself.
_PHYSICS = {"core", "compiler", "geometry", "materials", "sph", "integrators", "schemes", "parallel", "exact"}
_CASES = {"core", "case", "casefile"}
_FILES = {"output", "measures"}
_RUN = _PHYSICS | _CASES | _FILES | {"setup", "precheck", "diagnostics", "simulation"}
MAY_IMPORT = {
    "core": set(),
    "compiler": {"core"},
    "case": {"core"},
    "casefile": {"core", "case"},
    "geometry": {"core"},
    "materials": {"core", "compiler"},
    "sph": {"core", "compiler"},
    "integrators": {"core", "compiler", "sph"},
    "schemes": {"core", "compiler", "materials", "sph", "integrators"},
    "output": {"core"},
    "parallel": {"core", "compiler", "sph", "integrators", "schemes", "output"},
    "exact": {"core", "compiler", "materials"},
    "measures": {"core", "geometry", "output"},
    "setup": _PHYSICS | _CASES | _FILES,
    "precheck": _PHYSICS | _CASES | _FILES | {"setup"},
    "diagnostics": _PHYSICS | _CASES | _FILES | {"setup", "precheck"},
    "simulation": _RUN - {"simulation"},
    "visualization": _CASES | _FILES,
    "postprocessing": _RUN | {"visualization"},
    "sweeps": _RUN,
    "verification": _RUN | {"visualization"},
    "cli": _RUN | {"visualization", "postprocessing", "sweeps", "verification"},
}
# `measures` and `visualization` work on files alone: of `output` they know the reader and how a file is written whole.
READING = {"hvisph.output." + name for name in ("file_names", "reader", "snapshot", "atomic_write")}

# The packages that may use each third-party library; a library that is not named is not allowed.
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
    "PIL": {"visualization"},
    "pandas": {"postprocessing"},
    "matplotlib": {"visualization"},
    "jinja2": {"visualization"},
    "hvisph_validation": {"cli"},
    "sklearn": {"sweeps"},
    "pyvista": {"output"},
    "scipy": {"sweeps", "geometry", "measures", "diagnostics", "verification", "exact"},
    "llvmlite": {"compiler"},
    "platformdirs": {"compiler"},
    "psutil": {"core", "cli"},
    "mpi4py": {"parallel"},
    "numba": {"compiler", "setup", "precheck", "simulation", "diagnostics"},
    "numpy": {*MAY_IMPORT} - {"cli", "casefile"},  # `case` within a function
}
# Slow to import and seldom needed: only within functions, so that nobody pays who does not use them. `import scipy`
# takes 0.01 s and loads its parts when they are used.
LAZY = {"PIL", "trimesh", "jinja2", "sklearn", "matplotlib", "meshio", "pint", "psutil", "mpi4py", "pyvista"}
# Outside `compiler`, numba sets and tells the number of threads; only `compiler` compiles.
NUMBA_ELSEWHERE = {"config", "get_num_threads", "set_num_threads", "threading_layer"}
# Packages that must load without numba: nothing that they do needs a compiler. Commands import what they call.
WITHOUT_NUMBA = ("case", "casefile", "geometry", "output", "measures", "visualization")


def module_name(path):
    parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


SOURCES = {module_name(path): path for path in sorted(PACKAGE.rglob("*.py")) if "_data" not in path.parts}
TREES = {name: ast.parse(path.read_text(encoding="utf-8")) for name, path in SOURCES.items()}
PACKAGES = sorted(path.name for path in PACKAGE.iterdir() if (path / "__init__.py").exists())


def package_of(module):
    parts = module.split(".")
    return parts[1] if len(parts) > 1 and parts[1] in PACKAGES else ""


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


def test_every_package_is_in_the_table():
    assert set(PACKAGES) == set(MAY_IMPORT)


@pytest.mark.parametrize("package", MAY_IMPORT)
def test_a_package_imports_only_what_it_may(package):
    wrong = [
        f"{module}, line {line}: {name}"
        for module in SOURCES
        if package_of(module) == package
        for name, line in ours(module)
        if package_of(name) and package_of(name) not in {package, *MAY_IMPORT[package]}
    ]
    assert not wrong, "\n".join(wrong)


def test_measures_and_visualization_use_only_the_reader_of_output():
    wrong = [
        f"{module}, line {line}: {name}"
        for module in SOURCES
        if package_of(module) in ("measures", "visualization")
        for name, line in ours(module)
        if package_of(name) == "output" and name not in READING | {"hvisph.output"}
    ]
    assert not wrong, "\n".join(wrong)


def test_libraries_stay_in_their_packages():
    wrong = [
        f"{module}, line {line}: {name}"
        for module in SOURCES
        for name, line in imports(module)
        if package_of(module) not in LIBRARIES.get(name.split(".")[0], {package_of(module)})
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
        if name.split(".")[0] in LAZY or name.startswith("scipy.")
    ]
    assert not wrong, "\n".join(wrong)


def test_only_the_compiler_package_compiles():
    wrong = []
    for module, tree in TREES.items():
        if package_of(module) == "compiler":
            continue
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "numba":
                wrong.append(f"{module}, line {node.lineno}: from numba import")
            used = isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name)
            if used and node.value.id == "numba" and node.attr not in NUMBA_ELSEWHERE:
                wrong.append(f"{module}, line {node.lineno}: numba.{node.attr}")
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize("package", WITHOUT_NUMBA)
def test_packages_that_load_without_numba(package):
    """Follow the imports that loading a module of the package sets off, parent packages included."""
    todo = [(module, module) for module in SOURCES if package_of(module) == package]
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


# Participles, prepositions and adverbs that say nothing alone of what a function returns or does.
BARE = set("""above across after again ahead alike along apart around aside at away before begun behind below beside between
    beyond both brought by done down drawn each either even every few found from given gone grown held here how in inside
    into just kept laid less made many meant met more most much near nearest next no none now of off on once only onto or
    other out outside over per said same seen shown since so some still such taken than that then there these this
    those through till to together told toward under until up upon usual what when where which while who whose why with
    within without yet""".split())  # fmt: skip  # noqa: SIM905
NOUNS = {
    "bed",
    "embed",
    "exceed",
    "feed",
    "fixed",
    "need",
    "next",
    "proceed",
    "seed",
    "shared",
    "shed",
    "speed",
    "spread",
}
# Names of this kind that remain in the package, public and private; the numbers may only fall.
MOST_PUBLIC, MOST_PRIVATE = 0, 30
MOST_MODULES, MOST_FILES, MOST_LINES, MOST_OF_A_MODULE = 20, 350, 55_920, 400


def is_bare(name):
    words = [word for word in name.split("_") if word]
    return bool(words) and all(word not in NOUNS and (word in BARE or word.endswith("ed")) for word in words)


def test_functions_are_named_by_verbs_and_nouns():
    functions = [
        f"{module}.{node.name}"
        for module, tree in TREES.items()
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef) and is_bare(node.name)
        and not any("property" in ast.unparse(decorator) for decorator in node.decorator_list)
    ]  # fmt: skip
    assert not [module for module in TREES if is_bare(module.rpartition(".")[2])]
    private = [name for name in functions if name.rpartition(".")[2].startswith("_")]
    assert len(private) <= MOST_PRIVATE, private
    assert len(functions) - len(private) <= MOST_PUBLIC, set(functions) - set(private)


# Phrases in place of a term of the glossary; the test of the documentation uses them, too.
REPLACED = re.compile(
    r"\b(blob|crumb|density lead|drawn apart|held tension|in the house|lead over the number|lets go|lump|nothing to tune"
    r"|own faces|parts from|printed form|rough normal|separating contact|repulsive contact|string of particles|torn off"
    r"|welded contact|what a material bears|what bears no|who meets whom"
    r"|does not tell|do not tell|falls into itself|go on with|goes on with|make room)"
)


def test_modules_have_a_first_line_in_terms_of_the_glossary():
    for module, tree in TREES.items():
        first = (ast.get_docstring(tree) or "").partition("\n")[0]
        assert first.endswith("."), f"{module}: {first!r}"
        assert not REPLACED.search(first.lower()), f"{module}: {first!r}"


def test_size_of_the_package():
    folders = Counter(path.parent for path in SOURCES.values() if path.name != "__init__.py")
    assert max(folders.values()) <= MOST_MODULES, folders.most_common(3)
    assert len(SOURCES) <= MOST_FILES
    lines = {module: len(path.read_text(encoding="utf-8").splitlines()) for module, path in SOURCES.items()}
    assert sum(lines.values()) <= MOST_LINES
    assert max(lines.values()) <= MOST_OF_A_MODULE, max(lines, key=lines.get)
