"""Pair laws: compiled rates against plain twins, balances, frames of reference."""

from dataclasses import fields, replace

import numba
import numpy as np
import pytest
from sph_twins import Cloud, compiled_rates, components, packed, random_cloud, tensile, twin_rates

from hvisph.schemes.protocol import Smoothing
from hvisph.schemes.riemann.scheme import Riemann
from hvisph.schemes.standard.options import GrayArtificialStress, MonaghanViscosity
from hvisph.schemes.standard.scheme import Eulerian
from hvisph.sph.contact import variable_resolution
from hvisph.sph.terms import artificial_stress
from hvisph.sph.terms.limiters import LIMITERS

FORMULATIONS = {
    "standard": Eulerian(viscosity=MonaghanViscosity(1.3, 2.1)),
    "artificial_stress": Eulerian(artificial_stress=GrayArtificialStress()),
    "contact": Riemann(reconstruction=LIMITERS["none"], corrected_variant=False),
    "contact_van_leer": Riemann(reconstruction=LIMITERS["van_leer"], corrected_variant=False),
    "consistent": Riemann(reconstruction=LIMITERS["minmod"], tension_stabilized=False),
    "separating": Riemann(has_contact=True, friction=0.3),
    "unlike": Riemann(has_contact=True, friction=0.3, unequal_spacings=True),
    "elastic": Riemann(has_contact=True, friction=0.3, adjoint=True),
    "following": Riemann(has_contact=True, reconstruction=LIMITERS["none"], smoothing=Smoothing(True)),
}
EVERY = pytest.mark.parametrize("formulation", FORMULATIONS.values(), ids=FORMULATIONS)
DIMS = pytest.mark.parametrize("dim", [1, 2, 3])
# Loops of their own for a text that others of the same dimensions have as well.
ALONE = {("artificial_stress", 1), ("artificial_stress", 3), ("contact", 1), ("contact", 3), ("consistent", 3),
         ("separating", 1), ("separating", 3), ("unlike", 1), ("elastic", 1), ("following", 3)}  # fmt: skip


def every_in(*dims):
    """Every formulation in so many dimensions."""
    return pytest.mark.parametrize(("formulation", "dim"), [
        pytest.param(formulation, dim, id=f"{name}-{dim}", marks=[pytest.mark.slow] * ((name, dim) in ALONE))
        for name, formulation in FORMULATIONS.items() for dim in dims
    ])  # fmt: skip


def turn(dim):
    """Return a rotation about no axis of the grid."""
    q, _ = np.linalg.qr(np.random.default_rng(5).normal(size=(dim, dim)))
    return q if np.linalg.det(q) > 0 else q[:, ::-1]


def assert_same(found, wanted, tolerance):
    """Compare rows of rates, each column on the scale of its largest value."""
    scale = np.abs(wanted).max(axis=0)
    assert np.all(np.abs(found - wanted) <= tolerance * scale)


@every_in(1, 2, 3)
def test_compiled_rates_are_those_of_the_formulas(formulation, dim):
    cloud = random_cloud(dim)
    # sums of up to 80 terms in another order, the largest ten times the sum
    assert_same(compiled_rates(cloud, formulation), twin_rates(cloud, formulation), 1e-12)


@every_in(1, 2, 3)
def test_momentum_and_energy_balance(formulation, dim):
    cloud = random_cloud(dim, seed=3)
    rates = compiled_rates(cloud, formulation)
    force, power = cloud.m[:, None] * rates[:, :dim], cloud.m * rates[:, dim]
    # round-off of 300 terms
    assert np.all(np.abs(force.sum(0)) < 1e-13 * np.abs(force).sum(0))
    work = (force * cloud.u).sum(1)
    assert abs(work.sum() + power.sum()) < 1e-13 * (np.abs(work) + np.abs(power)).sum()


