"""Gravity and overburden: free fall, columns at rest, the field of a sphere, the balance of energy."""

import numpy as np
import pytest
from small_runs import DAMAGED, GAS, LIQUID, METAL, OPTIONS, assert_same_results, final, row_of

from hvisph.case.consistency import warnings_of
from hvisph.casefile.loader import load_case
from hvisph.core.errors import CaseError
from hvisph.integrators.gravity import GRAVITATIONAL_CONSTANT, SPHERE, UNIFORM, Gravity
from hvisph.output.reader import list_snapshots, read_snapshot
from hvisph.setup.initial_state import begin
from hvisph.simulation.listener import Listener
from hvisph.simulation.run import resume, run


def column(**further):
    """A column of water, 1 m high, on a plane of symmetry, with its overburden."""
    return load_case({
        "kinematics": "uniaxial_strain", "resolution": 0.01, "gravity": [-9.81], "overburden": True,
        "bodies": {"water": {"material": LIQUID, "shape": {"type": "interval", "length": 1.0}, "position": [0.5]}},
        "symmetry": [{"axis": "x"}], "time": {"end": 1e-4}, "output": {"every": 1e-4},
    } | further)  # fmt: skip


@pytest.mark.parametrize(("formulation", "dim"), [
    ("riemann", 1), ("eulerian", 1), ("total_lagrangian", 1), ("riemann", 2), ("adaptive", 2), ("eulerian", 3),
])  # fmt: skip
def test_free_fall(formulation, dim, tmp_path):
    """A body falls by g t^2/2 without a strain; its kinetic energy is that which gravity gives, to round-off."""
    g, end = np.array([3e8, -2e8, 1e8])[:dim], 2e-6
    case = row_of([DAMAGED], dim, speed=0.0, gravity=g.tolist(), time={"end": end},
                  formulation={"type": formulation} | OPTIONS.get(formulation, {}))  # fmt: skip
    outcome = run(case, tmp_path / "run")
    end_state = final(tmp_path / "run")
    assert np.allclose(end_state.fields["velocity"], g * end, rtol=1e-12, atol=0.0)
    assert np.abs(end_state.fields["pressure"]).max() < 1e-3
    assert abs(outcome.summary["conservation"]["energy_drift"]) < 1e-12


def test_the_balance_of_an_impact_under_gravity(tmp_path):
    case = row_of([METAL, METAL], 2, gravity=[2e9, 1e9], time={"end": 1e-6})
    summary = run(case, tmp_path / "run").summary
    assert abs(summary["conservation"]["energy_drift"]) < 1e-12
    assert abs(summary["conservation"]["momentum_drift"]) < 1e-12
    # both fall alike: what the shot gives the target is the same without the field
    alone = run(row_of([METAL, METAL], 2, time={"end": 1e-6}), tmp_path / "alone").summary["measures"]
    transfer = summary["measures"]["momentum_transfer"]["value"]
    assert transfer == pytest.approx(alone["momentum_transfer"]["value"], rel=1e-6)


def test_resume_under_gravity_gives_the_same_bits(tmp_path):
    case = row_of([METAL, METAL], 2, gravity=[2e9, 0.0], time={"end": 5e-7}, output={"every": 1e-7})
    run(case, tmp_path / "whole")
    run(case.model_copy(update={"time": case.time.model_copy(update={"max_steps": 9})}), tmp_path / "part")
    resume(tmp_path / "part", max_steps=10**6)
    assert_same_results(tmp_path / "whole", tmp_path / "part")


@pytest.mark.parametrize("formulation", ["riemann", "eulerian"])
def test_a_column_stays_at_rest(formulation, tmp_path):
    """After half a transit of sound the pressure is that of the overburden, and nothing moves.

    The pair sums at the free face see half of a neighbourhood: the rows there start with an error of rho g dx.
    """
    run(column(formulation={"type": formulation}, time={"end": 6.7e-3}, output={"every": 6.7e-3}), tmp_path / "run")
    state = final(tmp_path / "run").fields
    depth = 1.0 - state["position"][:, 0]
    inside = (depth > 0.1) & (depth < 0.95)
    exact = 1000.0 * 9.81 * depth
    assert np.abs(state["pressure"] - exact)[inside].max() < 0.03 * exact.max()
    assert np.abs(state["velocity"]).max() < 1e-3 * np.sqrt(9.81)


