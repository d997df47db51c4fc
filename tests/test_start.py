"""Runs that start from another run: the state bit for bit, revolved and extruded states, added bodies, bad input."""

import numpy as np
import pytest
from small_runs import DAMAGED, HARDENING, METAL, assert_same_results, document_of, final

from hvisph.casefile.loader import load_case
from hvisph.core.errors import CaseError
from hvisph.output.reader import list_snapshots, read_snapshot
from hvisph.precheck.estimate import estimate
from hvisph.setup.initial_state import begin
from hvisph.simulation.run import resume, run

AT, ROUND_OFF = 4e-7, 1e-13
POROUS = HARDENING | {"porosity": {"distension": 1.2, "elastic_pressure": 0.1e9, "solid_pressure": 1e9}}
EVERY = {"output": {"every": 2e-7}}


def going_on(document, folder, mapping="same", **further):
    """The case that goes on from the run in a folder."""
    start = {"run": str(folder), "at": AT, "as": mapping, "width": further.pop("width", None)}
    return document | {"start": start} | further


def snapshot_at_start(folder):
    return next(one for one in map(read_snapshot, list_snapshots(folder)) if abs(one.time - AT) < 1e-12)


def totals(fields):
    """Mass, momentum, angular momentum about x and energies of some particles."""
    x, u, m, e = (fields[name] for name in ("position", "velocity", "mass", "internal_energy"))
    spin = x[:, 1] * u[:, 2] - x[:, 2] * u[:, 1] if x.shape[1] == 3 else 0.0 * m
    momentum = np.zeros(3)
    momentum[: u.shape[1]] = m @ u
    return m.sum(), momentum, m @ spin, 0.5 * m @ (u**2).sum(axis=1), m @ e


@pytest.fixture(scope="module")
def plane_run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("plane") / "run"
    document = document_of([POROUS, DAMAGED], **EVERY, time={"end": 6e-7})
    run(load_case(document), folder)
    return document, folder


@pytest.fixture(scope="module")
def ring_run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("rings") / "run"
    document = document_of([METAL, METAL], kinematics="axisymmetric", **EVERY, time={"end": AT})
    run(load_case(document), folder)
    return document, folder


def test_the_state_is_that_of_the_snapshot_bit_for_bit(plane_run, tmp_path):
    """All fields with their history variables, and the numbers; the run goes on, conserves, and resumes bit for bit."""
    document, folder = plane_run
    case = load_case(going_on(document, folder))
    before, started = snapshot_at_start(folder), begin(case).particles
    np.testing.assert_array_equal(started.id, before.id)
    for name in set(started.names) & set(before.fields):
        np.testing.assert_array_equal(started[name], before.fields[name], err_msg=name)
    assert "history_variable" in before.fields
    assert started["history_variable"].max() > 1.0
    outcome = run(case, tmp_path / "whole")
    assert outcome.summary["end_time"] == 6e-7
    assert outcome.summary["start"]["at"] == pytest.approx(AT)
    assert abs(outcome.summary["conservation"]["energy_drift"]) < 1e-12
    assert abs(outcome.summary["conservation"]["momentum_drift"]) < 1e-12
    assert [one.time for one in map(read_snapshot, list_snapshots(tmp_path / "whole"))] == [AT, 6e-7]
    stopped = load_case(going_on(document, folder, time={"end": 6e-7, "max_steps": 3}))
    run(stopped, tmp_path / "parts")
    resume(tmp_path / "parts", max_steps=0)
    assert_same_results(tmp_path / "whole", tmp_path / "parts")


def test_going_on_is_near_to_never_having_stopped(plane_run, tmp_path):
    """Forces are evaluated anew at the start, so that steps differ: positions by 1 % of the spacing at most."""
    document, folder = plane_run
    run(load_case(going_on(document, folder)), tmp_path / "run")
    gone, whole = final(tmp_path / "run"), final(folder)
    moved = np.abs(gone.fields["position"] - whole.fields["position"]).max()
    assert moved < 0.01 * document["resolution"]


