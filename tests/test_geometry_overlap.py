"""Bodies that stand in each other are found whatever their shape; those whose faces touch are not."""

import math
from dataclasses import replace

import numpy as np
import pytest

from hvisph.geometry.cutting_planes import Section, fill_section
from hvisph.geometry.filling import fill
from hvisph.geometry.lattices import Grading, fill_graded
from hvisph.geometry.overlap import Standing, overlaps
from hvisph.geometry.placement import rotate, rotation_matrix, row
from hvisph.geometry.shapes import (
    Annulus,
    Box,
    Cylinder,
    Difference,
    Disc,
    Frustum,
    HollowSphere,
    Interval,
    Nosed,
    Placed,
    Polygon,
    Sphere,
    Union,
)

TURN = {2: rotation_matrix(2, 0.6), 3: rotation_matrix(3, 0.9, (1.0, 2.0, -0.5))}


def standing(shape, filling, place, turn=None, surface=True):
    """A body of `filling`, turned and moved to `place`; a fill of its own if it is told the name of an arrangement."""
    filling = rotate(filling, turn) if turn is not None else filling
    breadth = filling.volumes ** (1.0 / shape.dim)
    spacing = filling.finest, float(np.max(filling.spacing))
    return Standing(filling.positions + place, breadth, spacing, Placed(shape, place, turn) if surface else None)


def along(dim, x):
    """The place x along a slanted line through the origin."""
    direction = np.array([1.0, 0.3, -0.2][:dim])
    return x * direction / np.linalg.norm(direction)


ROUND = {
    "disc, square": (Disc(11.3), "square"),
    "disc, rings": (Disc(11.3), "rings"),
    "disc, relaxed": (Disc(11.3), "relaxed"),
    "disc, hexagonal": (Disc(11.3), "hexagonal"),
    "disc with rings on its surface": (Disc(12.0), "lattice_two_rings"),
    "annulus": (Annulus(12.0, 5.0), "square"),
    "sphere, cubic": (Sphere(9.7), "cubic"),
    "sphere, hcp": (Sphere(9.7), "hcp"),
    "hollow sphere": (HollowSphere(11.0, 6.0), "cubic"),
    "interval": (Interval(7.0), "uniform"),
}


@pytest.mark.parametrize("name", ROUND)
@pytest.mark.parametrize("dx", [1.0, 0.7])
def test_round_bodies_touch_in_any_direction(name, dx):
    shape, arrangement = ROUND[name]
    filling = fill(shape, arrangement, dx)
    size = shape.extent()[0]
    for other in (1.0, 0.5):  # of half the spacing, too
        second = filling if other == 1.0 else fill(shape, arrangement, other * dx)
        finer = min(filling.finest, second.finest)

        def found(depth, second=second):
            where = along(shape.dim, size - depth)
            return overlaps([standing(shape, filling, 0.0 * where), standing(shape, second, where)])

        assert not found(0.0)
        assert not found(0.2 * finer)
        for depth in (0.5 * finer, 1.5 * finer, 0.5 * size, size):
            (one,) = found(depth)
            assert one.bodies == (0, 1)


@pytest.mark.parametrize("dim", [2, 3])
def test_turned_boxes_and_their_corners(dim):
    box, plate = Box([6.0, 5.0, 4.0][:dim]), Box([3.0, 14.0, 14.0][:dim])
    one, other = fill(box, None, 0.8), fill(plate, None, 1.0)
    corner = float(np.abs(np.asarray(box.size) / 2 @ np.abs(TURN[dim][0])))
    for depth, refused in ((0.0, False), (0.1, False), (0.5, True), (2.0, True)):
        where = np.zeros(dim)
        where[0] = 1.5 + corner - depth * one.finest
        found = overlaps([standing(box, one, where, TURN[dim]), standing(plate, other, 0 * where)])
        assert bool(found) == refused, depth


@pytest.mark.parametrize("offset", [0.0, 0.1, 0.5])
@pytest.mark.parametrize("dim", [1, 2, 3])
def test_a_body_within_another_is_found_wherever_the_lattices_meet(dim, offset):
    """A plate of one layer, a small body in the middle, one around another: matter stands in matter."""
    large = Box([11.0] * dim) if dim > 1 else Interval(11.0)
    for size in ([3.0] * dim, [0.6, *[9.0] * (dim - 1)], [0.6, *[20.0] * (dim - 1)]):
        small = Box(size) if dim > 1 else Interval(size[0])
        two = [standing(large, fill(large, None, 1.0), np.zeros(dim)),
               standing(small, fill(small, None, 1.0), np.full(dim, offset))]  # fmt: skip
        for bodies in (two, two[::-1]):
            assert len(overlaps(bodies)) == 1


def test_a_body_in_a_hole_that_fits_is_none():
    disc, turn = Disc(8.0), TURN[2]
    plate = Difference(Box([14.0, 12.0]), [Disc(8.0)])
    one, other = fill(disc, "relaxed", 0.8), fill(plate, None, 0.8)
    assert not overlaps([standing(disc, one, np.zeros(2)), standing(plate, other, np.zeros(2), turn)])
    (found,) = overlaps([standing(disc, one, np.array([0.4, 0.0])), standing(plate, other, np.zeros(2), turn)])
    assert found.depth >= 0.3
    assert found.place[0] > 3.0


