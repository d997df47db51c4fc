"""SPH-projection: each pass against plain NumPy, momentum, body force, clamps, mirrors, threads, restart."""

import numba
import numpy as np
import pytest

from hvisph.core.particles import CLAMPED, FLAGS, ID, MATERIAL, Particles
from hvisph.integrators import sums as column
from hvisph.materials.damage import NoDamage
from hvisph.materials.eos import StiffenedGas
from hvisph.materials.material_table import Material
from hvisph.materials.strength import VonMises
from hvisph.schemes.projection.rows import TrailingMean
from hvisph.schemes.projection.stepper import Projection, ProjectionStepper
from hvisph.schemes.protocol import Smoothing
from hvisph.sph.kernels import CUBIC_SPLINE
from hvisph.sph.neighbours.ghost_rows import Plane

DX = 1e-4
STEP = 1e-10
STEEL = Material("steel", 7900.0, StiffenedGas(4600.0, 2.17), VonMises(85.3e9, 0.979e9), NoDamage())
ALUMINIUM = Material("aluminium", 2785.0, StiffenedGas(5328.0, 2.0), VonMises(27.6e9, 0.3e9), NoDamage())
# 1 / (-A rho h^2) for the cubic spline and endless neighbours: integrals in closed form.
FULLNESS = {1: 1.0 / (8.0 * np.log(2.0)), 2: 7.0 / 40.0, 3: 1.0 / 6.0}
SIDES = {1: (60,), 2: (12, 9), 3: (6, 5, 5)}


def block(dim, shaken=0.1, seed=1):
    """Two materials that meet at x = 0 and approach, their particles shaken off the lattice."""
    random = np.random.default_rng(seed)
    axes = [(np.arange(n) - 0.5 * (n - 1)) * DX for n in SIDES[dim]]
    position = np.stack([a.ravel() for a in np.meshgrid(*axes, indexing="ij")], axis=1)
    count = len(position)
    particles = Particles(dim, count, ("pressure",))
    left = position[:, 0] < 0.0
    density = np.where(left, STEEL.density, ALUMINIUM.density)
    particles["position"] = position + shaken * DX * random.uniform(-1.0, 1.0, position.shape)
    particles["velocity"] = 300.0 * random.normal(size=position.shape)
    particles["velocity"][left, 0] += 1000.0
    particles["mass"], particles["density"] = density * DX**dim, density
    particles["smoothing_length"] = 1.5 * DX
    particles["pressure"] = 1e9 * random.normal(size=count)
    deviator = 1e8 * random.normal(size=particles["deviator"].shape)
    deviator[:, :3] -= deviator[:, :3].mean(axis=1, keepdims=True)
    if dim == 1:  # as uniaxial strain keeps it
        deviator[:, 1] = deviator[:, 2] = -0.5 * deviator[:, 0]
    particles["deviator"] = deviator
    particles.tags[:, ID], particles.tags[:, MATERIAL] = np.arange(count), ~left
    return particles


def stepper_of(particles, planes=(), **options):
    made = ProjectionStepper(particles, Projection(**options), [STEEL, ALUMINIUM], 0.5, 0.0, 1.5 * DX, planes)
    made.start()
    return made


def run(made, steps, step=STEP):
    made.predict(step)
    for number in range(1, steps + 1):
        made.evaluate()
        made.complete(step, step)
        if number % 16 == 0:
            made.permute()
    return made


def by_id(particles, name):
    return particles[name][np.argsort(particles.id)]


def gradients(x, h):
    """grad_a W_ab (n, n, dim) of the cubic spline, and r^2."""
    dim = x.shape[1]
    apart = x[:, None, :] - x[None, :, :]
    r = np.sqrt((apart**2).sum(axis=2))
    hm = 0.5 * (h[:, None] + h[None, :])
    q = r / hm
    slope = np.where(q < 1.0, -3.0 * q + 2.25 * q**2, np.where(q < 2.0, -0.75 * (2.0 - q) ** 2, 0.0))
    np.fill_diagonal(r, 1.0)
    factor = CUBIC_SPLINE.norm(dim) / hm ** (dim + 1) * slope / r
    np.fill_diagonal(factor, 0.0)
    np.fill_diagonal(r, 0.0)
    return factor[:, :, None] * apart, r**2, apart


