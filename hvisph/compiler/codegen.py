"""The compilation target of loops: numba's CPU target with a code generator of its own.

numba optimises each function, links all that it calls into it, optimises the whole again, and makes machine code of
it. A loop inlines the functions that it calls, so the machine code of these functions is never used. In this target a
library is linked, optimised and translated to machine code when the address of a function in it is requested. This
saves a third of the time of a first run.

The target has its own typing context, target context, code generator and registries. It is registered with numba under
the name TARGET, and code that is compiled for numba's own target is unaffected by it.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, partial
from typing import Any

import numba
from llvmlite import ir
from llvmlite.binding import ModuleRef, add_symbol
from numba.core import imputils, types, typing, utils
from numba.core.codegen import JITCodeLibrary, JITCPUCodegen
from numba.core.compiler import Compiler, CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import PassManager
from numba.core.cpu import CPUContext
from numba.core.environment import lookup_environment
from numba.core.externals import c_math_functions
from numba.core.registry import CPUDispatcher, CPUTarget, cpu_target
from numba.core.runtime import _nrt_python, rtsys
from numba.core.target_extension import CPU, dispatcher_registry, jit_registry, target_override, target_registry
from numba.core.typed_passes import NopythonRewrites
from numba.core.typing import templates
from numba.core.untyped_passes import InlineClosureLikes

TARGET = "hvisph"
# Prefixes of numba's names for the environment of a function and for the body of a parallel loop.
_ENVIRONMENT, _PARALLEL_BODY = "_ZN08NumbaEnv", "__numba_parfor_gufunc"
# Alignment of the stack [bytes]: a vector that is spilled to the stack then lies in one cache line.
STACK = 64
# LLVM's flag of arithmetic that may be reordered, see `compiler.vector.lanes`.
_REORDERED = "reassoc"

# Machine code, and the names that it defines.
MachineCode = tuple[bytes, list[str]]

_typing_registry, _lowering_registry = templates.Registry(), imputils.Registry(TARGET)
infer_global = _typing_registry.register_global
lower_builtin, lower_cast = _lowering_registry.lower, _lowering_registry.lower_cast


class Library(JITCodeLibrary):
    """A library that is optimised and translated to machine code when an address in it is requested."""

    _has_machine_code = False

    def serialize_using_object_code(self) -> tuple[str, str, MachineCode]:
        """Return the machine code and the names that it defines; no other library links a loop."""
        module = self._final_module
        names = [f.name for f in (*module.functions, *module.global_variables) if not f.is_declaration]
        return self.name, "object", (self._get_compiled_object(), names)

    @classmethod
    def _unserialize(cls, codegen: _Codegen, state: tuple[str, str, MachineCode]) -> Library:
        name, _, (machine_code, names) = state
        self: Library = codegen.create_library(name)
        self.enable_object_caching()
        self._set_compiled_object(machine_code)
        codegen._engine._defined_symbols.update(names)
        self._assemble()
        return self

    def add_ir_module(self, ir_module: ir.Module) -> None:
        """Add a module and align the stack of its functions."""
        for function in ir_module.functions:
            if not function.is_declaration:
                function.attributes.add("nounwind")  # llvmlite writes no attribute where this set is empty
                function.attributes.alignstack = STACK
        super().add_ir_module(ir_module)

    def _optimize_functions(self, ll_module: ModuleRef) -> None:
        ll_module.data_layout = self._codegen._data_layout

    def _optimize_final_module(self) -> None:
        """Optimise once, or twice as numba does where sums may be reordered: their bits depend on the first pass."""
        if _REORDERED in str(self._final_module):
            super()._optimize_final_module()
        else:
            passes, builder = self._codegen._module_pass_manager()
            passes.run(self._final_module, builder)

    def finalize(self) -> None:
        """Complete the list of callees; they are linked when machine code is made."""
        for library in self._linking_libraries:
            self._reload_init.update(library._reload_init)
        self._finalized = True

    def _add_callees(self, callees: dict[JITCodeLibrary, None]) -> dict[JITCodeLibrary, None]:
        """Add all libraries that this one links, directly or not, to `callees`, callers first."""
        for library in self._linking_libraries:
            if library not in callees:
                callees[library] = None
                if isinstance(library, Library):
                    library._add_callees(callees)
        return callees

    def _link(self) -> None:
        """Link all callees into one module and optimise it."""
        callees = self._add_callees({})
        # Twice: a function is linked only if another one requests it, and a later library may do so.
        for library in (*callees, *callees):
            self._final_module.link_in(library._get_module_for_linking(), preserve=True)
        self._optimize_final_module()
        self._final_module.verify()

    def _assemble(self) -> None:
        """Make machine code, or take that of the cache, and set the environments of its functions."""
        self._has_machine_code = True
        self._finalize_final_module()
        for variable in self._final_module.global_variables:
            environment = lookup_environment(variable.name) if variable.name.startswith(_ENVIRONMENT) else None
            if environment is not None:
                self._codegen.set_env(variable.name, environment)

    def get_pointer_to_function(self, name: str) -> int:
        """Return the address of a function, or 0 if the library does not define it."""
        self._ensure_finalized()
        if not self._has_machine_code:
            names = (function.name for function in self._final_module.functions if not function.is_declaration)
            if self.name.startswith(_PARALLEL_BODY) or name not in names:
                return 0  # called by compiled code only
            self._link()
            self._assemble()
        address: int = super().get_pointer_to_function(name)
        return address


class _Codegen(JITCPUCodegen):
    _library_class = Library

    def set_env(self, env_name: str, env: object) -> None:
        """Set the environment of a function that has machine code; `Library` sets the others later."""
        if self._engine.is_symbol_defined(env_name):
            super().set_env(env_name, env)


class _LoopContext(CPUContext):
    def init(self) -> None:
        """Create the code generator; loops from the cache need the names of numba's runtime, not its compiled part."""
        self.is32bit = utils.MACHINE_BITS == 32
        self._internal_codegen = _Codegen(TARGET)
        c_math_functions.install(self)
        for name, address in _nrt_python.c_helpers.items():
            add_symbol(name if name.startswith("_") else f"NRT_{name}", address)

    def load_additional_registries(self) -> None:
        """Load numba's runtime, compiled for its own target, its implementations and those of this package."""
        rtsys.initialize(cpu_target.target_context)
        super().load_additional_registries()
        self.install_registry(_lowering_registry)


