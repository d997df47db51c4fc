"""Snapshots there and back: exact in both formats, readable by VTK, damage recognised."""

import json
import os
import shutil
import subprocess
import sys
import textwrap
from pathlib import Path
from xml.etree import ElementTree

import meshio
import numpy as np
import pytest
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOHDF import vtkHDFReader
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader, vtkXMLUnstructuredGridWriter

from hvisph.core.errors import OutputError
from hvisph.core.fields import CATALOGUE
from hvisph.output import verified_hdf5
from hvisph.output.hdf5 import write_hdf5
from hvisph.output.reader import read_snapshot, read_time
from hvisph.output.snapshot import Snapshot
from hvisph.output.vtu import write_pvd, write_vtu

TESTS = str(Path(__file__).parent)
WRITERS = {"h5": write_hdf5, "vtu": write_vtu}


def make_snapshot(n=50, dim=2, seed=1):
    random = np.random.default_rng(seed)
    fields = {}
    for name, field in CATALOGUE.items():
        parts = field.components(dim)
        fields[name] = random.normal(size=(n, parts) if field.rank != "scalar" else n) * 10.0 ** random.integers(
            -20, 20
        )
    fields["density"][:3] = [np.nan, np.inf, 5e-324][:n]
    fields["not_in_catalogue"] = random.normal(size=n)
    return Snapshot(
        time=1.2345678901234567e-6,
        step=1234,
        dimensions=dim,
        fields=fields,
        body=random.integers(0, 2, n),
        material=random.integers(0, 2, n).astype(np.int32),
        id=np.arange(n),
        bodies=["projectile", "Ziel <&>"],
        materials=["aluminium-howell-ball", "Stahl für alles"],
        metadata={
            "spacing": 0.1 + 0.2,
            "title": "Größe \u2192 <x>",
            "case": "a: 1\n" * 20_000,
            "steps": np.int64(3),
        },
    )


def assert_same(a, b):
    assert (a.time, a.step, a.dimensions) == (b.time, b.step, b.dimensions)
    assert (a.bodies, a.materials, a.metadata) == (b.bodies, b.materials, b.metadata)
    assert a.fields.keys() == b.fields.keys()
    for name in a.fields:
        assert a.fields[name].dtype == b.fields[name].dtype
        assert a.fields[name].shape == b.fields[name].shape
        assert a.fields[name].tobytes() == b.fields[name].tobytes(), name
    for name in ("body", "material", "id"):
        assert getattr(a, name).dtype == getattr(b, name).dtype
        assert (getattr(a, name) == getattr(b, name)).all()


@pytest.mark.parametrize("kind", WRITERS)
@pytest.mark.parametrize("dim", [1, 2, 3])
@pytest.mark.parametrize("n", [1, 50])
def test_there_and_back_is_exact(tmp_path, kind, dim, n):
    snapshot = make_snapshot(n, dim)
    path = tmp_path / "any.name"  # the content tells the format, not the name
    WRITERS[kind](path, snapshot)
    assert_same(read_snapshot(path), snapshot)
    assert [p.name for p in tmp_path.iterdir()] == ["any.name"]


@pytest.mark.parametrize("kind", WRITERS)
def test_vtk_reads_points_cells_and_arrays(tmp_path, kind):
    snapshot = make_snapshot(40, 2)
    path = str(tmp_path / f"s.{kind}")
    WRITERS[kind](path, snapshot)
    reader = vtkHDFReader() if kind == "h5" else vtkXMLUnstructuredGridReader()
    assert reader.CanReadFile(path)
    reader.SetFileName(path)
    reader.Update()
    grid = reader.GetOutput()
    assert grid.GetNumberOfCells() == 40
    assert grid.GetCellType(39) == 1
    assert grid.GetCell(39).GetPointId(0) == 39
    points = vtk_to_numpy(grid.GetPoints().GetData())
    assert (points[:, :2] == snapshot.fields["position"]).all()
    assert (points[:, 2] == 0).all()
    data = grid.GetPointData()
    assert (vtk_to_numpy(data.GetArray("velocity"))[:, :2] == snapshot.fields["velocity"]).all()
    assert (vtk_to_numpy(data.GetArray("mass")) == snapshot.fields["mass"]).all()
    assert (vtk_to_numpy(data.GetArray("body")) == snapshot.body).all()
    assert grid.GetFieldData().GetArray("TimeValue").GetValue(0) == snapshot.time


