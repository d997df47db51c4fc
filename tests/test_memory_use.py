"""Memory of large runs: lazy fields, released arrays, reordering without copies."""

import dataclasses

import numpy as np
import pytest
from small_runs import METAL, row_of

from hvisph.core.errors import OutputError
from hvisph.core.fields import Derived, transform_arrays
from hvisph.core.particles import Ordered, reorder
from hvisph.measures.measure import measure
from hvisph.output import hdf5
from hvisph.output.reader import list_snapshots, read_snapshot
from hvisph.schemes.stepper import Stepper
from hvisph.simulation.clock import release_arrays
from hvisph.simulation.run import run
from hvisph.simulation.run_files import RunFiles
from hvisph.sph.neighbours.cells import Grid

SMALL = {"time": {"end": 3e-7}, "formulation": {"type": "eulerian"}}


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    folder = tmp_path_factory.mktemp("room") / "run"
    case = row_of([METAL, METAL], symmetry=[{"axis": "y", "at": 0.0, "keep": "above"}], output={"every": 7e-8}, **SMALL)
    return case, folder, run(case, folder, threads=1).summary


@pytest.mark.parametrize("formulation", ["eulerian", "riemann"])
def test_moments_inside_steps_are_the_same_in_any_room(formulation, tmp_path, monkeypatch):
    case = row_of([METAL, METAL], output={"every": 2e-9}, time={"end": 4e-8}, formulation={"type": formulation})
    run(case, tmp_path / "own", threads=1)
    monkeypatch.setattr(Stepper, "workspace", None)
    run(case, tmp_path / "new", threads=1)
    pairs = [[read_snapshot(path) for path in list_snapshots(tmp_path / name)] for name in ("own", "new")]
    assert len(pairs[0]) == 21
    assert len({one.step for one in pairs[0]}) < 15  # several moments in some steps
    for one, other in zip(*pairs, strict=True):
        assert one.time == other.time
        assert all((one.fields[name] == other.fields[name]).all() for name in one.fields)


def test_a_snapshot_read_lazily_is_the_same(done, monkeypatch):
    monkeypatch.setattr(hdf5, "_SMALL", 0)
    for path in list_snapshots(done[1]):
        now, lazy = read_snapshot(path), read_snapshot(path, lazily=True)
        assert isinstance(lazy.fields, Derived)
        assert list(lazy.fields) == list(now.fields)
        assert all((lazy.fields[name] == now.fields[name]).all() for name in now.fields)


def test_what_stands_in_another_snapshot_is_read_lazily_too(done, tmp_path, monkeypatch):
    first, *_, last = map(read_snapshot, list_snapshots(done[1]))
    hdf5.write_hdf5(tmp_path / "000000.vtkhdf", first)
    hdf5.write_hdf5(tmp_path / "000001.vtkhdf", last, hdf5.StorageOptions(constants_in="000000.vtkhdf"))
    monkeypatch.setattr(hdf5, "_SMALL", 0)
    lazy = read_snapshot(tmp_path / "000001.vtkhdf", lazily=True)
    assert isinstance(lazy.fields, Derived)
    assert all((lazy.fields[name] == last.fields[name]).all() for name in last.fields)
    assert (lazy.body == last.body).all()


def test_measures_are_the_same_lazily(done, monkeypatch):
    plain = measure(done[1]).as_dict()
    assert {name: one for name, one in plain.items() if name in done[2]}.items() <= done[2].items()
    monkeypatch.setattr(hdf5, "_SMALL", 0)  # images of a symmetric model included
    assert measure(done[1]).as_dict() == plain


def test_a_first_snapshot_that_is_gone_is_made_again(done, tmp_path, monkeypatch):
    case, _, before = done
    last = RunFiles.write_last

    def losing(self, failed):
        self.writer.path(0).unlink()
        return last(self, failed)

    monkeypatch.setattr(RunFiles, "write_last", losing)
    summary = run(case, tmp_path / "run", threads=1).summary
    assert {name: one["value"] for name, one in summary["measures"].items()} == {
        name: one["value"] for name, one in before["measures"].items()
    }


