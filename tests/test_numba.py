"""Hvisph beside other users of numba in one process, and the parts of numba that it relies on."""

import ast
import importlib
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import hvisph

PACKAGE = Path(hvisph.__file__).parent

USER_MODULE = """
import numpy as np
from numba import njit, prange

@njit(cache=True)
def scalar(x):
    return 2.0 * x + 1.0

@njit(cache=True, parallel=True)
def parallel_sum(values):
    total = 0.0
    for k in prange(values.size):
        total += values[k]
    return total

@njit(cache=True)
def root(x):
    if x < 0.0:
        raise ValueError("negative number")
    return np.sqrt(x) + np.arange(5).sum()
"""

FILL_USER_CACHE = """
import numpy as np
import user_module

user_module.scalar(1.0), user_module.parallel_sum(np.ones(10)), user_module.root(1.0)
"""

# User functions from the cache before, between and after runs of two formulations.
MIXED_USE = """
import json
import tempfile
import numba
import numpy as np
import user_module
from hvisph.casefile.loader import load_case
from hvisph.simulation.run import run

def step(formulation):
    body = {"material": "aluminium-howell-ball", "shape": {"type": "interval", "length": 5e-3}}
    case = {"kinematics": "uniaxial_strain", "resolution": 5e-4, "time": {"end": 1e-6, "max_steps": 2},
            "formulation": {"type": formulation},
            "bodies": {"flyer": body | {"velocity": [1000.0]}, "target": body | {"velocity": [0.0]}}}
    with tempfile.TemporaryDirectory() as folder:
        run(load_case(case), folder + "/run", threads=1)

results = [user_module.scalar(2.0)]
step("eulerian")
results += [user_module.parallel_sum(np.ones(10)), user_module.scalar(2.0)]
step("riemann")
results += [user_module.root(4.0), user_module.scalar(2.0), user_module.parallel_sum(np.ones(10))]
try:
    user_module.root(-1.0)
except ValueError as error:
    results.append(str(error))
functions = user_module.scalar, user_module.parallel_sum, user_module.root
results.append([sum(function.stats.cache_misses.values()) for function in functions])

@numba.njit
def fresh(x):
    return user_module.scalar(x) * user_module.root(x)

results.append(fresh(4.0))
print(json.dumps(results))
"""


def run_python(program, folder):
    environment = os.environ | {"PYTHONPATH": os.pathsep.join((str(folder), *sys.path)), "NUMBA_CACHE_DIR": str(folder)}
    result = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True)
    assert result.returncode == 0, (result.returncode, result.stderr)
    return result.stdout


def test_cached_functions_of_a_user_work_before_between_and_after_runs(tmp_path):
    (tmp_path / "user_module.py").write_text(USER_MODULE)
    run_python(FILL_USER_CACHE, tmp_path)
    results = json.loads(run_python(MIXED_USE, tmp_path).splitlines()[-1])
    assert results == [5.0, 10.0, 5.0, 12.0, 5.0, 10.0, "negative number", [0, 0, 0], 108.0]


# Modules of numba and llvmlite beyond their public interfaces, with what is imported from each.
INTERNAL = {
    "numba.core": "cgutils imputils types typing utils",
    "numba.core.base": "BaseContext",
    "numba.core.caching": "NullCache",
    "numba.core.codegen": "JITCPUCodegen JITCodeLibrary",
    "numba.core.compiler": "CompileResult Compiler CompilerBase DefaultPassBuilder",
    "numba.core.compiler_machinery": "PassManager",
    "numba.core.cpu": "CPUContext",
    "numba.core.environment": "Environment lookup_environment",
    "numba.core.externals": "c_math_functions",
    "numba.core.registry": "CPUDispatcher CPUTarget cpu_target",
    "numba.core.runtime": "_nrt_python rtsys",
    "numba.core.serialize": "dumps",
    "numba.core.sigutils": "normalize_signature",
    "numba.core.target_extension": "CPU dispatcher_registry jit_registry target_override target_registry",
    "numba.core.typeconv": "Conversion",
    "numba.core.typed_passes": "NopythonRewrites",
    "numba.core.typing": "templates",
    "numba.core.typing.templates": "AbstractTemplate ConcreteTemplate Signature signature",
    "numba.core.untyped_passes": "InlineClosureLikes",
}
PUBLIC = {"numba", "numba.extending", "llvmlite", "llvmlite.ir", "llvmlite.binding"}

# Members of theirs whose names begin with an underscore.
PRIVATE = {
    *("_codegen", "_data_layout", "_final_module", "_finalized", "_linking_libraries", "_reload_init"),  # of a library
    *("_ensure_finalized", "_finalize_final_module", "_get_compiled_object", "_get_module_for_linking"),
    *("_optimize_final_module", "_optimize_functions", "_set_compiled_object", "_unserialize"),
    *("_defined_symbols", "_engine", "_internal_codegen", "_module_pass_manager"),  # of a code generator
    *("_toplevel_target_context", "_toplevel_typing_context"),  # of a target
    *("_cache", "_compilation_chain_init_hook", "_rebuild", "_reduce"),  # of a dispatcher and its results
    "_getvalue",  # of a structure in generated code
    "_lookup_global",  # of a typing context
}


def test_internals_of_numba_that_are_used_are_known():
    imported, private = {}, set()
    for path in PACKAGE.rglob("*.py"):
        text = path.read_text()
        if not re.search(r"(from|import) (numba|llvmlite)", text):
            continue
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] in ("numba", "llvmlite"):
                if node.module not in PUBLIC:
                    imported.setdefault(node.module, set()).update(alias.name for alias in node.names)
            elif isinstance(node, ast.Attribute):
                private.add(node.attr)
            elif isinstance(node, ast.ClassDef):  # what a class of numba's is given beside or instead of its own
                private.update(member.name for member in node.body if isinstance(member, ast.FunctionDef))
    sources = [
        importlib.import_module(name).__file__
        for name in ("numba.core.dispatcher", "numba.core.typing.context", "numba.np.ufunc.parallel", *imported)
    ]
    words = set().union(*(re.findall(r"\b_[a-z]\w*", Path(source).read_text()) for source in sources))
    assert {module: " ".join(sorted(names)) for module, names in imported.items()} == INTERNAL
    assert private & words == PRIVATE
