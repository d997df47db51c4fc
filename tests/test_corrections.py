"""Corrected kernels: exactness, balances, the plain twin, safeguards, and the case's side of them."""

import math
from dataclasses import replace

import numba
import numpy as np
import pytest
from sph_twins import compiled_rates, neighbours, packed, random_cloud, tensile

from hvisph.casefile.loader import dump_case, load_case
from hvisph.core.errors import CaseError
from hvisph.output.reader import read_history
from hvisph.schemes.standard.law import LEVEL
from hvisph.schemes.standard.options import PLAIN_GRADIENT, GrayArtificialStress, KernelCorrection
from hvisph.schemes.standard.scheme import Eulerian
from hvisph.setup.formulations import formulation_of
from hvisph.simulation.run import run
from hvisph.sph.neighbours.ghost_rows import Plane
from hvisph.sph.terms.shape_matrix import SINGULAR

KINDS = ("shepard", "gradient", "mixed")
DIMS = pytest.mark.parametrize("dim", [1, 2, 3])


def kinds_and_dims(*kinds):
    """Every kind in 2D, the mixed one in all dimensions; the others compile loops of their own for one text."""
    return pytest.mark.parametrize(("kind", "dim"), [
        pytest.param(kind, dim, marks=[pytest.mark.slow] * (kind != "mixed" and dim != 2)) for kind in kinds for dim in (1, 2, 3)
    ])  # fmt: skip


KIND_AND_DIM = kinds_and_dims(*KINDS)


def corrected(kind="mixed", factor=7.5, by_component=False):
    """The standard form with artificial stress and a correction."""
    correction = KernelCorrection(kind != "gradient", kind != "shepard", factor, by_component)
    return Eulerian(artificial_stress=GrayArtificialStress(), correction=correction)


def kernel_and_gradient(cloud, kernel, a, b):
    """Return W_ab and its gradient at `a`."""
    x_ab = cloud.x[a] - cloud.x[b]
    r, h = np.linalg.norm(x_ab), 0.5 * (cloud.h[a] + cloud.h[b])
    return kernel.value(r, h, cloud.dim), kernel.derivative(r, h, cloud.dim) * x_ab / r


def corrections_of(cloud, formulation, a):
    """Return A (dim, dim) and B (dim) of particle `a`, straight from Young 2021 eqs. 4-5."""
    kernel, dim, volume = formulation.kernel, cloud.dim, cloud.m / cloud.rho
    near = neighbours(cloud, kernel, a)
    plain = np.eye(dim), np.zeros(dim)
    if len(near) < 2:
        return plain
    pairs = {b: kernel_and_gradient(cloud, kernel, a, b) for b in near}
    s, slope = 1.0, np.zeros(dim)
    if formulation.correction.shepard:
        s = volume[a] * kernel.value(0.0, cloud.h[a], dim) + sum(volume[b] * w for b, (w, _) in pairs.items())
        slope = sum(volume[b] * grad for b, (_, grad) in pairs.items())
    k = np.eye(dim)
    if formulation.correction.gradient:
        moment = sum(
            volume[b] * np.outer((grad * s - slope * w) / s**2, cloud.x[b] - cloud.x[a])
            for b, (w, grad) in pairs.items()
        )
        mean = np.trace(moment) / dim
        if not (mean > SINGULAR and np.linalg.det(moment) > SINGULAR * mean**dim):
            return plain
        k = np.linalg.inv(moment)
    return k / s, -k @ slope / s**2


