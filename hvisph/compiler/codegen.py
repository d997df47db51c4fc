"""Machine code is made of what Python calls, once, and not of what other code takes in.

numba makes machine code of every function: of a loop, of the part of it that threads share, and of all that it calls.
A loop takes these in as text and is optimised as a whole, so their own code is wasted time; worse, where a
name exists twice the first one is called: a loop that was compiled in this process would run its part's own code, and
one from the cache that of the whole, whose sums of vectors may round differently. So a library is handed to the
processor when an address in it is asked for, and not before; and it is linked and optimised then, as a whole. numba
optimises every function, and again with each that takes it in, and copies all that it calls into each, level by level:
a third of the time of a first run.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from llvmlite.binding import parse_bitcode
from numba.core.codegen import JITCodeLibrary
from numba.core.environment import lookup_environment
from numba.core.registry import cpu_target

# How numba begins the names of what a function finds its exceptions by, and of the parts of loops that threads share.
_ENVIRONMENT, _SHARED_PART = "_ZN08NumbaEnv", "__numba_parfor_gufunc"
# Vectors that no register is left for wait on the stack, each in one line of the cache if that is aligned so [bytes].
STACK = 64
# The flag of what may be reordered, see `compiler.vector.lanes`.
_REORDERED = "reassoc"


class Library(JITCodeLibrary):
    """Code that is optimised and becomes machine code when an address in it is asked for."""

    _handed_over = False
    _bitcode = b""

    @classmethod
    def _unserialize(cls, codegen: Any, state: Any) -> Library:
        """Return a library from the cache; what others take in of it is read when one does."""
        name, _, (machine_code, bitcode) = state
        self: Library = codegen.create_library(name)
        self.enable_object_caching()
        self._set_compiled_object(machine_code)
        self._bitcode = bitcode
        self._finalize_final_module()
        return self

    def _get_module_for_linking(self) -> Any:
        if self._bitcode:
            self._shared_module, self._bitcode = parse_bitcode(self._bitcode), b""
        return super()._get_module_for_linking()

    def add_ir_module(self, ir_module: Any) -> None:
        """Add a module whose functions align their stack."""
        for function in ir_module.functions:
            if not function.is_declaration:
                function.attributes.add("nounwind")  # llvmlite writes none where this set is empty
                function.attributes.alignstack = STACK
        super().add_ir_module(ir_module)

    def _optimize_functions(self, ll_module: Any) -> None:
        ll_module.data_layout = self._codegen._data_layout

    def _optimize_final_module(self) -> None:
        """Optimise once where no sum may be reordered; where one may, its bits hang on numba's first round, too."""
        if _REORDERED in str(self._final_module):
            super()._optimize_final_module()
        else:
            passes, builder = self._codegen._module_pass_manager()
            passes.run(self._final_module, builder)

    def finalize(self) -> None:
        """Leave what is called where it is until all is linked."""
        for library in self._linking_libraries:
            self._reload_init.update(library._reload_init)
        self._finalized = True

    def _finalize_final_module(self) -> None:  # from the cache, made already
        self._hand_over()

    def _called(self, found: dict[Library, None]) -> dict[Library, None]:
        """Add all that this library calls to what is `found`, callers first."""
        for library in self._linking_libraries:
            if library not in found:
                found[library] = None
                library._called(found)
        return found

    def _make(self) -> None:
        """Link all that this library calls into one whole, and optimise that."""
        called = self._called({})
        # twice: what nothing asks for yet is not taken in, and one that comes later may ask for it
        for library in (*called, *called):
            self._final_module.link_in(library._get_module_for_linking(), preserve=True)
        self._optimize_final_module()
        self._final_module.verify()

    def _hand_over(self) -> None:
        self._handed_over = True
        super()._finalize_final_module()
        for variable in self._final_module.global_variables:
            environment = lookup_environment(variable.name) if variable.name.startswith(_ENVIRONMENT) else None
            if environment is not None:
                self._codegen.set_env(variable.name, environment)

    def get_pointer_to_function(self, name: str) -> int:
        """Return the address of a function, 0 where this library has none of that name."""
        self._ensure_finalized()
        own = (function.name for function in self._final_module.functions if not function.is_declaration)
        if not self._handed_over:
            if self.name.startswith(_SHARED_PART) or name not in own:
                return 0  # Python calls nothing here
            self._make()
            self._hand_over()
        address: int = super().get_pointer_to_function(name)
        return address


def install() -> None:
    """Have numba make code in this way from now on."""
    codegen: Any = cpu_target.target_context.codegen()
    codegen._library_class = Library
    set_environment = codegen.set_env

    def set_env(name: str, environment: Any) -> None:
        if codegen._engine.is_symbol_defined(name):  # else when its library is handed over
            set_environment(name, environment)

    codegen.set_env = set_env


def know(names: Iterable[str]) -> None:
    """Let what has these names in a library from the cache be found: what Python calls, and environments."""
    codegen: Any = cpu_target.target_context.codegen()
    codegen._engine._defined_symbols.update(names)
