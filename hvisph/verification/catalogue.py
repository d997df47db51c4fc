"""Verification problems by name: those of the package, and those of the folder `validation` of a source checkout."""

from __future__ import annotations

import sys
from importlib import import_module
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType

from hvisph.core.errors import CaseError

from .problem import Problem
from .problems import bars, hugoniot, noh, plate, sod

NAME = "hvisph_validation"
FOLDER = Path(__file__).resolve().parents[2] / "validation"


def checkout_module(name: str) -> ModuleType | None:
    """Return the module `name` of the folder `validation` beside the package; None where there is no such folder."""
    if NAME not in sys.modules:
        spec = spec_from_file_location(NAME, FOLDER / "__init__.py", submodule_search_locations=[str(FOLDER)])
        if spec is None or spec.loader is None or not (FOLDER / "__init__.py").is_file():
            return None
        package = sys.modules[NAME] = module_from_spec(spec)
        spec.loader.exec_module(package)
    return import_module(f"{NAME}.{name}")


def require_module(name: str) -> ModuleType:
    """Return the module `name` of the folder `validation`; raises `CaseError` with the remedy where there is none."""
    module = checkout_module(name)
    if module is None:
        raise CaseError(
            "the experiments are in the folder `validation` of a source checkout, which this installation is not; "
            "take the command in a checkout as `python -m hvisph validate`"
        )
    return module


_QUICK = (hugoniot.PROBLEM, plate.PROBLEM, sod.SOD_PROBLEM, sod.BLAST_PROBLEM, noh.PROBLEM, bars.PROBLEM)
_OTHERS = checkout_module("problems")

PROBLEMS: dict[str, Problem] = {problem.name: problem for problem in _QUICK}
PROBLEMS |= _OTHERS.PROBLEMS if _OTHERS is not None else {}
_BLIND = checkout_module("blind")
PROBLEMS |= {_BLIND.PROBLEM.name: _BLIND.PROBLEM} if _BLIND is not None else {}