def twin(cloud, formulation):
    """Return rates and fall-backs in plain Python, each particle by the printed sums."""
    kernel, dim, n = formulation.kernel, cloud.dim, len(cloud.x)
    corrections = [corrections_of(cloud, formulation, a) for a in range(n)]
    volume = cloud.m / cloud.rho
    w0 = kernel.shape.py_func(1.0 / formulation.h_over_dx)
    stress = -formulation.artificial_stress.eps * tensile(cloud.stress) / cloud.rho[:, None, None] ** 2
    rows, fallen = [], np.zeros(n)
    for a in range(n):
        acceleration, power, mu_max, gradient = np.zeros(dim), 0.0, 0.0, np.zeros((dim, dim))
        near = neighbours(cloud, kernel, a)
        for b in near:
            x_ab, u_ab = cloud.x[a] - cloud.x[b], cloud.u[a] - cloud.u[b]
            r, h = np.linalg.norm(x_ab), 0.5 * (cloud.h[a] + cloud.h[b])
            w, grad = kernel_and_gradient(cloud, kernel, a, b)
            g_ab = corrections[a][0] @ grad + w * corrections[a][1]
            g_ba = -corrections[b][0] @ grad + w * corrections[b][1]
            if refused(formulation.correction, g_ab, -g_ba, grad, x_ab):
                g_ab, g_ba = grad, -grad
                fallen[a] += 1
            mu = min(h * u_ab @ x_ab / (r**2 + 0.01 * h**2), 0.0)
            mean_c, mean_rho = 0.5 * (cloud.c[a] + cloud.c[b]), 0.5 * (cloud.rho[a] + cloud.rho[b])
            pi = (-formulation.viscosity.alpha * mean_c * mu + formulation.viscosity.beta * mu**2) / mean_rho
            f = (kernel.shape.py_func(r / h) / w0) ** formulation.artificial_stress.exponent
            shared = (f * (stress[a] + stress[b]) - pi * np.eye(dim)) @ (0.5 * (g_ab - g_ba)) * cloud.m[b]
            both = volume[b] / cloud.rho[a] * (cloud.stress[a] @ g_ab - cloud.stress[b] @ g_ba)
            acceleration += both + shared
            power -= u_ab @ (volume[b] / cloud.rho[a] * cloud.stress[a] @ g_ab + 0.5 * shared)
            gradient -= volume[b] * np.outer(u_ab, g_ab)
            mu_max = max(mu_max, -mu)
        plain = np.array_equal(corrections[a][0], np.eye(dim)) and not corrections[a][1].any()
        fallen[a] = len(near) if plain else fallen[a]
        rows.append([*acceleration, power, mu_max, *gradient.ravel()])
    return np.array(rows), fallen


def refused(correction, own, others, plain, x_ab):
    """Whether a pair takes the plain gradient."""
    factor = correction.factor
    if not math.isfinite(factor):
        return False
    if correction.by_component:
        tested = np.abs(x_ab) > LEVEL * np.linalg.norm(x_ab)
        ratios = np.concatenate([(own / plain)[tested], (others / plain)[tested]])
        return bool(np.any(ratios >= factor) or np.any(ratios <= 1.0 / factor))
    return any(
        np.linalg.norm(g) >= factor * np.linalg.norm(plain) or g @ x_ab / (plain @ x_ab) <= 1.0 / factor
        for g in (own, others)
    )


def with_stragglers(cloud):
    """Move one particle far off and two more to each other alone: none and one neighbour."""
    x = cloud.x.copy()
    x[3] += 0.3
    x[5] = x[3] + 0.1
    x[6] = x[5] + 0.4e-3
    return replace(cloud, x=x)


def fallbacks(pairs, count):
    return pairs.sorted[pairs.place[:count], pairs.slots["FALLBACKS"]]


@pytest.mark.parametrize(("kind", "dim", "factor", "by_component"), [
    *(pytest.param(kind, dim, 7.5, False, id=f"limited-{kind}-{dim}")
      for kind, dim in (("shepard", 2), ("gradient", 2), ("mixed", 1), ("mixed", 2), ("mixed", 3))),
    pytest.param("mixed", 2, 7.5, True, id="printed-mixed-2"), pytest.param("mixed", 2, math.inf, False, id="unlimited-mixed-2"),
])  # fmt: skip
def test_compiled_rates_are_those_of_the_formulas(kind, factor, by_component, dim):
    cloud = with_stragglers(random_cloud(dim))
    formulation = corrected(kind, factor, by_component)
    pairs = packed(cloud, formulation)
    pairs.evaluate(cloud.h.max())
    found = pairs.rates[pairs.place[: len(cloud.x)]]
    wanted, fallen = twin(cloud, formulation)
    # sums in another order, of terms ten times the sum and inverses of matrices with conditions up to 20
    assert np.all(np.abs(found - wanted) <= 1e-11 * np.abs(wanted).max(axis=0))
    assert np.array_equal(fallbacks(pairs, len(cloud.x)), fallen)
    assert fallen[5] == fallen[6] == 1