@pytest.mark.parametrize("formulation", ["eulerian", "total_lagrangian"])
def test_another_formulation_goes_on(formulation, plane_run, tmp_path):
    """The state is the same, the law another one, and the balance closes."""
    document, folder = plane_run
    case = load_case(going_on(document, folder, formulation={"type": formulation}))
    before, started = snapshot_at_start(folder), begin(case).particles
    for name in ("position", "velocity", "density", "internal_energy", "deviator", "plastic_strain", "damage"):
        np.testing.assert_array_equal(started[name], before.fields[name], err_msg=name)
    outcome = run(case, tmp_path / "run")
    assert outcome.summary["status"] == "done"
    assert abs(outcome.summary["conservation"]["energy_drift"]) < 1e-12


@pytest.mark.parametrize(("axes", "part"), [("", 1.0), ("y", 0.5), ("yz", 0.25)])
def test_a_revolved_state_has_the_sums_of_its_rings(axes, part, ring_run):
    """Mass, momentum, angular momentum and energies to round-off, whole and of halves and quarters."""
    document, folder = ring_run
    document = going_on(document, folder, "revolved", kinematics="three_d", time={"end": 6e-7})
    document["bodies"] = {name: body | {"velocity": [0, 0, 0]} for name, body in document["bodies"].items()}
    document["symmetry"] = [{"axis": axis} for axis in axes]
    particles = begin(load_case(document)).particles
    here, there = totals(particles), totals(snapshot_at_start(folder).fields)
    for one, other in zip(here[::3] + here[4:], there[::3] + there[4:], strict=True):
        assert one == pytest.approx(part * other, rel=ROUND_OFF)
    scale = (particles["mass"][:, None] * np.abs(particles["velocity"])).sum()
    assert here[1][0] == pytest.approx(part * there[1][0], abs=ROUND_OFF * scale)
    if not axes:
        assert np.abs(here[1][1:]).max() < ROUND_OFF * scale
        assert abs(here[2]) < ROUND_OFF * scale * np.abs(particles["position"]).max()
    for number, axis in enumerate("yz"):
        assert axis not in axes or (particles["position"][:, 1 + number] > 0.0).all()


def test_the_stress_of_a_ring_turns_with_it(ring_run):
    """Radial, hoop and axial components about the axis are those of the ring everywhere."""
    document, folder = ring_run
    document = going_on(document, folder, "revolved", kinematics="three_d", time={"end": 6e-7})
    document["bodies"] = {name: body | {"velocity": [0, 0, 0]} for name, body in document["bodies"].items()}
    particles, before = begin(load_case(document)).particles, snapshot_at_start(folder)
    x, (xx, yy, zz, xy, xz, yz) = particles["position"], particles["deviator"].T
    radius = np.hypot(x[:, 1], x[:, 2])
    c, s = x[:, 1] / radius, x[:, 2] / radius
    turned = np.stack([xx, yy * c**2 + zz * s**2 + 2 * yz * c * s, yy * s**2 + zz * c**2 - 2 * yz * c * s,
                       xy * c + xz * s], axis=1)  # fmt: skip
    own = before.fields["position"]
    ring = np.argmin((own[None, :, 0] - x[:, 0, None]) ** 2 + (own[None, :, 1] - radius[:, None]) ** 2, axis=1)
    scale = np.abs(before.fields["deviator"]).max()
    np.testing.assert_allclose(turned, before.fields["deviator"][ring], atol=1e-12 * scale)
    np.testing.assert_array_equal(particles["density"], before.fields["density"][ring])


def test_a_revolved_run_goes_on(ring_run, tmp_path):
    document, folder = ring_run
    document = going_on(document, folder, "revolved", kinematics="three_d", time={"end": 4.5e-7})
    document["bodies"] = {name: body | {"velocity": [0, 0, 0]} for name, body in document["bodies"].items()}
    outcome = run(load_case(document), tmp_path / "run")
    assert outcome.summary["status"] == "done"
    assert abs(outcome.summary["conservation"]["energy_drift"]) < 1e-12


def test_an_extruded_state_has_the_sums_of_the_plane_run(tmp_path):
    """Rows at the spacing along z; per metre in the plane, times the width in 3D."""
    document = document_of([METAL, METAL], **EVERY, time={"end": AT})
    run(load_case(document), tmp_path / "run")
    width = 2e-3
    document = going_on(document, tmp_path / "run", "extruded", width=width, kinematics="three_d", time={"end": 6e-7})
    shape = {"type": "box", "size": [3e-3, 6e-3, width]}
    document["bodies"] = {
        name: body | {"velocity": [0, 0, 0], "shape": shape} for name, body in document["bodies"].items()
    }
    particles = begin(load_case(document)).particles
    here, there = totals(particles), totals(snapshot_at_start(tmp_path / "run").fields)
    for number in (0, 3, 4):
        assert here[number] == pytest.approx(width * there[number], rel=ROUND_OFF)
    np.testing.assert_allclose(here[1], width * there[1], atol=ROUND_OFF * width * np.abs(there[1]).max())
    assert sorted(set(np.round(particles["position"][:, 2] / 0.5e-3, 6))) == [-1.5, -0.5, 0.5, 1.5]