def full(tensor, dim):
    """In-plane matrices (n, dim, dim) of stored symmetric tensors."""
    at = {1: [[0]], 2: [[0, 3], [3, 1]], 3: [[0, 3, 4], [3, 1, 5], [4, 5, 2]]}[dim]
    return tensor[:, at]


def twin(before, deviator, printed, min_support, force):
    """A step in plain NumPy, with the deviator that the first pass arrived at."""
    dim = before["position"].shape[1]
    x, u, m, rho, h, p = (
        before[k] for k in ("position", "velocity", "mass", "density", "smoothing_length", "pressure")
    )
    g, r2, apart = gradients(x, h)
    volume = m / rho
    gradient = -np.einsum("b,abi,abj->aij", volume, u[:, None] - u[None, :], g)
    stress = full(deviator, dim) / (rho**2)[:, None, None]
    acceleration = np.einsum("b,abij,abj->ai", m, stress[:, None] + stress[None, :], g) + force
    tentative = u + STEP * acceleration
    between = tentative[:, None] - tentative[None, :]
    density = rho * (1.0 + STEP * np.einsum("b,abi,abi->a", volume, between, g))
    c = 8.0 * (apart * g).sum(axis=2) / ((rho[:, None] + rho) ** 2 * (r2 + (0.1 * 1.5 * DX) ** 2))
    diagonal = c @ m
    found = ((rho - density) / (rho * STEP**2) + c @ (m * p)) / diagonal
    found[-diagonal * rho * h**2 * FULLNESS[dim] < min_support] = 0.0
    if printed:
        pair = (found / rho**2)[:, None] + found / rho**2
    else:
        pair = (found[:, None] + found) / (rho[:, None] * rho)
    acceleration = acceleration - np.einsum("b,ab,abi->ai", m, pair, g)
    after = u + STEP * acceleration
    return {
        "gradient": gradient,
        "pressure": found,
        "velocity": after,
        "position": x + 0.5 * STEP * (u + after),
    }


def near(found, expected):
    # sums of 30 to 100 terms of both signs, in another order
    return np.allclose(found, expected, rtol=1e-9, atol=1e-11 * np.abs(expected).max())


@pytest.mark.parametrize(("dim", "printed"), [(1, False), (2, False), (2, True), (3, False)])
def test_passes_follow_the_formulas(dim, printed):
    particles = block(dim)
    min_support = 0.45
    force = np.array([3e9, -1e9, 2e9])[:dim]
    made = stepper_of(particles, original_gradient=printed, min_support=min_support, body_force=tuple(force))
    before = {name: particles[name].copy() for name in particles.names}
    made.predict(STEP)
    made.evaluate()
    expected = twin(before, particles["deviator"], printed, min_support, force)
    gradient = made.rates[:, dim + 2 :].reshape(-1, dim, dim)
    assert near(gradient, expected["gradient"])
    assert near(particles["pressure"], expected["pressure"])
    assert 0 < (particles["pressure"] == 0.0).sum() < particles.count
    made.complete(STEP, STEP)
    assert near(particles["velocity"], expected["velocity"])
    assert near(particles["position"], expected["position"])
    assert (particles["density"] == before["density"]).all()


