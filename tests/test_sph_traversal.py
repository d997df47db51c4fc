"""The traversal of pairs: every neighbour once, wherever particles are; images at symmetry planes."""

import numpy as np
import pytest
from sph_twins import compiled_rates, packed, random_cloud

from hvisph.core.errors import RunError
from hvisph.formulations.eulerian import Eulerian
from hvisph.formulations.options import GrayArtificialStress
from hvisph.formulations.riemann import Riemann
from hvisph.sph import traversal
from hvisph.sph.cells import Grid
from hvisph.sph.kernels import CUBIC_SPLINE
from hvisph.sph.pairs import Pairs, Pass
from hvisph.sph.rows import RowLayout
from hvisph.sph.symmetry import Plane


def collect(near, n, rows, i, constants, out):
    """Write how many neighbours particle `i` has, and two sums over their numbers."""
    count, numbers, squares = 0.0, 0.0, 0.0
    for k in range(n):
        j = np.uint64(near[k])
        if rows[j, 0] < 1e29:  # not the row that fills lists up
            count += 1.0
            numbers += rows[j, ID]  # noqa: F821
            squares += rows[j, ID] ** 2  # noqa: F821
    out[i, 0] = count
    out[i, 1] = numbers
    out[i, 2] = squares


def made(x, h):
    """Return `Pairs` that collect the neighbours of particles at `x` (n, dim) with lengths `h` (n,)."""
    n, dim = x.shape
    layout = RowLayout(dim, (("x", "vector"), ("h", "scalar"), ("id", "scalar")))
    pairs = Pairs(layout, CUBIC_SPLINE, [Pass(collect, layout, {})], np.zeros(1), x, h.max())
    pairs.rows[:, :dim], pairs.rows[:, dim], pairs.rows[:, dim + 1] = x, h, np.arange(n)
    return pairs


def assert_complete(pairs, x, h):
    """Compare what the traversal finds with all pairs of particles."""
    pairs.evaluate(h.max())
    found = pairs.rates[pairs.place[: len(x)], :3]
    distance2 = ((x[:, None] - x[None]) ** 2).sum(-1)
    near = distance2 < (h[:, None] + h[None]) ** 2
    np.fill_diagonal(near, False)
    numbers = np.arange(len(x))
    assert np.array_equal(found, np.stack([near.sum(1), near @ numbers, near @ numbers**2], 1))


def plate(dim, thick, spacing, seed=0):
    """Return a disturbed plate, `thick` particles along x."""
    axes = [np.arange(thick)] + [np.arange({2: 40, 3: 9}[dim])] * (dim - 1)
    x = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, dim) * spacing
    rng = np.random.default_rng(seed)
    return x + 0.1 * spacing * rng.normal(size=x.shape), 1.4 * spacing * (1 + 0.1 * rng.random(len(x)))


@pytest.mark.parametrize("spacing", [0.1e-3, 0.37e-3, 1.0])
@pytest.mark.parametrize("thick", [1, 2, 3, 5, 8])
@pytest.mark.parametrize("dim", [2, 3])
def test_thin_plates(dim, thick, spacing):
    x, h = plate(dim, thick, spacing)
    assert_complete(made(x, h), x, h)


def test_a_row():
    rng = np.random.default_rng(0)
    x = np.arange(100.0)[:, None] + 0.2 * rng.random((100, 1))
    h = 1.3 + 0.2 * rng.random(100)
    assert_complete(made(x, h), x, h)


@pytest.mark.parametrize("dim", [2, 3])
def test_the_smallest_torus_wraps_everything(dim):
    x, h = plate(dim, 8, 1e-3)
    pairs = made(x - x.mean(0), h)
    pairs.grid = Grid((4, 4, 4 if dim == 3 else 1), pairs.grid.edge)
    assert_complete(pairs, x - x.mean(0), h)


@pytest.mark.parametrize("dim", [2, 3])
def test_debris_may_fly_anywhere(dim):
    x, h = plate(dim, 5, 1e-3)
    pairs = made(x, h)
    x[::7] *= np.linspace(1.0, -1e5, len(x[::7]))[:, None]
    x[1::7] += 1e6
    pairs.rows[:, :dim] = x
    assert_complete(pairs, x, h)


def test_room_for_neighbours_grows():
    x, h = plate(2, 8, 1e-3)
    pairs = made(x, 3.0 * h)
    pairs.capacity = 8
    assert_complete(pairs, x, 3.0 * h)
    assert pairs.capacity > 8


def test_a_collapse_is_an_error(monkeypatch):
    x, h = plate(2, 8, 1e-3)
    monkeypatch.setattr(traversal, "MOST_NEIGHBOURS", 20)
    pairs = made(1e-3 * x, h)
    pairs.capacity = 8
    with pytest.raises(RunError, match="collapsed"):
        pairs.evaluate(h.max())


@pytest.mark.parametrize(
    "formulation", [Eulerian(artificial_stress=GrayArtificialStress()), Riemann()], ids=["standard", "contact"]
)
def test_half_with_symmetry_planes_is_the_mirrored_whole(formulation):
    cloud = random_cloud(2)
    planes = (Plane(0, cloud.x[:, 0].min() - 0.4e-3), Plane(1, cloud.x[:, 1].min() - 0.3e-3))
    pairs = packed(cloud, formulation)
    half = Pairs(pairs.layout, formulation.kernel, formulation.passes(2), formulation.coefficients(), cloud.x,
                 cloud.h.max(), planes)  # fmt: skip
    half.rows[:] = pairs.rows
    half.evaluate(cloud.h.max())
    whole = cloud
    for plane in planes:
        whole = whole.with_image(plane.axis, plane.at)
    wanted = compiled_rates(whole, formulation)[: len(cloud.x)]
    found = half.rates[half.place[: len(cloud.x)]]
    assert np.all(np.abs(found - wanted) <= 1e-11 * np.abs(wanted).max(axis=0))  # sums in another order
