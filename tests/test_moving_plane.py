"""Planes of symmetry that move: the same bar as on a wall at rest, the balance, a resume, bad input."""

import numpy as np
import pytest
from small_runs import METAL, assert_same_results, final

from hvisph.case.conditions import condition_words
from hvisph.casefile.loader import load_case
from hvisph.core.errors import CaseError
from hvisph.simulation.run import resume, run

WALL = 300.0
TABLE = [[0.0, 100.0], [2e-7, 300.0], [2e-7, 150.0]]


def bar(speed, wall, formulation="riemann", **further):
    """A bar in plane strain on a wall, both at constant speed."""
    shape = {"type": "box", "size": [4e-3, 2e-3]}
    return load_case({
        "kinematics": "plane_strain", "resolution": 0.25e-3, "formulation": {"type": formulation},
        "bodies": {"bar": {"material": METAL, "shape": shape, "position": [2e-3, 0.0], "velocity": [speed, 0.0]}},
        "symmetry": [{"axis": "x"} | ({"velocity": wall} if wall else {})],
        "time": {"end": 1.5e-6}, "output": {"every": 5e-7},
    } | further)  # fmt: skip


@pytest.mark.parametrize("formulation", ["riemann", "eulerian"])
def test_a_moving_wall_is_one_at_rest_to_who_moves_with_it(formulation, tmp_path):
    run(bar(-WALL, 0.0, formulation), tmp_path / "rest")
    outcome = run(bar(0.0, WALL, formulation), tmp_path / "moves")
    rest, moves = final(tmp_path / "rest"), final(tmp_path / "moves")
    shift = np.array([WALL * 1.5e-6, 0.0])
    assert np.allclose(moves.fields["position"] - shift, rest.fields["position"], rtol=0.0, atol=1e-6 * 4e-3)
    assert np.allclose(moves.fields["velocity"] - [WALL, 0.0], rest.fields["velocity"], rtol=0.0, atol=1e-3)
    assert abs(outcome.summary["conservation"]["energy_drift"]) < 1e-12
    momentum = (moves.fields["mass"] * moves.fields["velocity"][:, 0]).sum()
    columns = np.genfromtxt(tmp_path / "moves" / "history.csv", delimiter=",", names=True)
    assert columns["external_work"][-1] == pytest.approx(WALL * momentum, rel=1e-9)
    assert columns["support_momentum_x"][-1] == pytest.approx(-momentum, rel=1e-9)


def test_a_wall_that_follows_a_table_is_balanced_and_resumed(tmp_path):
    case = bar(0.0, TABLE)
    outcome = run(case, tmp_path / "whole")
    assert abs(outcome.summary["conservation"]["energy_drift"]) < 1e-12
    run(case.model_copy(update={"time": case.time.model_copy(update={"max_steps": 11})}), tmp_path / "part")
    resume(tmp_path / "part", max_steps=10**6)
    assert_same_results(tmp_path / "whole", tmp_path / "part")


@pytest.mark.parametrize(("change", "words"), [
    ({"formulation": "total_lagrangian"}, "only planes of riemann and eulerian"),
    ({"symmetry": [{"axis": "x", "velocity": 1.0}, {"axis": "x", "at": 9e-3, "keep": "below"}]}, "one plane across"),
    ({"symmetry": [{"axis": "x", "velocity": [[1, 0], [0, 1]]}]}, "must rise"),
    ({"time": {"end": 1e-7, "integrator": "predictor_corrector"}}, "leapfrog"),
    ({"edges": [{"axis": "x", "at": 4e-3, "keep": "below"}]}, "does not go with open edges"),
])  # fmt: skip
def test_bad_input(change, words):
    with pytest.raises(CaseError, match=words):
        bar(0.0, WALL, **change)


def test_check_names_the_moving_plane():
    assert condition_words(bar(0.0, WALL)) == [("moving plane", "x = 0 m: 300 m/s")]
