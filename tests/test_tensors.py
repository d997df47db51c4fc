"""Tensors as values: every operation against numpy's matrices, compiled floats and lanes against the same text."""

import numpy as np
import pytest

from hvisph.compiler import tensors as t
from hvisph.compiler import tensors3d
from hvisph.compiler.jit import bind, specialise
from hvisph.compiler.vector.api import LANES, load_row_lanes, neighbours, put_row_lanes
from hvisph.core.fields import SYMMETRIC_LENGTH
from hvisph.sph.neighbours.particle_layout import RowLayout
from hvisph.sph.terms.shape_matrix import sound_inverse

DIMS = pytest.mark.parametrize("dim", [1, 2, 3])
UPPER = {1: [(0, 0)], 2: [(0, 0), (1, 1), (0, 1)], 3: [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)]}


def symmetric_of(matrix):
    return tuple(matrix[i, j] for i, j in UPPER[len(matrix)])


def gradient_of(matrix):
    return tuple(np.asarray(matrix).ravel())


def drawn(dim, seed=0):
    """Two vectors, a symmetric and two general matrices."""
    rng = np.random.default_rng(seed)
    s = rng.normal(size=(dim, dim))
    return *rng.normal(size=(2, dim)), s + s.T, *(rng.normal(size=(2, dim, dim)) + 2.0 * np.eye(dim))


def assert_close(found, wanted):
    # sums of at most nine products of numbers of order one
    np.testing.assert_allclose(found, wanted, rtol=1e-13, atol=1e-13)


@DIMS
def test_every_operation_is_what_numpys_matrices_say(dim):
    a, b, s, g, k = drawn(dim)
    va, vb, ts, tg, tk = tuple(a), tuple(b), symmetric_of(s), gradient_of(g), gradient_of(k)
    assert_close(t.add(va, vb), a + b)
    assert_close(t.subtract(va, vb), a - b)
    assert_close(t.multiply(3.0, va), 3.0 * a)
    assert_close(t.dot(va, vb), a @ b)
    assert_close(t.dot(tg, tk), (g * k).sum())
    assert_close(t.double_dot(ts, ts), (s * s).sum())
    assert_close(t.outer(va, vb), gradient_of(np.outer(a, b)))
    assert_close(t.symmetric_outer(va, t.multiply(2.0, va)), symmetric_of(2.0 * np.outer(a, a)))
    assert_close(t.symmetric_dot(ts, va), s @ a)
    assert_close(t.dot_rows(tg, va), g @ a)
    assert_close(t.add_identity(ts, 0.7), symmetric_of(s + 0.7 * np.eye(dim)))
    assert_close(t.divergence(tg), np.trace(g))
    assert_close(t.mean_diagonal(tg), np.trace(g) / dim)
    assert_close(t.power_of_dimension(1.3, tg), 1.3**dim)
    assert_close(t.matrix(ts), gradient_of(s))
    assert_close(t.identity(tg), gradient_of(np.eye(dim)))
    assert_close(t.transpose(tg), gradient_of(g.T))
    assert_close(t.product(tg, tk), gradient_of(g @ k))
    assert_close(t.determinant(tg), np.linalg.det(g))
    assert_close(t.adjugate(tg), gradient_of(np.linalg.inv(g) * np.linalg.det(g)))
    gradient = np.random.default_rng(1).normal(size=(len(ts), dim))  # a row for each component
    assert_close(t.dot_rows(gradient_of(gradient), va), gradient @ a)
    assert_close(t.product(gradient_of(gradient), tg), gradient_of(gradient @ g))


