"""The traversal of pairs: every neighbour once, wherever particles are; images at symmetry planes."""

import numpy as np
import pytest
from small_runs import DAMAGED, METAL, assert_same_results, row_of
from sph_twins import compiled_rates, packed, random_cloud

from hvisph.casefile.loader import load_case
from hvisph.compiler.jit import prange, specialise
from hvisph.compiler.parallel_for import particle_loop
from hvisph.compiler.vector.api import flush_tiny, restore_mode
from hvisph.compiler.vector.intrinsics import HAS_REGISTER
from hvisph.compiler.vector.lanes import LANES
from hvisph.core.errors import RunError
from hvisph.schemes.riemann.scheme import Riemann
from hvisph.schemes.standard.options import GrayArtificialStress
from hvisph.schemes.standard.scheme import Eulerian
from hvisph.simulation.run import run
from hvisph.sph.kernels import CUBIC_SPLINE
from hvisph.sph.neighbours import cells, traversal
from hvisph.sph.neighbours.cells import Grid, find_undisturbed, sort
from hvisph.sph.neighbours.ghost_rows import Plane
from hvisph.sph.neighbours.pairs import Pairs, Pass, show_stage
from hvisph.sph.neighbours.particle_layout import RowLayout


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
def test_packed_rows_in_sorted_ones(dim):
    x, h = plate(dim, 8, 1e-3)
    width, n = dim + 5, len(x)
    rows = np.column_stack([x, h, np.random.default_rng(2).random((n, 4))])
    apart, shared = np.zeros((n, 2 * width)), np.column_stack([np.zeros((n, width)), rows])
    order, place = np.zeros((2, n), np.uint32)
    found = []
    for given, out, first in ((rows, apart, 0), (shared, shared, width)):
        columns, grid = np.zeros((dim + 1, n + 8)), Grid.from_positions(x, 2.0 * h.max())
        sort(grid, given, np.arange(n, dtype=np.uint64), dim, np.zeros(n, np.uint32), order, place, out, columns, dim,
             packed=first)  # fmt: skip
        found.append((out[:, :width].copy(), columns, order.copy()))
    assert all(np.array_equal(one, other) for one, other in zip(*found, strict=True))
    assert np.array_equal(shared[place, :width], rows)
    shared[:, width:] = -1.0  # passes have written there
    show = specialise(show_stage, PACKED=width, SHOWN=2 * dim)
    particle_loop(show)(n, shared, place)
    assert np.array_equal(shared[:, width : width + 2 * dim], rows[:, : 2 * dim])
    assert (shared[:, width + 2 * dim :] == -1.0).all()


@pytest.mark.parametrize("dim", [2, 3])
def test_the_smallest_torus_wraps_everything(dim):
    x, h = plate(dim, 8, 1e-3)
    pairs = made(x - x.mean(0), h)
    pairs.grid = Grid((4, 4, 4 if dim == 3 else 1), pairs.grid.edge)
    assert_complete(pairs, x - x.mean(0), h)


def keep_list(near, n, rows, i, constants, out):
    """Write the list of particle `i`, its length first."""
    out[i, 0] = n
    for k in range(n):
        out[i, k + np.uint64(1)] = near[k]


def lists(pairs, grid, owned, way=traversal.FORGETS, space=traversal.NO_LISTS, **options):
    """Return the lists of `pairs` in sorted numbers, a row a particle: of those that are not owned, nothing."""
    n, dim = pairs.present, pairs.layout.dim
    sweep, found = traversal.loop(dim, specialise(keep_list), lists=way, **options), np.zeros((n, 2000), np.uint32)
    traversal.complete_sweep(sweep, pairs.sorted, pairs.columns, pairs.order, (n, owned), grid,
                             pairs.kernel.reach, np.zeros(1), 1500, lambda capacity: found, space)  # fmt: skip
    return [row[1 : 1 + row[0]] for row in found]


def plain_lists(x, h, grid, reach, owned):
    """The plain twin: cells in rising order along x, then y, then z, distances in double precision."""
    dim, shape = x.shape[1], np.array(grid.shape)
    cells = np.floor(x / grid.edge).astype(np.int64) % shape[:dim]
    cells = np.hstack([cells, np.zeros((len(x), 3 - dim), np.int64)])
    inside: dict = {}
    for k, cell in enumerate(cells):
        inside.setdefault(tuple(cell), []).append(k)
    steps = [(-1, 0, 1) if axis < dim else (0,) for axis in range(3)]
    found = []
    for k, cell in enumerate(cells):
        near = [j for dz in steps[2] for dy in steps[1] for dx in steps[0]
                for j in inside.get(tuple((cell + np.array([dx, dy, dz])) % shape), [])]  # fmt: skip
        near = np.array([j for j in near if j != k], np.int64)
        d = x[k] - x[near]
        r2 = d[:, 0] * d[:, 0]
        for axis in range(1, dim):
            r2 = r2 + d[:, axis] * d[:, axis]
        limit = (h[k] + h[near]) * (0.5 * traversal.RIM * reach)
        near = near[r2 < limit * limit]
        found.append(np.append(near, [len(x)] * (-len(near) % LANES)) if k in owned else np.zeros(0))
    return found


