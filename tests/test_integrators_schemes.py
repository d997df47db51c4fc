"""Time integrators: order in dt, conservation, criteria."""

import itertools

import numba
import numpy as np
import pytest

from hvisph.compiler.jit import specialise
from hvisph.core.particles import Particles
from hvisph.integrators import sums as column
from hvisph.integrators.scheme import SCHEMES
from hvisph.integrators.sums import COUNTED, add_chunks
from hvisph.integrators.time_step import Criteria
from hvisph.materials.eos import StiffenedGas
from hvisph.materials.material_table import Material
from hvisph.materials.strength import ElasticStrength, VonMises
from hvisph.schemes.riemann.scheme import Riemann
from hvisph.schemes.standard.options import NO_VISCOSITY, GrayArtificialStress
from hvisph.schemes.standard.scheme import Eulerian
from hvisph.schemes.stepper import Stepper
from hvisph.sph.neighbours.cells import Grid

ELASTIC = Material("elastic", 2785.0, StiffenedGas(5328.0, 2.0), ElasticStrength(27.6e9))
PLASTIC = Material("plastic", 2785.0, StiffenedGas(5328.0, 2.0), VonMises(27.6e9, 0.3e9))
EVERY = pytest.mark.parametrize("scheme", SCHEMES.values(), ids=SCHEMES)
DX = 1e-3


def stepper(x, u, formulation, material, scheme, numbers=None):
    """Return a `Stepper`, started, of particles at `x` (n, dim) with velocities `u` and permanent `numbers`."""
    n, dim = x.shape
    particles = Particles(dim, n, scheme.extra_fields())
    particles["position"], particles["velocity"] = x, u
    particles["density"], particles["mass"] = material.density, material.density * DX**dim
    particles["smoothing_length"] = 1.4 * DX
    particles.tags[:, 0] = np.arange(n) if numbers is None else numbers
    made = Stepper(particles, formulation, [material], scheme.stage, scheme.previous, 1.4 * DX)
    made.start()
    if scheme.previous:
        made.complete(0.0, 0.0)
    return made


def advance(made, steps, dt):
    """Take `steps` steps of `dt` [s]."""
    made.predict(dt)
    for _ in range(steps):
        made.evaluate()
        made.complete(dt, dt)


def colliding_blocks():
    """Return positions and velocities of two small blocks about to meet."""
    axes = np.meshgrid(np.arange(12), np.arange(10), indexing="ij")
    x = (np.stack(axes, -1).reshape(-1, 2) + 0.5) * DX
    rng = np.random.default_rng(0)
    u = np.where(x[:, :1] < 6 * DX, [[900.0, 50.0]], [[-900.0, 0.0]])
    return x + 0.05 * DX * rng.normal(size=x.shape), u


@EVERY
def test_a_smooth_wave_converges_to_second_order_in_time(scheme):
    x = (np.arange(60) + 0.5)[:, None] * DX
    u = 20.0 * np.exp(-(((x - 0.03) / 6e-3) ** 2))
    states = []
    for steps in (40, 80, 160):
        made = stepper(x, u, Eulerian(viscosity=NO_VISCOSITY), ELASTIC, scheme)
        advance(made, steps, 2e-6 / steps)
        p = made.particles
        states.append([p["position"][:, 0], p["velocity"][:, 0], p["density"], p["deviator"][:, 0],
                       p["internal_energy"]])  # fmt: skip
    for coarse, middle, fine in zip(*states, strict=True):
        ratio = np.linalg.norm(coarse - middle) / np.linalg.norm(middle - fine)
        assert np.log2(ratio) == pytest.approx(2.0, abs=0.1)  # higher orders of steps up to a third of dx/c


# of standard SPH by the other schemes: `test_cadence`, whose loops are compiled anyway
@pytest.mark.parametrize(("scheme", "formulation"), [
    (SCHEMES["leapfrog"], Eulerian(artificial_stress=GrayArtificialStress())), *((one, Riemann()) for one in SCHEMES.values()),
], ids=["standard-leapfrog", *(f"contact-{name}" for name in SCHEMES)])  # fmt: skip
def test_energy_and_momentum_keep_at_any_step(scheme, formulation):
    x, u = colliding_blocks()
    made = stepper(x, u, formulation, PLASTIC, scheme)
    before = made.sums.copy()
    advance(made, 40, 0.3 * DX / 7000.0)
    total = before[column.KINETIC] + before[column.INTERNAL]
    change = made.sums - before
    assert made.sums[column.INTERNAL] > 0.2 * total  # it is an impact
    assert abs(change[column.KINETIC] + change[column.INTERNAL]) < 1e-13 * total  # rounding of 40 steps
    momentum = np.abs(made.particles["mass"][:, None] * u).sum()
    assert np.abs(change[column.MOMENTUM : column.MOMENTUM + 2]).max() < 1e-13 * momentum


@pytest.mark.parametrize("formulation", [Eulerian(artificial_stress=GrayArtificialStress()), Riemann()],
                         ids=["standard", "contact"])  # fmt: skip
