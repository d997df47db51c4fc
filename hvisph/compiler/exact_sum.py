"""Sums that do not depend on the order of their terms: every term is rounded to whole numbers of a fixed unit.

A term is taken apart into a whole number of the unit and one of 2^-34 of it, and each is summed as an integer. So any
order, any number of threads and any number of processes give the same sum to the last bit. With a unit of 2^-40 of the
whole, the finer part is 2^-74 of it: far below the rounding of the terms themselves.

Adding 1.5 2^52 units to a number below 2^51 of them leaves the whole number in the last bits of the result: the
rounding costs no conversion.
"""

from __future__ import annotations

from math import ceil, fsum, log2

import numpy as np

from hvisph.compiler.vector.api import LANES, add_rounded, chosen

from .jit import compiled

# Bits of the finer part, which leave room for 2^29 terms, and those of a unit below the whole.
FINER, BELOW = 34, 40
_FINE = 2.0**-FINER
# A term of so many units is too large, and sums of their sizes up to it are right.
LARGEST = 2.0**51


def unit_of(whole: float) -> float:
    """Return the unit in which to count what amounts to `whole` altogether: a power of two; 2^-40 for nothing.

    A sum may reach 2^11 times the whole.
    """
    return float(2.0 ** (ceil(log2(whole)) - BELOW)) if 0.0 < whole < np.inf else 2.0**-BELOW


def rounder_of(unit: np.ndarray | float) -> np.ndarray | float:
    """Return what `add_whole` adds to terms to round them to whole numbers of `unit`."""
    return 1.5 * 2.0**52 * unit


@compiled
def add_whole(sums, i, k, term, rounder):
    """Add `term` to the whole number sums[i, 0, k] and the finer one sums[i, 1, k], for `rounder` see `rounder_of`."""
    zero, one, at = np.uint64(0), np.uint64(1), np.uint64(k)
    fine = rounder * 5.820766091346741e-11  # 2^-34
    whole = term + rounder
    rest = (term - (whole - rounder)) + fine
    sums[i, zero, at] += np.float64(whole).view(np.int64) - np.float64(rounder).view(np.int64)
    sums[i, one, at] += np.float64(rest).view(np.int64) - np.float64(fine).view(np.int64)


@compiled
def add_vector(sums, i, k, terms, rounder):
    """Add the components of the vector `terms` to the columns from the k-th on, see `add_whole`."""
    column = np.uint64(k)
    for term in terms:
        add_whole(sums, i, column, term, rounder)
        column += np.uint64(1)


@compiled
def add_lanes(counted, k, here, terms, rounder):
    """Add to the whole number counted[0, k] and the finer one counted[1, k] of each lane what `here` is of `terms`.

    `counted` is an array of int64 (2, columns, LANES); for `rounder` see `rounder_of`.
    """
    add_rounded(counted, np.uint64(k), chosen(here, terms, 0.0), rounder, FINER)


@compiled
def add_lanes_of(counted, k, here, terms, rounder):
    """Add the components of the vector `terms` to the columns from the k-th on, see `add_lanes`."""
    column = np.uint64(k)
    for term in terms:
        add_lanes(counted, column, here, term, rounder)
        column += np.uint64(1)


@compiled
def sum_lanes(wholes, i, counted):
    """Write into wholes[i] the sums over the lanes of `counted`."""
    for part in range(np.uint64(counted.shape[0])):
        for k in range(np.uint64(counted.shape[1])):
            whole = np.int64(0)
            for lane in range(np.uint64(LANES)):
                whole += counted[part, k, lane]
            wholes[i, part, k] = whole


def whole_parts(terms: np.ndarray, unit: float) -> np.ndarray:
    """Return the sum over the first axis of `terms` (n, ...) as whole numbers and finer ones (2, ...)."""
    terms = np.asarray(terms, float)
    whole = np.rint(terms * (1.0 / unit))
    rest = np.rint((terms - whole * unit) * (1.0 / (unit * _FINE)))
    with np.errstate(invalid="ignore"):
        parts: np.ndarray = np.stack([whole, rest]).astype(np.int64).sum(axis=1)
    return parts


def value_of(parts: np.ndarray, unit: np.ndarray | float) -> np.ndarray:
    """Return the sums (...) that whole numbers and finer ones (2, ...) stand for."""
    values: np.ndarray = (parts[0] + parts[1] * _FINE) * unit
    return values


def total(terms: np.ndarray, unit: float) -> np.ndarray:
    """Return the sum over the first axis of `terms` (n, ...), whatever their order."""
    return value_of(whole_parts(terms, unit), unit)


def exact_sum(terms: np.ndarray) -> float:
    """Return the sum of `terms` (n,) rounded once: slow, for what is summed once a run."""
    return fsum(terms.tolist())


def exact_parts(terms: np.ndarray) -> list[float]:
    """Return few numbers whose exact sum is that of `terms` (n,): `fsum` of those of several parts is of all."""
    rest, parts = terms.tolist(), [fsum(terms.tolist())]
    while parts[-1] and abs(parts[-1]) < np.inf:
        rest.append(-parts[-1])
        parts.append(fsum(rest))
    return parts
