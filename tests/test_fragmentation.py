"""Separation of a body into fragments: connected components, their numbers, contact between them."""

from dataclasses import replace

import numba
import numpy as np
import pytest
from composite_runs import advance
from small_runs import METAL, SPRING, assert_same_results, row_of

import hvisph
from hvisph.casefile.loader import load_case
from hvisph.core.errors import CaseError
from hvisph.setup.build import build
from hvisph.simulation.loop import separate_fragments
from hvisph.simulation.run import run
from hvisph.sph.neighbours.connected_components import connect_components, label_components

BAR = {"type": "box", "size": [4e-3, 3e-3]}


def brute(position, labels, link):
    """Groups by looking at all pairs, until nothing changes."""
    apart = np.linalg.norm(position[:, None] - position[None], axis=2)
    near = (apart < link) & (labels[:, None] == labels[None])
    group = np.arange(len(position))
    while True:
        least = np.where(near, group[None], len(group)).min(axis=1)
        if (least >= group).all():
            return group
        group = np.minimum(group, least)


@pytest.mark.parametrize("dim", [1, 2, 3])
def test_connected_is_what_all_pairs_say(dim):
    random = np.random.default_rng(dim)
    for spread in (2.0, 6.0, 400.0):  # dense; on the verge of falling apart; a cloud that the torus wraps round
        position = random.uniform(-1.0, 1.0, (300, dim)) * spread
        position[:100] = 0.4 * random.integers(0, 10, (100, dim)) + 1e-3 * random.normal(size=(100, dim))  # a lump
        labels = random.integers(0, 3, 300).astype(np.uint32)
        for link in (0.3, 1.0):
            found, right = connect_components(position, labels, link), brute(position, labels, link)
            assert np.array_equal(np.unique(found, return_inverse=True)[1], np.unique(right, return_inverse=True)[1])


def square(x, y, count=4):
    """Places of a square of particles a spacing apart."""
    nodes = np.arange(count)
    return np.stack(np.meshgrid(nodes + x, nodes + y, indexing="ij"), -1).reshape(-1, 2).astype(float)


def test_the_largest_keeps_the_number_and_dust_stays_of_its_body():
    parts = [square(0, 0), square(10, 0, 5), square(20, 0, 3), square(30, 0, 2), square(0, 20)]
    position = np.concatenate(parts)
    body = np.repeat([0, 0, 0, 0, 1], [len(part) for part in parts])
    numbers = np.random.default_rng(0).permutation(len(position))
    first = label_components(position, np.ones(len(position)), 3.0, body, body, numbers)
    sizes = [first[body == 0][np.cumsum([0, 16, 25, 9])[k]] for k in range(4)]
    assert sizes[1] == sizes[3] == 0  # the largest, and four particles
    assert {sizes[0], sizes[2]} == {2, 3}
    assert set(first[body == 1]) == {1}
    order = np.random.default_rng(1).permutation(len(position))
    again = label_components(position[order], np.ones(len(order)), 3.0, body[order], body[order], numbers[order])
    assert np.array_equal(again, first[order])  # whatever the order of the particles
    assert np.array_equal(label_components(position, np.ones(len(position)), 3.0, body, first, numbers), first)
    position[first == sizes[0]] = square(15.5, 0)  # they meet again: two pieces they stay
    assert np.array_equal(label_components(position, np.ones(len(position)), 3.0, body, first, numbers), first)


def halves(formulation, gap=2e-3, shape=None, **contact):
    """Two bars of one body, `gap` apart."""
    x = 2e-3 + gap / 2
    parts = [{"shape": BAR, "position": [place, 0.0]} for place in (-x, x)]
    return load_case({
        "kinematics": "plane_strain", "resolution": 0.5e-3,
        "bodies": {"pair": {"material": SPRING, "shape": shape or {"type": "union", "parts": parts},
                            "position": [0.0, 0.0]}},
        "formulation": {"type": formulation} | ({"contact": {"type": "frictional", **contact}} if contact else {}),
        "time": {"end": 1.0},
    })  # fmt: skip


def struck(setup, speed=20.0, end=150e-6):
    """Let the left half strike the right one; return both mean velocities along x, drifts of energy and momentum, and
    the gap between them, in spacings."""
    particles = setup.particles
    left = particles.id[particles["position"][:, 0] < 0.0].copy()
    particles["velocity"][np.isin(particles.id, left), 0] = speed
    mass, momentum = particles["mass"].sum(), particles["mass"] @ particles["velocity"][:, 0]
    separate_fragments(setup, 0)
    drift, _ = advance(setup, end)
    of_left = np.isin(particles.id, left)
    after = particles["mass"] @ particles["velocity"][:, 0]
    speeds = [float(np.average(particles["velocity"][side, 0])) for side in (of_left, ~of_left)]
    x = particles["position"][:, 0]
    gap = (x[~of_left].min() - x[of_left].max()) / 0.5e-3
    return speeds, abs(drift) / (0.25 * mass * speed**2), abs(after / momentum - 1.0), gap


