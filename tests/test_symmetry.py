"""Planes of symmetry: a half behaves as the whole, momentum along the plane stays, and nothing passes."""

import numpy as np
import pytest
from small_runs import METAL

from hvisph.casefile.loader import load_case
from hvisph.core.particles import Particles
from hvisph.setup.build import build
from hvisph.sph.neighbours import particle_layout
from hvisph.sph.neighbours.ghost_rows import Plane, make_images, mirror, turn_back
from hvisph.sph.neighbours.particle_layout import RowLayout

DX = 0.5e-3


def advanced(case, steps, disturb=None):
    """Return the setup of `case` after so many steps of the step loop, without files."""
    setup = build(case)
    if disturb:
        disturb(setup.particles)
    stepper, criteria = setup.stepper, setup.criteria
    stepper.start()
    step = criteria.limit(stepper.lengths, stepper.signals, stepper.rates, stepper.place, stepper.particles.id).dt
    stepper.predict(step)
    for number in range(steps):
        stepper.evaluate()
        following = criteria.limit(
            stepper.lengths, stepper.signals, stepper.rates, stepper.place, stepper.particles.id
        ).dt
        stepper.complete(step, following)
        step = following
        if number % 16 == 15:
            stepper.permute()
    return setup


def wedge(formulation, keep, **further):
    """A box that slides along a plane of symmetry and runs into it, disordered, with an oblique velocity."""
    sign = 1.0 if keep == "above" else -1.0
    return load_case({
        "kinematics": "plane_strain", "resolution": DX, "formulation": {"type": formulation}, "time": {"end": 1e-3},
        "bodies": {"box": {"material": METAL, "shape": {"type": "box", "size": [5e-3, 4e-3]},
                           "position": [0.0, sign * 2e-3], "velocity": [700.0, -sign * 900.0]}},
        "symmetry": [{"axis": "y", "keep": keep}],
    } | further)  # fmt: skip


def disorder(particles):
    rng = np.random.default_rng(4)
    particles["position"][:] += rng.normal(size=particles["position"].shape) * 0.1 * DX
    particles["position"][:, 1] = np.copysign(np.abs(particles["position"][:, 1]), particles["position"][:, 1].mean())


@pytest.mark.parametrize("keep", ["above", "below"])
@pytest.mark.parametrize("formulation", ["riemann", "eulerian"])
def test_nothing_passes_a_plane_and_momentum_along_it_stays(formulation, keep):
    setup = advanced(wedge(formulation, keep), 150, disorder)
    particles, sign = setup.particles, 1.0 if keep == "above" else -1.0
    assert (sign * particles["position"][:, 1]).min() >= 0.0
    momentum = (particles["mass"] * particles["velocity"][:, 0]).sum()
    # round-off of some 1e3 particle-steps near the plane
    assert momentum == pytest.approx(700.0 * particles["mass"].sum(), rel=1e-13)
    sums = setup.stepper.sums
    start = 0.5 * particles["mass"].sum() * (700.0**2 + 900.0**2)
    assert sums[0] + sums[1] == pytest.approx(start, rel=1e-13)


def test_particles_do_cross_and_are_turned_back():
    def aim(particles):
        disorder(particles)
        particles["velocity"][:, 1] *= 8.0

    setup = advanced(wedge("riemann", "above"), 60, aim)
    assert setup.particles["position"][:, 1].min() >= 0.0
    assert np.isfinite(setup.particles.data).all()


def test_a_half_does_what_the_whole_does():
    def whole(particles):
        # rows of the whole are mirrored pairs: the same disorder above and below
        at = particles["position"]
        shift = np.sin(3e3 * at[:, 0]) * np.cos(2e3 * at[:, 1])
        at[:, 0] += 0.1 * DX * shift
        at[:, 1] += 0.1 * DX * np.sin(5e3 * at[:, 1])

    shape = {"type": "box", "size": [5e-3, 4e-3]}
    plate = {"type": "box", "size": [2e-3, 8e-3]}
    case = {
        "kinematics": "plane_strain", "resolution": DX, "time": {"end": 1e-3},
        "bodies": {"box": {"material": METAL, "shape": shape, "velocity": [1500.0, 0.0]},
                   "plate": {"material": METAL, "shape": plate}},
    }  # fmt: skip
    both = advanced(load_case(case), 60, whole).particles
    half = advanced(load_case(case | {"symmetry": [{"axis": "y"}]}), 60, whole).particles
    upper = np.flatnonzero(both["position"][:, 1] > 0.0)

    def sorted_by_place(particles, chosen):
        rows = np.column_stack([particles[name][chosen] for name in ("position", "velocity", "density", "deviator")])
        return rows[np.lexsort((np.round(rows[:, 1], 9), np.round(rows[:, 0], 9)))]

    one, other = sorted_by_place(both, upper), sorted_by_place(half, np.arange(half.count))
    assert one.shape == other.shape
    # rounding of another order of summation, grown over 60 steps
    assert np.all(np.abs(one - other) <= 1e-8 * np.abs(one).max(axis=0))


def test_each_plane_turns_the_rates_of_those_that_pass_it():
    particles, layout = Particles(2, 3), RowLayout(2, (("x", "vector"),))
    particles["position"] = [[-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]]
    particles["mass"] = 1.0
    rows, turned = particles["position"].copy(), np.ones((3, particle_layout.width(2)))
    turn_back(particles, rows, layout, turned, np.array([2, 1, 0]), (Plane(0, 0.0), Plane(1, 0.0)))
    assert (particles["position"] == 1.0).all()
    # acceleration, power, |mu| and the gradient xx, xy, yx, yy; rows of rates stand in another order
    assert turned.tolist() == [[1.0] * 8, [1, -1, 1, 1, 1, -1, -1, 1], [-1, 1, 1, 1, 1, -1, -1, 1]]


@pytest.mark.parametrize(
    "planes", [(), (Plane(0, 0.1),), (Plane(0, 0.1, -1.0, 3.0), Plane(1, -0.2)), (Plane(1, 0.0), Plane(0, 0.2))]
)
def test_images_are_those_of_the_plain_formulas(planes):
    """Particles beyond a plane by as much as 0.1; a reach of 0.3."""
    layout, reach = RowLayout(2, (("x", "vector"), ("u", "vector"), ("h", "scalar"))), 0.3
    generator = np.random.default_rng(5)
    rows, numbers = generator.uniform(-1.0, 1.0, (60, layout.width)), np.arange(60, dtype=np.uint64) + np.uint64(7)
    for plane in planes:
        kept = plane.side * (rows[:, plane.axis] - plane.at) > -0.1
        rows, numbers = rows[kept], numbers[kept]
    expected, expected_numbers = rows, numbers
    made, all_numbers, images = make_images(rows, numbers, planes, layout, reach)
    for k, plane in enumerate(planes):
        depth = plane.side * (plane.at - expected[:, plane.axis])
        source = np.flatnonzero(np.abs(depth) < reach + max(0.0, *depth[depth < reach]))
        assert images[k].first == len(expected)
        assert np.array_equal(images[k].source, source)
        expected = np.concatenate([expected, mirror(expected[source], plane, layout)])
        own = expected_numbers[source] | np.uint64(1 << (32 + k))
        expected_numbers = np.concatenate([expected_numbers, own])
    assert np.array_equal(made, expected[len(rows) :])
    assert np.array_equal(all_numbers, expected_numbers)
