"""The elastic bar that strikes a wall, by finite elements: exact in one dimension, and what the bars' problem asks."""

import numpy as np
import pytest
from striking_bar import rebound, stiffness

from hvisph.verification.problem import POISSON_RATIO, RHO, YOUNGS_MODULUS
from hvisph.verification.problems.bars import LEFT, SIZES, SPEED

METAL = (YOUNGS_MODULUS, POISSON_RATIO, RHO)


@pytest.mark.parametrize("dim", [2, 3])
def test_stiffness_knows_rigid_motions_and_uniform_strain(dim):
    k = stiffness(0.5, dim, 2.0, 0.3)
    assert np.allclose(k, k.T, atol=1e-14)
    corners = np.stack(np.meshgrid(*[[0.0, 0.5]] * dim, indexing="ij"), -1).reshape(-1, dim)
    turn = np.zeros((dim, dim))
    turn[0, 1], turn[1, 0] = -1.0, 1.0
    for motion in (np.ones_like(corners), corners @ turn.T):
        assert np.abs(k @ motion.ravel()).max() < 1e-14
    strained = np.zeros_like(corners)
    strained[:, 0] = corners[:, 0]
    modulus = 2.0 * 0.7 / (1.3 * 0.4)
    energy = 0.5 * strained.ravel() @ k @ strained.ravel()
    assert energy == pytest.approx(0.5 * modulus * 0.5**dim, rel=1e-13)


def test_a_bar_of_one_dimension_gives_all_back():
    """Poisson's ratio 0 makes a plane bar one of one dimension: it leaves as fast as it came."""
    found = [25.0 - rebound((10e-3, 2e-3), dx, (70e9, 0.0, 2700.0), 25.0, 6e-6)[0] for dx in (1e-3, 0.25e-3)]
    assert abs(found[1]) < 0.5 * abs(found[0])
    assert abs(found[1]) < 0.05 * 25.0  # the layer at the wall loses its motion: half an element of 40


@pytest.mark.parametrize(("dim", "dx"), [(2, 0.25e-3), (3, 0.5e-3)])
def test_what_the_problem_of_the_bars_asks_is_what_finite_elements_have(dim, dx):
    velocity, free = rebound(tuple(SIZES[dim]), dx, METAL, SPEED / 2, 12e-6)
    assert SPEED / 2 - velocity == pytest.approx(LEFT[dim], rel=0.015)
    assert free < 6e-6