@pytest.mark.parametrize("kind", WRITERS)
def test_tensors_are_in_the_order_of_vtk(tmp_path, kind):
    snapshot = make_snapshot(4, 3)
    snapshot.fields["deviator"] = np.tile(np.arange(6.0), (4, 1))  # xx yy zz xy xz yz
    path = str(tmp_path / "s")
    WRITERS[kind](path, snapshot)
    reader = vtkHDFReader() if kind == "h5" else vtkXMLUnstructuredGridReader()
    reader.SetFileName(path)
    reader.Update()
    tensor = reader.GetOutput().GetPointData().GetArray("deviator")
    assert tensor.GetTuple(0) == (0, 1, 2, 3, 5, 4)  # xx yy zz xy yz xz


@pytest.mark.parametrize("kind", WRITERS)
def test_every_truncation_and_flipped_bit_is_recognised(tmp_path, kind):
    path = tmp_path / "s"
    snapshot = make_snapshot(20, 2)
    snapshot.metadata = {"spacing": 0.1}
    WRITERS[kind](path, snapshot)
    whole = path.read_bytes()
    random = np.random.default_rng(5)
    for length in [0, 1, 7, 8, 100, len(whole) // 2, len(whole) - 33, len(whole) - 1]:
        path.write_bytes(whole[:length])
        with pytest.raises(OutputError, match=str(path)):
            read_snapshot(path)
    last = range(len(whole) - 40, len(whole))
    for place in [*range(12), *random.integers(0, len(whole), 150).tolist(), *last]:
        damaged = bytearray(whole)
        damaged[place] ^= 1 << int(random.integers(0, 8))
        path.write_bytes(damaged)
        with pytest.raises(OutputError, match="cannot read"):
            read_snapshot(path)


def test_what_is_no_snapshot_is_said_to_be_none(tmp_path):
    import h5py

    with pytest.raises(OutputError, match="no such file"):
        read_snapshot(tmp_path / "missing.h5")
    for content, message in [
        (b"", "it is empty"),
        (b"PK\x03\x04", "none of HDF5, VTU"),
        (b"<html></html>", "VTKFile"),
        (b'<?xml version="1.0"?><VTKFile type="PolyData"><PolyData/></VTKFile>', "no points|damaged"),
    ]:
        (tmp_path / "f").write_bytes(content)
        with pytest.raises(OutputError, match=message):
            read_snapshot(tmp_path / "f")
    with h5py.File(tmp_path / "other.h5", "w") as h5:
        h5["x"] = 1
    with pytest.raises(OutputError, match="no checksum"):
        read_snapshot(tmp_path / "other.h5")
    with pytest.raises(OutputError, match=r"directory|denied"):
        read_snapshot(tmp_path)


def test_an_earlier_snapshot_survives_a_full_disk(tmp_path):
    """A limit on the size of files stands for the full disk: the write fails in the same place."""
    program = """
        import resource, sys
        sys.path.insert(0, sys.argv[-1])
        from test_output_snapshots import WRITERS, make_snapshot, assert_same
        from hvisph.core.errors import OutputError
        from hvisph.output.reader import read_snapshot
        small, large = make_snapshot(10), make_snapshot(5000)
        for kind, write in WRITERS.items():
            path = f"{sys.argv[1]}/s.{kind}"
            write(path, small)
            for limit in (300_000, 301_000, 600_000):
                resource.setrlimit(resource.RLIMIT_FSIZE, (limit, resource.RLIM_INFINITY))
                try:
                    write(path, large)
                except OutputError as error:
                    print(error)
                resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
            assert_same(read_snapshot(path), small)
    """
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(program), str(tmp_path), TESTS], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    assert done.stdout.count("file too large") == 6
    assert sorted(p.name for p in tmp_path.iterdir()) == ["s.h5", "s.vtu"]