def test_a_body_bears_what_lies_on_it():
    """Water on rock, and a layer of sand between them: each column goes on where the one above ends.

    What is narrower, wider or rigid is refused, unless it settles.
    """
    shape = {"type": "box", "size": [1.0, 1.0]}
    layers = {"rock": (METAL, 0.5), "sand": (SAND, 1.5), "water": (LIQUID, 2.5)}
    bodies = {name: {"material": one, "shape": shape, "position": [at, 0.0]} for name, (one, at) in layers.items()}
    case = {
        "kinematics": "plane_strain", "resolution": 0.05, "gravity": [-9.81, 0.0], "overburden": {"lateral": 0.5},
        "bodies": bodies, "symmetry": [{"axis": "x"}, {"axis": "y", "at": -0.5}, {"axis": "y", "at": 0.5, "keep": "below"}],
        "time": {"end": 1e-4}, "output": {"every": 1e-4},
    }  # fmt: skip
    particles = begin(load_case(case)).particles
    ball = {"material": METAL, "shape": {"type": "disc", "diameter": 0.4}, "position": [3.2, 0.0]}
    plate = {"material": METAL, "shape": {"type": "box", "size": [0.2, 1.0]}, "position": [3.1, 0.0], "rigid": "fixed"}
    wide = {"material": METAL, "shape": {"type": "box", "size": [0.2, 1.4]}, "position": [3.1, 0.0]}
    for body, words, further in (
        (ball, "not as wide", {}),
        (plate, "rigid", {}),
        (wide, "not as wide", {"symmetry": [{"axis": "x"}]}),
    ):
        several = case | {"bodies": bodies | {"more": body}} | further
        with pytest.raises(CaseError, match=f"bodies.more: stands on 'water' and .*{words}"):
            begin(load_case(several))
        begin(load_case(several | {"settle": 1e-3}))
    for number, load in enumerate([(1000.0 + 2000.0) * 9.81, 1000.0 * 9.81, 0.0]):
        own = particles.body == number
        depth = number + 1.0 - particles["position"][own, 0]
        rho = [2785.0, 2000.0, 1000.0][number]
        deviator = particles["deviator"][own, 0]
        # S = -(1 - K0) P 2/3; compressed by 1e-5 of the modulus, sand by 5e-4
        assert np.allclose(deviator, -(2.0 / 3.0) * 0.5 * (load + rho * 9.81 * depth), rtol=2e-3)


def test_overburden_with_a_lateral_ratio(tmp_path):
    """Vertical stress rho g s, horizontal K0 of it; the weight is that of the compressed rows."""
    rock = METAL | {"strength": {"type": "elastic", "shear_modulus": 27e9}}
    case = load_case({
        "kinematics": "plane_strain", "resolution": 1.0, "gravity": [0.0, -10.0], "overburden": {"lateral": 0.5},
        "bodies": {"rock": {"material": rock, "shape": {"type": "box", "size": [6.0, 20.0]}, "position": [0.0, 10.0]}},
        "symmetry": [{"axis": "y"}], "time": {"end": 1e-6}, "output": {"every": 1e-6},
    })  # fmt: skip
    run(case, tmp_path / "run")
    state = final(tmp_path / "run").fields
    stress = 2785.0 * 10.0 * (20.0 - state["position"][:, 1])
    vertical = state["deviator"][:, 1] - state["pressure"]
    horizontal = state["deviator"][:, 0] - state["pressure"]
    assert np.allclose(vertical, -stress, rtol=1e-4)  # the rock is denser by p/K below, 1e-5 of it
    assert np.allclose(horizontal, -0.5 * stress, rtol=1e-4)


