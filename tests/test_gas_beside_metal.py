"""Gas behind a metal wall that is struck: smoothing lengths that follow density on both sides of a contact."""

import pytest

from hvisph.casefile.loader import load_case
from hvisph.simulation.run import run


@pytest.mark.parametrize("density", [59.4, 1.19], ids=["50_bar", "1_bar"])
def test_the_balances(density, tmp_path):
    """Every pair in contact is in the lists of both sides: energy and momentum are balanced to round-off.

    The ball's spacing is fitted to its size, so that the contact takes unequal smoothing lengths.
    """
    case = load_case({
        "kinematics": "plane_strain", "resolution": 0.25e-3,
        "bodies": {
            "ball": {"material": "aluminium-6061-t6", "shape": {"type": "disc", "diameter": 2e-3},
                     "velocity": [5000.0, 0.0]},
            "wall": {"material": "aluminium-6061-t6", "shape": {"type": "box", "size": [1.5e-3, 6e-3]}},
            "air": {"material": {"density": density, "eos": {"type": "ideal_gas", "gamma": 1.4}},
                    "internal_energy": 2.1e5, "shape": {"type": "box", "size": [4e-3, 6e-3]}},
        },
        "time": {"end": 1e-6}, "output": {"every": 1e-6},
    })  # fmt: skip
    conservation = run(case, tmp_path / "run").summary["conservation"]
    assert abs(conservation["energy_drift"]) < 1e-12
    assert abs(conservation["momentum_drift"]) < 1e-12
