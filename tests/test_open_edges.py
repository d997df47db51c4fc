"""Open edges and pressures on faces: pulses leave, faces balance a uniform pressure, energy and momentum are counted."""

import numpy as np
import pytest
from small_runs import METAL, SPRING, assert_same_results, final

from hvisph.case.conditions import condition_words
from hvisph.casefile.loader import load_case
from hvisph.compiler.jit import python_twin
from hvisph.core.errors import CaseError
from hvisph.geometry.cutting_planes import Edge, cut_open, face_areas, follow, row_shares
from hvisph.output.reader import list_snapshots, read_snapshot
from hvisph.simulation.listener import Listener
from hvisph.simulation.run import resume, run
from hvisph.sph.terms.riemann_solver import outgoing_jump

DX = 1e-4
SPEED = np.sqrt(70e9 * 0.7 / (1.3 * 0.4) / 2785.0)  # of longitudinal waves in SPRING [m/s]


def bar(formulation, rows=30, length=60, edged=True, **further):
    """A bar in 1D that a sin^2 pulse of pressure of so many rows enters; three times as long without an edge."""
    full, time = length * DX, rows * DX / SPEED
    times = np.linspace(0.0, time, 21)
    pulse = 1e7 * np.sin(np.pi * times / time) ** 2
    size = full if edged else 3.0 * full
    document = {
        "kinematics": "uniaxial_strain", "resolution": DX, "formulation": {"type": formulation},
        "bodies": {"bar": {"material": SPRING, "shape": {"type": "interval", "length": size}, "position": [size / 2]}},
        "loads": [{"box": {"max": [5 * DX]}, "pressure": np.column_stack([times, pulse]).tolist(), "normal": "-x"}],
        "time": {"end": 1.4 * full / SPEED + time}, "output": {"every": 0.1 * full / SPEED},
    }  # fmt: skip
    document |= {"edges": [{"axis": "x", "at": full, "keep": "below"}]} if edged else {}
    return load_case(document | further)


def speeds(folder, count):
    states = [read_snapshot(path) for path in list_snapshots(folder)]
    return np.array([state.fields["velocity"][:count, 0] for state in states])


@pytest.mark.parametrize(("formulation", "rows", "share"), [
    ("riemann", 30, 1e-3), ("riemann", 17, 1e-3), ("eulerian", 30, 0.02), ("total_lagrangian", 30, 0.02),
])  # fmt: skip
def test_a_pulse_leaves(formulation, rows, share, tmp_path):
    """What returns is the difference from a bar so long that nothing has returned in it.

    The Riemann problem at the layer has u* = u_a; the viscous edge misses by what a row of dx makes of a pulse.
    """
    outcome = run(bar(formulation, rows), tmp_path / "open")
    run(bar(formulation, rows, edged=False), tmp_path / "long")
    there = speeds(tmp_path / "long", 54)
    returned = np.abs(speeds(tmp_path / "open", 54) - there).max()
    assert returned < share * np.abs(there).max()
    conservation, energies = outcome.summary["conservation"], outcome.summary["energies"]
    assert abs(conservation["energy_drift"]) < 1e-12
    # the rest is heat of the fluxes that damp a pulse of few rows
    assert energies["edge_energy"] > 0.6 * energies["external_work"]