@pytest.mark.parametrize("kind", [UNIFORM, SPHERE])
def test_acceleration_is_the_slope_of_the_potential(kind):
    field = Gravity(kind, (0.3, -0.2, 0.1), 4.0, 0.7)
    x = np.random.default_rng(1).normal(size=(50, 3))
    step = 1e-6
    slopes = [(field.potential(x + step * e) - field.potential(x - step * e)) / (2 * step) for e in np.eye(3)]
    assert np.allclose(field.acceleration(x), -np.stack(slopes, 1), atol=1e-6)


def test_an_orbit_about_a_sphere(tmp_path):
    """Ten turns of an elastic stone: energy is kept, radius and period are those of Kepler.

    The tide, of the order of the square of the stone's size over the radius, is 7e-4.
    """
    mass, radius = 4.33e9, 75.5
    r = 2.0 * radius
    speed = float(np.sqrt(GRAVITATIONAL_CONSTANT * mass / r))
    period = 2.0 * np.pi * r / speed
    soft = {"density": 1000.0, "eos": {"type": "elastic", "youngs_modulus": 0.2, "poisson_ratio": 0.3},
            "strength": {"type": "elastic"}}  # fmt: skip
    stone = {"material": soft, "shape": {"type": "box", "size": [4.0, 4.0]}, "position": [r, 0.0]}
    case = load_case({
        "kinematics": "plane_strain", "resolution": 1.0, "formulation": {"type": "total_lagrangian"},
        "gravity": {"type": "sphere", "mass": mass, "radius": radius, "centre": [0.0, 0.0]},
        "bodies": {"stone": stone | {"velocity": [0.0, speed]}},
        "time": {"end": 10.0 * period}, "output": {"every": 5.0 * period},
    })  # fmt: skip
    outcome = run(case, tmp_path / "run")
    assert outcome.exit_code == 0
    x = final(tmp_path / "run").fields["position"].mean(axis=0)
    assert np.hypot(*x) == pytest.approx(r, rel=1e-3)
    assert abs(np.arctan2(x[1], x[0])) < 20.0 * np.pi * 7e-4
    assert abs(outcome.summary["conservation"]["energy_drift"]) < 1e-4


@pytest.mark.parametrize(("settings", "words"), [
    ({"gravity": [1.0, 2.0]}, "needs 1 in 1D"),
    ({"gravity": None, "overburden": True}, "needs `gravity`"),
    ({"gravity": None, "overburden": False, "settle": 1e-3}, "settle: needs `gravity`"),
    ({"symmetry": []}, "nothing supports the bodies along x: .*keep: above"),
    ({"symmetry": [], "overburden": False, "settle": 1e-3}, "settle: nothing supports"),
    ({"symmetry": [{"axis": "x", "at": 1.0, "keep": "below"}]}, "nothing supports the bodies"),
    ({"formulation": {"type": "total_lagrangian"}}, "free of stress"),
    ({"bodies": {"air": {"material": GAS, "shape": {"type": "interval", "length": 1.0}, "position": [0.5]}}}, "a gas has"),
    ({"gravity": [-9.81e9]}, "beyond half to twice the density"),
])  # fmt: skip
def test_what_is_refused(settings, words):
    with pytest.raises(CaseError, match=words):
        begin(column(**settings))


@pytest.mark.parametrize("position", [0.53, 0.6])
def test_a_body_that_hangs_above_its_support_is_refused(position):
    """It says how far; a column on another that stands is taken."""
    water = {"material": LIQUID, "shape": {"type": "interval", "length": 1.0}, "position": [position]}
    with pytest.raises(CaseError, match=f"{100 * (position - 0.5):g} spacings above the plane along x"):
        begin(column(bodies={"water": water}))
    gap = position - 0.5
    foot = {"material": METAL, "shape": {"type": "interval", "length": gap}, "position": [gap / 2]}
    begin(column(bodies={"foot": foot, "water": water}))


