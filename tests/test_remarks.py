"""What a run says of itself at its end."""

import numpy as np
import pytest

from hvisph.measures.remarks import remarks
from hvisph.output.snapshot import Snapshot

DX = 1e-3


def snapshot(position, velocity=0.0, energy=0.0, body=0):
    n = len(position)
    fields = {
        "position": position, "velocity": np.full(position.shape, velocity), "mass": np.full(n, 2700 * DX**2),
        "density": np.full(n, 2700.0), "internal_energy": np.broadcast_to(energy, n).astype(float),
    }  # fmt: skip
    zero = np.zeros(n, dtype=int)
    return Snapshot(0.0, 0, 2, fields, zero + body, zero, np.arange(n), ["plate"], ["metal"], {})


@pytest.fixture
def plate():
    x, y = np.meshgrid(np.arange(20) * DX, np.arange(10) * DX)
    return np.column_stack([x.ravel(), y.ravel()])


def said(now, start, whole=True):
    return remarks(now, start, ["plate"], [whole], DX)


def test_a_sound_body_has_nothing_to_say(plate):
    start = snapshot(plate, velocity=100.0)
    assert said(start, start) == []


def test_clumped_pairs(plate):
    moved = plate.copy()
    moved[:6:2] = moved[1:6:2] + 0.1 * DX
    (text,) = said(snapshot(moved), snapshot(plate))
    assert "plate: 3 % of its particles" in text
    assert "clumped" in text


def test_a_solid_that_tears_says_so_unless_it_may_fail(plate):
    torn = plate + np.where(plate[:, :1] > 14.5 * DX, 5 * DX, 0.0)
    (text,) = said(snapshot(torn), snapshot(plate))
    assert "25 % of it has torn off" in text
    assert said(snapshot(torn), snapshot(plate), whole=False) == []
    assert said(snapshot(torn), snapshot(torn)) == []  # it was in pieces from the start


def test_internal_energy_below_zero(plate):
    start = snapshot(plate, velocity=100.0)
    energy = np.zeros(len(plate))
    energy[3] = -0.5e4 * len(plate)
    (text,) = said(snapshot(plate, 100.0, energy), start)
    assert "below zero" in text