@pytest.mark.parametrize("room", [None, np.empty(3), np.empty((40, 4))])
def test_rows_are_put_into_order_in_any_room(room):
    rng = np.random.default_rng(1)
    for values in (rng.random((30, 5)), rng.integers(0, 9, (30, 4)).astype(np.uint32), rng.random(30)):
        order, before = rng.permutation(30), values.copy()
        reorder(values, order, room)
        assert (values == before[order]).all()


def test_ordered_rows_are_those_taken_in_order():
    values, order = np.arange(12.0).reshape(6, 2), np.array([5, 0, 3])
    one = Ordered(values, order)
    assert (one.shape, one.dtype, len(one)) == ((3, 2), values.dtype, 3)
    assert (one[1:] == values[order][1:]).all()


def test_arrays_change_now_or_when_asked_for():
    asked = []

    def make(name):
        asked.append(name)
        return np.ones(2)

    lazy = transform_arrays(Derived("ab", make), lambda _, values: 2.0 * values, ["b"])
    assert (list(lazy), asked) == (["b"], [])
    assert (lazy["b"] == 2.0).all()
    assert asked == ["b"]
    with pytest.raises(KeyError):
        lazy["a"]
    with pytest.raises(KeyError):
        transform_arrays({"a": np.ones(1)}, lambda _, values: values, ["c"])


def test_what_is_released_is_empty_and_settings_stay():
    grid = Grid.from_positions(np.random.default_rng(0).random((50, 2)), 0.1)

    @dataclasses.dataclass(frozen=True)
    class Fixed:
        values: np.ndarray

    class Holder:
        pass

    Fixed.__module__ = Holder.__module__ = "hvisph.made_up"
    holder = Holder()
    holder.grid, holder.own, holder.fixed, holder.itself = [grid], np.ones((3, 2)), Fixed(np.ones(2)), holder
    release_arrays(holder)
    assert len(grid.starts) == 0
    assert holder.own.shape == (0, 2)
    assert len(holder.fixed.values) == 2


def test_an_array_that_is_read_alone_is_told_to_be_damaged(done, tmp_path, monkeypatch):
    """Read lazily only what is asked for is looked at; a snapshot without sums of its arrays is looked at as a whole."""
    path, now = tmp_path / "000001.vtkhdf", read_snapshot(list_snapshots(done[1])[-1])
    monkeypatch.setattr(hdf5, "_SMALL", 0)
    hdf5.write_hdf5(path, now)
    content = bytearray(path.read_bytes())
    place = content.index(now.fields["density"].tobytes())
    content[place + 5] ^= 4
    path.write_bytes(content)
    lazy = read_snapshot(path, lazily=True)
    assert (lazy.fields["position"] == now.fields["position"]).all()
    with pytest.raises(OutputError, match="density.*damaged"):
        lazy.fields["density"]
    with pytest.raises(OutputError, match="damaged"):
        read_snapshot(path)
    monkeypatch.setattr(hdf5, "_has_sums", lambda path: False)
    with pytest.raises(OutputError, match="damaged"):
        read_snapshot(path, lazily=True)
    path.write_bytes(content[:-4000])
    monkeypatch.undo()
    with pytest.raises(OutputError, match="truncated"):
        read_snapshot(path, lazily=True)


def test_a_damaged_header_is_told(done, tmp_path, monkeypatch):
    path, now = tmp_path / "000001.vtkhdf", read_snapshot(list_snapshots(done[1])[-1])
    monkeypatch.setattr(hdf5, "_SMALL", 0)
    hdf5.write_hdf5(path, now)
    content = path.read_bytes()
    assert content.count(b'"dimensions": ') == 1
    path.write_bytes(content.replace(b'"dimensions": ', b'"dimensionz": '))
    with pytest.raises(OutputError, match="header"):
        read_snapshot(path, lazily=True)
