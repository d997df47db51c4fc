"""Gauges: what they follow, what they record, when, and what is refused."""

import numpy as np
import pytest
from small_runs import DAMAGED, FORMULATIONS, METAL, OPTIONS, row_of

from hvisph.casefile.loader import load_case
from hvisph.core.errors import CaseError
from hvisph.core.fields import component_names
from hvisph.output.reader import list_snapshots, read_history, read_snapshot
from hvisph.simulation.run import run

LINEAR = {"density": 1.0, "eos": {"type": "linear", "cauchy_number": 1.0}}


def layers(**changes):
    return {
        "title": "two layers",
        "units": "none",
        "kinematics": "uniaxial_strain",
        "resolution": 0.02,
        "bodies": {
            "left": {"material": LINEAR, "shape": {"type": "interval", "length": 0.5}, "velocity": 0.5},
            "right": {"material": LINEAR, "shape": {"type": "interval", "length": 0.5}, "velocity": -0.5},
        },
        "formulation": {"type": "eulerian", "kernel": "gaussian", "h_over_dx": 1.2},
        "time": {"end": 0.1},
    } | changes


def gauges(**kinds):
    return {"gauges": kinds}


def test_rides_with_the_material(tmp_path):
    fields = ["position", "velocity", "pressure", "density", "stress", "sound_speed", "internal_energy"]
    case = layers(**gauges(A={"type": "material", "at": 0.111, "fields": fields}))
    outcome = run(load_case(case), tmp_path / "run", threads=1)
    history = read_history(outcome.folder)
    last = read_snapshot(list_snapshots(outcome.folder)[-1])
    first = read_snapshot(list_snapshots(outcome.folder)[0])
    number = np.abs(first.fields["position"][:, 0] - 0.111).argmin()
    for column, field in (("velocity_x", "velocity"), ("position_x", "position"), ("pressure", "pressure"),
                          ("density", "density"), ("sound_speed", "sound_speed")):  # fmt: skip
        value = np.ravel(last.fields[field][number])[0]
        # the very numbers of the snapshot: both are the state at the end of the step
        assert history[f"gauge.A.{column}"][-1] == pytest.approx(value, rel=1e-14, abs=1e-14)
    assert history["gauge.A.stress_xx"][-1] == pytest.approx(-history["gauge.A.pressure"][-1], rel=1e-12)
    assert len(history["gauge.A.density"]) == len(history["time"])
    assert history["gauge.A.position_x"][0] == pytest.approx(0.11)


def test_rides_on_through_new_orders_of_the_state(tmp_path):
    # the state is put into cell order every 16 steps; a gauge must not change its particle
    case = layers(**gauges(A={"type": "material", "at": -0.3, "fields": "position"}))
    case["time"] = {"end": 0.3, "step": 0.002}
    history = read_history(run(load_case(case), tmp_path / "run", threads=1).folder)
    x, t = history["gauge.A.position_x"], history["time"]
    assert np.abs(np.diff(x)).max() < 0.5 * np.diff(t).max() * 1.05  # never faster than the impact


def test_fixed_point_and_shepard(tmp_path):
    case = layers(**gauges(
        inside={"type": "fixed", "at": 0.1, "fields": ["velocity_x", "density"]},
        edge={"type": "fixed", "at": 0.499, "fields": "density"},
        ahead={"type": "fixed", "at": 0.9, "fields": "density"},
    ))  # fmt: skip
    case["time"] = {"end": 0.02}
    history = read_history(run(load_case(case), tmp_path / "run", threads=1).folder)
    # Before the shock comes: constants are met to round-off, at the free surface as well.
    assert history["gauge.inside.velocity_x"][0] == pytest.approx(-0.5, rel=1e-13)
    assert history["gauge.edge.density"][0] == pytest.approx(1.0, rel=1e-13)
    assert np.isnan(history["gauge.ahead.density"]).all()


