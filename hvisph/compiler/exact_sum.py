"""Exact sums, which do not depend on the order of their terms: each term is rounded to whole multiples of a fixed unit.

A term is split into a whole number of units and a whole number of finer units of 2^-34 of the first, and both are
summed as integers. Any order, any number of threads and any number of processes give the same sum to the last bit.
With a unit of 2^-40 of the total, the finer unit is 2^-74 of it, far below the rounding error of the terms.

Adding 1.5 2^52 units to a number below 2^51 of them leaves the whole number in the last bits of the result, so that
rounding needs no conversion.
"""

from itertools import chain
from math import ceil, fsum, log2

import numpy as np

from hvisph.compiler.vector.api import LANES, add_rounded, select

from .jit import inline

# Bits of the finer part, which allow 2^29 terms, and bits of the unit below the total.
FINER, BELOW = 34, 40
AT_ONCE = 8192  # terms that are made Python's numbers at once
_FINE = 2.0**-FINER
LARGEST = 2.0**51  # terms must be smaller than this number of units; sums of their magnitudes are correct up to it


def sum_unit(total: float) -> float:
    """Return a power of two, the unit for terms that add up to `total`, or to 2^11 times that; 2^-40 for zero."""
    return float(2.0 ** (ceil(log2(total)) - BELOW)) if 0.0 < total < np.inf else 2.0**-BELOW


def rounding_constant(unit: np.ndarray | float) -> np.ndarray | float:
    """Return the number that `add_term` adds to terms to round them to multiples of `unit`."""
    return 1.5 * 2.0**52 * unit


@inline
def add_term(sums, i, k, term, rounder):
    """Add `term` to the whole number sums[i, 0, k] and the finer one sums[i, 1, k]; rounder: `rounding_constant`."""
    zero, one, column = np.uint64(0), np.uint64(1), np.uint64(k)
    fine = rounder * 5.820766091346741e-11  # 2^-34
    coarse = term + rounder
    residual = (term - (coarse - rounder)) + fine
    sums[i, zero, column] += np.float64(coarse).view(np.int64) - np.float64(rounder).view(np.int64)
    sums[i, one, column] += np.float64(residual).view(np.int64) - np.float64(fine).view(np.int64)


@inline
def add_vector(sums, i, k, terms, rounder):
    """Add the components of the vector `terms` to the columns from the k-th on, see `add_term`."""
    column = np.uint64(k)
    for term in terms:
        add_term(sums, i, column, term, rounder)
        column += np.uint64(1)


@inline
def add_lanes(sums, k, mask, terms, rounder):
    """Add `terms`, where the mask `mask` holds, to the whole numbers sums[0, k] and the finer ones sums[1, k].

    `sums` is an array of int64 (2, columns, LANES); for `rounder` see `rounding_constant`.
    """
    add_rounded(sums, np.uint64(k), select(mask, terms, 0.0), rounder, FINER)


@inline
def add_lane_vectors(sums, k, mask, terms, rounder):
    """Add the components of the vector `terms` to the columns from the k-th on, see `add_lanes`."""
    column = np.uint64(k)
    for term in terms:
        add_lanes(sums, column, mask, term, rounder)
        column += np.uint64(1)


@inline
def sum_lanes(totals, i, sums):
    """Write into totals[i] the sums over the lanes of `sums`."""
    for part in range(np.uint64(sums.shape[0])):
        for k in range(np.uint64(sums.shape[1])):
            total = np.int64(0)
            for lane in range(np.uint64(LANES)):
                total += sums[part, k, lane]
            totals[i, part, k] = total


def encode_terms(terms: np.ndarray, unit: float) -> np.ndarray:
    """Return the sum over the first axis of `terms` (n, ...) as whole numbers and finer ones (2, ...)."""
    terms = np.asarray(terms, float)
    coarse = np.rint(terms * (1.0 / unit))
    residual = np.rint((terms - coarse * unit) * (1.0 / (unit * _FINE)))
    with np.errstate(invalid="ignore"):
        parts: np.ndarray = np.stack([coarse, residual]).astype(np.int64).sum(axis=1)
    return parts


def decode_sum(parts: np.ndarray, unit: np.ndarray | float) -> np.ndarray:
    """Return the sums (...) of whole numbers and finer ones (2, ...)."""
    values: np.ndarray = (parts[0] + parts[1] * _FINE) * unit
    return values


def sum_in_units(terms: np.ndarray, unit: float) -> np.ndarray:
    """Return the sum over the first axis of `terms` (n, ...), independent of their order."""
    return decode_sum(encode_terms(terms, unit), unit)


def exact_sum(terms: np.ndarray) -> float:
    """Return the sum of `terms` (n,) rounded once: slow, for sums that are taken once per run."""
    return fsum(chain.from_iterable(terms[k : k + AT_ONCE].tolist() for k in range(0, len(terms), AT_ONCE)))


def exact_parts(terms: np.ndarray) -> list[float]:
    """Return few numbers whose exact sum is that of `terms` (n,), so that parts can be combined by `fsum`."""
    numbers, parts = terms.tolist(), [fsum(terms.tolist())]
    while parts[-1] and abs(parts[-1]) < np.inf:
        numbers.append(-parts[-1])
        parts.append(fsum(numbers))
    return parts
