"""Scalar functions over many particles at once: every lane has the bits that a single number has."""

from inspect import signature
from math import exp

# ruff: noqa: F821 - templates
import numpy as np
import pytest

from hvisph.compiler.exact_sum import add_lanes, encode_terms, rounding_constant, sum_lanes
from hvisph.compiler.if_conversion import convert_tree
from hvisph.compiler.jit import inline, prange, python_twin, specialise
from hvisph.compiler.tensors import put, row_gradient, row_symmetric, row_vector
from hvisph.compiler.vector.lane_masks import first_lanes
from hvisph.compiler.vector.lanes import LANES
from hvisph.compiler.vector.memory_access import gather
from hvisph.materials import stress_update
from hvisph.materials.damage import GradyKipp, JohnsonCookDamage, PressureCutoff, PrincipalStress
from hvisph.materials.damage.fracture_energy import FractureEnergy
from hvisph.materials.eos import Linear, MieGrueneisen, StiffenedGas, Tillotson
from hvisph.materials.material_table import Material, pack
from hvisph.materials.strength import JohnsonCook, LinearHardening, NoStrength, VonMises
from hvisph.schemes.stepper import OF_MATERIALS

COUNT = 40  # a multiple of all numbers of lanes


def _one(data, i, out):
    put(out, i, 0, function(row_vector(data, i, 0, 3)))


def _singly(data, near, out):
    for k in range(np.uint64(data.shape[0])):
        one(data, np.uint64(near[k]), out)


def _together(data, near, out):
    for k in range(np.uint64(0), np.uint64(data.shape[0]), np.uint64(LANES)):
        one(gather(data, near, k), np.uint64(0), gather(out, near, k))


def both_ways(function, data, width):
    """Return what a compiled `function` makes of rows (n, 3) in plain Python, one at a time, and lanes at a time."""
    near = np.random.default_rng(3).permutation(len(data)).astype(np.uint32)
    made = [np.array([python_twin(function)(tuple(row)) for row in data.tolist()])]
    for loop in (_singly, _together):
        out = np.zeros((len(data), width))
        specialise(loop, parallel=False, one=specialise(_one, function=function))(data, near, out)
        made.append(out)
    return made


@pytest.mark.parametrize("function", [one for one in OF_MATERIALS if one.py_func.__name__ != "thinning"])
def test_what_particles_are_made_of_is_computed_for_many(function):
    # One at a time, as nested returns ask for, the whole pass takes twice as long. Thinning loops, seldom.
    convert_tree(function.py_func, range(2, len(signature(function.py_func).parameters)))


@inline
def _early(v):
    """Return early, late, or from within."""
    if v[0] > 1.0:
        if v[1] > 0.0:
            return 1.0, v[2]
        if v[2] > 0.0:
            return v[1] * v[2], 2.0
    a, b = v[0], 0.0
    return a, b


@inline
def _mutating(v):
    """Change what stood before, on either side, in a loop and with masks made of masks."""
    a, b, c = v
    if a > 0.0 and not (b > 0.0 or c <= 0.0):
        a, b = b - a, a / 3.0
    elif -1.0 < a < 0.0:
        a *= 3.0
        new = a + c
        b = new if new > 0.1 else -new
    else:
        b = 7.0
    for _ in range(3):
        if a < 2.0:
            a += 0.7 * abs(c)
    return a, max(b, c), min(a, 0.3)


@inline
def _known_at_times(v):
    """Change what is there only if a constant says so."""
    if FLAG:
        a = v[0]
    b = v[1]
    if FLAG:
        if b > 0.0:
            a = 2.0 * a
        else:
            b = a
    if not FLAG:
        a = v[2]
    return a, b


FLAG = True


@inline
def _powers(v):
    """Take functions that no vector has."""
    a = abs(v[0])
    if a > 0.5:
        a = exp(v[1]) + a**1.7
    return a, a**0.5


@inline
def _searching(v):
    """Loop until a lane is content: called for each by itself."""
    a = abs(v[0]) + 1.0
    for k in range(20):
        if a > 10.0 + v[1]:
            break
        a = a * 1.5 + k
    return a, v[2]


@pytest.mark.parametrize(
    ("function", "width"), [(_early, 2), (_mutating, 3), (_known_at_times, 2), (_powers, 2), (_searching, 2)]
)
def test_branches_returns_and_loops(function, width):
    data = np.random.default_rng(0).normal(size=(COUNT, 3))
    data[0], data[1, 0], data[2, 1] = 0.0, np.nan, np.inf
    python, singly, together = both_ways(function, data, width)
    assert np.array_equal(singly, together, equal_nan=True)
    assert np.allclose(python, together, rtol=1e-14, equal_nan=True)  # powers of Python's library