def test_combined_and_pointed_shapes():
    wedge = Polygon([(0.0, 0.0), (8.0, -3.0), (8.0, 3.0)])
    pair = Union([Disc(6.0), Placed(Box([8.0, 3.0]), np.array([-5.0, 0.0]))])
    one, other = fill(wedge, None, 0.5), fill(pair, None, 0.5)
    for depth, refused in ((0.0, False), (2.0, True)):  # a tip without particles is not matter: 0.5 would be little
        found = overlaps([standing(wedge, one, np.array([3.0 - depth, 0.0])), standing(pair, other, np.zeros(2))])
        assert bool(found) == refused


def test_graded_boxes_and_their_place_in_a_row():
    shape = Box([9.0, 20.0])
    filling = fill_graded(shape, 0.5, Grading((3.0, 6.0), 1.5))
    centres = row([filling] * 2, [0.0] * 2, [None] * 2, [shape] * 2, [True] * 2)
    assert centres[1, 0] - centres[0, 0] == pytest.approx(9.0)
    for depth, refused in ((0.0, False), (0.05, False), (0.3, True)):
        where = np.array([9.0 - depth, 0.0])
        found = overlaps([standing(shape, filling, 0 * where), standing(shape, filling, where)])
        assert bool(found) == refused


def test_solids_of_revolution_over_their_axis():
    ball, plate = Sphere(8.0), Cylinder(12.0, 3.0, "x")
    fills = [fill_section(solid, None, 0.5) for solid in (ball, plate)]

    def found(depth):
        places = np.array([-4.0 + depth, 0.0]), np.array([1.5, 0.0])
        bodies = [
            Standing(f.positions + x, np.full(f.count, f.finest), (f.finest, f.finest), Placed(Section(s), x))
            for f, s, x in zip(fills, (ball, plate), places, strict=True)
        ]
        return overlaps(bodies)

    assert not found(0.0)
    assert found(0.3)
    assert found(4.0)


@pytest.mark.parametrize("shapes", [("sphere", "cubic", 0.0), ("sphere", "hcp", 0.0), ("disc", "relaxed", 0.3)])
def test_particles_without_a_shape_by_the_room_they_fill(shapes):
    name, arrangement, angle = shapes
    shape = Sphere(9.0) if name == "sphere" else Disc(12.0)
    filling = fill(shape, arrangement, 1.0)
    turn = None if angle == 0.0 else rotation_matrix(2, angle)
    plate = Box([4.0, 12.0, 12.0][: shape.dim])
    size = shape.extent()[0]
    for depth, refused in ((0.0, False), (1.5, True), (size / 2, True)):
        for other, wide, surface in ((shape, size, False), (plate, (size + 4.0) / 2, True)):
            where = np.zeros(shape.dim)
            where[0] = wide - depth
            bodies = [standing(shape, filling, where, turn, surface=False),
                      standing(other, fill(other, None, 1.0), 0 * where, surface=surface)]  # fmt: skip
            assert bool(overlaps(bodies)) == refused, (other.kind, depth)


def test_particles_of_files_in_each_others_holes():
    """Two lattices, each in the other's holes, half a spacing deep along faces, and one within the other."""
    box = Box([6.0, 6.0, 6.0])
    filling = fill(box, None, 1.0)
    for x in (5.5, 3.5, 0.5):
        bodies = [standing(box, filling, np.zeros(3), surface=False),
                  standing(box, filling, np.array([x, 0.5, 0.5]), surface=False)]  # fmt: skip
        assert len(overlaps(bodies)) == 1
    assert not overlaps([standing(box, filling, np.zeros(3), surface=False),
                         standing(box, filling, np.array([6.0, 0.5, 0.5]), surface=False)])  # fmt: skip


def test_particles_in_one_place_are_refused():
    """Faces that touch with particles on them, of which two coincide, as rings on the surface of discs may have."""
    box = Box([4.0, 4.0])
    filling = fill(box, None, 1.0)
    on_face = replace(filling, positions=filling.positions + np.array([0.5, 0.0]))
    other = replace(filling, positions=filling.positions - np.array([0.5, 0.0]))
    where = np.array([4.0, 0.0])
    (found,) = overlaps([standing(box, on_face, 0 * where), standing(box, other, where)])
    assert found.depth == 0.0
    assert found.place[0] == 2.0
    assert not overlaps([standing(box, on_face, 0 * where), standing(box, other, where + np.array([0.0, 0.5]))])


@pytest.mark.parametrize("axis", ["x", "y"])
def test_a_nose_on_a_plate(axis):
    nose, plate = Nosed(Frustum(7.0, 2.0, 8.0), 3, axis), Box([3.0, 9.0, 9.0])
    turn = None if axis == "x" else rotation_matrix(3, -math.pi / 2)
    one, other = fill(nose, "hcp", 0.7), fill(plate, None, 1.0)
    for depth, refused in ((0.0, False), (0.2, False), (0.35, True), (3.0, True)):
        where = np.array([-4.0 + depth, 0.0, 0.0])
        found = overlaps([standing(nose, one, where, turn), standing(plate, other, np.array([1.5, 0.0, 0.0]))])
        assert bool(found) == refused, depth
