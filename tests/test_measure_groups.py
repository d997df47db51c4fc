"""Connected groups, fragments and voids."""

import numpy as np
import pytest
from measure_bodies import MM, ball, box, impact_end, impact_start, reordered, snapshot

from hvisph.measures.cavities import void_fraction
from hvisph.measures.fragments import Fragments, Groups, connected_groups, main_body
from hvisph.measures.measurement_frame import Scene
from hvisph.measures.result import evaluate


def fragments(snapshot, body, spacing):
    members = np.flatnonzero(snapshot.body == body)
    labels = connected_groups(snapshot.fields["position"][members], spacing)
    return Fragments.from_groups(snapshot, Groups.from_labels(members, labels), body)


def test_groups_are_linked_at_two_spacings():
    x = np.array([0.0, 1.9, 3.8, 5.9, 7.8, 100.0])[:, None]
    np.testing.assert_array_equal(connected_groups(x, 1.0), [0, 0, 0, 1, 1, 2])
    np.testing.assert_array_equal(connected_groups(x, 1.0, link=2.2), [0, 0, 0, 0, 0, 1])
    np.testing.assert_array_equal(main_body(x, 1.0), [0, 1, 2])
    assert len(main_body(np.empty((0, 2)), 1.0)) == 0


def test_groups_against_brute_force():
    position = np.random.default_rng(5).uniform(0.0, 30.0, (250, 2))
    near = np.linalg.norm(position[:, None] - position[None], axis=2) <= 2.0
    for _ in range(8):  # squaring reaches chains of 2^8 links: longer than there are particles
        near = (near.astype(int) @ near.astype(int)) > 0
    labels = connected_groups(position, 1.0)
    np.testing.assert_array_equal(labels[:, None] == labels[None], near)
    sizes = np.bincount(labels)
    assert (np.diff(sizes) <= 0).all()


def test_groups_of_unlike_spacings_against_brute_force():
    random = np.random.default_rng(6)
    position, spacing = random.uniform(0.0, 30.0, (250, 2)), random.choice([0.4, 0.5, 1.0, 1.7], 250)
    distance = np.linalg.norm(position[:, None] - position[None], axis=2)
    near = distance <= spacing[:, None] + spacing[None]  # two of the mean
    for _ in range(8):
        near = (near.astype(int) @ near.astype(int)) > 0
    labels = connected_groups(position, spacing)
    np.testing.assert_array_equal(labels[:, None] == labels[None], near)
    np.testing.assert_array_equal(connected_groups(position, np.ones(250)), connected_groups(position, 1.0))


def test_a_graded_plate_is_one_piece():
    """Layers that grow by a tenth to four times the finest, cut by a plane of symmetry: one body, whose rim is its own."""
    steps = 1.1 ** np.minimum(np.arange(30), 15)
    x = np.cumsum(steps) - 0.5 * steps
    position = np.stack(np.meshgrid(np.arange(4.0), x, indexing="ij"), -1).reshape(-1, 2) * MM
    start = snapshot(np.array([[-2.0, 0.5], [-1.0, 0.5]]) * MM, position)
    start.fields["velocity"][:2] = [1000.0, 0.0]
    start.fields["smoothing_length"] = 1.2 * np.concatenate([np.ones(2), np.tile(steps, 4)]) * MM
    start.metadata.update({"spacing": MM, "h_over_dx": 1.2, "shot": {"planes": [{"axis": "y", "at": 0.0}]}})
    assert len(fragments(start, 1, MM)) > 10  # by the finest alone
    (whole,) = Scene.from_snapshot(start, start).fragments(1)
    assert whole.count == 2 * len(position)


def test_fragments_have_their_mass_and_velocity():
    dx = 0.1 * MM
    large, small = ball([0, 0], 3 * MM, dx), ball([9 * MM, 1 * MM], 1 * MM, dx)
    snap = snapshot(np.concatenate([small, large]), box([20 * MM, 0], [21 * MM, 1 * MM], dx))
    snap.fields["velocity"][: len(small)] = [500.0, -20.0]
    first, second = fragments(snap, 0, dx)
    assert (first.count, second.count) == (len(large), len(small))
    assert first.mass + second.mass == pytest.approx(snap.fields["mass"][snap.body == 0].sum())
    np.testing.assert_allclose(second.velocity, [500.0, -20.0])
    np.testing.assert_allclose(second.centre, [9 * MM, 1 * MM])
    np.testing.assert_allclose(second.extent, np.ptp(small, axis=0))
    assert (snap.body[second.particles] == 0).all()
    assert fragments(snap, 0, dx).heaviest.count == len(large)
    snap.fields["mass"][: len(small)] *= 100.0  # as far from the axis of rings
    assert fragments(snap, 0, dx).heaviest.count == len(small)
    assert len(fragments(snap, 5, dx)) == 0