@pytest.mark.parametrize("kind", [0, 1])
def test_a_plane_wave_leaves_through_pairs_aslant(kind, tmp_path):
    """Of a P (0) or S (1) pulse of 16 rows across a plane body 1 % of the amplitude is left, the tail of the scheme.

    The sides are so far that nothing of them arrives.
    """
    modulus = 70e9 / 2.6 if kind else 70e9 * 0.7 / (1.3 * 0.4)
    length, speed = 24 * DX, np.sqrt(modulus / 2785.0)
    time = (length / 2 + 20 * DX) / speed
    half = np.ceil(SPEED * time / DX + 4) * DX
    x = (np.arange(24) + 0.5) * DX
    pulse = np.cos(np.pi * np.clip((x - length / 2) / (16 * DX), -0.5, 0.5)) ** 2
    rows = [(at, y, *((0.0, u) if kind else (u, 0.0))) for at, u in zip(x, pulse, strict=True) for y in (-half, half)]
    np.savetxt(tmp_path / "u.csv", rows, delimiter=",", header="x,y,u,v", comments="")
    body = {"material": SPRING, "shape": {"type": "box", "size": [length, 2 * half]}, "position": [length / 2, 0.0],
            "initial_velocity": [{"type": "table", "file": str(tmp_path / "u.csv")}]}  # fmt: skip
    run(load_case({
        "kinematics": "plane_strain", "resolution": DX, "bodies": {"body": body},
        "edges": [{"axis": "x", "at": length, "keep": "below"}, {"axis": "x", "at": 0.0, "keep": "above"}],
        "time": {"end": time}, "output": {"every": time},
    }), tmp_path / "run")  # fmt: skip
    state = final(tmp_path / "run").fields
    x, y = state["position"].T
    left = state["velocity"][(np.abs(y) < 3 * DX) & (np.abs(x - length / 2) < length / 2), kind]
    assert np.abs(left).max() < 0.01 * 0.5  # a half of it goes to each side


def test_the_traction_of_an_outgoing_wave():
    """The jump of a pair has the traction of the wave u(t - n . x/c), whose stress is Hooke's, the density 1."""
    rng, c_l, c_t = np.random.default_rng(4), 3.0, 1.7
    for dim in (2, 3):
        n, e, u = rng.normal(size=(3, dim))
        n, e = n / np.linalg.norm(n), e / np.linalg.norm(e)
        slip = (u @ n) * n / c_l + (u - (u @ n) * n) / c_t
        strain = 0.5 * (np.outer(slip, n) + np.outer(n, slip))
        stress = (c_l**2 - 2 * c_t**2) * np.trace(strain) * np.eye(dim) + 2 * c_t**2 * strain
        jump = np.array(python_twin(outgoing_jump)(tuple(u), tuple(e), tuple(n), c_t / c_l))
        traction = c_l * (jump @ e) * e + c_t * (jump - (jump @ e) * e)
        assert np.allclose(traction, stress @ e, atol=1e-13)


def block(formulation="riemann", **further):
    """A block with edges on three sides that a load on a part of its face pushes."""
    box = {"type": "box", "size": [3e-3, 4e-3]}
    return load_case({
        "kinematics": "plane_strain", "resolution": 0.25e-3,
        "formulation": {"type": formulation} | ({"conversion": {"strain": 0.02}} if formulation == "adaptive" else {}),
        "bodies": {"block": {"material": METAL, "shape": box, "position": [1.5e-3, 0.0]}},
        "edges": [{"axis": "x", "at": 3e-3, "keep": "below"}, {"axis": "y", "at": 2e-3, "keep": "below"},
                  {"axis": "y", "at": -2e-3, "keep": "above"}],
        "loads": [{"box": {"max": [0.6e-3, 1e-3], "min": [None, -1e-3]}, "normal": "-x",
                   "pressure": [[0, 0], [1e-7, "2 GPa"], [4e-7, "2 GPa"], [4e-7, 0]]}],
        "time": {"end": 1e-6}, "output": {"every": 5e-7},
    } | further)  # fmt: skip


@pytest.mark.parametrize("formulation", ["riemann", "eulerian", "total_lagrangian", "adaptive"])
def test_energy_and_momentum_are_counted(formulation, tmp_path):
    conservation = run(block(formulation), tmp_path / "run").summary["conservation"]
    assert abs(conservation["energy_drift"]) < 1e-12
    columns = np.genfromtxt(tmp_path / "run" / "history.csv", delimiter=",", names=True)
    given = 2e9 * 2e-3 * 3.5e-7  # the integral of the table
    taken = columns["momentum_x"][-1] + columns["edge_momentum_x"][-1]
    # the jump falls within a step, which is a 30th of the pulse
    assert taken == pytest.approx(given, rel=0.03)
    assert columns["edge_energy"][-1] > 0.0