def test_free_surface_in_two_dimensions(tmp_path):
    case = {
        "title": "disc on a plate",
        "kinematics": "plane_strain",
        "resolution": "0.5 mm",
        "bodies": {
            "projectile": {"material": "aluminium-howell-ball", "shape": {"type": "disc", "diameter": "4 mm"},
                           "velocity": ["1 km/s", 0]},
            "target": {"material": "aluminium-howell-ball", "shape": {"type": "box", "size": ["3 mm", "10 mm"]}},
        },
        "formulation": {"type": "eulerian"},
        "time": {"end": "0.2 us"},
        "gauges": {
            "back": {"type": "free_surface", "at": ["0.5 mm", "0.1 mm"], "fields": ["position", "velocity_x"]},
            "side": {"type": "free_surface", "at": ["1 mm", 0], "direction": "+y", "fields": ["position_y"]},
            "felt": {"type": "fixed", "at": ["1.5 mm", 0], "fields": ["von_mises_stress", "deviator"]},
            "tip": {"type": "material", "at": ["-3.9 mm", 0], "fields": ["stress", "plastic_strain", "damage"]},
        },
    }  # fmt: skip
    history = read_history(run(load_case(case), tmp_path / "run", threads=1).folder)
    # faces lie half a spacing outside the outermost particles: 3 mm and 5 mm
    assert history["gauge.back.position_x"][0] == pytest.approx(3e-3, rel=1e-9)
    assert history["gauge.side.position_y"][0] == pytest.approx(5e-3, rel=1e-9)
    assert {"gauge.felt.deviator_zz", "gauge.tip.stress_xy", "gauge.back.velocity_x"} <= history.keys()
    assert "gauge.back.velocity_y" not in history
    assert np.isfinite(history["gauge.felt.deviator_zz"]).all()


ALONE = [("riemann", 1), ("total_lagrangian", 1), ("total_lagrangian", 3), ("adaptive", 1), ("adaptive", 3)]


@pytest.mark.parametrize(
    ("formulation", "dim"),  # cases of projection have two dimensions or three; some would compile loops for this alone
    [pytest.param(name, dim, marks=[pytest.mark.slow] * ((name, dim) in ALONE))
     for name in FORMULATIONS for dim in (1, 2, 3) if (name, dim) != ("projection", 1)],
)  # fmt: skip
def test_every_formulation_and_dimension(tmp_path, formulation, dim):
    """Riding gauges hold the very numbers of the snapshot; a fixed one lies among those of its neighbours."""
    beside = [0.0] * (dim - 1)
    fields = ["position", "velocity", "pressure", "density", "stress", "von_mises_stress", "plastic_strain"]
    case = row_of(
        [DAMAGED if formulation == "adaptive" else METAL] * 2,
        dim,
        formulation={"type": formulation} | OPTIONS.get(formulation, {}),
        time={"end": 3e-8 if formulation == "projection" else 2e-7},
        gauges={
            "riding": {"type": "material", "at": [-0.8e-3, *beside], "fields": fields},
            "fixed": {"type": "fixed", "at": [0.9e-3, *beside], "fields": fields},
            "back": {"type": "free_surface", "at": [-0.8e-3, *beside], "direction": "-x", "fields": fields},
        },
    )
    outcome = run(case, tmp_path / "run", threads=1)
    history = read_history(outcome.folder)
    first, last = (read_snapshot(list_snapshots(outcome.folder)[k]) for k in (0, -1))
    columns = [c for field in fields for c in component_names(field, dim)]
    assert {f"gauge.{name}.{c}" for name in ("riding", "fixed", "back") for c in columns} <= history.keys()
    start = first.fields["position"]
    ridden = np.linalg.norm(start - [-0.8e-3, *beside], axis=1).argmin()
    for name in ("velocity", "pressure", "density", "von_mises_stress", "plastic_strain"):
        values = last.fields[name]
        own = np.ravel(values[ridden])[0]
        suffix = "_x" if name == "velocity" else ""
        assert history[f"gauge.riding.{name}{suffix}"][-1] == pytest.approx(own, rel=1e-12, abs=1e-12), name
        reached = np.linalg.norm(last.fields["position"] - [0.9e-3, *beside], axis=1) < 2.0e-3
        near = np.ravel(values[reached, 0] if name == "velocity" else values[reached])
        found, rounding = history[f"gauge.fixed.{name}{suffix}"][-1], 1e-12 * np.abs(near).max()
        assert near.min() - rounding <= found <= near.max() + rounding, name
    # half a spacing outside the last particle beside the axis; spacings have changed by some percent
    inner = (np.abs(last.fields["position"][:, 1:dim]) < 0.5e-3).all(axis=1)
    outermost = last.fields["position"][inner, 0].min()
    assert history["gauge.back.position_x"][-1] == pytest.approx(outermost - 0.25e-3, abs=0.1 * 0.5e-3)