def cloud(kind, dim):
    """Particles whose neighbours are hard to tell, in more ways than one."""
    rng = np.random.default_rng(1)
    if kind == "lattice":  # with neighbours at the very rim, 2h = 3 dx
        x, h = plate(dim, 7, 1.0)
        return np.round(x) * 0.37e-3, np.full(len(x), 1.5 * 0.37e-3)
    x, h = plate(dim, 6, 1e-3)
    if kind == "lengths":  # from a tenth to all of the largest
        return x, h * 10.0 ** -rng.random(len(x))
    x[::7] += np.round(1e3 * rng.normal(size=x[::7].shape)) * 1e-3  # "far": others of a cell of the torus
    x[1::7] += 1e9
    return x, h


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("kind", ["lattice", "lengths", "far"])
def test_lists_are_those_of_the_plain_twin(kind, dim):
    x, h = cloud(kind, dim)
    pairs = made(x, h)
    pairs.evaluate(h.max())
    n, order = len(x), pairs.order[: len(x)]
    for shape in (pairs.grid.shape, (4, 4, 4 if dim == 3 else 1)):
        grid = Grid(shape, pairs.grid.edge)
        sort(
            grid,
            pairs.rows,
            pairs.numbers,
            dim,
            pairs.cells[:n],
            order,
            pairs.place[:n],
            pairs.sorted[:n],
            pairs.columns,
            dim,
        )
        owned = np.flatnonzero(order < n - 40)
        wanted = plain_lists(x[order], h[order], grid, pairs.kernel.reach, set(owned.tolist()))
        for own, plain in zip(lists(pairs, grid, n - 40), wanted, strict=True):
            assert np.array_equal(own, plain)
        for width in (500, 30, 2):  # space for the lists of all chunks, of some, of none
            space = np.full((n, width), 7, np.uint32)
            for way in (traversal.KEEPS, traversal.TAKES):
                for own, plain in zip(lists(pairs, grid, n - 40, way, space), wanted, strict=True):
                    assert np.array_equal(own, plain)
            starts = space.reshape(-1)[:: traversal.CHUNK * width]
            assert starts.all() if width == 500 else width == 30 or not starts.any()


@pytest.mark.parametrize("dim", [3, pytest.param(2, marks=pytest.mark.slow)])
def test_particles_within_rigid_bodies_have_no_lists(dim):
    """Rows below zero, all of whose neighbours are so, are left out; others have all of their neighbours."""
    x, h = plate(dim, {2: 40, 3: 16}[dim], 1e-3)
    pairs, n = made(x, h), len(x)
    rigid = pairs.rows[:, dim + 1] = np.where(x[:, 0] > x[:, 0].mean(), -1.0, 1.0)
    pairs.evaluate(h.max())
    order, space, left_out = pairs.order[:n], np.full((n, 500), 7, np.uint32), 0
    wanted = plain_lists(x[order], h[order], pairs.grid, pairs.kernel.reach, set(range(n)))
    for way in (traversal.FORGETS, traversal.KEEPS, traversal.TAKES):
        found = lists(pairs, pairs.grid, n, way, space, first_result=0, rigid=dim + 1)
        for k, (own, plain) in enumerate(zip(found, wanted, strict=True)):
            alone = (rigid[order[[*plain[plain < n].astype(int), k]]] < 0.0).all()
            assert np.array_equal(own, [] if alone else plain)
            left_out += alone
    assert 0.3 * n < left_out / 3 < 0.5 * n


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


def square_all(a, out):
    """Square numbers as a pass over pairs does, then as other loops do."""
    for k in prange(1):
        mode = flush_tiny()
        for j in range(len(a)):
            out[k, j] = a[j] * a[j]
        restore_mode(mode)
        for j in range(len(a)):
            out[k + 1, j] = a[j] * a[j]


def test_tiny_numbers_are_zero_in_the_passes_alone():
    a, out = np.array([1e-155, 1e-160, 3.0, -1e100]), np.zeros((2, 4))
    specialise(square_all, parallel=True)(a, out)
    assert np.array_equal(out[0], np.where(a * a < 2.3e-308, 0.0 if HAS_REGISTER else a * a, a * a))
    assert np.array_equal(out[1], a * a)


