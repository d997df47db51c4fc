"""hvisph: smoothed particle hydrodynamics for solids under high-velocity impact.

The names of `__all__` are imported at first use, so that importing the package is fast.
"""

from importlib import import_module
from typing import Any

__version__ = "0.1.0"
__all__ = ["compare", "load_case", "measure", "open_run", "report", "resume", "run", "sweep"]

_LAZY = {
    "compare": ("hvisph.postprocessing.comparison", "compare"),
    "load_case": ("hvisph.casefile.loader", "load_case"),
    "run": ("hvisph.simulation.run", "run"),
    "resume": ("hvisph.simulation.run", "resume"),
    "measure": ("hvisph.measures.measure", "measure"),
    "open_run": ("hvisph.postprocessing.run_data", "open_run"),
    "report": ("hvisph.visualization.html.report", "report"),
    "sweep": ("hvisph.sweeps.driver", "sweep"),
}


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])


def __getattr__(name: str) -> Any:
    if name in _LAZY:
        module, attribute = _LAZY[name]
        return getattr(import_module(module), attribute)
    raise AttributeError(f"module 'hvisph' has no attribute {name!r}")