@pytest.mark.parametrize("dim", [1, 2, 3])
def test_deviator_is_that_of_the_stress_update(dim):
    """Hooke's law and the Jaumann rate below yield, to first order in the tiny step; traceless always."""
    particles = block(dim)
    made = stepper_of(particles)
    old = particles["deviator"].copy()
    step = 1e-14
    made.predict(step)
    made.evaluate()
    whole = np.zeros((particles.count, 3, 3))
    whole[:, :dim, :dim] = made.rates[:, dim + 2 :].reshape(-1, dim, dim)
    rate = 0.5 * (whole + whole.transpose(0, 2, 1))
    spin = 0.5 * (whole - whole.transpose(0, 2, 1))
    stress = np.zeros((particles.count, 3, 3))
    stress[:, :dim, :dim] = full(old, dim)
    stress[:, [0, 1, 2], [0, 1, 2]] = old[:, :3]
    shear = np.where(particles["density"] > 5000.0, 85.3e9, 27.6e9)[:, None, None]
    trace = np.trace(rate, axis1=1, axis2=2)[:, None, None] / 3.0
    change = 2.0 * shear * (rate - trace * np.eye(3)) + spin @ stress - stress @ spin
    elastic = particles["plastic_strain"] == 0.0
    assert elastic.sum() > 20
    found = (particles["deviator"] - old)[elastic, 0] / step
    # differences of stresses of 1e8 Pa over steps of some Pa
    assert np.allclose(found, change[elastic, 0, 0], rtol=1e-6, atol=1e-5 * np.abs(change).max())
    assert np.abs(particles["deviator"][:, :3].sum(axis=1)).max() < 1e-6 * 1e9


@pytest.mark.parametrize(("dim", "options"), [(1, {}), (2, {}), (2, {"original_gradient": True}), (3, {}),
                                              (2, {"smoothing": Smoothing(True)})])  # fmt: skip
def test_momentum_stays(dim, options):
    particles = block(dim)
    made = stepper_of(particles, **options)
    start = made.sums[column.MOMENTUM : column.MOMENTUM + 3].copy()
    size = (particles["mass"] * np.linalg.norm(particles["velocity"], axis=1)).sum()
    run(made, 40, 1e-11)
    assert np.isfinite(particles.data).all()
    # round-off of forces that are a thousand times what they leave
    assert np.abs(made.sums[column.MOMENTUM : column.MOMENTUM + 3] - start).max() < 1e-12 * size


def test_guard_factor():
    for dim, expected in FULLNESS.items():
        assert Projection().fullness(dim) == pytest.approx(expected, rel=1e-6)


def test_free_fall():
    """A body that nothing touches falls as a whole: no stress, no pressure, only g."""
    particles = block(2, shaken=0.0)
    particles["velocity"], particles["pressure"], particles["deviator"] = 0.0, 0.0, 0.0
    start = particles["position"].copy()
    made = run(stepper_of(particles, body_force=(0.0, -9.81)), 50)
    t = 50 * STEP
    assert np.allclose(by_id(particles, "velocity"), [0.0, -9.81 * t], rtol=1e-9, atol=1e-15)
    assert np.allclose(by_id(particles, "position") - start, [0.0, -0.5 * 9.81 * t**2], rtol=0, atol=1e-16 * 10)
    # gravity is momentum from outside, which the budget takes from SUPPORT
    gained = made.sums[column.MOMENTUM + 1]
    assert gained == pytest.approx(-t * made.sums[column.SUPPORT + 1], rel=1e-9)


def test_clamped_particles_stay_and_what_they_take_is_counted():
    particles = block(2)
    held = particles["position"][:, 0] > 0.45 * SIDES[2][0] * DX * 0.9
    particles.tags[held, FLAGS] = CLAMPED
    particles["velocity"][held] = 0.0
    place = particles["position"][held].copy()
    made = stepper_of(particles)
    before = made.sums[column.MOMENTUM]
    taken = 0.0
    made.predict(1e-11)
    for _ in range(10):
        made.evaluate()
        made.complete(1e-11, 1e-11)
        taken += 1e-11 * made.sums[column.SUPPORT]
    assert (particles["position"][held] == place).all()
    assert abs(taken) > 0.0
    assert made.sums[column.MOMENTUM] + taken == pytest.approx(before, rel=1e-10)


