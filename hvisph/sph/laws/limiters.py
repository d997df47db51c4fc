"""Limiters of a reconstruction: means of two slopes that vanish where their signs differ.

Each has two forms: of numbers, `limit(a, b)`, and as a share of the first for vectors, `share(a, b) = limit(a, b)/a`,
where a is the square of one and b its product with the other.

    minmod      the smaller
    van_leer    harmonic mean 2 a b / (a + b)                           van Leer 1974
    van_albada  a b (a + b) / (a^2 + b^2): smooth where a = b           van Albada, van Leer & Roberts 1982
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from hvisph.core.jit import compiled

# Keeps 0/0 from what is nothing.
TINY = 1e-30


@compiled
def minmod(a, b):
    """Return the smaller in size of `a` and `b`, 0 where their signs differ."""
    return 0.5 * (np.copysign(1.0, a) + np.copysign(1.0, b)) * min(abs(a), abs(b))


@compiled
def van_leer(a, b):
    """Return the harmonic mean of `a` and `b`, 0 where their signs differ."""
    product = max(a * b, 0.0)
    return 2.0 * product * (a + b) / ((a + b) * (a + b) + TINY)


@compiled
def van_albada(a, b):
    """Return van Albada's mean of `a` and `b`, 0 where their signs differ."""
    return max(a * b, 0.0) * (a + b) / (a * a + b * b + TINY)


@compiled
def minmod_share(a, b):
    """Return minmod(a, b) / a for a >= 0, 0 for a = 0."""
    return max(min(a, b), 0.0) / (a + TINY)


@compiled
def van_leer_share(a, b):
    """Return van_leer(a, b) / a for a >= 0, 0 for a = 0."""
    b = max(b, 0.0)
    return 2.0 * b / (a + b + TINY)


@compiled
def van_albada_share(a, b):
    """Return van_albada(a, b) / a for a >= 0, 0 for a = 0."""
    b = max(b, 0.0)
    return b * (a + b) / (a * a + b * b + TINY)


@dataclass(frozen=True)
class Limiter:
    """Name and both forms of a limiter; of ``none``, without reconstruction, neither form is called."""

    name: str
    limit: Any
    share: Any

    @property
    def acts(self) -> bool:
        """Whether there is a reconstruction."""
        return self.name != "none"


LIMITERS = {name: Limiter(name, limit, share) for name, limit, share in (
    ("none", minmod, minmod_share), ("minmod", minmod, minmod_share),
    ("van_leer", van_leer, van_leer_share), ("van_albada", van_albada, van_albada_share),
)}  # fmt: skip
NO_RECONSTRUCTION = LIMITERS["none"]