def test_pressures_that_alternate_are_warned_of():
    """Standard SPH has no force against them; density dissipation damps them, to 0.8 % at 50 rows for 3.4 %."""
    words = "alternate from row to row"
    assert any(words in one for one in warnings_of(column(formulation={"type": "eulerian"})))
    damped = {"type": "eulerian", "density_dissipation": {"type": "zisis"}}
    for formulation in ({"type": "riemann"}, damped):
        assert not any(words in one for one in warnings_of(column(formulation=formulation)))


@pytest.mark.parametrize("with_dissipation", [True, False])
def test_density_dissipation_evens_pressures_at_rest(with_dissipation, tmp_path):
    """After settling the difference of neighbours is that of the weight of a row, or 2 rows of the alternating mode."""
    more = {"density_dissipation": {"type": "zisis"}} if with_dissipation else {}
    run(column(resolution=0.05, formulation={"type": "eulerian"} | more, settle=12.0 / 1483.0), tmp_path / "run")
    state = final(tmp_path / "run").fields
    order = np.argsort(state["position"][:, 0])
    steps = -np.diff(state["pressure"][order])[1:8] / (1000.0 * 9.81 * 0.05)
    assert (np.abs(steps - 1.0).max() < 0.2) == with_dissipation


def test_free_sides_are_warned_of():
    box = {"material": METAL, "shape": {"type": "box", "size": [1.0, 1.0]}, "position": [0.5, 0.0]}
    settings = {"kinematics": "plane_strain", "gravity": [-9.81, 0.0], "bodies": {"box": box}, "resolution": 0.1}
    words = "nothing holds the sides along y"
    assert any(words in warning for warning in warnings_of(column(**settings)))
    walls = [{"axis": "x"}, {"axis": "y", "at": -0.5}, {"axis": "y", "at": 0.5, "keep": "below"}]
    for held in ({"symmetry": walls}, {"overburden": {"lateral": 0.0}}):
        assert not any(words in warning for warning in warnings_of(column(**settings | held)))
    disc = {"disc": box | {"shape": {"type": "disc", "diameter": 1.0}}}
    assert any("below its highest point" in warning for warning in warnings_of(column(**settings | {"bodies": disc})))


def test_gravity_across_the_axis_is_refused():
    with pytest.raises(CaseError, match="along the axis x alone"):
        row_of([METAL], 2, kinematics="axisymmetric", gravity=[1.0, 2.0])


class Heard(Listener):
    """Keeps the messages of a run."""

    def __init__(self):
        self.said = []

    def message(self, text):
        self.said.append(text)


ELASTIC = METAL | {"strength": {"type": "elastic", "shear_modulus": 27.6e9}}
SAND = {"density": 2000.0, "eos": {"type": "linear", "bulk_modulus": 1e8},
        "strength": {"type": "rock", "shear_modulus": 6e7, "cohesion": 0.0, "friction": 0.6, "tension": 0.0}}  # fmt: skip


@pytest.mark.parametrize(("formulation", "material", "within"), [
    ("riemann", LIQUID, 0.01), ("eulerian", LIQUID, 0.08), ("riemann", ELASTIC, 0.01), ("total_lagrangian", ELASTIC, 0.01),
])  # fmt: skip
def test_a_column_settles_from_no_stress(formulation, material, within, tmp_path):
    """After 16 transit times the lowest mode has fallen by exp(-4 pi): the stress is that of the weight, at rest.

    Half a spacing of the height, 2.5 %, is what the free face is away; within is what pair sums leave below it.
    """
    speed = 1483.0 if material is LIQUID else 6500.0
    water = {"material": material, "shape": {"type": "interval", "length": 1.0}, "position": [0.5]}
    case = column(resolution=0.05, formulation={"type": formulation}, bodies={"water": water}, overburden=False,
                  settle=16.0 / speed, time={"end": 5.0 / speed}, output={"every": 5.0 / speed})  # fmt: skip
    heard = Heard()
    outcome = run(case, tmp_path / "run", listener=heard)
    assert any(text.startswith("note: settled for") for text in heard.said)
    state = final(tmp_path / "run").fields
    depth = 1.0 - state["position"][:, 0]
    stress = state["pressure"] - (state["deviator"][:, 0] if "deviator" in state else 0.0)
    exact = material["density"] * 9.81 * depth
    inside = (depth > 0.15) & (depth < 0.9)
    assert np.abs(stress - exact)[inside].max() < within * exact.max()
    assert np.abs(state["velocity"]).max() < 1e-3 * np.sqrt(9.81)
    assert abs(outcome.summary["conservation"]["energy_drift"]) < 1e-12