def test_a_retired_particle_records_nothing(tmp_path):
    case = row_of([METAL], formulation={"type": "eulerian"}, speed=2000.0, domain={"max": [3.5e-3, None]},
                  gauges={"front": {"type": "material", "at": [2.7e-3, 0.2e-3], "fields": ["position", "density"]},
                          "rear": {"type": "material", "at": [0.3e-3, 0.2e-3], "fields": ["position", "density"]}},
                  )  # fmt: skip
    outcome = run(case, tmp_path / "run", threads=1)
    assert outcome.summary["conservation"]["retired_particles"] > 0
    history = read_history(outcome.folder)
    x = history["gauge.front.position_x"]
    gone = np.isnan(x)
    assert gone[-1]
    assert not gone[0]
    assert not np.diff(gone.astype(int)).min() < 0  # for good
    assert np.array_equal(gone, np.isnan(history["gauge.front.density"]))
    # up to then it flies: particles are retired every 16 steps
    assert 3.5e-3 * 0.9 <= x[~gone][-1] < 3.5e-3 + 2000.0 * 17 * np.diff(history["time"]).max()
    assert np.isfinite(history["gauge.rear.position_x"]).all()


def test_cadence(tmp_path):
    case = layers(**gauges(
        often={"type": "material", "at": 0.1, "fields": "density", "every": 2},
        plain={"type": "material", "at": 0.1, "fields": "density"},
    ))  # fmt: skip
    case["time"] = {"end": 0.1, "step": 0.005}
    case["output"] = {"every": 0.1, "history_every": 5}
    history = read_history(run(load_case(case), tmp_path / "run", threads=1).folder)
    assert list(history["step"]) == [0, 2, 4, 5, 6, 8, 10, 12, 14, 15, 16, 18, 20]
    due = history["step"] % 2 == 0
    assert np.array_equal(np.isfinite(history["gauge.often.density"]), due)
    assert np.isfinite(history["gauge.plain.density"]).all()


def test_a_gauge_may_be_a_coarse_spacing_from_the_nearest_particle(tmp_path):
    """Half a diagonal of a coarse body's lattice is more than a spacing of the case."""
    setting = ["bodies.target.resolution=0.6 mm", "gauges.A={type: material, at: [1.2 mm, 0], fields: [position]}",
               "bodies.target.shape.size.0=2.4 mm", "time.end=1 ns"]  # fmt: skip
    history = read_history(run(load_case("al_al_coarse", setting), tmp_path / "run", threads=1).folder)
    assert abs(history["gauge.A.position_x"][0] - 1.2e-3) == pytest.approx(0.3e-3, rel=0.01)


@pytest.mark.parametrize(
    ("gauge", "place", "words"),
    [
        ({"type": "material", "at": 3.0}, "gauges.A.at", "outside every body"),
        ({"type": "free_surface", "at": -0.7}, "gauges.A.at", "outside every body"),
        ({"type": "material", "at": [0.1, 0.0]}, "gauges.A.at", "needs 1 in 1D"),
        (
            {"type": "material", "at": 0.1, "fields": ["presure"]},
            "gauges.A.fields.0",
            "did you mean 'pressure'",
        ),
        ({"type": "material", "at": 0.1, "fields": ["velocity", "velocity_x"]}, "gauges.A.fields", "twice"),
        ({"type": "material", "at": 0.1, "fields": ["velocity_y"]}, "gauges.A.fields.0", "unknown field"),
        ({"type": "material", "at": 0.1, "fields": ["viscosity_factor"]}, "gauges.A.fields", "not a field of"),
        ({"type": "free_surface", "at": 0.1, "direction": "+y"}, "gauges.A.direction", "no axis y"),
        ({"type": "material", "at": 0.1, "every": 0}, "gauges.A.every", "greater than or equal to 1"),
    ],
)
def test_refused(tmp_path, gauge, place, words):
    with pytest.raises(CaseError) as caught:
        run(load_case(layers(**gauges(A=gauge))), tmp_path / "run", threads=1)
    assert place in str(caught.value)
    assert words in str(caught.value)
    assert not (tmp_path / "run").exists()
