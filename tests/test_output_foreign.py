"""Files of other codes: written by VTK itself and as LAMMPS writes them, in every encoding; names and units."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from hvisph.cli.main import app
from hvisph.core.errors import OutputError
from hvisph.measures.measure import measure
from hvisph.output.foreign import snapshot_of_another_code
from hvisph.output.reader import Convention, list_snapshots, read_history, read_snapshot

MODES = ["ascii", "binary", "appended", "compressed"]


def arrays_of(points):
    random = np.random.default_rng(3)
    n = len(points)
    return {"Velocity": random.normal(size=(n, 3)), "rho_own": random.uniform(1, 2, n), "m": random.uniform(1, 2, n),
            "mol": np.repeat([2, 5], n // 2), "ID": np.arange(n)[::-1].copy()}  # fmt: skip


def points_of(n=30):
    points = np.random.default_rng(2).normal(size=(n, 3))
    points[:, 2] = 0.0
    return points


def grid_of(kind, points, arrays, time=None):
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData, vtkUnstructuredGrid

    holder, grid = vtkPoints(), vtkPolyData() if kind == "poly" else vtkUnstructuredGrid()
    holder.SetDataTypeToDouble()
    holder.SetData(numpy_to_vtk(points, deep=True))
    grid.SetPoints(holder)
    cells = vtkCellArray()
    for i in range(len(points)):
        if kind == "poly":
            cells.InsertNextCell(1, [i])
        else:
            grid.InsertNextCell(1, 1, [i])
    if kind == "poly":
        grid.SetVerts(cells)
    for name, values in arrays.items():
        array = numpy_to_vtk(values, deep=True)
        array.SetName(name)
        grid.GetPointData().AddArray(array)
    if time is not None:
        array = numpy_to_vtk(np.array([time]), deep=True)
        array.SetName("TimeValue")
        grid.GetFieldData().AddArray(array)
    return grid


def write_vtp(path, grid, mode="binary"):
    from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter

    writer = vtkXMLPolyDataWriter()
    {"ascii": writer.SetDataModeToAscii, "binary": writer.SetDataModeToBinary}.get(
        mode, writer.SetDataModeToAppended)()  # fmt: skip
    if mode != "compressed":
        writer.SetCompressorTypeToNone()
    if mode == "raw":
        writer.EncodeAppendedDataOff()
    finish(writer, path, grid)


def write_vtk(path, grid, mode, version):
    from vtkmodules.vtkIOLegacy import vtkPolyDataWriter, vtkUnstructuredGridWriter

    writer = vtkPolyDataWriter() if grid.IsA("vtkPolyData") else vtkUnstructuredGridWriter()
    (writer.SetFileTypeToBinary if mode == "binary" else writer.SetFileTypeToASCII)()
    writer.SetFileVersion(version)
    finish(writer, path, grid)


def finish(writer, path, grid):
    writer.SetFileName(str(path))
    writer.SetInputData(grid)
    assert writer.Write() == 1


def check(got, points, arrays, close, factor=(1.0, 1.0, 1.0)):
    length, mass, time = factor
    assert got.dimensions == 2
    assert got.bodies == ["body 2", "body 5"]
    assert (got.id == np.arange(len(points))).all()
    back = slice(None, None, -1)
    np.testing.assert_allclose(got.fields["position"], length * points[back, :2], **close)
    np.testing.assert_allclose(got.fields["velocity"], length / time * arrays["Velocity"][back, :2], **close)
    np.testing.assert_allclose(got.fields["density"], mass / length**3 * arrays["rho_own"][back], **close)
    np.testing.assert_allclose(got.fields["mass"], mass * arrays["m"][back], **close)


OWN = Convention({"density": "rho_own"}, (1.0, 1.0, 1.0))  # densities between 1 and 2 are meant


@pytest.mark.parametrize("mode", [*MODES, "raw"])
def test_vtp(tmp_path, mode):
    points = points_of()
    arrays = arrays_of(points)
    write_vtp(tmp_path / "s.vtp", grid_of("poly", points, arrays, 2.5e-6), mode)
    got = read_snapshot(tmp_path / "s.vtp", OWN)
    check(got, points, arrays, {"rtol": 1e-9 if mode == "ascii" else 0})
    assert got.time == 2.5e-6


@pytest.mark.parametrize("kind", ["poly", "grid"])
@pytest.mark.parametrize("mode", ["ascii", "binary"])
@pytest.mark.parametrize("version", [42, 51])
def test_legacy_vtk(tmp_path, kind, mode, version):
    points = points_of()
    arrays = arrays_of(points)
    write_vtk(tmp_path / "s.vtk", grid_of(kind, points, arrays, 2.5e-6), mode, version)
    got = read_snapshot(tmp_path / "s.vtk", OWN)
    # VTK prints some 6 digits of a double at least
    check(got, points, arrays, {"rtol": 1e-5 if mode == "ascii" else 0})
    assert got.time == pytest.approx(2.5e-6)


def test_legacy_vtk_as_written_by_hand(tmp_path):
    text = """# vtk DataFile Version 3.0