def test_mirror_is_as_good_as_the_other_half():
    whole = block(2, shaken=0.0)
    u = whole["velocity"]
    x = whole["position"]
    x[:, 1] += 0.5 * DX  # nine rows: shift so that none lies on the plane
    whole["velocity"][:, 1], whole["deviator"], whole["pressure"] = 0.0, 0.0, 0.0
    u[:, 0] = np.where(x[:, 0] < 0.0, 500.0, 0.0)
    upper = x[:, 1] > 0.25 * DX
    half = Particles(2, int(upper.sum()), ("pressure",))
    half.data[...] = whole.data[upper]
    half.tags[...] = whole.tags[upper]
    half.tags[:, ID] = np.arange(half.count)
    both = Particles(2, 2 * half.count, ("pressure",))
    both.data[: half.count], both.data[half.count :] = half.data, half.data
    both["position"][half.count :, 1] *= -1.0
    both.tags[: half.count], both.tags[half.count :] = half.tags, half.tags
    both.tags[:, ID] = np.arange(both.count)
    run(stepper_of(half, (Plane(1, 0.0),)), 40)
    run(stepper_of(both), 40)
    # the same sums in another order, over 40 steps
    for name, size in (("position", DX), ("velocity", 500.0), ("pressure", 1e11)):
        found, expected = by_id(half, name), by_id(both, name)[: half.count]
        assert np.allclose(found, expected, rtol=1e-8, atol=1e-8 * size)
    assert np.abs(by_id(half, "velocity")[:, 1]).max() > 1.0


@pytest.mark.skipif(numba.config.NUMBA_NUM_THREADS < 2, reason="needs two threads")
def test_two_threads_give_the_bits_of_one():
    ends = []
    for threads in (1, 2):
        numba.set_num_threads(threads)
        particles = block(3)
        run(stepper_of(particles), 40, 1e-11)
        ends.append(particles.data.copy())
    numba.set_num_threads(numba.config.NUMBA_NUM_THREADS)
    assert (ends[0] == ends[1]).all()


def test_an_old_list_serves_as_well_as_a_new_one():
    particles, other = block(2), block(2)
    kept, fresh = stepper_of(particles), stepper_of(other)
    for made in (kept, fresh):
        made.predict(1e-11)
    lists = 0
    for _ in range(30):
        lists += kept._is_stale()
        fresh._path = np.inf
        for made in (kept, fresh):
            made.evaluate()
            made.complete(1e-11, 1e-11)
    assert 0 < lists < 30
    assert np.allclose(particles["velocity"], other["velocity"], rtol=1e-9, atol=1e-6)


def test_a_restored_run_goes_on_with_the_same_bits():
    particles = block(2)
    made = run(stepper_of(particles), 21, 1e-11)
    saved = [{name: values.copy() for name, values in one.items()} for one in (made.get_carried(), made.history())]
    other = Particles(2, particles.count, ("pressure",))
    other.data[...], other.tags[...] = particles.data, particles.tags
    again = stepper_of(block(2))
    again.particles.data[...], again.particles.tags[...] = other.data, other.tags
    again.restore(*saved)
    for one in (made, again):
        for _ in range(20):
            one.evaluate()
            one.complete(1e-11, 1e-11)
    assert (made.particles.data == again.particles.data).all()
    assert (made.pressures == again.pressures).all()


def test_trailing_mean():
    """Two constants and a ramp, through a change of order."""
    ids = np.array([2, 0, 1])
    mean = TrailingMean(3, 1.0)
    for number in range(300):
        values = np.array([1.0, 2.0, 0.01 * number])
        mean.add(values[ids], 0.01)
        if number == 9:  # before the run the field was zero, for the rest of a window of 0.95
            assert mean.mean()[1] == pytest.approx(0.1 / 0.95)
        if number == 152:
            order = np.array([1, 2, 0])
            mean.permute(order)
            ids = ids[order]
    found = mean.mean()[np.argsort(ids)]
    assert found[:2] == pytest.approx([1.0, 2.0])
    # the last 0.95 to 1 of a ramp that has come to 3
    assert found[2] == pytest.approx(2.5, abs=0.05)