def test_energy_is_counted_about_an_axis(tmp_path):
    """Images across the axis and the dashpot of its pairs act in pairs with the layer, too."""
    shape = {"type": "cylinder", "diameter": 4e-3, "length": 3e-3}
    case = block(
        kinematics="axisymmetric",
        bodies={"block": {"material": METAL, "shape": shape, "position": [1.5e-3, 0.0]}},
        edges=[{"axis": "x", "at": 3e-3, "keep": "below"}, {"axis": "y", "at": 2e-3, "keep": "below"}],
    )
    summary = run(case, tmp_path / "run").summary
    assert abs(summary["conservation"]["energy_drift"]) < 1e-12
    assert summary["energies"]["edge_energy"] > 0.0


def test_particles_before_an_edge_have_no_normal_of_the_layer(tmp_path):
    """Of a rock that breaks packed rows stand in sorted ones, which an evaluation overwrites."""
    outcome = run(load_case({
        "kinematics": "axisymmetric", "resolution": 8e-4, "edges": [{"axis": "x", "at": 8e-3, "keep": "below"}],
        "bodies": {
            "shot": {"material": "aluminium-tillotson", "shape": {"type": "sphere", "diameter": 3.2e-3},
                     "velocity": [5e3, 0.0]},
            "rock": {"material": "granite", "shape": {"type": "cylinder", "diameter": 16e-3, "length": 14.4e-3}},
        }, "time": {"end": 2e-7}, "output": {"every": 2e-7}}), tmp_path)  # fmt: skip
    assert abs(outcome.summary["conservation"]["energy_drift"]) < 1e-12


def test_the_same_bits_after_a_resume(tmp_path):
    case = block(time={"end": 5e-7}, output={"every": 2e-7})
    run(case, tmp_path / "whole")
    run(case.model_copy(update={"time": case.time.model_copy(update={"max_steps": 11})}), tmp_path / "part")
    resume(tmp_path / "part", max_steps=10**6)
    assert_same_results(tmp_path / "whole", tmp_path / "part")


def test_a_body_in_flight_keeps_its_velocity(tmp_path):
    """The layer has the velocity of the start and goes along: nothing acts on what moves as a whole."""
    body = {"material": METAL, "shape": {"type": "box", "size": [3e-3, 4e-3]}, "velocity": [300.0, -200.0]}
    run(block(loads=[], bodies={"block": body | {"position": [1.5e-3, 0.0]}}), tmp_path / "run")
    assert np.abs(final(tmp_path / "run").fields["velocity"] - [300.0, -200.0]).max() < 1e-9


@pytest.mark.parametrize(("kinematics", "size"), [
    ("three_d", [4e-3, 4e-3, 4e-3]), pytest.param("plane_strain", [5e-3, 5e-3], marks=pytest.mark.slow),
])  # fmt: skip
def test_faces_hold_a_uniform_pressure(kinematics, size, tmp_path):
    """A block under pressure whose faces bear that pressure stays at rest: the shares are those of the pair sums."""
    gas = {"density": 1000.0, "eos": {"type": "ideal_gas", "gamma": 1.5}}
    signs = [sign + axis for axis in "xyz"[: len(size)] for sign in "+-"]
    case = load_case({
        "kinematics": kinematics, "resolution": 0.25e-3, "formulation": {"type": "eulerian"},
        "bodies": {"block": {"material": gas, "internal_energy": 2e5, "shape": {"type": "box", "size": size}}},
        "loads": [{"box": {}, "normal": sign, "pressure": [[0.0, 1e8]]} for sign in signs],
        "time": {"end": 1e-6}, "output": {"every": 1e-6},
    })  # fmt: skip
    run(case, tmp_path / "run")
    state = final(tmp_path / "run").fields
    place = state["position"] - state["position"].mean(axis=0)
    beyond = np.sum(np.abs(place) > 0.5 * np.array(size) - 1.5e-3, axis=1)  # of how many faces it is near
    # the sum of the kernel over a lattice is 1 to 2 % beside one; a corner lacks more than its faces bear
    assert np.abs(state["velocity"])[beyond < 2].max() < 0.02 * 1e8 / (1000.0 * 0.25e-3) * 1e-6