by hand
ASCII
DATASET POLYDATA
POINTS 2 float
0 0 0 1 0.5 0
VERTICES 2 4
1 0
1 1
POINT_DATA 2
SCALARS rho float 1
LOOKUP_TABLE default
2700
2800
SCALARS Mk int
LOOKUP_TABLE default
10 20
VECTORS Vel float
1 2 0
3 4 0
"""
    path = tmp_path / "s.vtk"
    path.write_text(text)
    got = read_snapshot(path, Convention({"body": "Mk"}))
    assert got.fields["density"].tolist() == [2700.0, 2800.0]
    assert got.fields["velocity"].tolist() == [[1.0, 2.0], [3.0, 4.0]]
    assert got.bodies == ["body 10", "body 20"]
    path.write_text(text[: text.index("3 4 0")])
    with pytest.raises(OutputError, match="truncated"):
        read_snapshot(path)
    grid = "DATASET STRUCTURED_POINTS\nDIMENSIONS 2 1 1\nORIGIN 0 0 0\nSPACING 1 1 1\n"
    path.write_text(text[: text.index("DATASET")] + grid + text[text.index("POINT_DATA") :])
    with pytest.raises(OutputError, match="POLYDATA and UNSTRUCTURED_GRID"):
        read_snapshot(path)


def lammps(points, arrays, step, scaled=False, time=None):
    low, high = points.min() - 1.0, points.max() + 1.0
    shown = (points - low) / (high - low) if scaled else points
    lines = [f"ITEM: TIMESTEP\n{step}"] + ([] if time is None else [f"ITEM: TIME\n{time!r}"])
    lines += [f"ITEM: NUMBER OF ATOMS\n{len(points)}", "ITEM: BOX BOUNDS ss ss pp"]
    lines += [f"{float(low)!r} {float(high)!r}"] * 2 + ["-0.5 0.5"]
    lines.append("ITEM: ATOMS id mol element " + ("xs ys" if scaled else "x y") + " vx vy mass c_rho_own")
    for i in range(len(points)):
        v = arrays["Velocity"][i]
        numbers = [*shown[i, :2], *v[:2], arrays["m"][i], arrays["rho_own"][i]]
        lines.append(f"{arrays['ID'][i]} {arrays['mol'][i]} Al " + " ".join(repr(float(one)) for one in numbers))
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize("scaled", [False, True])
def test_lammps_dump(tmp_path, scaled):
    points = points_of()
    arrays = arrays_of(points)
    path = tmp_path / "dump.1000"
    # the last of several moments in a file counts
    path.write_text(lammps(points + 1.0, arrays, 0) + lammps(points, arrays, 1000, scaled, 4.0))
    units = (1e-3, 1e-3, 1e-6)
    got = read_snapshot(path, Convention({"density": "rho_own"}, units))
    check(got, points, arrays, {"rtol": 1e-12, "atol": 1e-15}, units)
    assert (got.step, got.time) == (1000, pytest.approx(4e-6))
    path.write_text(path.read_text()[:-60])
    with pytest.raises(OutputError, match="truncated"):
        read_snapshot(path)


def shot(path, time, dx=1e-3, unit=(1.0, 1.0, 1.0)):
    """A block that has flown through a plate, or is before it, in the units of `unit` (length, mass, time in SI)."""
    x, y = np.meshgrid(np.arange(4) * dx, (np.arange(4) - 1.5) * dx)
    block = np.column_stack([x.ravel() - 4.5 * dx + 1000.0 * time, y.ravel()])
    x, y = np.meshgrid((np.arange(2) + 0.5) * dx, (np.arange(40) - 19.5) * dx)
    plate = np.column_stack([x.ravel(), y.ravel()])
    plate = plate if time == 0.0 else plate[np.abs(plate[:, 1]) > 4 * dx]
    points = np.zeros((len(block) + len(plate), 3))
    points[:, :2] = np.concatenate([block, plate])
    velocity = np.zeros_like(points)
    velocity[: len(block), 0] = 1000.0
    length, mass, seconds = unit
    grid = grid_of("poly", points / length, {
        "vel": velocity * seconds / length, "m": np.full(len(points), 2.7e-3) / mass,
        "rho": np.full(len(points), 2700.0) * length**3 / mass, "body": np.repeat([0, 1], [len(block), len(plate)]),
        "id": np.concatenate([np.arange(len(block)), 100 + np.flatnonzero(np.isin(
            np.arange(80), np.arange(80) if time == 0.0 else np.flatnonzero(
                np.abs(np.repeat((np.arange(40) - 19.5), 2)) > 4)))]),
    }, time / seconds)  # fmt: skip
    write_vtp(path, grid)


def test_a_folder_of_another_code_is_measured_in_its_units(tmp_path):
    for folder, unit in (("si", (1.0, 1.0, 1.0)), ("small", (1e-3, 1e-3, 1e-6))):
        (tmp_path / folder).mkdir()
        for number, time in enumerate((0.0, 2e-5)):
            shot(tmp_path / folder / f"s_{number}.vtp", time, unit=unit)
    assert [path.name for path in list_snapshots(tmp_path / "si")] == ["s_0.vtp", "s_1.vtp"]
    plain = measure(tmp_path / "si")
    told = CliRunner().invoke(app, ["measure", str(tmp_path / "small"), "--units", "mm,g,us", "--field", "density=rho",
                                    "--json"])  # fmt: skip
    assert told.exit_code == 0, told.output
    found = json.loads(told.output)
    assert plain.answer.startswith("body 1: perforated")
    assert found["time"] == pytest.approx(2e-5)
    for name, result in plain.results.items():
        value = found["measures"][name]["value"]
        assert value is None if result.value is None else value == pytest.approx(result.value, rel=1e-9)
    assert plain["residual_velocity"].value == pytest.approx(1000.0)


@pytest.mark.parametrize(("unit", "likely"), [
    ((1e-2, 1e-3, 1e-6), "cm,g,us"), ((1e-3, 1e-3, 1e-6), "mm,g,us"), ((1e-3, 1.0, 1e-3), "mm,kg,ms"),
    ((1e-3, 1e3, 1.0), "mm,t,s")])  # fmt: skip
def test_densities_that_no_solid_has_in_si_are_refused_with_the_likely_units(tmp_path, unit, likely):
    shot(tmp_path / "s.vtp", 0.0, unit=unit)
    with pytest.raises(OutputError, match=f"give --units {likely},"):
        read_snapshot(tmp_path / "s.vtp")
    told = CliRunner().invoke(app, ["measure", str(tmp_path / "s.vtp"), "--units", likely])
    assert told.exit_code == 0, told.output


def test_what_is_said_wrongly_is_refused(tmp_path):
    path = tmp_path / "s.vtp"
    shot(path, 0.0)
    for words, text in ((["--units", "mm,us,g"], "--units"), (["--units", "mm"], "--units"),
                        (["--field", "density"], "--field"), (["--field", "densty=rho"], "density"),
                        (["--field", "density=roh"], "rho")):  # fmt: skip
        told = CliRunner().invoke(app, ["measure", str(path), *words])
        assert told.exit_code != 0
        assert text in told.output + str(told.exception)


@pytest.mark.parametrize(("name", "value"), [
    ("position", np.nan), ("position", np.inf), ("position", 1e300), ("mass", 0.0), ("mass", np.nan),
    ("density", -1.0)])  # fmt: skip
def test_points_that_no_matter_has_are_refused_by_every_command(tmp_path, name, value):
    points, fields = np.random.default_rng(0).random((20, 3)), {"mass": np.ones(20), "density": np.full(20, 2700.0)}
    (points if name == "position" else fields[name])[3] = value
    with pytest.raises(OutputError, match=f"the {name} of point 3 is"):
        snapshot_of_another_code(points, fields, {})


def test_a_gauge_that_holds_text_is_refused(tmp_path):
    (tmp_path / "history.csv").write_text("time,gauge.rear.pressure\n0,1e9\n1e-6,abc\n")
    with pytest.raises(OutputError, match=r"gauge\.rear\.pressure holds text in place of numbers"):
        read_history(tmp_path)