@every_in(1, 2, 3)
def test_rates_do_not_know_the_observers_velocity(formulation, dim):
    cloud = random_cloud(dim)
    moving = replace(cloud, u=cloud.u + 7000.0)
    # 7000 m/s beside 300 m/s costs little more than a digit
    assert_same(compiled_rates(moving, formulation), compiled_rates(cloud, formulation), 1e-11)


@every_in(2, 3)
def test_rates_turn_with_the_body(formulation, dim):
    cloud, q = random_cloud(dim), turn(dim)
    here, there = compiled_rates(cloud, formulation), compiled_rates(cloud.turned(q), formulation)
    last = dim + 2 + dim * dim
    gradients = q @ here[:, dim + 2 : last].reshape(-1, dim, dim) @ q.T
    turned = gradients.reshape(-1, dim * dim)
    further = here[:, last:].copy()
    if getattr(formulation, "adjoint", False):  # the gradient that the next evaluation compares with
        first = 3 + dim * (dim - 1) // 2
        before = q @ further[:, first:].reshape(-1, dim, dim) @ q.T
        further[:, first:] = before.reshape(-1, dim * dim)
    expected = np.hstack([here[:, :dim] @ q.T, here[:, dim : dim + 2], turned, further])
    # a limiter may amplify rounding where slopes nearly cancel
    assert_same(there, expected, 1e-10)


