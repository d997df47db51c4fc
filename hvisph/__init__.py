"""hvisph: smoothed particle hydrodynamics for solids under high-velocity impact.

`load_case`, `run`, `resume` and `measure` are imported when first used, so that importing
the package stays light.
"""

from importlib import import_module
from typing import Any

__version__ = "0.1.0"
__all__ = ["load_case", "measure", "resume", "run", "sweep"]

_LAZY = {
    "load_case": ("hvisph.casefile.loader", "load_case"),
    "run": ("hvisph.simulation.run", "run"),
    "resume": ("hvisph.simulation.resume", "resume"),
    "measure": ("hvisph.measures.measure", "measure"),
    "sweep": ("hvisph.sweeps.begin", "sweep"),
}


def __getattr__(name: str) -> Any:
    if name in _LAZY:
        module, attribute = _LAZY[name]
        return getattr(import_module(module), attribute)
    raise AttributeError(f"module 'hvisph' has no attribute {name!r}")
