"""Shapes and arrangements: published counts, density, symmetry, refusals."""

import math

import numpy as np
import pytest
from scipy.spatial import cKDTree

from hvisph.core.catalogues import arrangements_of
from hvisph.core.errors import CaseError
from hvisph.geometry.filling import FUNCTIONS, estimated_count, fill
from hvisph.geometry.shapes import Box, Cylinder, Disc, Interval, Sphere

MM = 1e-3
PUBLISHED = [
    (Disc(10 * MM), "rings", 0.1 * MM, 8012),
    (Disc(10 * MM), "lattice_two_rings", 0.1 * MM, 7830),
    (Box([2 * MM, 50 * MM]), "square", 0.1 * MM, 10_000),
    (Box([2 * MM, 50.1 * MM]), "square", 0.1 * MM, 10_020),
    (Sphere(12 * MM), "cubic", 1 * MM, 912),
    (Box([3 * MM, 100 * MM, 100 * MM]), "cubic", 1 * MM, 30_000),
    (Interval(0.5), "uniform", 1 / 400, 200),
]
SHAPES = [
    Interval(1.0),
    Disc(1.0),
    Box([0.8, 2.1]),
    Sphere(1.0),
    Box([0.7, 1.1, 0.9]),
    Cylinder(1.0, 0.8, "x"),
    Cylinder(1.0, 0.8, "y"),
    Cylinder(1.0, 0.8, "z"),
]
PAIRS = [(shape, name) for shape in SHAPES for name in arrangements_of(shape.dim, shape.kind)]


@pytest.mark.parametrize(("shape", "arrangement", "dx", "count"), PUBLISHED)
@pytest.mark.parametrize("scale", [1.0, 1e3, 1 / 3, 0.1 + 0.2])
def test_published_counts_at_any_scale(shape, arrangement, dx, count, scale):
    sizes = {k: np.asarray(v) * scale for k, v in vars(shape).items()}
    sizes = {k: v.tolist() for k, v in sizes.items()}
    filling = fill(type(shape)(**sizes), arrangement, dx * scale, exact=False)
    assert filling.count == count
    assert filling.note == ""


@pytest.mark.parametrize(("shape", "name"), PAIRS)
def test_density_is_right(shape, name):
    dx = 0.04 if name == "relaxed" and shape.dim == 3 else 0.02  # 80,000 particles take ten seconds to relax
    filling = fill(shape, name, dx, exact=False)
    assert filling.volumes == pytest.approx(dx**shape.dim, rel=1e-14)
    # a sharp surface cuts cells: the error is a fraction of a layer, dx / size; two boxes of faces at most
    layers = min(shape.extent()) / dx
    assert filling.volumes.sum() == pytest.approx(shape.volume, rel=2.5 / layers)
    assert estimated_count(shape, dx) == pytest.approx(filling.count, rel=2.5 / layers)
    # what the filling claims to stand for is nearer the truth than one particle layer per axis
    for got, want in zip(filling.size, shape.extent(), strict=True):
        assert abs(got - want) <= 0.6 * dx


@pytest.mark.parametrize(("shape", "name"), PAIRS)
def test_particles_lie_inside_and_apart(shape, name):
    dx = 0.05
    positions = fill(shape, name, dx, exact=False).positions
    assert positions.flags.c_contiguous
    assert positions.shape[1] == shape.dim
    # the rings' last circle lies on the circumference; rounding of counts adds at most half a layer
    assert (np.abs(positions) <= np.asarray(shape.extent()) / 2 + 0.51 * dx).all()
    distance = cKDTree(positions).query(positions, k=2)[0][:, 1]
    # rings with a rounded count are up to 4.3 % closer than dx along the ring (k = 1: 6 particles, 1.0)
    # a relaxed packing's outer layer is closer by a fifth (see the figures of its own test)
    assert distance.min() > (0.7 if name == "relaxed" else 0.95) * dx


@pytest.mark.parametrize(("shape", "name"), [p for p in PAIRS if p[1] not in ("hcp", "relaxed")])
def test_mirror_symmetry_across_the_shot_axis(shape, name):
    if shape.dim == 1:
        positions = fill(shape, name, 0.03).positions
        assert (positions == -positions[::-1]).all()
        return
    positions = fill(shape, name, 0.03).positions
    mirrored = positions * np.array([1.0, -1.0, 1.0])[: shape.dim]
    distance, _ = cKDTree(positions).query(mirrored)
    assert distance.max() < 1e-14  # a few bits of a coordinate near 1


def test_hexagonal_and_hcp_have_equal_neighbours():
    for shape, name, neighbours in [(Disc(1.0), "hexagonal", 6), (Sphere(1.0), "hcp", 12)]:
        positions = fill(shape, name, 0.05, exact=False).positions
        tree = cKDTree(positions)
        a = tree.query(positions, k=2)[0][:, 1].min()
        inner = positions[np.linalg.norm(positions, axis=1) < 0.3]
        counts = tree.query_ball_point(inner, a * 1.001, return_length=True) - 1
        assert (counts == neighbours).all()


def test_rings_are_as_published():
    positions = fill(Disc(10.0), "rings", 0.5, exact=False).positions
    radius = np.linalg.norm(positions, axis=1) / 0.5
    for k in range(1, 11):
        on_ring = positions[np.abs(radius - k) < 1e-9]
        assert len(on_ring) == round(2 * math.pi * k)
        assert on_ring[0] == pytest.approx([0.5 * k, 0.0], abs=1e-15)


def test_lattice_two_rings_counts_of_young_2021():
    positions = fill(Disc(10.0), "lattice_two_rings", 0.1, exact=False).positions
    radius = np.linalg.norm(positions, axis=1)
    # floor(2 pi 49) = 307 on the inner ring, rounded 2 pi 50 = 314 on the outer
    assert (np.abs(radius - 4.9) < 1e-9).sum() == 307
    assert (np.abs(radius - 5.0) < 1e-9).sum() == 314
    assert (radius < 4.8).sum() == 7209


def test_a_size_that_does_not_divide_is_said():
    filling = fill(Box([2.04, 5.0]), "square", 0.1, exact=False)
    assert filling.size == pytest.approx((2.0, 5.0))
    assert filling.note == "2.04 x 5 is filled as 2 x 5 at resolution 0.1"


@pytest.mark.parametrize(
    ("shape", "name", "dx", "message"),
    [
        (Disc(1.0), "lattice_two_rings", 0.3, "at least 3 particle spacings, not 2"),
        (Box([0.01, 1.0]), "square", 0.1, "thinner than half a particle"),
        (Box([0.01, 1.0]), "hexagonal", 0.1, "thinner"),
        (Disc(1.0), "rings", 5.0, "thinner"),
    ],
)
def test_refusals_say_what_is_allowed(shape, name, dx, message):
    with pytest.raises(CaseError, match=message):
        fill(shape, name, dx)


def test_contains_is_strict_at_the_surface():
    disc = Disc(2.0)
    assert disc.contains(
        np.array([[0.0, 0.0], [0.999, 0.0], [1.0, 0.0], [math.sqrt(0.5), math.sqrt(0.5)]])
    ).tolist() == [
        True,
        True,
        False,
        False,
    ]
    cylinder = Cylinder(2.0, 6.0, "y")
    points = np.array([[0.0, 2.9, 0.0], [0.0, 3.0, 0.0], [0.9, 0.0, 0.9], [0.5, -2.9, 0.5]])
    assert cylinder.contains(points).tolist() == [True, False, False, True]


def test_every_arrangement_has_a_shape():
    assert {name for _, name in PAIRS} == set(FUNCTIONS)