def test_a_kill_while_writing_leaves_no_partial_file_under_the_name(tmp_path):
    program = """
        import os, sys
        sys.path.insert(0, sys.argv[-1])
        from test_output_snapshots import WRITERS, make_snapshot
        from hvisph.output import verified_hdf5, vtu
        for module in (vtu, verified_hdf5):
            module.append_checksum = lambda file: os.kill(os.getpid(), 9)
        WRITERS[sys.argv[2]](sys.argv[1], make_snapshot())
    """
    for kind in WRITERS:
        path = tmp_path / f"s.{kind}"
        WRITERS[kind](path, make_snapshot(7))
        done = subprocess.run(
            [sys.executable, "-c", textwrap.dedent(program), str(path), kind, TESTS], capture_output=True
        )
        assert done.returncode != 0
        assert_same(read_snapshot(path), make_snapshot(7))
        WRITERS[kind](path, make_snapshot(9))
        assert not path.with_name(path.name + ".partial").exists()
        assert read_snapshot(path).count == 9


@pytest.mark.parametrize("mode", ["ascii", "binary", "appended", "compressed"])
def test_vtu_of_another_code(tmp_path, mode):
    """Written by VTK itself, as most codes do, in its ways of encoding."""
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkUnstructuredGrid

    random = np.random.default_rng(3)
    points = random.normal(size=(30, 3))
    points[:, 2] = 0
    arrays = {
        "Velocity": random.normal(size=(30, 3)),
        "rho": 2700.0 + random.normal(size=30),
        "m": random.uniform(1.0, 2.0, size=30),
        "mol": np.repeat([2, 5], 15),
        "ID": np.arange(30)[::-1].copy(),
        "Own quantity": random.normal(size=30),
    }
    grid, holder = vtkUnstructuredGrid(), vtkPoints()
    holder.SetDataTypeToDouble()
    holder.SetData(numpy_to_vtk(points, deep=True))
    grid.SetPoints(holder)
    for i in range(30):
        grid.InsertNextCell(1, 1, [i])
    for name, values in arrays.items():
        array = numpy_to_vtk(values, deep=True)
        array.SetName(name)
        grid.GetPointData().AddArray(array)
    writer = vtkXMLUnstructuredGridWriter()
    writer.SetFileName(str(tmp_path / "s.vtu"))
    writer.SetInputData(grid)
    if mode == "ascii":
        writer.SetDataModeToAscii()
    elif mode == "binary":
        writer.SetDataModeToBinary()
    else:
        writer.SetDataModeToAppended()
    if mode != "compressed":
        writer.SetCompressorTypeToNone()
    assert writer.Write() == 1
    got = read_snapshot(tmp_path / "s.vtu")
    # ascii holds the 15 or so digits that VTK prints
    close = {"rtol": 1e-9} if mode == "ascii" else {"rtol": 0}
    assert got.dimensions == 2
    assert (got.id == np.arange(30)).all()
    assert got.bodies == ["body 2", "body 5"]
    assert (got.body == np.repeat([1, 0], 15)).all()
    for ours, theirs in [("velocity", "Velocity"), ("density", "rho"), ("mass", "m"), ("Own quantity",) * 2]:
        want = arrays[theirs][::-1]
        np.testing.assert_allclose(got.fields[ours], want[:, :2] if want.ndim == 2 else want, **close)


