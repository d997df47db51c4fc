"""What a run does to smoothing lengths that follow the density, and to particles that are held."""

import numpy as np
import pytest
from composite_runs import advance
from small_runs import GAS, METAL, final, row_of

from hvisph.output.reader import list_snapshots, read_snapshot
from hvisph.setup.build import build
from hvisph.simulation.run import run


def gas(dim, speed, **limits):
    """Two boxes of gas that collide, with a smoothing length that follows the density."""
    formulation = {"type": "eulerian", "smoothing_length": {"type": "variable"} | limits}
    checks = {"speed_over_initial": None, "density": False}
    return row_of(
        [GAS, GAS], dim=dim, speed=speed, formulation=formulation, time={"end": 8e-7, "cfl": 0.3}, limits=checks
    )


@pytest.mark.parametrize("dim", [2, 3])
def test_a_length_follows_the_density_to_the_power_of_minus_one_over_the_dimensions(dim, tmp_path):
    run(gas(dim, 2000.0), tmp_path / "run", threads=1)
    start, end = read_snapshot(list_snapshots(tmp_path / "run")[0]), final(tmp_path / "run")
    grown = end.fields["smoothing_length"] / start.fields["smoothing_length"]
    density = end.fields["density"] / start.fields["density"]
    assert density.max() > 1.3
    assert density.min() < 0.9
    # both follow the same rate by a rule that is of third order in the change of a step, 2 % at most
    np.testing.assert_allclose(grown, density ** (-1.0 / dim), rtol=1e-4)


def test_a_length_stays_between_its_limits(tmp_path):
    run(gas(2, 2000.0, min_over_initial=0.95, max_over_initial=1.02), tmp_path / "run", threads=1)
    start, end = read_snapshot(list_snapshots(tmp_path / "run")[0]), final(tmp_path / "run")
    grown = end.fields["smoothing_length"] / start.fields["smoothing_length"]
    np.testing.assert_allclose([grown.min(), grown.max()], [0.95, 1.02], rtol=1e-12)


def test_contact_sph_counts_no_change_of_a_length_at_its_limit():
    smoothing = {"type": "variable", "min_over_initial": 0.95, "max_over_initial": 1.02}
    form = {"type": "riemann", "smoothing_length": smoothing, "contact": {"type": "bonded"}}
    setup = build(row_of([GAS, GAS], dim=1, dx=2e-4, formulation=form))
    setup.stepper.start()
    start = setup.stepper.lengths[0]
    advance(setup, 4e-7)
    stepper = setup.stepper
    free = (stepper.lengths > 0.95 * start * (1.0 + 1e-12)) & (stepper.lengths < 1.02 * start * (1.0 - 1e-12))
    assert 0.1 < free.mean() < 0.9
    np.testing.assert_array_equal(stepper.pairs.rows[:, stepper.pairs.slots["FOLLOWING_SHARE"]], free)


def squeezed(integrator):
    """A box that strikes another, of which the rear is held."""
    held = [{"box": {"min": [1.5e-3, None]}}]
    return row_of([METAL, METAL], speed=500.0, clamped=held, time={"end": 1.5e-6, "integrator": integrator})


def test_held_particles_are_shown_at_rest():
    setup = build(squeezed("leapfrog"))
    advance(setup, 1.5e-6)
    stepper = setup.stepper
    held, at = (setup.particles.tags[:, 3] & 1).astype(bool), stepper.pairs.slots["U"]
    assert np.abs(stepper.rates[stepper.place[held], :2]).max() > 0.0  # pushed
    assert not stepper.pairs.rows[held, at : at + 2].any()


@pytest.mark.parametrize("integrator", ["leapfrog", "predictor_corrector"])
def test_held_particles_stay_and_what_they_take_is_counted(integrator, tmp_path):
    summary = run(squeezed(integrator), tmp_path / "run", threads=1).summary
    start, end = read_snapshot(list_snapshots(tmp_path / "run")[0]), final(tmp_path / "run")
    still = start.fields["position"][:, 0] >= 1.5e-3
    assert 0.1 < still.mean() < 0.9
    assert (end.fields["position"][still] == start.fields["position"][still]).all()
    assert not end.fields["velocity"][still].any()
    # the push has arrived: without the account a tenth of the momentum is missing
    momentum = [(one.fields["mass"][:, None] * one.fields["velocity"]).sum(axis=0) for one in (start, end)]
    assert np.linalg.norm(momentum[1] - momentum[0]) > 0.1 * np.linalg.norm(momentum[0])
    assert summary["conservation"]["momentum_drift"] < 1e-13
    assert abs(summary["conservation"]["energy_drift"]) < 1e-13