def bed(material, lateral=None, ball=True, **further):
    """A bed on a floor between walls, and a ball that will strike it."""
    bodies = {"bed": {"material": material, "shape": {"type": "box", "size": [1.0, 1.0]}, "position": [0.5, 0.0]}}
    if ball:
        bodies = {"ball": {"material": METAL, "shape": {"type": "disc", "diameter": 0.3}, "position": [1.3, 0.0],
                           "velocity": [-2.0, 0.0], "role": "projectile"}} | bodies  # fmt: skip
    return load_case({
        "kinematics": "plane_strain", "resolution": 0.1, "gravity": [-9.81, 0.0],
        "overburden": False if lateral is None else {"lateral": lateral}, "bodies": bodies,
        "symmetry": [{"axis": "x"}, {"axis": "y", "at": -0.5}, {"axis": "y", "at": 0.5, "keep": "below"}],
        "time": {"end": 1e-4}, "output": {"every": 1e-4},
    } | further)  # fmt: skip


@pytest.mark.parametrize(("material", "lateral", "ratio", "settle"), [
    (ELASTIC, None, 0.5236, 2.5e-3), (ELASTIC, 0.7, 0.7, 2.5e-3), (SAND, 0.5, 0.571, 0.02),
])  # fmt: skip
def test_a_bed_between_walls(material, lateral, ratio, settle, tmp_path):
    """Settled without stress K0 is nu/(1 - nu), 0.5236; a given ratio is in equilibrium and stays; the ball waits.

    Sand flows to the ratio at which (1 - K0) P is 0.6 of the pressure, 0.571. The rows at floor and face are left out.
    """
    with_ball = material is not SAND  # alone it has the loops of `test_late_stages`
    run(bed(material, lateral, with_ball, settle=settle), tmp_path / "run")
    start = read_snapshot(list_snapshots(tmp_path / "run")[0])
    fields = {name: values[start.body == int(with_ball)] for name, values in start.fields.items()}
    inside = np.abs(fields["position"][:, 0] - 0.5) < 0.3
    vertical, horizontal = ((fields["deviator"][:, k] - fields["pressure"])[inside] for k in (0, 1))
    weight = material["density"] * 9.81 * (1.0 - fields["position"][inside, 0])
    assert np.allclose(-vertical, weight, rtol=0.0, atol=0.02 * material["density"] * 9.81)  # 10 rows
    assert np.allclose(horizontal / vertical, ratio, rtol=0.04)  # 10 rows
    if with_ball:
        ball = {name: values[start.body == 0] for name, values in start.fields.items()}
        assert np.all(ball["velocity"] == [-2.0, 0.0])
        assert np.all(ball["pressure"] == 0.0)
        assert np.ptp(ball["position"][:, 0]) < 0.3


def test_a_short_settling_is_warned_of(tmp_path):
    heard = Heard()
    run(bed(ELASTIC, settle=1e-4, ball=False), tmp_path / "run", listener=heard)
    assert any(text.startswith("warning: settled for") and "settle longer" in text for text in heard.said)


WALLS = [{"axis": "y", "at": -0.5}, {"axis": "y", "at": 0.5, "keep": "below"}]