@pytest.mark.parametrize("formulation", ["riemann", "eulerian"])
def test_halves_of_a_body_part_as_two_bodies_do(formulation):
    setup = build(halves(formulation))
    (left, right), energy, momentum, gap = struck(setup)
    assert energy < 1e-12
    assert momentum < 1e-12
    assert right - left > 3.0  # of 20 m/s: what vibrates in short bars is lost to the bounce
    assert gap > 1.3
    two = build(halves(formulation))
    two.particles.tags[two.particles["position"][:, 0] > 0.0, 1] = 1  # told to be two bodies
    two.stepper.pieces = None
    two.stepper.body_contact.renumber(two.particles.body)
    (as_left, as_right), *_ = struck(two)
    assert (left, right) == (as_left, as_right)  # to the last bit
    if formulation == "riemann":  # of one number they weld
        (left, right), *_ = struck(build(halves(formulation, self_contact="none")))
        assert abs(right - left) < 0.1


def test_faces_that_look_at_each_other_part_where_the_body_is_one():
    """Prongs, which no number tells apart: of one piece as far as anybody knows, they part as two bodies do."""
    (as_left, as_right), *_ = struck(build(halves("riemann")))
    setup = build(halves("riemann", self_contact="all"))
    setup.stepper.pieces = None  # the two pieces have one number
    (left, right), energy, momentum, gap = struck(setup)
    assert energy < 1e-12
    assert momentum < 1e-12
    assert gap > 1.3
    assert right - left == pytest.approx(as_right - as_left, abs=1.0)  # of 20 m/s; welded 0


def test_each_formulation_has_its_own_kinds_of_self_contact():
    for formulation, given, allowed in (
        ("eulerian", "all", "'fragments'"),
        ("total_lagrangian", "fragments", "'all' or 'none'"),
    ):
        said = f"formulation.contact.self_contact: '{given}' is not available with '{formulation}'; give {allowed}"
        with pytest.raises(CaseError, match=said):
            halves(formulation, self_contact=given)


def test_a_body_in_one_piece_is_as_it_was_to_the_last_bit(tmp_path):
    for own in ("none", "fragments"):
        case = row_of([METAL, METAL], formulation={"type": "riemann", "contact": {"type": "frictional", "self_contact": own}},
                      time={"end": 6e-7}, output={"every": 3e-7})  # fmt: skip
        run(case, tmp_path / own, threads=1)
    assert_same_results(tmp_path / "none", tmp_path / "fragments")


def closing(**further):
    """Two bars of one body that fly at each other, of any number of dimensions, for runs with files."""
    case = halves("riemann", gap=2e-3, self_contact="all")
    body = case.bodies["pair"]
    velocity = {"type": "linear", "gradient": [[-1e5, 0.0], [0.0, 0.0]]}
    return load_case(case.model_dump(mode="json", exclude_unset=True) | {
        "bodies": {"pair": body.model_dump(mode="json", exclude_unset=True) | {"initial_velocity": [velocity]}},
        "time": {"end": 8e-6}, "output": {"every": 4e-6}} | further)  # fmt: skip


def test_pieces_go_on_after_a_resume_and_with_any_number_of_threads(tmp_path):
    case = closing()
    run(case, tmp_path / "one", threads=1)
    run(case, tmp_path / "two", threads=min(2, numba.config.NUMBA_NUM_THREADS))
    assert_same_results(tmp_path / "one", tmp_path / "two")
    stopped = case.model_copy(update={"time": case.time.model_copy(update={"max_steps": 70})})
    run(stopped, tmp_path / "parts", threads=1)
    hvisph.resume(tmp_path / "parts", max_steps=0, threads=1)
    assert_same_results(tmp_path / "one", tmp_path / "parts")


def test_a_plug_that_has_left_does_not_weld_again():
    """A piece is told from its body once it is farther away than kernels reach, not before."""
    setup = build(halves("riemann", gap=0.5e-3, self_contact="fragments"))  # a slit narrower than the kernel's reach
    separate_fragments(setup, 0)
    assert set(setup.stepper.pieces) == {0}
    particles = setup.particles
    right = particles["position"][:, 0] > 0.0
    particles["position"][right, 0] += 2e-3
    separate_fragments(setup, 3)  # not due
    assert set(setup.stepper.pieces) == {0}
    separate_fragments(setup, 64)
    assert set(setup.stepper.pieces) == {0, 1}
    assert len(set(setup.stepper.pieces[right])) == 1
    assert setup.stepper.pieces[particles.id == 0] == [0]


def test_one_body_in_one_piece_alone_has_no_contact():
    case = halves("riemann", shape=BAR)
    assert not build(case).stepper.formulation.has_contact
    assert build(halves("riemann", shape=BAR, self_contact="fragments")).stepper.formulation.has_contact
    assert replace(build(halves("riemann")).stepper.formulation, has_contact=False).fragment_contact