def plain_undisturbed(x, rows, known, zero, equal, grid):
    """The plain twin: cells within two of which all rows are zero, and those of other cells near agree."""
    dim, shape = x.shape[1], np.array(grid.shape)
    place = np.hstack([np.floor(x / grid.edge).astype(np.int64), np.zeros((len(x), 3 - dim), np.int64)]) % shape
    steps = np.stack(np.meshgrid(*[(-1, 0, 1) if axis < dim else (0,) for axis in range(3)]), -1).reshape(-1, 3)
    alike = {}
    for cell in map(tuple, place):
        own = rows[(place == cell).all(1)]
        known_rows = np.arange(len(x))[(place == cell).all(1)] < known
        alike[cell] = known_rows.all() and not own[:, zero].any() and (own[:, equal] == own[0, equal]).all()
    first = {cell: rows[(place == cell).all(1)][0, equal] for cell in alike}
    around = {cell: {tuple((cell + step) % shape) for step in steps} & alike.keys() for cell in alike}
    for _ in range(2):
        alike = {
            cell: all(alike[near] and (first[near] == first[cell]).all() for near in around[cell]) for cell in alike
        }
    return {cell for cell, rests in alike.items() if rests}


@pytest.mark.parametrize("dim", [1, 2, 3])
def test_undisturbed_cells(dim):
    rng = np.random.default_rng(dim)
    n = {1: 60, 2: 900, 3: 2500}[dim]
    x = rng.random((n, dim)) * {1: 60.0, 2: 30.0, 3: 14.0}[dim]
    rows = np.zeros((n, dim + 3))
    rows[:, :dim], rows[:, dim] = x, 0.4
    rows[:, dim + 2] = x[:, 0] > x[:, 0].max() / 2  # another body
    rows[np.argmin((x**2).sum(1)), dim + 1] = 1.0  # a stress
    grid, known = Grid.from_positions(x, 1.0), n - 1
    order, place, columns = np.zeros(n, np.uint32), np.zeros(n, np.uint32), np.zeros((dim + 1, n + 8))
    out = np.zeros((n + 1, dim + 3))
    sort(grid, rows, np.arange(n, dtype=np.uint64), dim, np.zeros(n, np.uint32), order, place, out, columns, dim)
    zero, equal = np.array([dim + 1], np.uint64), np.array([dim + 2], np.uint64)
    find_undisturbed(grid, order, known, out, zero, equal, dim)
    index = np.flatnonzero(grid.undisturbed & (np.diff(grid.starts.astype(np.int64)) > 0))
    nx, _, nz = grid.shape
    line, block = index // nx, cells.BLOCK
    found = set(zip(index % nx, line % block + block * (line // (block * nz)), line // block % nz, strict=True))
    assert found == plain_undisturbed(x, rows, known, [dim + 1], [dim + 2], grid)
    assert 0 < len(found) < len(plain_cells(x, grid))


def plain_cells(x, grid):
    """The cells that hold particles."""
    return set(map(tuple, np.floor(x / grid.edge).astype(np.int64) % np.array(grid.shape)[: x.shape[1]]))


@pytest.mark.parametrize(("kinematics", "formulation"), [
    ("plane_strain", "riemann"), ("plane_strain", "eulerian"), ("axisymmetric", "eulerian"), ("three_d", "riemann"),
])  # fmt: skip
def test_leaving_out_undisturbed_cells_changes_no_number(formulation, kinematics, tmp_path, monkeypatch):
    """Of three bodies in a row the last, and the part of the second ahead of the shock, are left out at first."""
    dim = 3 if kinematics == "three_d" else 2
    case = row_of([METAL, METAL, DAMAGED], dim, 0.2e-3 if dim == 3 else 0.25e-3, kinematics=kinematics,
                  formulation={"type": formulation}, time={"end": 1e-6, "max_steps": 12})  # fmt: skip
    assert_nothing_hangs_on_cells_left_out(case, tmp_path, monkeypatch)


@pytest.mark.parametrize("kinematics", ["uniaxial_strain", "axisymmetric", "three_d"])
def test_leaving_out_particles_within_rigid_bodies_changes_no_number(kinematics, tmp_path, monkeypatch):
    """Those that no deformable particle is near: one by one, or all of a cell with all candidates."""
    dim = {"uniaxial_strain": 1, "three_d": 3}.get(kinematics, 2)
    case = row_of([METAL, METAL], dim, 0.25e-3, kinematics=kinematics, speed=800.0,
                  time={"end": 1e-6, "max_steps": 12}).model_dump(mode="json")  # fmt: skip
    next(iter(case["bodies"].values()))["rigid"] = {"move": "x" if dim == 1 or kinematics == "axisymmetric" else "free"}
    run(load_case(case), tmp_path / "with")
    monkeypatch.setattr(traversal, "loop", lambda *given, made=traversal.loop: made(*given[:-1]))
    run(load_case(case), tmp_path / "without")
    assert_same_results(tmp_path / "with", tmp_path / "without")


def assert_nothing_hangs_on_cells_left_out(case, tmp_path, monkeypatch):
    skipped = []

    def leave_out_nothing(grid, *given):
        find_undisturbed(grid, *given)
        skipped.append(grid.undisturbed.any())
        grid.undisturbed[:] = 0

    run(case, tmp_path / "with")
    monkeypatch.setattr(cells, "find_undisturbed", leave_out_nothing)
    run(case, tmp_path / "without")
    assert any(skipped)
    assert_same_results(tmp_path / "with", tmp_path / "without")
