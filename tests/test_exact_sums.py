"""Sums in whole numbers: the compiled loop and its plain twin, any order, what is none or too large."""

import math

import numpy as np
import pytest

from hvisph.compiler.exact_sum import (
    FINER,
    LARGEST,
    add_term,
    decode_sum,
    encode_terms,
    exact_parts,
    exact_sum,
    rounding_constant,
    sum_in_units,
    sum_unit,
)
from hvisph.compiler.jit import specialise


def _add_all(terms, rounder, sums):
    for term in terms:
        add_term(sums, np.uint64(0), np.uint64(1), term, rounder)


def compiled_parts(terms, unit):
    """Return the pair of integers that the compiled function adds up to."""
    sums = np.zeros((1, 2, 9), np.int64)
    specialise(_add_all, parallel=False)(terms, rounding_constant(unit), sums)
    others = np.delete(sums[0], 1, axis=1)
    assert not others.any()
    return sums[0, :, 1]


@pytest.mark.parametrize("scale", [1e-30, 1.0, 3e12])
def test_any_order_and_any_partition_give_the_same_integers(scale):
    rng = np.random.default_rng(0)
    terms = scale * rng.normal(size=10_000) * 10.0 ** rng.uniform(-8, 0, 10_000)
    unit = sum_unit(float(np.abs(terms).sum()))
    whole = encode_terms(terms, unit)
    assert np.array_equal(whole, compiled_parts(terms, unit))
    assert np.array_equal(whole, compiled_parts(rng.permutation(terms), unit))
    assert np.array_equal(whole, sum(encode_terms(part, unit) for part in np.array_split(terms, 7)))
    # each term is off by half a unit of the finer part at most, 2^-74 of the whole
    assert abs(sum_in_units(terms, unit) - exact_sum(terms)) <= len(terms) * unit * 2.0**-FINER + 2e-16 * abs(
        sum_in_units(terms, unit)
    )


def test_units_are_powers_of_two_and_of_nothing_there_is_one():
    assert np.log2(sum_unit(3.0)) == np.round(np.log2(sum_unit(3.0)))
    assert sum_unit(0.0) == sum_unit(np.inf) == sum_unit(1.0)
    assert 2.0**11 <= LARGEST * sum_unit(7.0) / 7.0 <= 2.0**12


def test_sums_below_their_unit_are_kept():
    assert sum_in_units(np.full(1000, 1e-7), 1.0) == pytest.approx(1e-4, rel=2.0**-FINER / 1e-7)
    assert decode_sum(np.array([3, 1 << (FINER - 1)]), 0.5) == 1.75


@pytest.mark.parametrize("seed", range(3))
def test_parts_of_several_processes_sum_to_what_one_rounds(seed):
    rng = np.random.default_rng(seed)
    terms = rng.normal(size=1000) * 10.0 ** rng.integers(-18, 18, 1000)
    split = np.split(terms, [0, 10, 700])  # one process has nothing
    assert math.fsum(part for one in split for part in exact_parts(one)) == exact_sum(terms)
    assert max(len(exact_parts(one)) for one in split) < 9