def test_vtu_with_separate_velocity_components(tmp_path):
    points = np.random.default_rng(0).normal(size=(5, 3))
    data = {k: np.arange(5.0) + i for i, k in enumerate(["u", "v", "w", "e", "material"])}
    meshio.Mesh(points, [("vertex", np.arange(5).reshape(5, 1))], point_data=data).write(tmp_path / "s.vtu")
    got = read_snapshot(tmp_path / "s.vtu")
    assert (got.fields["velocity"] == np.stack([data["u"], data["v"], data["w"]], axis=1)).all()
    assert (got.fields["internal_energy"] == data["e"]).all()
    assert len(got.bodies) == len(got.materials) == 5


def test_pvd_series(tmp_path):
    entries = [(0.0, "vtu/000000.vtu"), (0.1 + 0.2, "vtu/a&b.vtu")]
    write_pvd(tmp_path / "series.pvd", entries)
    sets = ElementTree.parse(tmp_path / "series.pvd").getroot().find("Collection")
    assert [(float(s.get("timestep")), s.get("file")) for s in sets] == entries


def test_metadata_must_be_plain(tmp_path):
    snapshot = make_snapshot(3)
    snapshot.metadata = {"bad": object()}
    with pytest.raises(TypeError, match="plain numbers and text"):
        write_hdf5(tmp_path / "s.h5", snapshot)
    assert list(tmp_path.iterdir()) == []


def test_importing_readers_is_light():
    program = (
        "import sys, hvisph.output.reader, hvisph.output.run_folder, hvisph.output.hdf5, hvisph.geometry.filling, "
        "hvisph.geometry.overlap; print(sorted({'meshio', 'scipy.spatial', 'scipy.optimize', 'numba'} & set(sys.modules)))"
    )
    assert subprocess.run([sys.executable, "-c", program], capture_output=True, text=True).stdout.strip() == "[]"


def finished(folder, **settings):
    """A short run of two bodies, one of which fails."""
    from small_runs import DAMAGED, METAL, row_of

    from hvisph.simulation.run import run

    return run(row_of([METAL, DAMAGED], time={"end": 6e-7}, output={"every": 2e-7}, **settings), folder, threads=1)


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    """The folder of a short run."""
    return finished(tmp_path_factory.mktemp("series") / "run").folder


def test_snapshots_say_what_happened_to_each_particle_so_far(ran):
    files = sorted((ran / "snapshots").iterdir())
    states = [read_snapshot(path) for path in files]
    start = states[0].fields["position"]
    highest = np.full(states[0].count, -np.inf)
    for state in states:
        fields = state.fields
        assert (fields["displacement"] == fields["position"] - start).all()
        assert (fields["failed"] == (fields["damage"] >= 1.0)).all()
        highest = np.maximum(highest, fields["pressure"])
        assert (fields["peak_pressure"] >= highest).all()
        highest = fields["peak_pressure"]
    summary = json.loads((ran / "summary.json").read_text())
    assert highest.max() == pytest.approx(summary["pressures"]["highest"], rel=1e-12)


def test_vtk_opens_all_moments_as_one_series(ran, tmp_path):
    moved = ran.rename(tmp_path / "elsewhere")  # the series goes where the folder goes
    try:
        reader = vtkHDFReader()
        reader.SetFileName(str(moved / "series.vtkhdf"))
        reader.Update()
        files = sorted((moved / "snapshots").iterdir())
        assert reader.GetNumberOfSteps() == len(files) == 4
        for step, path in enumerate(files):
            state = read_snapshot(path)
            reader.SetStep(step)
            reader.Update()
            grid = reader.GetOutput()
            assert reader.GetTimeValue() == state.time
            assert grid.GetNumberOfCells() == state.count
            assert (vtk_to_numpy(grid.GetPoints().GetData())[:, :2] == state.fields["position"]).all()
            for name in ("pressure", "peak_pressure", "temperature", "failed"):
                np.testing.assert_array_equal(vtk_to_numpy(grid.GetPointData().GetArray(name)), state.fields[name])
            labels = grid.GetFieldData().GetAbstractArray("body_names")
            assert [labels.GetValue(k) for k in range(labels.GetNumberOfValues())] == state.bodies
    finally:
        moved.rename(ran)


