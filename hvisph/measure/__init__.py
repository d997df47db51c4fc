"""Lengths, histories and pictures from a run's files.

The package can be called: ``hvisph.measure(source, at=None)`` is `hvisph.measure.measures.measure`, before
and after something of the package was imported.
"""

import sys
from types import ModuleType
from typing import Any


class _Callable(ModuleType):
    def __call__(self, *arguments: Any, **keywords: Any) -> Any:
        from hvisph.measure.measures import measure

        return measure(*arguments, **keywords)


sys.modules[__name__].__class__ = _Callable
