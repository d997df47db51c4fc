"""Which particles the centre pressure watches, its peaks, and the plateau of plate impacts."""

import numpy as np
import pytest
from measure_bodies import MM, ball, box, snapshot

from hvisph.casefile.loader import load_case
from hvisph.diagnostics.budgets import observed_particles
from hvisph.measures.measurement_frame import Scene
from hvisph.measures.pressure import AXIS_COLUMN, CENTRE_COLUMN, axis_particles, centre_particles, peak, plateau
from hvisph.measures.result import UndefinedMeasureError, evaluate
from hvisph.setup.initial_state import begin


def test_centre_particles_are_within_three_tenths_of_a_millimetre():
    position = ball([-5 * MM, 2 * MM], 10 * MM, 0.1 * MM)
    distance = np.linalg.norm(position - [-5 * MM, 2 * MM], axis=1)
    chosen = centre_particles(position, 0.1 * MM)
    np.testing.assert_array_equal(chosen, np.flatnonzero(distance <= 0.3 * MM))
    assert len(chosen) > 20


@pytest.mark.parametrize(("count", "nearest"), [(10, 4), (9, 1)])
def test_coarse_projectile_has_its_nearest_particles(count, nearest):
    dx = 1 * MM
    position = box([0, 0], [count * dx, count * dx], dx)
    # an even lattice has four particles at one distance from its centre, an odd one a particle on it
    assert len(centre_particles(position, dx)) == nearest


def test_axis_particles():
    dx = 0.1 * MM
    even = ball([0, 0], 2 * MM, dx)
    assert (np.abs(even[axis_particles(even, dx), 1]) < dx).all()
    assert len(axis_particles(even, dx)) == (np.abs(even[:, 1]) < dx).sum()
    line = box([-1 * MM], [0], dx)
    assert len(axis_particles(line, dx)) == len(line)


@pytest.mark.parametrize(
    ("settings", "body"), [((), 1), (("bodies.target.role=projectile", "bodies.flyer.role=layer"), 0)]
)
def test_history_watches_the_projectile_wherever_it_stands_in_the_file(settings, body):
    plate = {"material": "copper-ofhc", "shape": {"type": "interval", "length": 2 * MM}}
    bodies = {"target": plate | {"position": [-1 * MM]}, "flyer": plate | {"position": [1 * MM], "velocity": [-300.0]}}
    case = load_case(
        {"kinematics": "uniaxial_strain", "resolution": 0.1 * MM, "bodies": bodies, "time": {"end": 1e-6}}, settings
    )
    state = begin(case)
    for numbers in observed_particles(state.particles, state.planes, case).values():
        assert (state.particles.body[np.isin(state.particles.id, numbers)] == body).all()


def history():
    time = np.linspace(0.0, 8e-6, 801)
    return {
        "time": time,
        "centre_pressure": 19e9 * np.exp(-(((time - 0.9e-6) / 0.4e-6) ** 2)),
        "axis_pressure_min": -20e9 * np.exp(-(((time - 2.3e-6) / 0.2e-6) ** 2)),
    }


def centre_pressure_peak(columns, until=np.inf):
    return peak(columns, CENTRE_COLUMN, 1.0, until)


def centre_tension_peak(columns, until=np.inf):
    return peak(columns, AXIS_COLUMN, -1.0, until)


def test_peaks_are_samples_with_their_time():
    high = centre_pressure_peak(history())
    assert high.value == pytest.approx(19e9, rel=1e-6)
    assert high.time == pytest.approx(0.9e-6, abs=1e-9)
    low = centre_tension_peak(history())
    assert low.value == pytest.approx(20e9, rel=1e-6)
    assert low.time == pytest.approx(2.3e-6, abs=1e-9)
    # neighbouring samples are 10 ns away: (0.01/0.4)^2 of the peak lower
    assert high.uncertainty == pytest.approx(19e9 * (0.01 / 0.4) ** 2, rel=0.01)


def test_peaks_only_up_to_the_moment():
    early = centre_pressure_peak(history(), until=0.5e-6)
    assert early.time == pytest.approx(0.5e-6)
    assert early.value == pytest.approx(19e9 * np.exp(-1.0), rel=1e-6)
    assert centre_tension_peak({"time": np.arange(3.0), "axis_pressure_min": np.ones(3)}).value == 0.0


def test_peaks_that_are_not_there():
    columns = {"time": np.arange(2.0), "centre_pressure": np.array([np.nan, 5.0])}
    assert centre_pressure_peak(columns).value == 5.0
    with pytest.raises(UndefinedMeasureError, match="no history"):
        centre_pressure_peak(None)
    with pytest.raises(UndefinedMeasureError, match="column"):
        centre_tension_peak({"time": np.zeros(2)})
    with pytest.raises(UndefinedMeasureError, match="numbers"):
        centre_pressure_peak({**columns, "centre_pressure": np.array(["1.0", "None"])})
    with pytest.raises(UndefinedMeasureError, match="no value"):
        centre_pressure_peak(columns, until=0.5)


def plates(stress_of, velocity_of, dx=0.01 * MM, length=2 * MM):
    snap = snapshot(box([-length], [0], dx), box([0], [length], dx), time=2e-7, dx=dx)
    x = snap.fields["position"][:, 0]
    snap.fields["pressure"] = stress_of(x) - 0.2e9 * (stress_of(x) > 0)
    snap.fields["deviator"][:, 0] = -0.2e9 * (stress_of(x) > 0)
    snap.fields["velocity"][:, 0] = velocity_of(x)
    return Scene(snap)


def test_plateau_of_a_plate_impact():
    def stress(x):
        noise = 0.05e9 * np.sin(2 * np.pi * x / 0.04e-3)
        inside = (x > -0.9 * MM) & (x < 1.2 * MM)
        spike = -6e9 * np.exp(-((x / 0.03e-3) ** 2))
        return np.where(inside, 28.65e9 + noise + spike, 0.0)

    found = plateau(plates(stress, lambda x: np.where(x < -0.9 * MM, 3100.0, np.where(x < 1.2 * MM, 1550.0, 0))))
    # whole waves of the ringing average out to a part of one of their 80 particles
    assert found.stress.value == pytest.approx(28.65e9, rel=5e-4)
    assert found.stress.uncertainty < 0.06e9
    assert found.velocity.value == pytest.approx(1550.0)
    assert found.count > 50


def test_plateau_stops_where_a_release_has_come_back():
    def stress(x):
        return np.where((x > -0.4 * MM) & (x < 1.6 * MM), 20e9, np.where(x > 1.6 * MM, 0.0, 1e9))

    found = plateau(plates(stress, lambda x: 1000.0 + 0 * x))
    assert found.stress.value == pytest.approx(20e9)
    assert found.count < 0.5 * 80


def test_no_plateau_says_why():
    with pytest.raises(UndefinedMeasureError, match="compressed"):
        plateau(plates(lambda x: 0 * x, lambda x: 0 * x))
    with pytest.raises(UndefinedMeasureError, match="too short"):
        plateau(plates(lambda x: np.where(np.abs(x) < 0.08 * MM, 5e9, 0.0), lambda x: 0 * x))
    assert "plateau_stress" not in evaluate("run", Scene(snapshot(ball([0, 0], MM, 0.1 * MM))))
