"""Placement: touching rows, gaps, stated centres, rotations."""

import math

import numpy as np
import pytest

from hvisph.core.errors import CaseError
from hvisph.geometry.filling import fill
from hvisph.geometry.placement import rotate, rotation_matrix, row
from hvisph.geometry.shapes import Box, Cylinder, Disc, Interval

DX = 0.1


def in_row(fillings, gaps, positions):
    return row(fillings, gaps, positions, [None] * len(fillings), [True] * len(fillings))


def placed(fillings, gaps, positions):
    centres = in_row(fillings, gaps, positions)
    return [filling.positions + centre for filling, centre in zip(fillings, centres, strict=True)]


def test_two_bodies_touch_at_zero():
    disc, plate = fill(Disc(2.0), "rings", DX, exact=False), fill(Box([0.4, 3.0]), None, DX)
    a, b = placed([disc, plate], [0.0, 0.0], [None, None])
    assert a[:, 0].max() == pytest.approx(-DX / 2, abs=1e-15)
    assert b[:, 0].min() == pytest.approx(DX / 2, abs=1e-15)


def test_a_gap_moves_the_projectile_not_the_struck_face():
    bodies = [fill(Interval(length), None, DX) for length in (0.5, 0.2, 0.2)]
    a, b, c = placed(bodies, [0.0, 0.3, 0.1], [None, None, None])
    assert a[:, 0].max() == pytest.approx(-0.3 - DX / 2)
    assert b[:, 0].min() == pytest.approx(DX / 2)
    assert c[:, 0].min() - b[:, 0].max() == pytest.approx(0.1 + DX)


def test_a_body_alone_starts_at_zero():
    (only,) = placed([fill(Box([1.0, 1.0]), None, DX)], [0.0], [None])
    assert only[:, 0].min() == pytest.approx(DX / 2)


def test_a_stated_centre_leaves_the_row_alone():
    plate = fill(Box([0.4, 3.0]), None, DX)
    centres = in_row([plate] * 4, [0.0] * 4, [None, (5.0, 1.0), None, None])
    assert centres[1].tolist() == [5.0, 1.0]
    assert centres[[0, 2, 3], 0] == pytest.approx([-0.2, 0.2, 0.6])


def test_rotations():
    quarter = rotation_matrix(2, math.pi / 2)
    assert quarter @ [1.0, 0.0] == pytest.approx([0.0, 1.0])
    matrix = rotation_matrix(3, 0.7, (1.0, 2.0, -0.5))
    assert matrix @ matrix.T == pytest.approx(np.eye(3), abs=1e-15)
    assert np.linalg.det(matrix) == pytest.approx(1.0)
    assert matrix @ [1.0, 2.0, -0.5] == pytest.approx([1.0, 2.0, -0.5])
    rod = fill(Cylinder(1.0, 2.0, "x"), None, 0.25)
    turned = rotate(rod, rotation_matrix(3, math.pi / 2))
    assert np.ptp(turned.positions, axis=0) == pytest.approx(np.ptp(rod.positions, axis=0)[[1, 0, 2]])
    for bad in [(1, 0.1, (0, 0, 1)), (3, 0.1, (0.0, 0.0, 0.0)), (3, 0.1, (math.nan, 0, 1))]:
        with pytest.raises(CaseError):
            rotation_matrix(*bad)


def test_a_rotated_body_still_touches():
    plate = fill(Box([0.4, 3.0]), None, DX)
    oblique = rotate(plate, rotation_matrix(2, 0.4))
    a, b = placed([fill(Disc(1.0), None, DX, exact=False), oblique], [0.0, 0.0], [None, None])
    assert b[:, 0].min() - a[:, 0].max() == pytest.approx(DX)