@KIND_AND_DIM
@pytest.mark.parametrize("factor", [1.5, 7.5, math.inf])
def test_momentum_and_energy_balance(kind, factor, dim):
    cloud = with_stragglers(random_cloud(dim, seed=3))
    rates = compiled_rates(cloud, corrected(kind, factor))
    force, power = cloud.m[:, None] * rates[:, :dim], cloud.m * rates[:, dim]
    # round-off of 300 terms
    assert np.all(np.abs(force.sum(0)) < 1e-13 * np.abs(force).sum(0))
    work = (force * cloud.u).sum(1)
    assert abs(work.sum() + power.sum()) < 1e-13 * (np.abs(work) + np.abs(power)).sum()


@kinds_and_dims("gradient", "mixed")
def test_the_gradient_of_a_linear_field_is_exact_up_to_free_surfaces(kind, dim):
    cloud = random_cloud(dim, seed=7)
    slope = np.random.default_rng(2).normal(size=(dim, dim))
    cloud = replace(cloud, u=3.0 + cloud.x @ slope.T)
    found = compiled_rates(cloud, corrected(kind, math.inf))[:, dim + 2 :]
    # exact but for rounding: velocities of 3 against differences of 1e-3
    assert found == pytest.approx(np.tile(slope.ravel(), (len(found), 1)), abs=1e-10)
    # what it puts right: the plain gradient misses by half at an end, an edge, a corner
    plain = compiled_rates(cloud, Eulerian(artificial_stress=GrayArtificialStress(), product=True))[:, dim + 2 :]
    assert np.abs(plain - slope.ravel()).max() > 0.3 * np.abs(slope).max()


@kinds_and_dims("shepard", "mixed")
def test_the_corrected_kernel_sums_to_one(kind, dim):
    """sum_b V_b W~_ab = 1 at every place, so its gradient there, the particle's own share included, is 0."""
    cloud = random_cloud(dim, seed=1)
    formulation = corrected(kind, math.inf)
    pairs = packed(cloud, formulation)
    pairs.evaluate(cloud.h.max())
    rows, slots, volume = pairs.sorted[pairs.place[: len(cloud.x)]], pairs.slots, cloud.m / cloud.rho
    kernel = formulation.kernel
    for a in range(0, len(cloud.x), 7):
        matrix = rows[a, slots["A"] : slots["A"] + dim * dim].reshape(dim, dim)
        shift = rows[a, slots["B"] : slots["B"] + dim]
        own = volume[a] * kernel.value(0.0, cloud.h[a], dim)
        near = [(volume[b], *kernel_and_gradient(cloud, kernel, a, b)) for b in neighbours(cloud, kernel, a)]
        gradient = own * shift + sum(v * (matrix @ grad + w * shift) for v, w, grad in near)
        size = own * np.abs(shift) + sum(v * np.abs(matrix @ grad) for v, w, grad in near)
        assert np.all(np.abs(gradient) < 1e-13 * size.max())  # rounding of 80 terms
        if kind == "shepard":
            assert matrix[0, 0] * (own + sum(v * w for v, w, _ in near)) == pytest.approx(1.0, rel=1e-13)


@DIMS
def test_with_every_pair_fallen_back_it_is_the_product_form(dim):
    cloud = random_cloud(dim)
    rates = compiled_rates(cloud, corrected("mixed", 1.0 + 1e-12))
    product = compiled_rates(cloud, Eulerian(artificial_stress=GrayArtificialStress(), product=True))
    # a factor of 1 leaves no pair corrected; sums in another order
    assert np.all(np.abs(rates - product) <= 1e-12 * np.abs(product).max(axis=0))


@DIMS
def test_a_symmetry_plane_stands_for_the_mirrored_half(dim):
    half = random_cloud(dim, seed=4)
    half = replace(half, x=half.x + np.eye(dim)[0] * (0.4e-3 - half.x[:, 0].min()))
    whole = half.with_image(0, 0.0)
    formulation, count = corrected(), len(half.x)
    pairs = packed(half, formulation, (Plane(0, 0.0),))
    pairs.evaluate(half.h.max())
    found, wanted = pairs.rates[pairs.place[:count]], compiled_rates(whole, formulation)[:count]
    assert np.all(np.abs(found - wanted) <= 1e-11 * np.abs(wanted).max(axis=0))  # as for the twin


