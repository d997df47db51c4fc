"""Pair laws and runs in single precision against those in double, and what the loader refuses."""

from dataclasses import replace

import numba
import numpy as np
import pytest
from small_runs import METAL, TWO, assert_same_results, cracked_bar, final, row_of, struck_laminate
from sph_twins import compiled_rates, packed, random_cloud, twin_rates
from test_open_edges import block

from hvisph.casefile.loader import load_case
from hvisph.core.errors import CaseError
from hvisph.schemes.protocol import Smoothing
from hvisph.schemes.riemann.scheme import Riemann
from hvisph.schemes.standard.options import MonaghanViscosity
from hvisph.schemes.standard.scheme import Eulerian
from hvisph.simulation.run import resume, run

FACES = Riemann(has_contact=True, friction=0.3, self_contact=True, adjoint=True, single=True)
STANDARD = Eulerian(viscosity=MonaghanViscosity(1.3, 2.1), single=True)
KINDS = pytest.mark.parametrize(
    ("formulation", "dim"),
    [
        pytest.param(STANDARD, 2, id="standard"),
        pytest.param(Riemann(has_contact=True, friction=0.3, single=True), 2, id="separating"),
        pytest.param(Riemann(has_contact=True, friction=0.3, unequal_spacings=True, single=True), 3, id="unlike"),
        pytest.param(Riemann(has_contact=True, smoothing=Smoothing(True), single=True), 1, id="following"),
        pytest.param(FACES, 2, id="elastic_faces"),
    ],
)


def error(found, wanted):
    """Return the root mean square of the differences, each column over that of `wanted`."""
    size = np.sqrt(np.mean(wanted**2, axis=0))
    return np.sqrt(np.mean((found - wanted) ** 2, axis=0)) / np.where(size > 0.0, size, 1.0)


@KINDS
def test_rates_are_those_of_double_precision(formulation, dim):
    cloud = random_cloud(dim)
    # numbers of 6e-8 in sums that are a tenth of their largest term; limiters amplify where slopes nearly cancel
    assert error(compiled_rates(cloud, formulation), twin_rates(cloud, formulation)).max() < 5e-6


@KINDS
def test_momentum_and_energy_balance(formulation, dim):
    cloud = random_cloud(dim, seed=3)
    rates = compiled_rates(cloud, formulation)
    force, power = cloud.m[:, None] * rates[:, :dim], cloud.m * rates[:, dim]
    # either side of a pair rounds for itself, to 6e-8, and errors have either sign
    assert np.all(np.abs(force.sum(0)) < 1e-7 * np.abs(force).sum(0))
    work = (force * cloud.u).sum(1)
    assert abs(work.sum() + power.sum()) < 1e-7 * (np.abs(work) + np.abs(power)).sum()


@KINDS
def test_rates_do_not_know_place_and_velocity_of_the_observer(formulation, dim):
    cloud = random_cloud(dim)
    away = replace(cloud, u=cloud.u + 7000.0, x=cloud.x + 1000.0 * cloud.h.max())
    # differences are rounded after subtraction: 1000 lengths and 7 km/s cost nothing
    assert error(compiled_rates(away, formulation), compiled_rates(cloud, formulation)).max() < 5e-6


@KINDS
def test_bits_depend_neither_on_order_nor_on_threads(formulation, dim):
    cloud = random_cloud(dim)
    rates = compiled_rates(cloud, formulation)
    numba.set_num_threads(min(2, numba.config.NUMBA_NUM_THREADS))
    order = np.random.default_rng(2).permutation(len(cloud.x))
    pairs = packed(cloud, formulation)
    pairs.rows, pairs.numbers = pairs.rows[order].copy(), pairs.numbers[order].copy()
    pairs.evaluate(cloud.h.max())
    numba.set_num_threads(1)
    assert np.array_equal(pairs.rates[pairs.place[: len(order)]], rates[order])


def test_normals_of_flat_faces_have_length_one():
    cloud, side = random_cloud(2), 1e-3 * np.arange(9)
    x = np.stack(np.meshgrid(side, side, indexing="ij"), -1).reshape(-1, 2)
    cloud = replace(cloud, x=x, h=np.full(81, 1.4e-3), m=1e-6 * cloud.rho, body=np.zeros(81), face=np.zeros((81, 2)))
    pairs = packed(cloud, FACES)
    pairs.evaluate(1.4e-3)
    FACES.keep(pairs, cloud.h)
    at = pairs.slots["N_PREVIOUS"]
    assert pairs.rows[[36, 40, 44], at : at + 2] == pytest.approx(np.array([[0, -1], [0, 0], [0, 1]]), abs=1e-6)


def tumbling():
    """A rigid box that strikes one of metal beside its centre."""
    case = row_of([METAL, METAL], speed=800.0, time={"end": 1e-6}, output={"every": 5e-7}).model_dump(mode="json")
    case["bodies"]["body_0"] |= {"rigid": True, "position": [-1.5e-3, 1.3e-3]}
    case["bodies"]["body_1"]["position"] = [1.5e-3, 0.0]
    return load_case(case)


@pytest.mark.parametrize("made", [tumbling, struck_laminate, cracked_bar, block])
def test_runs_are_those_of_double_precision_and_go_on_after_a_resume(made, tmp_path, monkeypatch):
    ends = []
    for precision in ("double", "single"):
        case = made()
        formulation = case.formulation.model_copy(update={"precision": precision})
        case = case.model_copy(update={"formulation": formulation})
        outcome = run(case, tmp_path / precision, threads=1)
        ends.append(final(tmp_path / precision).fields)
    for name in ("velocity", "density", "internal_energy", "plastic_strain", "peak_pressure"):
        wanted, found = (end[name].reshape(len(end["density"]), -1) for end in ends)
        assert np.sqrt(np.mean((found - wanted) ** 2)) < 2e-6 * np.sqrt(np.mean(wanted**2)), name
    kept = outcome.summary["conservation"]
    assert abs(kept["energy_drift"]) < 1e-7
    assert abs(kept.get("momentum_drift") or 0.0) < 1e-7
    monkeypatch.setattr("hvisph.simulation.run.set_threads", lambda *_: numba.set_num_threads(TWO))
    run(case.model_copy(update={"time": case.time.model_copy(update={"max_steps": 11})}), tmp_path / "part")
    resume(tmp_path / "part", max_steps=10**6)
    numba.set_num_threads(1)
    assert_same_results(tmp_path / "single", tmp_path / "part")


@pytest.mark.parametrize(
    ("formulation", "named"),
    [
        ("{type: eulerian, precision: single, contact: {type: penalty}}", "penalty"),
        ("{type: eulerian, precision: single, correction: {type: mixed}}", "correction"),
        ("{type: total_lagrangian, precision: single}", "riemann and eulerian"),
    ],
)
def test_what_has_no_single_precision_is_refused(formulation, named):
    with pytest.raises(CaseError, match=named):
        load_case("al_al_coarse", [f"formulation={formulation}"])