def test_full_lattice_has_no_voids():
    # straight edges: only the scallops between the discs, a tenth of dx deep
    assert void_fraction(Scene(impact_end())).value < 0.002
    # a disc cut from a lattice: the closing fills the steps of its edge, about dx/4 over 100 dx of diameter
    assert void_fraction(Scene(impact_start())).value < 0.008


@pytest.mark.parametrize("radius", [3.0, 4.0])
def test_holes_of_known_area(radius):
    dx = 0.1 * MM
    disc = ball([0, 0], 10 * MM, dx)
    holes = np.array([[0, 0], [2.5, 0], [-2, 1.5], [0.5, -3]]) * MM
    gap = np.linalg.norm(disc[:, None] - holes[None], axis=2).min(axis=1) <= radius * dx
    found = void_fraction(Scene(snapshot(disc[~gap])))
    # discs of radius dx reach into each hole: the cells left are those farther than dx from every particle
    fine = np.linspace(-5.1 * dx, 5.1 * dx, 301)
    u, v = np.meshgrid(fine, fine)
    inside = np.hypot(u, v) < (radius + 1) * dx
    area = 0.0
    for hole in holes:
        around = disc[~gap] - hole
        around = around[np.linalg.norm(around, axis=1) < 8 * dx]
        far = np.min([(u - p[0]) ** 2 + (v - p[1]) ** 2 for p in around], axis=0) > dx**2
        area += float((far & inside).sum()) * (fine[1] - fine[0]) ** 2
    expected = area / (np.pi * (5 * MM + 0.5 * dx) ** 2) + void_fraction(Scene(snapshot(disc))).value
    # the grid of dx/3 knows each hole's rim to a fraction of a cell
    assert found.value == pytest.approx(expected, abs=0.001)


def test_large_hole_is_filled_and_open_bay_is_not():
    dx = 0.1 * MM
    plate = box([0, 0], [10 * MM, 10 * MM], dx)
    middle = np.linalg.norm(plate - 5 * MM, axis=1) < 3 * MM
    bay = np.linalg.norm(plate - [0, 5 * MM], axis=1) < 3 * MM
    # the hole less the rim of dx that the discs cover: pi 2.9^2 of 100 mm^2
    assert void_fraction(Scene(snapshot(plate[~middle]))).value == pytest.approx(0.264, abs=0.01)
    assert void_fraction(Scene(snapshot(plate[~bay]))).value < 0.01


@pytest.mark.parametrize("bore", [0.4, 3.0])
def test_the_bore_of_a_ring_is_no_void(bore):
    """At the start, squeezed, and with a void beside it, which a ring whose start is not known has in its bore."""
    disc = ball([0, 0], 10 * MM, 0.1 * MM)
    ring = disc[np.linalg.norm(disc, axis=1) > bore * MM]
    start = snapshot(ring)
    assert void_fraction(Scene(start, start)).value < 0.012
    assert void_fraction(Scene(start)).value > 0.4 * (bore / 5.0) ** 2
    assert void_fraction(Scene(snapshot(ring * [1.0, 0.85]), start)).value < 0.012
    kept = np.linalg.norm(ring - [-4.0 * MM, 0.0], axis=1) > 0.5 * MM
    part = snapshot(ring[kept])
    part.id = np.flatnonzero(kept)
    assert void_fraction(Scene(part, start)).value == pytest.approx((0.4 / 5) ** 2 / (1 - (bore / 5) ** 2), abs=0.004)


def test_voids_do_not_depend_on_order_or_place():
    dx = 0.1 * MM
    disc = ball([0, 0], 6 * MM, dx)
    disc = disc[np.random.default_rng(1).uniform(size=len(disc)) > 0.35]
    snap = snapshot(disc)
    value = void_fraction(Scene(snap)).value
    assert value > 0.01
    assert void_fraction(Scene(reordered(snap, np.arange(snap.count)[::-1]))).value == value
    # the grid goes with the body; cells on a disc's very edge may turn with the last bits
    assert void_fraction(Scene(snapshot(disc + np.array([1.0, -0.3])))).value == pytest.approx(value, abs=2e-4)


def test_voids_are_a_matter_of_two_dimensions():
    scene = Scene(snapshot(ball([0, 0, 0], 2 * MM, 0.2 * MM), dx=0.2 * MM))
    assert evaluate("run", scene)["void_fraction"].value is None
