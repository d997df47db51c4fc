"""Slope limiters: means of two slopes that vanish where their signs differ.

Each function returns limit(a, b)/a for a >= 0. For vectors a is the square of one slope and b its product with the
other. Numerator and denominator are returned separately, so that one division serves several
(`sph.terms.riemann_solver`).

    minmod      the smaller
    van_leer    harmonic mean 2 a b / (a + b)                           van Leer 1974
    van_albada  a b (a + b) / (a^2 + b^2): smooth where a = b           van Albada, van Leer & Roberts 1982
"""

from __future__ import annotations

from dataclasses import dataclass

from hvisph.compiler.jit import CompiledFunction, inline

# Guard against 0/0.
TINY = 1e-30


@inline
def minmod(a, b):
    """Return numerator and denominator of minmod(a, b)/a."""
    return max(min(a, b), 0.0), a + TINY


@inline
def van_leer(a, b):
    """Return numerator and denominator of van_leer(a, b)/a."""
    b = max(b, 0.0)
    return 2.0 * b, a + b + TINY


@inline
def van_albada(a, b):
    """Return numerator and denominator of van_albada(a, b)/a."""
    b = max(b, 0.0)
    return b * (a + b), a * a + b * b + TINY


@dataclass(frozen=True)
class Limiter:
    """Name of a limiter and its `share`; of ``none``, without reconstruction, that is not called."""

    name: str
    share: CompiledFunction

    @property
    def acts(self) -> bool:
        """Whether there is a reconstruction."""
        return self.name != "none"


LIMITERS = {
    name: Limiter(name, share)
    for name, share in (("none", minmod), ("minmod", minmod), ("van_leer", van_leer), ("van_albada", van_albada))
}
NO_RECONSTRUCTION = LIMITERS["none"]