def test_pyvista_opens_both(ran):
    pyvista = pytest.importorskip("pyvista")
    last = read_snapshot(sorted((ran / "snapshots").iterdir())[-1])
    grid = pyvista.read(ran / "snapshots" / "000003.vtkhdf")
    assert (grid["pressure"] == last.fields["pressure"]).all()
    assert list(grid.field_data["material_names"]) == last.materials
    reader = pyvista.get_reader(ran / "series.vtkhdf")
    assert reader.read().n_points == last.count


def test_arrays_have_units_and_names_of_any_language(tmp_path):
    import h5py

    snapshot = make_snapshot(5, 2)
    write_hdf5(tmp_path / "s.vtkhdf", snapshot)
    with h5py.File(tmp_path / "s.vtkhdf") as h5:
        data = h5["VTKHDF/PointData"]
        assert {name: data[name].attrs["units"] for name in ("velocity", "pressure", "damage")} == {
            "velocity": "m/s", "pressure": "Pa", "damage": ""}  # fmt: skip
        assert all("units" in array.attrs for array in data.values())  # numbers of bodies too
        assert h5["VTKHDF/Points"].attrs["units"] == "m"
        assert data["displacement"].attrs["meaning"] == "displacement since the start"
        assert [text.decode() for text in h5["VTKHDF/FieldData/body_names"]] == snapshot.bodies


def test_snapshots_of_earlier_versions_stay_readable(ran, tmp_path):
    import hvisph
    from hvisph.output.reader import list_snapshots

    old = shutil.copytree(ran, tmp_path / "old")
    for path in (old / "snapshots").iterdir():
        path.rename(path.with_suffix(".h5"))
    assert [path.name for path in list_snapshots(old)] == [f"{k:06d}.h5" for k in range(4)]
    assert hvisph.measure(old).as_dict()["measures"] == hvisph.measure(ran).as_dict()["measures"]
    (old / "snapshots" / "000003.h5").rename(old / "snapshots" / "000003.vtkhdf")  # gone on with by this one
    assert [path.stem for path in list_snapshots(old)] == [f"{k:06d}" for k in range(4)]


def test_the_series_forgets_what_is_forgotten(ran, tmp_path):
    from hvisph.output.run_folder import delete_snapshots

    copy = shutil.copytree(ran, tmp_path / "copy")
    delete_snapshots(copy, last=True)
    assert [path.name for path in (copy / "snapshots").iterdir()] == ["000003.vtkhdf"]
    assert not (copy / "series.vtkhdf").exists()


def test_a_file_is_checked_once_and_again_when_it_changed(tmp_path, monkeypatch):
    path, checked = tmp_path / "000001.vtkhdf", []
    write_hdf5(path, make_snapshot())
    verify_checksum = verified_hdf5.verify_checksum
    monkeypatch.setattr(verified_hdf5, "verify_checksum", lambda file: checked.append(verify_checksum(file)))
    for _ in range(2):  # just written: a change might not show in its time
        read_snapshot(path)
    assert len(checked) == 2
    os.utime(path, (1e9, 1e9))
    for _ in range(3):
        read_snapshot(path)
    assert len(checked) == 3
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    with pytest.raises(OutputError, match="checksum"):
        read_snapshot(path)


@pytest.mark.parametrize("kind", WRITERS)
def test_the_time_alone(tmp_path, kind):
    path = tmp_path / f"one.{kind}"
    WRITERS[kind](path, make_snapshot())
    assert read_time(path) == make_snapshot().time
    with pytest.raises(OutputError):
        read_time(tmp_path / "none.vtkhdf")