@DIMS
def test_full_tensors_hold_those_in_the_plane(dim):
    _, _, s, g, _ = drawn(dim)
    full = np.zeros((3, 3))
    full[:dim, :dim] = g
    assert tensors3d.full_gradient(gradient_of(g)) == gradient_of(full)
    full[:dim, :dim] = s
    assert tensors3d.extend_symmetric(symmetric_of(s)) == symmetric_of(full)
    assert tensors3d.plane_components(symmetric_of(full), dim) == symmetric_of(s)
    assert tensors3d.replace_zz(gradient_of(full), 5.0)[8] == 5.0
    stored = np.arange(8.0)[None]
    six = tensors3d.row_full_symmetric(stored, 0, 1, dim)
    assert six == tuple(range(1, 1 + SYMMETRIC_LENGTH[dim])) + (0.0,) * (6 - SYMMETRIC_LENGTH[dim])
    back = np.zeros((1, 8))
    tensors3d.put_full_symmetric(back, 0, 1, six, dim)
    np.testing.assert_array_equal(back[0, 1 : 1 + SYMMETRIC_LENGTH[dim]], six[: SYMMETRIC_LENGTH[dim]])


def test_strain_rates_and_rotations():
    _, _, s, g, _ = drawn(3)
    assert_close(tensors3d.symmetric_part(gradient_of(g)), symmetric_of((g + g.T) / 2))
    spin = g - g.T
    assert_close(tensors3d.curl(gradient_of(g)), (spin[2, 1], spin[0, 2], spin[1, 0]))
    a = np.array([0.3, -0.2, 0.5])
    w = np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])
    turn = np.linalg.solve(np.eye(3) - w, np.eye(3) + w)
    assert_close(tensors3d.rotation(tuple(a)), gradient_of(turn))
    assert_close(tensors3d.rotate(symmetric_of(s), gradient_of(turn)), symmetric_of(turn @ s @ turn.T))
    flat = tensors3d.rotation((0.0, 0.0, 0.4))
    assert_close(tensors3d.rotate_in_plane(symmetric_of(s), 0.4), tensors3d.rotate(symmetric_of(s), flat))


@pytest.mark.parametrize("dim", [2, 3])
def test_what_turns(dim):
    a, b, s, g, _ = drawn(dim)
    w = np.random.default_rng(2).normal(size=(1, 0, 1, 3)[dim])
    in_space = (w if dim == 3 else np.array([0.0, 0.0, w[0]]))[:, None]
    matrix = np.cross(in_space.T, np.eye(3))[:, :dim].T[:, :dim]  # of w x x
    found = np.cross(*(np.pad(v, (0, 3 - dim)) for v in (a, b)))
    kept = slice(None) if dim == 3 else slice(2, 3)
    assert_close(t.torque(tuple(a), tuple(b)), found[kept])
    assert_close(t.axial_cross(tuple(w), tuple(a)), matrix @ a)
    assert_close(t.spin_gradient(tuple(w)), gradient_of(matrix))
    curl = tensors3d.curl(tensors3d.full_gradient(gradient_of(g)))
    assert_close(t.axial_curl(gradient_of(g)), curl[kept])
    # the moment of a x (w x a), summed with the weights of s
    inertia = (np.trace(s) * np.eye(dim) - s) if dim == 3 else np.array([[np.trace(s)]])
    assert_close(t.inertia(symmetric_of(s)), gradient_of(inertia))


@pytest.mark.parametrize("dim", [2, 3])
def test_what_lies_beside_a_line(dim):
    a, b, _, _, _ = drawn(dim)
    e = a / np.linalg.norm(a)
    found, seen = t.tangential_part(tuple(b), b @ e, tuple(e)), t.tangential_components(tuple(b), tuple(e))
    back = t.tangential_vector(found, tuple(e))
    assert len(found) == {2: 1, 3: 3}[dim]
    assert_close(back, b - (b @ e) * e)
    assert_close(t.dot(found, found), b @ b - (b @ e) ** 2)
    assert_close(t.dot(seen, found), t.dot(found, found))


@DIMS
def test_ranks_are_as_long_as_rows_say(dim):
    for rank, sizes in t.SIZE.items():
        assert RowLayout(dim, (("x", rank),)).used_width == sizes[dim - 1]


