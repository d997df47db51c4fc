"""Particles that a pass over present neighbours concerns, found by cells."""

import itertools

import numpy as np
import pytest

from hvisph.sph.neighbours.contact_candidates import Selection


def plain(position, eulerian, bodies, edge, with_neighbours):
    """The choice cell by cell, with dictionaries."""
    cells = [tuple(cell) for cell in np.floor(position * (1.0 / edge)).astype(int)]
    held = {}
    for cell, kind, body in zip(cells, eulerian, bodies, strict=True):
        held.setdefault(cell, []).append((kind, body))
    shifts = list(itertools.product((-1, 0, 1), repeat=position.shape[1]))

    def around(cell):
        return [there for shift in shifts if (there := tuple(np.add(cell, shift))) in held]

    meets = {cell: len({body for there in around(cell) for _, body in held[there]}) > 1 for cell in held}
    near = {cell: any(kind for there in around(cell) for kind, _ in held[there]) for cell in held}
    if with_neighbours:
        near = {cell: any(near[there] for there in around(cell)) for cell in held}
    return np.array([meets[cell] for cell in cells]), np.array([near[cell] for cell in cells])


@pytest.mark.parametrize("with_neighbours", [False, True])
@pytest.mark.parametrize("spread", [1.0, 30.0])  # the second wraps round the grid many times
def test_particles_are_chosen_by_cells_of_space(spread, with_neighbours):
    random = np.random.default_rng(3)
    start = random.uniform(0.0, 8.0, (400, 2))
    selection = Selection(start, 1.0, with_neighbours)
    now = start.copy()
    now[150:] += random.uniform(-4.0, 4.0, (250, 2)) * spread
    eulerian = (random.random(400) < 0.02).astype(np.uint8)
    bodies = (np.arange(400) // 200).astype(np.uint32)
    for place in (now, now[::-1].copy(), now):  # nothing is left of the time before
        found = selection.choose(place, eulerian, bodies)
        for one, expected in zip(found, plain(place, eulerian, bodies, 1.0, with_neighbours), strict=True):
            np.testing.assert_array_equal(one, expected)
            assert 0 < one.sum() < 400