def test_rigid_bodies_while_others_settle(tmp_path):
    """A plate on the bed comes to rest with it, a piston waits for its table, and one above the bed is refused."""
    plate = {"material": METAL, "shape": {"type": "box", "size": [0.3, 1.0]}, "position": [1.15, 0.0], "rigid": "x"}
    for rigid, speed in (("x", 0.0), ({"velocity": [[0.0, -3.0], [1.0, 0.0]]}, -3.0)):
        held = {"clamped": [{"box": {"max": [0.2, None]}, "bodies": ["bed"]}], "symmetry": WALLS}
        case = bed(ELASTIC, settle=5e-3, ball=False).model_dump(exclude_unset=True) | held
        case["bodies"]["plate"] = plate | {"rigid": rigid}
        run(load_case(case), tmp_path / "run", force=True)
        start = read_snapshot(list_snapshots(tmp_path / "run")[0])
        fields = {name: values[start.body == 1] for name, values in start.fields.items()}
        assert fields["position"][:, 0].mean() == pytest.approx(1.15, abs=1e-5)
        assert fields["velocity"][:, 0] == pytest.approx(speed, abs=1e-4)
        weight = 2785.0 * 9.81 * (1.0 + (0.3 if speed == 0.0 else 0.0))
        stress = (start.fields["pressure"] - start.fields["deviator"][:, 0])[start.body == 0]
        assert stress.max() == pytest.approx(weight, rel=0.1)  # half a row of ten
    case["bodies"]["plate"] = plate | {"position": [1.5, 0.0]}
    with pytest.raises(CaseError, match="and falls"):
        begin(load_case(case))


@pytest.mark.parametrize("formulation", ["riemann", "eulerian", "total_lagrangian"])
@pytest.mark.parametrize("support", ["plane", "clamp"])
def test_supports_take_the_weight(support, formulation, tmp_path):
    """Momentum that they take is that of the weight above them; with a clamp the sum of all is zero to round-off."""
    end = 2e-3
    held = {"symmetry": [], "clamped": [{"box": {"max": [0.16]}}]} if support == "clamp" else {}
    water = {"material": ELASTIC, "shape": {"type": "interval", "length": 1.0}, "position": [0.5]}
    case = column(resolution=0.05, formulation={"type": formulation}, bodies={"water": water}, overburden=False,
                  settle=2.5e-3, time={"end": end}, output={"every": end}, **held)  # fmt: skip
    run(case, tmp_path / "run")
    columns = np.genfromtxt(tmp_path / "run" / "history.csv", delimiter=",", names=True)
    borne = 2785.0 * (0.85 if support == "clamp" else 1.0) * 9.81 * end
    assert columns["support_momentum_x"][-1] == pytest.approx(-borne, rel=2e-3)
    change = columns["momentum_x"] - columns["momentum_x"][0]
    closed = change + columns["support_momentum_x"] + borne * columns["time"] / end
    assert np.abs(closed).max() < 1e-12 * borne


def test_nothing_moves_without_weight(tmp_path):
    """Settled without gravity all stays as it is, to the bit."""
    case = bed(ELASTIC, gravity=[0.0, 0.0], settle=2e-4, ball=False)
    run(case, tmp_path / "run")
    start = begin(case).particles
    state = final(tmp_path / "run").fields
    assert np.all(state["position"] == start["position"])
    assert np.all(state["velocity"] == 0.0)


def test_a_settled_run_resumes_with_the_same_bits(tmp_path):
    case = bed(ELASTIC, 0.7, settle=3e-3, time={"end": 4e-3}, output={"every": 1e-3})
    run(case, tmp_path / "whole")
    run(case.model_copy(update={"time": case.time.model_copy(update={"max_steps": 9})}), tmp_path / "part")
    resume(tmp_path / "part", max_steps=10**6)
    assert_same_results(tmp_path / "whole", tmp_path / "part")