@DIMS
def test_one_thread_and_two_give_the_same_bits(dim):
    cloud, found = random_cloud(dim), []
    pairs = packed(cloud, corrected())
    before = numba.get_num_threads()
    try:
        for threads in (1, min(2, numba.config.NUMBA_NUM_THREADS)):
            numba.set_num_threads(threads)
            pairs.evaluate(cloud.h.max())
            found.append((pairs.rates.copy(), fallbacks(pairs, len(cloud.x))))
    finally:
        numba.set_num_threads(before)
    assert np.array_equal(found[0][0], found[1][0])
    assert np.array_equal(found[0][1], found[1][1])


def test_a_run_keeps_its_energy_and_counts_its_fallbacks(tmp_path):
    case = load_case(
        "al_al",
        overrides=[
            *("resolution=0.4 mm", "time.end=1.5 us", "output.every=1.5 us", "expected={}"),
            *("formulation.correction.type=mixed", "formulation.artificial_stress.type=gray"),
        ],
    )
    outcome = run(case, tmp_path / "run", threads=1)
    assert outcome.summary["status"] == "done"
    conservation = outcome.summary["conservation"]
    assert abs(conservation["energy_drift"]) < 1e-12  # kept pair by pair: rounding of 140 steps
    assert abs(conservation["momentum_drift"]) < 1e-12
    counts = np.asarray(read_history(outcome.folder)["correction_fallbacks"], float)
    assert np.all(counts == np.round(counts))
    # 1155 particles with 20 neighbours: the free surfaces' gradients, never most of them
    assert 0 < counts[-1] < 0.3 * 1155 * 20


CORRECTED = {"type": "eulerian", "correction": {"type": "mixed"}}


@pytest.mark.parametrize(
    ("stress", "factor"), [({"type": "none"}, 7.5), ({"type": "gray"}, 90.0), (None, 7.5)], ids=str
)
def test_the_factor_follows_from_artificial_stress_and_is_written_out(stress, factor):
    formulation = CORRECTED | ({"artificial_stress": stress} if stress else {})
    case = load_case(_plain() | {"formulation": formulation})
    assert case.formulation.correction.factor == factor
    assert case.formulation.momentum_form == "product"
    assert f"factor: {factor}" in dump_case(case)
    scheme = formulation_of(case)
    assert scheme.correction.acts
    assert scheme.correction == KernelCorrection(True, True, factor)


def test_no_correction_is_the_standard_formulation():
    case = load_case(_plain() | {"formulation": {"type": "eulerian", "correction": {"type": "none"}}})
    assert formulation_of(case).correction == PLAIN_GRADIENT


@pytest.mark.parametrize(
    ("formulation", "where"),
    [
        (CORRECTED | {"momentum_form": "sigma_over_rho_squared"}, "momentum_form"),
        (CORRECTED | {"density_dissipation": {"type": "zisis"}}, "density_dissipation"),
        (CORRECTED | {"density_form": "mass"}, "density_form"),
        (CORRECTED | {"viscosity": {"type": "balsara"}}, "viscosity"),
        (CORRECTED | {"contact": {"type": "penalty"}}, "contact"),
        ({"type": "eulerian", "correction": {"type": "mixed", "factor": 1.0}}, "factor"),
        ({"type": "eulerian", "correction": {"type": "mixd"}}, "did you mean 'mixed'"),
        ({"type": "eulerian", "correction": {"type": "none", "factor": 2.0}}, "factor"),
        ({"type": "riemann", "correction": {"type": "mixed"}}, "correction"),
    ],
)
def test_what_has_no_meaning_is_refused(formulation, where):
    with pytest.raises(CaseError, match=where):
        load_case(_plain() | {"formulation": formulation})


def _plain():
    box = {"material": "aluminium-howell-ball", "shape": {"type": "box", "size": [4e-3, 4e-3]}}
    return {
        "kinematics": "plane_strain", "resolution": 5e-4, "time": {"end": 1e-6},
        "bodies": {"projectile": box | {"velocity": [1000.0, 0.0]}, "target": box},
    }  # fmt: skip