METAL = StiffenedGas(5328.0, 2.0)
JOHNSON_COOK = JohnsonCook(27.6e9, 0.265e9, 0.426e9, 0.34, 0.015, 1.1, 775.0, 875.0)
MATERIALS = {
    "linear, hardening": Material("m", 2785.0, Linear(79e9), LinearHardening(27.6e9, 0.3e9, 1e9)),
    "stiffened gas": Material("m", 2785.0, METAL, VonMises(27.6e9, 0.3e9), PressureCutoff(-0.5e9, True)),
    "Mie-Grueneisen, Johnson-Cook": Material(
        "m", 2785.0, MieGrueneisen(5328.0, 2.0, 1.338), JOHNSON_COOK, JohnsonCookDamage(0.1, 0.1, 1.0, 0.01, 0.0)
    ),
    "Tillotson, water": Material(
        "m", 1000.0, Tillotson(2.18e9, 13.25e9, 0.7, 0.15, 7e6, 10.0, 5.0, 4.19e5, 2.69e6), NoStrength()
    ),
    "rated spall": Material(
        "m", 2785.0, METAL, VonMises(27.6e9, 0.3e9), PressureCutoff(-1e9, True), spall_strength=1e9, spall_exponent=0.2
    ),
    "rated spall, Johnson-Cook": Material(
        "m",
        2785.0,
        MieGrueneisen(5328.0, 2.0, 1.338),
        JOHNSON_COOK,
        JohnsonCookDamage(0.1, 0.1, 1.0, 0.01, 0.0),
        spall_strength=9e9,
        spall_exponent=0.25,
    ),
    "by stress": Material("m", 2785.0, METAL, VonMises(27.6e9, 0.3e9), PrincipalStress(0.3e9)),
    "fracture energy": Material(
        "m", 2785.0, METAL, JOHNSON_COOK, JohnsonCookDamage(0.1, 0.1, 1.0), fracture=FractureEnergy(1e4, 1e-4)
    ),
    "cracking": Material("m", 2785.0, METAL, VonMises(27.6e9, 0.3e9), GradyKipp(1e34, 9.0)),
}


def _respond(data, i, out, table, models, m):
    s, plastic_strain, damage, p, c, memory = update_stress(
        table, models, m, data[i, 0], data[i, 1], data[i, 2], row_symmetric(data, i, 3, 3), data[i, 9], data[i, 10],
        (data[i, 11], data[i, 12], data[i, 13], data[i, 14], data[i, 15], data[i, 16], data[i, 17], data[i, 18],
         data[i, 19]), row_gradient(data, i, 20, 3))  # fmt: skip
    put(out, i, 0, s)
    put(out, i, 6, (plastic_strain, damage, p, c))
    put(out, i, 10, memory)


def _respond_together(data, near, out, table, models, m):
    for k in range(np.uint64(0), np.uint64(data.shape[0]), np.uint64(LANES)):
        respond(gather(data, near, k), np.uint64(0), gather(out, near, k), table, models, m)


def _respond_singly(data, near, out, table, models, m):
    for k in range(np.uint64(data.shape[0])):
        respond(data, k, out, table, models, m)


@pytest.fixture(scope="module")
def loops():
    """Return the stress update of all models over rows, one at a time and lanes at a time."""
    one = specialise(_respond, update_stress=stress_update.update_stress)
    return [specialise(loop, parallel=False, respond=one) for loop in (_respond_singly, _respond_together)]


@pytest.mark.parametrize("material", MATERIALS.values(), ids=MATERIALS)
def test_the_stress_update_of_every_kind_of_model(loops, material):
    rng, table, models = np.random.default_rng(1), *pack([material])
    data = np.zeros((COUNT, 29))
    data[:, 0] = 1e-8
    data[:, 1] = material.density * rng.uniform(0.8, 1.3, COUNT)
    data[:, 2] = rng.choice([0.0, 1e5, 4e6], COUNT) * rng.random(COUNT)
    data[:, 3:9] = 1e8 * rng.normal(size=(COUNT, 6))
    data[:, 5] = -data[:, 3] - data[:, 4]
    data[:, 9] = rng.choice([0.0, 0.2], COUNT)
    data[:, 10] = rng.choice([0.0, 0.0, 0.3, 1.0], COUNT)
    data[:, 11:20] = stress_update.NO_HISTORY
    data[:, 16] = rng.choice([0.0, 0.9, 1.0], COUNT)
    past = data[:, 16] == 1.0
    data[past, 17:19], data[:, 19] = (2e8, 1e8), 1e-3
    data[:, 20:] = 10.0 ** rng.uniform(3, 8, (COUNT, 1)) * rng.normal(size=(COUNT, 9))
    data[:8, 20:], data[8:16, [22, 25, 26, 27]] = 0.0, 0.0  # at rest; in the plane
    near, made = np.arange(COUNT, dtype=np.uint32), []
    for loop in loops:
        out = np.zeros((COUNT, 19))
        loop(data, near, out, table, models, np.uint64(0))
        made.append(out)
    assert np.array_equal(made[0], made[1], equal_nan=True)
    assert np.isfinite(made[0][:, :10]).all()
    row = python_twin(stress_update.update_stress)
    for k in (3, 20, 33):
        d = data[k].tolist()
        s, *others, memory = row(
            table, models, 0, d[0], d[1], d[2], tuple(d[3:9]), d[9], d[10], tuple(d[11:20]), d[20:]
        )
        assert np.allclose([*s, *others, *memory], made[1][k], rtol=1e-12, atol=1e-4)


def _count(terms, near, number, rounder, wholes):
    for chunk in prange(1):
        counted = np.zeros((2, 3, LANES), np.int64)
        for k in range(np.uint64(0), np.uint64(number), np.uint64(LANES)):
            here = first_lanes(np.uint64(number) - k)
            add_lanes(counted, np.uint64(1), here, gather(terms, near, k)[np.uint64(0)], rounder)
        sum_lanes(wholes, np.uint64(chunk), counted)


def test_lanes_are_counted_as_single_terms_are():
    rng, number = np.random.default_rng(0), COUNT - 3
    terms, near = rng.normal(size=COUNT), np.arange(COUNT, dtype=np.uint32)
    wholes, unit = np.ones((1, 2, 3), np.int64), 2.0**-38
    specialise(_count, parallel=True)(terms, near, number, rounding_constant(unit), wholes)
    assert np.array_equal(wholes[0, :, 1], encode_terms(terms[:number], unit))
    assert not wholes[0, :, ::2].any()