def test_the_area_of_a_face():
    """Rows of any spacing along the normal add up to the face; about an axis to the lateral surface."""
    x, y = np.meshgrid((np.arange(10) + 0.5) * 0.9, np.arange(8) + 0.5)
    positions, volumes = np.column_stack([x.ravel(), y.ravel()]), np.full(80, 0.9)
    shares = np.array([0.8, 0.2])
    for axis, face in ((0, 8.0), (1, 9.0)):
        for sign in (1.0, -1.0):
            areas = face_areas(positions, volumes, 1.0, (axis, sign), shares, False)[1]
            assert areas.sum() == pytest.approx(face, rel=1e-12)
            assert np.sort(areas)[-1] == pytest.approx(0.8 * (1.0 if axis == 0 else 0.9), rel=1e-12)
    rings = volumes * 2 * np.pi * positions[:, 1]
    areas = face_areas(positions, rings, 1.0, (1, 1.0), shares, True)[1]
    assert areas.sum() == pytest.approx(2 * np.pi * 8.0 * 9.0, rel=1e-12)


def test_the_shares_of_rows():
    """They are what the pair sums at the face of a lattice lack, by brute force."""
    x, y = np.meshgrid(np.arange(9.0), np.arange(21.0))
    positions = np.column_stack([x.ravel(), y.ravel()])
    lacks = []
    for row in (8.0, 7.0, 6.0):
        lever = np.array([row, 10.0]) - positions
        r = np.sqrt((lever**2).sum(axis=1))
        near = (r > 0.0) & (r < 2.5)
        lacks.append(((2.5 - r[near]) * lever[near, 0] / r[near]).sum())
    aside = np.arange(-3.0, 4.0)
    shares = row_shares(np.arange(4.0), aside, lambda r: np.maximum(2.5 - r, 0.0))
    assert shares[:3] == pytest.approx(np.array(lacks) / sum(lacks), abs=1e-12)


def test_what_the_layer_follows():
    """A layer beside a plane of symmetry follows a rigid motion along the plane, and none across it."""
    x, y = np.meshgrid(np.arange(6) + 0.5, np.arange(5) + 0.5)
    matter = np.column_stack([x.ravel(), y.ravel()])
    layer = matter[matter[:, 0] > 3.0] + [3.0, 0.0]
    found = follow(layer, matter, [Edge(0, 6.0)], [(1, 0.0)], 2.0)
    motion = np.column_stack([np.full(30, 0.3), 0.1 * matter[:, 1]])
    moved = np.add.reduceat(motion[found.source] * found.signs * found.weight[:, None], found.starts, axis=0)
    assert np.allclose(moved[:, 0], 0.3)
    assert np.allclose(moved[layer[:, 1] < 3.0, 1], 0.1 * layer[layer[:, 1] < 3.0, 1])


def test_a_body_is_cut_and_continued():
    x = (np.arange(10) + 0.5)[:, None]
    positions, volumes, spacing = cut_open(x, np.ones(10), np.ones(10), [Edge(0, 7.0)], 2.8, False)
    assert np.sort(positions[:, 0]) == pytest.approx(np.arange(10) + 0.5)
    assert volumes.sum() == pytest.approx(10.0)
    assert np.all(spacing == 1.0)