class _TypingContext(typing.Context):
    def __init__(self) -> None:
        self._signatures: dict[tuple[types.Type, ...], templates.Signature] = {}
        super().__init__()

    def resolve_function_type(self, func: object, args: tuple[types.Type, ...], kws: dict[str, types.Type]) -> object:
        """Return the signature of a call; numba tries all templates of a built-in function again for every call."""
        function = self._lookup_global(func) or func
        if kws or not isinstance(function, types.Function):
            return super().resolve_function_type(func, args, kws)
        key = function, *args
        if key not in self._signatures:
            signature = super().resolve_function_type(func, args, kws)
            if signature is None:
                return None
            self._signatures[key] = signature
        return self._signatures[key]

    def refresh(self) -> None:
        """Load numba's types of functions, then those of this package: the first that match are taken."""
        super().refresh()
        self.install_registry(_typing_registry)


class _LoopCPU(CPU):
    """The CPU as hvisph's loops see it, for numba's registry of targets."""


class _LoopTarget(CPUTarget):
    @cached_property
    def _toplevel_target_context(self) -> _LoopContext:
        return _LoopContext(self.typing_context, TARGET)

    @cached_property
    def _toplevel_typing_context(self) -> _TypingContext:
        return _TypingContext()


target_registry[TARGET] = _LoopCPU
loop_target = _LoopTarget(TARGET)


class _Compiler(CompilerBase):
    """numba's compiler without the passes for functions within functions and for expressions of arrays."""

    def define_pipelines(self) -> list[PassManager]:
        """Return the passes; parallel loops need all."""
        manager = DefaultPassBuilder.define_nopython_pipeline(self.state)
        if not self.state.flags.auto_parallel.enabled:
            unused = InlineClosureLikes, NopythonRewrites
            manager.passes = [entry for entry in manager.passes if entry[0] not in unused]
            manager.finalize()
        return [manager]


class LoopDispatcher(CPUDispatcher):
    """A function that is compiled for this target."""

    targetdescr = loop_target

    def __init__(self, py_func: Callable[..., object], **options: Any):
        super().__init__(py_func, **{"pipeline_class": _Compiler} | options)

    def compile(self, sig: templates.Signature) -> object:
        """Return the entry for these types; numba takes the active target where it infers no types, as in parfors."""
        with target_override(TARGET):
            return super().compile(sig)


dispatcher_registry[_LoopCPU] = LoopDispatcher
# numba's own functions may contain functions and expressions of arrays.
jit_registry[_LoopCPU] = partial(numba.jit, _target=TARGET, pipeline_class=Compiler)