def test_a_second_projectile_strikes_the_deformed_plate(plane_run, tmp_path):
    """It is added in a free place, has numbers after those of the run, and the sums are those of both."""
    document, folder = plane_run
    second = {"material": METAL, "shape": {"type": "box", "size": [2e-3, 2e-3]}, "velocity": [2000.0, 0.0],
              "position": [-6e-3, 0.0]}  # fmt: skip
    both = going_on(document, folder)
    both["bodies"] = document["bodies"] | {"second": second}
    case, before = load_case(both), snapshot_at_start(folder)
    particles = begin(case).particles
    np.testing.assert_array_equal(particles["position"][: before.count], before.fields["position"])
    added = particles.body == 2
    assert particles["mass"][added].sum() == pytest.approx(2785.0 * 4e-6, rel=1e-12)
    assert [body.carried for body in estimate(case).bodies] == [True, True, False]
    outcome = run(case, tmp_path / "run")
    momentum = outcome.summary["conservation"]
    assert abs(momentum["momentum_drift"]) < 1e-12
    assert abs(momentum["energy_drift"]) < 1e-12


def second_at(x):
    return {"material": METAL, "shape": {"type": "box", "size": [2e-3, 2e-3]}, "position": [x, 0.0]}


@pytest.mark.parametrize(
    ("change", "where", "message"),
    [
        ({"start": {"run": "nowhere", "at": AT}}, "start.run", "no folder"),
        ({"at": 3e-7}, "start.at", "2e-07 s, 4e-07 s"),
        ({"time": {"end": AT}}, "time.end", "not after the start"),
        ({"mapping": "revolved"}, "start.as", "three_d"),
        ({"width": 1e-3}, "start.width", "extruded"),
        ({"mapping": "extruded", "width": 1e-4, "kinematics": "three_d"}, "start.width", "support"),
        ({"units": "none"}, "start.run", "units"),
        ({"resolution": 0.4e-3}, "resolution", "that of the run"),
        ({"symmetry": [{"axis": "y"}]}, "symmetry", "those of the run"),
        ({"formulation": {"type": "projection"}}, "start", "projection"),
        ({"remove": "body_1"}, "start.run", "body_1"),
        ({"body_1": {"material": METAL | {"density": 2700.0}}}, "bodies.body_1.material.density", "2770"),
        ({"body_1": {"material": DAMAGED | {"porosity": POROUS["porosity"]}}}, "bodies.body_1.material", "history_variable"),
        ({"second": second_at(0.5e-3)}, "bodies.second", "overlaps"),
        ({"second": {key: value for key, value in second_at(0.0).items() if key != "position"}},
         "bodies.second.position", "needed"),
    ],
)  # fmt: skip
def test_what_cannot_be_started_is_told(change, where, message, plane_run):
    document, folder = plane_run
    case = going_on(document, folder, change.pop("mapping", "same"), width=change.pop("width", None))
    if "at" in change:
        case["start"]["at"] = change.pop("at")
    bodies = dict(case["bodies"])
    bodies.pop(change.pop("remove", ""), None)
    bodies |= {"body_1": bodies["body_1"] | change.pop("body_1")} if "body_1" in change else {}
    bodies |= {"second": change.pop("second")} if "second" in change else {}
    with pytest.raises(CaseError, match=message) as error:
        begin(load_case(case | {"bodies": bodies} | change))
    assert where in str(error.value)


def test_a_late_stage_is_no_start(tmp_path):
    """Its densities are those of its bulk modulus."""
    late = [{"at": 1e-7, "bulk_modulus": 1e10}]
    document = document_of([METAL, METAL], speed=1.0, late=late, **EVERY, time={"end": AT})
    run(load_case(document), tmp_path / "run")
    with pytest.raises(CaseError, match="late stage"):
        begin(load_case(going_on(document, tmp_path / "run", time={"end": 2.0 * AT}, late=[])))