@pytest.mark.parametrize(("change", "words"), [
    ({"edges": [{"axis": "x", "at": 2.9e-3, "keep": "below"}]}, "a row of particles lies in the edge"),
    ({"edges": [{"axis": "x", "at": -9e-3, "keep": "below"}]}, "lies beyond the edge"),
    ({"edges": [{"axis": "x", "at": 9e-3, "keep": "below"}]}, "no body reaches it"),
    ({"edges": [{"axis": "z", "at": 3e-3, "keep": "below"}]}, "there is no axis z"),
    ({"edges": [{"axis": "x", "at": 3e-3, "keep": "below"}] * 2}, "two edges across an axis"),
    ({"symmetry": [{"axis": "x", "at": 4e-3, "keep": "above"}]}, "cut off by the symmetry plane"),
    ({"time": {"end": 1e-6, "integrator": "predictor_corrector"}}, "leapfrog"),
    ({"formulation": "projection"}, "has none; use riemann"),
    ({"clamped": [{"box": {"min": [2.6e-3, None]}}]}, "reaches a clamp"),
    ({"edges": [], "clamped": [{"box": {"max": [0.6e-3, None]}}]}, "clamped, rigid or beyond"),
    ({"loads": [{"box": {"max": [-1.0, None]}, "normal": "-x", "pressure": [[0, 1]]}]}, "no particle"),
    ({"loads": [{"box": {}, "normal": "-x", "pressure": [[1, 1], [0, 1]]}]}, "must rise"),
    ({"loads": [{"box": {}, "normal": "-z", "pressure": [[0, 1]]}]}, "there is no axis z"),
    ({"symmetry": [{"axis": "x"}]}, "at the plane of symmetry across x, inside"),
])  # fmt: skip
def test_what_is_refused(change, words):
    from hvisph.setup.build import build

    with pytest.raises(CaseError, match=words):
        build(block(**change))


def test_a_projectile_in_an_edge_is_refused():
    from hvisph.setup.build import build

    ball = {"material": METAL, "shape": {"type": "disc", "diameter": 1e-3}, "velocity": [1e3, 0.0],
            "position": [-0.6e-3, 1.75e-3]}  # fmt: skip
    target = {"material": METAL, "shape": {"type": "box", "size": [3e-3, 4e-3]}, "position": [1.5e-3, 0.0]}
    with pytest.raises(CaseError, match="starts in it"):
        build(block(loads=[], bodies={"ball": ball, "block": target}))


@pytest.mark.parametrize("formulation", ["riemann", "total_lagrangian"])
def test_a_load_that_stays_on_is_told(formulation, tmp_path):
    """0.5 GPa drives a bar at 33 m/s, 0.006 of the speed of sound, through its edge; 0.05 GPa is below the limit."""

    class Heard(Listener):
        said = ""

        def message(self, text):
            self.said += text

    for pressure, told in ((0.5e9, True), (0.05e9, False)):
        heard = Heard()
        case = load_case({
            "kinematics": "uniaxial_strain", "resolution": 0.25e-3, "formulation": {"type": formulation},
            "bodies": {"bar": {"material": METAL, "shape": {"type": "interval", "length": 3e-3}, "position": [1.5e-3]}},
            "edges": [{"axis": "x", "at": 3e-3, "keep": "below"}], "time": {"end": 7e-6}, "output": {"every": 7e-6},
            "loads": [{"box": {"max": [0.5e-3]}, "normal": "-x", "pressure": [[0.0, pressure]]}],
        })  # fmt: skip
        run(case, tmp_path / f"{pressure:g}", listener=heard)
        assert ("edges.0: the matter beside it has moved" in heard.said) == told


def test_check_names_edges_and_loads():
    words = condition_words(block())
    assert words[0] == ("open edge", "x = 0.003 m, matter below it")
    assert ("load", "0: up to 2e+09 Pa on faces -x") in words
