"""Planes of symmetry that move: the same bar as on a wall at rest, the balance, a resume, bad input."""

import numpy as np
import pytest
from small_runs import METAL, assert_same_results, final

from hvisph.case.conditions import condition_words
from hvisph.casefile.loader import load_case
from hvisph.core.errors import CaseError
from hvisph.measures.measurement_frame import Scene
from hvisph.output.reader import list_snapshots, read_snapshot
from hvisph.simulation.run import resume, run

WALL = 300.0
OPTIONS = {"adaptive": {"conversion": {"strain": 0.02}}}
TABLE = [[0.0, 100.0], [2e-7, 300.0], [2e-7, 150.0]]


def bar(speed, wall, formulation="riemann", **further):
    """A bar in plane strain on a wall, both at constant speed."""
    shape = {"type": "box", "size": [4e-3, 2e-3]}
    return load_case({
        "kinematics": "plane_strain", "resolution": 0.25e-3, "formulation": {"type": formulation} | OPTIONS.get(formulation, {}),
        "bodies": {"bar": {"material": METAL, "shape": shape, "position": [2e-3, 0.0], "velocity": [speed, 0.0]}},
        "symmetry": [{"axis": "x"} | ({"velocity": wall} if wall else {})],
        "time": {"end": 1.5e-6}, "output": {"every": 5e-7},
    } | further)  # fmt: skip


@pytest.mark.parametrize("formulation", ["riemann", "eulerian", "total_lagrangian", "adaptive"])
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


@pytest.mark.parametrize("formulation", ["riemann", "total_lagrangian"])
def test_a_wall_that_follows_a_table_is_balanced_and_resumed(formulation, tmp_path):
    """Measures mirror at the place of the wall at each snapshot: the way by the table is 75 um at 0.5 us."""
    case = bar(0.0, TABLE, formulation)
    outcome = run(case, tmp_path / "whole")
    assert abs(outcome.summary["conservation"]["energy_drift"]) < 1e-12
    (moved,) = read_snapshot(list_snapshots(tmp_path / "whole")[1]).metadata["moved_planes"]
    assert moved == {"axis": "x", "from": 0.0, "at": pytest.approx(2e-7 * 200.0 + 3e-7 * 150.0, rel=1e-9)}
    run(case.model_copy(update={"time": case.time.model_copy(update={"max_steps": 11})}), tmp_path / "part")
    resume(tmp_path / "part", max_steps=10**6)
    assert_same_results(tmp_path / "whole", tmp_path / "part")


@pytest.mark.parametrize(("change", "words"), [
    ({"formulation": "projection"}, "projection has no planes that move"),
    ({"symmetry": [{"axis": "x", "velocity": 1.0}, {"axis": "x", "at": 9e-3, "keep": "below"}]}, "one plane across"),
    ({"symmetry": [{"axis": "x", "velocity": [[1, 0], [0, 1]]}]}, "must rise"),
    ({"time": {"end": 1e-7, "integrator": "predictor_corrector"}}, "leapfrog"),
])  # fmt: skip
def test_bad_input(change, words):
    with pytest.raises(CaseError, match=words):
        bar(0.0, WALL, **change)


@pytest.mark.parametrize(("formulation", "further"), [
    ("riemann", {}), ("eulerian", {}), ("total_lagrangian", {}), ("riemann", {"gravity": [-2e8, 0.0]}),
])  # fmt: skip
def test_a_wall_drives_a_bar_through_an_open_edge(formulation, further, tmp_path):
    """What the wall gives is in the bar or has left by the edge: energy and momentum close with these columns."""
    edge = {"axis": "x", "at": 4e-3, "keep": "below"}
    case = bar(0.0, TABLE, formulation, edges=[edge, {"axis": "y", "at": 1e-3, "keep": "below"}], **further)
    conservation = run(case, tmp_path / "run").summary["conservation"]
    assert abs(conservation["energy_drift"]) < 1e-12
    assert abs(conservation["momentum_drift"] or 0.0) < 1e-12
    columns = np.genfromtxt(tmp_path / "run" / "history.csv", delimiter=",", names=True)
    assert columns["edge_momentum_x"][-1] > 0.0 or further
    assert columns["external_work"][-1] > columns["edge_energy"][-1] > 0.0 or further
    state = final(tmp_path / "run")
    assert state.fields["position"][:, 0].min() > 2e-7 * 200.0 + 1.3e-6 * 150.0  # the layer beside it, too


def test_a_body_on_a_moved_mirror_is_whole(tmp_path):
    """A half bar whose mirror sets off is completed about the plane where it is, not where it was."""
    table = [[0.0, 0.0], [5e-7, 200.0]]
    shape = {"type": "box", "size": [4e-3, 2e-3]}
    case = load_case({
        "kinematics": "plane_strain", "resolution": 0.25e-3,
        "bodies": {"bar": {"material": METAL, "shape": shape, "position": [2e-3, 0.0], "velocity": [100.0, 0.0]}},
        "symmetry": [{"axis": "y", "velocity": table}], "time": {"end": 1.5e-6}, "output": {"every": 1.5e-6},
    })  # fmt: skip
    run(case, tmp_path / "run")
    start, end = (read_snapshot(path) for path in list_snapshots(tmp_path / "run"))
    scene, place = Scene.from_snapshot(end, start), 5e-7 * 100.0 + 1e-6 * 200.0
    assert scene.position[:, 1].mean() == pytest.approx(place, rel=1e-9)
    highest = end.fields["position"][:, 1].max()
    assert np.ptp(scene.position[:, 1]) == pytest.approx(2.0 * (highest - place), rel=1e-9)


def test_walls_and_strips_have_no_images(tmp_path):
    """A wall that drives a bar at rest is no mirror of it, and two planes on one axis are those of an endless strip."""
    planes = [{"axis": "x", "velocity": 5.0}, {"axis": "y", "at": -1e-3}, {"axis": "y", "at": 1e-3, "keep": "below"}]
    case = load_case({
        "kinematics": "plane_strain", "resolution": 0.25e-3, "symmetry": planes,
        "bodies": {"bar": {"material": METAL, "shape": {"type": "box", "size": [4e-3, 2e-3]}, "position": [2e-3, 0.0]}},
        "time": {"end": 1e-7}, "output": {"every": 1e-7},
    })  # fmt: skip
    outcome = run(case, tmp_path / "run")
    start, end = (read_snapshot(path) for path in list_snapshots(tmp_path / "run"))
    assert Scene.from_snapshot(end, start).state.count == end.count
    assert outcome.summary["bodies"]["bar"]["velocity"][0] > 0.0


def test_check_names_the_moving_plane():
    assert condition_words(bar(0.0, WALL)) == [("moving plane", "x = 0 m: 300 m/s")]
