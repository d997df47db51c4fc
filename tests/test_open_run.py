"""A run in a notebook: states, history and summary as objects."""

import numpy as np
import pytest

import hvisph
from hvisph.casefile.loader import load_case
from hvisph.core.errors import CaseError


@pytest.fixture(scope="module")
def opened(tmp_path_factory):
    """A coarse impact, run and opened."""
    case = load_case("al_al_coarse", ["time.end=1us", "output.every=0.5us"], "0.5 mm")
    return hvisph.open_run(hvisph.run(case, tmp_path_factory.mktemp("notebook") / "impact").folder)


def test_states_are_tables(opened):
    pytest.importorskip("pandas")
    assert len(opened) == 3
    last = opened[-1]
    table = last.to_dataframe()
    assert len(table) == last.count
    assert np.array_equal(table["velocity_x"], last.fields["velocity"][:, 0])
    assert set(table["body"]) == {"projectile", "target"}
    assert [state.time for state in opened[:2]] == [opened[0].time, opened.state_at(0.5e-6).time]
    assert opened.history["kinetic_energy"].iloc[0] > opened.history["kinetic_energy"].iloc[-1]


def test_the_summary_has_measures_as_attributes(opened):
    assert opened.summary.residual_velocity.unit == "m/s"
    assert opened.summary["status"] == opened.summary.status == "done"
    assert "penetration" in dir(opened.summary)
    assert f"{float(opened.summary.penetration):.6g}" in repr(opened.summary.penetration)
    with pytest.raises(AttributeError, match="penetration"):
        _ = opened.summary.penetraton


def test_runs_show_themselves(opened):
    assert "<table>" in opened._repr_html_()
    assert "3 snapshots, done" in repr(opened)
    assert opened.plot("pressure").axes
    assert opened.report().name == "report.html"
    assert dir(hvisph) == sorted(["__version__", *hvisph.__all__])
    with pytest.raises(CaseError, match="no run"):
        hvisph.open_run(opened.path / "absent")
