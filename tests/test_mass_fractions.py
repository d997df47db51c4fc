"""Mass fractions, angular momentum, and the pressure beside its estimate."""

from dataclasses import replace

import numpy as np
import pytest
from small_runs import DAMAGED, METAL, final, row_of

from hvisph.casefile.loader import load_case
from hvisph.core.catalogues import unstrained_kinematics
from hvisph.diagnostics.budgets import angular_momentum_of
from hvisph.diagnostics.sanity_checks import NEGATIVE_ENERGY_TOLERANCE, SanityChecks
from hvisph.diagnostics.summary import shares
from hvisph.materials.damage import NoDamage
from hvisph.materials.melting import Lindemann
from hvisph.materials.validity_limits import range_of
from hvisph.output.reader import list_snapshots, read_snapshot
from hvisph.output.snapshot import Snapshot
from hvisph.precheck.impact_pair import compare_peak_pressure
from hvisph.setup.materials import material_of
from hvisph.simulation.run import run, set_threads

CASE = {
    "kinematics": "plane_strain",
    "resolution": "0.5 mm",
    "bodies": {
        "shot": {"material": "aluminium-2024-t351", "shape": {"type": "box", "size": ["2 mm", "2 mm"]},
                 "velocity": ["1 km/s", 0]},
        "wall": {"material": "aluminium-2024-t351", "shape": {"type": "box", "size": ["2 mm", "6 mm"]}},
    },
    "time": {"end": "1 us"},
}  # fmt: skip


def state(n=10, **fields):
    made = {"position": np.zeros((n, 2)), "velocity": np.ones((n, 2)), "mass": np.ones(n),
            "density": np.full(n, 2785.0), "internal_energy": np.zeros(n), "damage": np.zeros(n),
            "temperature": np.full(n, 300.0), "pressure": np.zeros(n)}  # fmt: skip
    zero = np.zeros(n, dtype=int)
    return Snapshot(0.0, 0, 2, made | fields, zero, zero, np.arange(n), ["a"], ["m"], {})


def metal():
    return material_of(load_case(CASE).bodies["shot"].material)


def test_shares_of_mass():
    start, one = state(), metal()
    calm = shares(start, start, [one])
    assert calm == {"failed": 0.0, "above_melting": 0.0, "beyond_range": 0.0, "negative_energy": 0.0}
    first, three, last = np.arange(10) < 1, np.arange(10) < 3, np.arange(10) == 9
    low = range_of(one).least_density
    assert 0.0 < low < 2785.0
    thin = first | last  # of which the first has failed, and is full of voids
    told = shares(state(damage=1.0 * three, density=np.where(thin, 0.9 * low, 2785.0),
                        internal_energy=np.where(first, -1.0, 1.0), temperature=np.where(three, 2000.0, 300.0)),
                  start, [one])  # fmt: skip
    assert told == pytest.approx({"failed": 0.3, "above_melting": 0.3, "beyond_range": 0.1, "negative_energy": 0.1})


def test_inclusions_have_their_own_shares():
    """A body of two materials, of which the second alone breaks and ends at a lower density."""
    metal_, last = metal(), np.arange(10) == 9
    whole = replace(metal_, damage=NoDamage())
    now = replace(state(damage=1.0 * last), material=last.astype(int))
    assert shares(now, now, [whole, metal_])["failed"] == pytest.approx(0.1)
    assert shares(now, now, [metal_, whole])["failed"] == 0.0


def test_melting_rises_with_compression():
    one = replace(metal(), melting=Lindemann(1000.0, 2.0, 1.5))
    hot = state(temperature=np.full(10, 1100.0))
    assert shares(hot, hot, [one])["above_melting"] == 1.0
    squeezed = replace(hot, fields=hot.fields | {"density": np.full(10, 1.2 * 2785.0)})
    assert shares(squeezed, hot, [one])["above_melting"] == 0.0


@pytest.mark.parametrize("dim", [1, 2, 3])
def test_angular_momentum_is_the_sum_of_cross_products(dim):
    random = np.random.default_rng(1)

    class Few(dict):
        pass

    few = Few(position=random.normal(size=(7, dim)), velocity=random.normal(size=(7, dim)), mass=random.random(7))
    few.dim, few.kinematics = dim, unstrained_kinematics(dim)
    x, v = (np.pad(few[name], ((0, 0), (0, 3 - dim))) for name in ("position", "velocity"))
    whole = (few["mass"][:, None] * np.cross(x, v)).sum(axis=0)
    np.testing.assert_allclose(angular_momentum_of(few).sum(axis=0), {1: [], 2: whole[2:], 3: whole}[dim], rtol=1e-12)


def test_pressure_beside_its_estimate():
    case = load_case(CASE)
    estimate = compare_peak_pressure(case, 1.0)[0]["impedance_match"]
    assert estimate == pytest.approx(9.0e9, rel=0.1)  # rho c u/2 and the slope of the Hugoniot
    assert compare_peak_pressure(case, 1.2 * estimate)[1] == []
    assert "0.5 times" in compare_peak_pressure(case, 0.5 * estimate)[1][0]
    assert "2 times" in compare_peak_pressure(case, 2.0 * estimate)[1][0]


def test_a_witness_plane_of_the_case_reaches_the_snapshots(tmp_path):
    set_threads(1)
    outcome = run(load_case(CASE | {"witness": {"x": "100 mm"}, "time": {"end": "20 ns"}}), tmp_path / "run", threads=1)
    assert read_snapshot(list_snapshots(outcome.folder)[-1]).metadata["witness"] == 0.1


def test_a_negative_energy_is_said_once():
    class Setup:
        class stepper:  # noqa: N801
            has_energy = True
            sums = np.zeros(13)
            signals = np.ones(1)

        class subdomain:  # noqa: N801
            get_maxima = staticmethod(np.atleast_1d)  # of one process: its own

    Setup.stepper.sums[0] = 100.0
    watch = SanityChecks(Setup, load_case(CASE).limits)
    assert watch.warning(1e-6) == ""
    Setup.stepper.sums[1] = -0.5 * NEGATIVE_ENERGY_TOLERANCE * 100.0
    assert watch.warning(1e-6) == ""
    Setup.stepper.sums[1] = -0.5
    assert "0.5 %" in watch.warning(2e-6)
    assert watch.warning(3e-6) == ""


def test_numbers_of_materials_are_not_those_of_bodies(tmp_path):
    """The third body alone breaks, and has the second material."""
    case = row_of(
        [METAL, METAL, DAMAGED], speed=3000.0, time={"end": 4e-6}, output={"every": 4e-6, "formats": ["hdf5"]}
    )
    outcome = run(case, tmp_path / "run")
    last = final(outcome.folder)
    broken = (last.fields["damage"] >= 1.0) & (last.body == 2)
    mass = last.fields["mass"]
    assert broken.any()
    assert outcome.summary["shares"]["failed"] == pytest.approx(mass[broken].sum() / mass.sum())