@pytest.mark.parametrize("unlike_spacings", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_faces_of_one_body(unlike_spacings):
    """Compiled as the formulas have it, in balance, and turned as the body is."""
    formulation = Riemann(has_contact=True, friction=0.3, self_contact=True, unequal_spacings=unlike_spacings)
    cloud, q = random_cloud(2), turn(2)
    alone = replace(cloud, body=0.0 * cloud.body)
    for one in (cloud, alone):
        found = compiled_rates(one, formulation)
        assert_same(found, twin_rates(one, formulation), 1e-12)
        force, power = one.m[:, None] * found[:, :2], one.m * found[:, 2]
        assert np.all(np.abs(force.sum(0)) < 1e-13 * np.abs(force).sum(0))
        assert abs((force * one.u).sum() + power.sum()) < 1e-13 * (np.abs(force * one.u).sum() + np.abs(power).sum())
        assert_same(compiled_rates(one.turned(q), formulation)[:, :2], found[:, :2] @ q.T, 1e-10)
    welded = compiled_rates(replace(alone, face=0.0 * cloud.face), formulation)
    assert np.abs(welded - compiled_rates(alone, formulation)).max() > 0.0


@DIMS
def test_corrected_gradients_are_exact_on_linear_fields(dim):
    cloud, rng = random_cloud(dim), np.random.default_rng(1)
    a, s = rng.normal(size=(dim, dim)), rng.normal(size=(dim, dim, dim))
    s = s + s.transpose(1, 0, 2)
    cloud = replace(cloud, u=5.0 + cloud.x @ a.T, stress=3.0 + np.einsum("ijk,nk->nij", s, cloud.x))
    formulation = FORMULATIONS["contact_van_leer"]
    pairs = packed(cloud, formulation)
    pairs._show = lambda *_: None  # packed rows would take the place of gradients
    pairs.evaluate(cloud.h.max())
    rows, slots = pairs.sorted[pairs.place[: len(cloud.x)]], formulation.layout(dim).slots()
    wanted_s = components(np.moveaxis(s, 2, 0)).T.ravel()
    # exact but for rounding: values of 5 against differences of 1e-3
    for name, wanted in (("GU", a.ravel()), ("GT", wanted_s)):
        found = rows[:, slots[name] : slots[name] + len(wanted)]
        assert np.abs(found - wanted).max() < 1e-10


@pytest.mark.parametrize("dim", [2, 3])
def test_a_string_of_particles_keeps_the_plain_gradient(dim):
    cloud = random_cloud(1)
    n, zero = len(cloud.x), np.zeros((len(cloud.x), 1))
    stress = np.zeros((n, dim, dim))
    stress[:, 0, 0] = cloud.stress[:, 0, 0]
    spread = [zero] * (dim - 1)
    x, u = np.hstack([cloud.x, *spread]), np.hstack([cloud.u, *spread])
    string = replace(cloud, x=x, u=u, stress=stress, face=np.zeros_like(x))
    formulation = FORMULATIONS["contact_van_leer"]
    assert_same(compiled_rates(string, formulation), twin_rates(string, formulation), 1e-12)


@EVERY
def test_any_number_of_threads_gives_the_same_bits(formulation):
    cloud = random_cloud(2)
    tiles = [replace(cloud, x=cloud.x + np.array([i, j]) * 9e-3) for i in range(3) for j in range(3)]
    large = Cloud(*(np.concatenate([getattr(t, f.name) for t in tiles]) for f in fields(Cloud)))
    most, before = min(2, numba.config.NUMBA_NUM_THREADS), numba.get_num_threads()
    found = []
    try:
        for threads in (1, most):
            numba.set_num_threads(threads)
            found.append(compiled_rates(large, formulation))
    finally:
        numba.set_num_threads(before)
    assert np.array_equal(*found)


def test_particles_without_shear_meet_as_fluids():
    cloud = random_cloud(2)
    fluid = replace(cloud, c_t=0.0 * cloud.c_t, stress=-np.eye(2) * np.abs(cloud.stress[:, :1, :1]))
    rates = compiled_rates(fluid, FORMULATIONS["contact"])
    assert np.isfinite(rates).all()
    # no impedance, no traction: along the line of centres alone, so angular momentum stays too
    torque = cloud.m * (cloud.x[:, 0] * rates[:, 1] - cloud.x[:, 1] * rates[:, 0])
    assert abs(torque.sum()) < 1e-12 * np.abs(torque).sum()


@pytest.mark.parametrize("shift", [-2.0, 0.0, 2.0])
def test_tensile_parts_are_those_of_the_principal_stresses(shift):
    tensors = np.random.default_rng(2).normal(size=(200, 3, 3))
    tensors = tensors + tensors.transpose(0, 2, 1) + shift * np.eye(3)
    tensors[0] = 0.0
    tensors[1] = np.diag([1.0, -1.0, 0.0])
    tensors[2] = 2.0 * np.eye(3)
    for three, two in zip(tensors, tensors[:, :2, :2], strict=True):
        found = artificial_stress.tensile_part(3)(tuple(components(three[None])[0]))
        assert found == pytest.approx(components(tensile(three[None]))[0], abs=1e-13)  # rounding of values of 5
        found = artificial_stress.tensile_part(2)(tuple(components(two[None])[0]))
        assert found == pytest.approx(components(tensile(two[None]))[0], abs=1e-13)


@DIMS
def test_depths_are_those_of_a_half_space(dim):
    """A lattice that fills a half space: what a particle lacks of its kernel says how deep it lies."""
    kernel, side = Riemann.kernel, {1: 12, 2: 12, 3: 9}[dim]
    axes = [np.arange(side) - side // 2.0] * (dim - 1)
    x = np.stack(np.meshgrid(-0.5 - np.arange(8.0), *axes, indexing="ij"), -1).reshape(-1, dim)
    table = variable_resolution.depths(kernel, 1.2)[
        (dim - 1) * variable_resolution.ENTRIES : dim * variable_resolution.ENTRIES
    ]
    for at in (0.5, 1.5):
        d = x - np.array([-at] + [0.0] * (dim - 1))
        r = np.linalg.norm(d, axis=1)
        near = (r > 0.0) & (r < kernel.reach * 1.2)
        ends = sum(kernel.derivative(size, 1.2, dim) * each / size for size, each in zip(r[near], d[near], strict=True))
        # the table is straight between 257 entries
        assert variable_resolution.depth(tuple(ends), 1.2, table) == pytest.approx(at, abs=2e-3)