def test_any_number_of_threads_any_order_of_memory_and_any_torus(formulation):
    scheme, states = SCHEMES["leapfrog"], []
    x, u = colliding_blocks()
    x = np.vstack([x + np.array([0.0, 0.01 * k]) for k in range(5)])  # more than one chunk
    u, numbers = np.tile(u, (5, 1)), np.arange(len(x))
    shuffled = np.random.default_rng(1).permutation(numbers)
    before = numba.get_num_threads()
    try:
        for threads, start, torus in ((1, numbers, None), (2, numbers, (4, 4, 1)), (1, shuffled, (16, 8, 1))):
            numba.set_num_threads(min(threads, numba.config.NUMBA_NUM_THREADS))
            made = stepper(x[start], u[start], formulation, PLASTIC, scheme, start)
            if torus:
                made.pairs.grid = Grid(torus, made.pairs.grid.edge)
            for _ in range(4):
                advance(made, 5, 0.3 * DX / 7000.0)
                if threads == 1:
                    made.permute()
            order = np.argsort(made.particles.id)
            states.append((made.particles.data[order], made.sums))
    finally:
        numba.set_num_threads(before)
    for state, sums in states[1:]:
        assert np.array_equal(state, states[0][0])
        assert np.array_equal(sums, states[0][1])


def test_sums_over_chunks_have_a_plain_twin():
    rng = np.random.default_rng(3)
    wholes, extremes = rng.integers(-(2**50), 2**50, (7, 2, COUNTED)), rng.random((7, 3))
    for broken in (None, 0, 1):
        if broken is not None:
            extremes[4, broken] = np.nan
        parts, whole = np.zeros((2, COUNTED), np.int64), np.zeros(3)
        specialise(add_chunks, parallel=False)(wholes, extremes, parts, whole)
        assert np.array_equal(parts, wholes.sum(0))
        assert np.array_equal(whole[:2], extremes[:, :2].max(0), equal_nan=True)
        assert whole[2] == pytest.approx(extremes[:, 2].sum(), rel=1e-14)  # in another order


def test_the_limit_has_a_plain_twin():
    rng, n = np.random.default_rng(1), 900
    criteria, numbers, place = Criteria(3, n, 0.3, 2.4), rng.permutation(n).astype(np.uint32), np.arange(n)
    for steep in (1e8, 1e11):  # neither and either criterion limits
        lengths, signals = rng.choice([1e-3, 2e-3], n), rng.choice([4e3, 5e3], n)
        rates = rng.choice([0.0, 1.0], (n, 14)) * ([steep] * 3 + [0.0, 900.0] + [0.0] * 9)
        found = criteria.limit(lengths, signals, rates, place.astype(np.uint32), numbers)
        times = lengths / (signals + 2.4 * rates[:, 4])
        with np.errstate(divide="ignore"):
            more = lengths * lengths / ((rates[:, 0] ** 2 + rates[:, 1] ** 2) + rates[:, 2] ** 2)
        by, at = ("acceleration", more) if np.sqrt(np.sqrt(more.min())) < times.min() else ("signal", times)
        first = min(np.flatnonzero(at == at.min()), key=lambda s: numbers[s])
        assert (found.criterion, found.particle, found.unrounded) == (by, first, at.min())


def test_the_limit_names_criterion_and_particle():
    criteria = Criteria(2, 1000, 0.3, 2.4)
    rng = np.random.default_rng(0)
    lengths, signals, rates = np.full(1000, 1e-3), np.full(1000, 5000.0), np.zeros((1000, 8))
    place, numbers = rng.permutation(1000).astype(np.uint32), rng.permutation(1000).astype(np.uint32)
    rates[:, 0] = 1e3
    found = criteria.limit(lengths, signals, rates, place, numbers)  # all alike
    assert (found.criterion, numbers[found.particle]) == ("signal", 0)
    rates[place[700], 3] = 2500.0  # largest |mu|: 5000 + 2.4 * 2500 m/s
    found = criteria.limit(lengths, signals, rates, place, numbers)
    assert (found.criterion, found.particle) == ("signal", 700)
    assert found.dt == pytest.approx(0.3 * 1e-3 / 11000.0)
    rates[place[300], 1] = 1e13
    found = criteria.limit(lengths, signals, rates, place, numbers)
    assert (found.criterion, found.particle) == ("acceleration", 300)
    assert found.dt == pytest.approx(0.3 * np.sqrt(1e-3 / np.hypot(1e3, 1e13)))
    for slot, value in itertools.product(range(8), (np.nan, np.inf)):
        broken = rates.copy()
        broken[place[42], slot] = value
        found = criteria.limit(lengths, signals, broken, place, numbers)
        assert (found.criterion, found.particle) == ("not_finite", 42)
    signals[:2] = 1e308  # finite, as their sum is not
    assert criteria.limit(lengths, signals, rates, place, numbers).criterion == "signal"