def _several(rows, i):
    """One of everything: what the compiler makes of it must be what Python makes of the same lines."""
    x, s, g = t.row_vector(rows, i, 0, DIM), t.row_symmetric(rows, i, 3, DIM), t.row_gradient(rows, i, 9, DIM)  # noqa: F821
    m = t.add(t.matrix(s), t.multiply(0.1, t.product(g, t.transpose(g))))
    inverse = t.multiply(1.0 / t.determinant(m), t.adjugate(m))
    v = t.subtract(t.symmetric_dot(t.add_identity(s, -0.5), x), t.dot_rows(inverse, x))
    t.put(rows, i, 0, v)
    full = tensors3d.full_gradient(t.outer(v, x))
    return (
        v,
        tensors3d.rotate(tensors3d.symmetric_part(full), tensors3d.rotation(tensors3d.curl(full))),
        t.divergence(g) * t.dot(v, x),
    )


def _of_lanes(rows, near):
    """The same sums over neighbours, in lanes."""
    found = t.broadcast(t.no_vector(DIM))  # noqa: F821
    for k in range(np.uint64(0), np.uint64(near.shape[0]), np.uint64(LANES)):
        b = neighbours(rows, near, k, WIDTH)  # noqa: F821
        g = t.gradient(b, 9, DIM)  # noqa: F821
        one = t.symmetric_dot(t.symmetric(b, 3, DIM), t.vector(b, 0, DIM))  # noqa: F821
        found = t.add(found, t.multiply(1.0 / t.determinant(g), t.dot_rows(g, one)))
    return t.lane_sums(found)


@DIMS
def test_compiled_floats_and_lanes_follow_the_text(dim):
    rows = np.random.default_rng(dim).normal(size=(2 * LANES, 18)) + 1.0
    twin, slow, fast = rows.copy(), specialise(_several, DIM=dim).py_func, specialise(_several, parallel=False, DIM=dim)
    for i in range(4):
        for found, wanted in zip(fast(rows, np.uint64(i)), slow(twin, i), strict=True):
            # products are contracted differently, and inverses amplify rounding
            np.testing.assert_allclose(found, wanted, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(rows, twin, rtol=1e-9)
    loop = specialise(_of_lanes, parallel=False, DIM=dim, WIDTH=18)
    wanted = np.zeros(dim)
    for row in rows:
        g = row[9 : 9 + dim * dim]
        one = t.symmetric_dot(tuple(row[3 : 3 + len(UPPER[dim])]), tuple(row[:dim]))
        wanted += np.array(t.dot_rows(tuple(g), one)) / t.determinant(tuple(g))
    found = loop(rows, np.arange(len(rows), dtype=np.uint32))
    np.testing.assert_allclose(found, wanted, rtol=1e-9, atol=1e-9 * np.abs(wanted).max())


def _shifted(rows, found):
    for i in range(np.uint64(rows.shape[0])):
        one = load_row_lanes(rows, np.uint64(i), COUNT)  # noqa: F821
        put_row_lanes(found, np.uint64(i), t.add(one, one) + one)


@pytest.mark.parametrize("count", [1, 2])
def test_rows_are_read_and_written_as_vectors_side_by_side(count):
    rows = np.random.default_rng(count).normal(size=(5, count * LANES + 3))
    found = np.full((5, 2 * count * LANES), 7.0)
    specialise(_shifted, parallel=False, COUNT=count)(rows, found)
    one = rows[:, : count * LANES]
    np.testing.assert_array_equal(found, np.hstack([one + one, one]))


@DIMS
def test_a_sound_inverse_is_one_and_a_flat_neighbourhood_has_none(dim):
    m = np.eye(dim) + 0.1 * np.random.default_rng(dim).normal(size=(dim, dim))
    inverse, sound = sound_inverse.py_func(gradient_of(m))
    assert sound
    assert_close(inverse, gradient_of(np.linalg.inv(m)))
    flat = 0.01 * m if dim == 1 else m * np.array([1.0] + [1e-3] * (dim - 1))
    inverse, sound = sound_inverse.py_func(gradient_of(flat))
    assert not sound
    assert inverse == gradient_of(np.eye(dim))
    assert not sound_inverse.py_func(gradient_of(-m))[1]


def test_a_misspelt_option_is_an_error():
    with pytest.raises(TypeError, match="no option 'WIDHT'; did you mean 'WIDTH'"):
        bind(_of_lanes, {"WIDHT": 18}, {"DIM": 2})
