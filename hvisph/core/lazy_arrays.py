"""Arrays computed on access, so that one at a time is in memory."""

from collections.abc import Callable, Iterable, Iterator, Mapping

import numpy as np


class Derived(Mapping[str, np.ndarray]):
    """Mapping of arrays, each computed on access.

    `names`: what there is.
    `make`: returns the array of a name.
    """

    def __init__(self, names: Iterable[str], make: Callable[[str], np.ndarray]):
        self._names, self._make = dict.fromkeys(names), make

    def __getitem__(self, name: str) -> np.ndarray:
        if name not in self._names:
            raise KeyError(name)
        return self._make(name)

    def __contains__(self, name: object) -> bool:
        return name in self._names

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)


def transform_arrays(
    arrays: Mapping[str, np.ndarray],
    change: Callable[[str, np.ndarray], np.ndarray],
    names: Iterable[str] | None = None,
) -> Mapping[str, np.ndarray]:
    """Return the arrays of some names, or all, as `change(name, array)` makes them.

    They are made now, and where `arrays` are `Derived` whenever they are asked for.

    Raises `KeyError` for a name that is not there.
    """
    chosen = list(arrays if names is None else names)
    for name in chosen:
        if name not in arrays:
            raise KeyError(name)
    if isinstance(arrays, Derived):
        return Derived(chosen, lambda name: change(name, arrays[name]))
    return {name: change(name, arrays[name]) for name in chosen}
