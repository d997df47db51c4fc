"""Fragments as lists and shares, and histories of all measures, on bodies made by hand."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest
from measure_bodies import MM, box, snapshot

import hvisph
from hvisph.core.errors import CaseError, OutputError
from hvisph.core.measure_catalogue import CATALOGUE
from hvisph.measures.measure import debris, measure_snapshot
from hvisph.measures.measurement_frame import Scene
from hvisph.measures.tables import columns, write_fragments, write_series
from hvisph.output.hdf5 import write_hdf5
from hvisph.output.vtu import write_vtu
from hvisph.visualization.curves import KINDS, series_picture

DX = 1 * MM
# what the projectile breaks into: particles along x and their velocity
PIECES = ((10, 400.0), (6, 600.0), (6, 650.0), (3, 700.0), (1, 800.0), (1, 900.0))


def broken(dim, time=1e-5, **metadata):
    """A projectile in six pieces one behind another, each with its own velocity, and a whole plate."""
    parts, speeds, x = [], [], 20 * MM
    for count, speed in PIECES:
        low, high = [x] + [0.0] * (dim - 1), [x + count * DX] + [DX] * (dim - 1)
        parts.append(box(low, high, DX))
        speeds += [speed] * count
        x += (count + 3) * DX
    plate = box([0.0] + [-8 * MM] * (dim - 1), [2 * MM] + [8 * MM] * (dim - 1), DX)
    snap = snapshot(np.concatenate(parts), plate, time=time, dx=DX, **metadata)
    velocity = snap.fields["velocity"]
    velocity[: len(speeds), 0] = speeds
    velocity[: len(speeds), 1:] = 30.0
    return snap


@pytest.fixture
def run(tmp_path):
    """A run folder of two moments in 2D: whole, then broken."""
    folder = tmp_path / "run"
    (folder / "snapshots").mkdir(parents=True)
    whole = box([-27 * MM, 0.0], [0.0, DX], DX)
    plate = box([0.0, -8 * MM], [2 * MM, 8 * MM], DX)
    write_hdf5(folder / "snapshots/000000.h5", replace(snapshot(whole, plate, dx=DX), step=0))
    write_hdf5(folder / "snapshots/000001.h5", broken(2))
    return folder


def read(path):
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


@pytest.mark.parametrize("dim", [1, 2, 3])
def test_known_pieces(dim):
    shot, plate = debris(Scene(broken(dim)))
    particle = 2785.0 * DX**dim
    assert [piece.count for piece in shot] == [count for count, _ in PIECES]
    np.testing.assert_allclose(shot.masses, [count * particle for count, _ in PIECES])
    np.testing.assert_allclose([piece.velocity[0] for piece in shot], [speed for _, speed in PIECES])
    np.testing.assert_allclose(shot.fragments[0].speed, np.sqrt(400.0**2 + (dim - 1) * 30.0**2))
    np.testing.assert_allclose(shot.fragments[1].centre, [36 * MM, *[0.5 * MM] * (dim - 1)])
    np.testing.assert_allclose(shot.fragments[1].extent, [5 * MM, *[0.0] * (dim - 1)], atol=1e-15)
    assert shot.roles == ("main body", "", "", "", "", "")
    assert plate.roles == ("main body",)
    assert shot.number() == 3
    assert shot.number(1) == len(shot) == 6
    assert shot.mass == pytest.approx(27 * particle)
    assert shot.share([0]) == pytest.approx(10 / 27)
    assert shot.share(shot.counts == 1) == pytest.approx(2 / 27)


def test_mass_distribution():
    shot, _ = debris(Scene(broken(2)))
    particle = 2785.0 * DX**2
    found = shot.distribution
    np.testing.assert_allclose(found.mass, np.array([10, 6, 3, 1]) * particle)
    np.testing.assert_array_equal(found.number, [1, 3, 4, 6])
    np.testing.assert_allclose(found.share, np.array([10, 22, 25, 27]) / 27)
    assert found.at_mass(6 * particle) == (3, pytest.approx(22 / 27))
    assert found.at_mass(7 * particle) == (1, pytest.approx(10 / 27))
    assert found.at_mass(11 * particle) == (0, 0.0)


def test_roles_in_the_target():
    dx = 1 * MM
    plate = box([0.0, -20 * MM], [2 * MM, 20 * MM], dx)
    plate = plate[np.abs(plate[:, 1]) > 5 * MM]
    plug = box([10 * MM, -3 * MM], [12 * MM, 3 * MM], dx)
    ejecta = box([-12 * MM, -4 * MM], [-10 * MM, 4 * MM], dx)
    snap = snapshot(box([20 * MM, 0.0], [24 * MM, 4 * MM], dx), np.concatenate([plate, plug, ejecta]), dx=dx)
    x = snap.fields["position"][:, 0]
    snap.fields["velocity"][(snap.body == 1) & (x > 5 * MM), 0] = 200.0
    snap.fields["velocity"][(snap.body == 1) & (x < 0.0), 0] = -200.0
    _, target = debris(Scene(snap))
    # two halves of 30 particles, 16 thrown back, 12 punched out
    assert target.counts.tolist() == [30, 30, 16, 12]
    assert target.roles == ("main body", "attached", "", "plug")
    assert measure_snapshot(snap)["plug_velocity"].value == pytest.approx(200.0)


def test_files_without_velocity_and_mass(tmp_path):
    snap = broken(2)
    for name in ("velocity", "mass"):
        del snap.fields[name]
    write_vtu(tmp_path / "bare.vtu", snap)
    found = hvisph.measure(tmp_path / "bare.vtu")
    shot = found.fragments[0]
    assert [piece.count for piece in shot] == [count for count, _ in PIECES]
    np.testing.assert_allclose(shot.fragments[1].centre, [36 * MM, 0.5 * MM])
    plain = json.loads(json.dumps(found.fragments_as_dict(), allow_nan=False))["bodies"][0]
    assert plain["fragments"][1]["mass"] is None
    assert plain["fragments"][1]["velocity"] == [None, None]
    assert plain["largest_mass_share"] is None
    assert plain["mass_distribution"]["mass"] == []
    rows = read(write_fragments(found, tmp_path / "bare.csv"))
    assert rows[1]["particles"] == "6"
    assert rows[1]["mass [kg/m]"] == rows[1]["speed [m/s]"] == rows[1]["number_at_least"] == ""


def test_plain_form_sums_up_the_small_ones():
    found = measure_snapshot(broken(3))
    plain = json.loads(json.dumps(found.fragments_as_dict(), allow_nan=False))
    assert plain["mass_unit"] == "kg"
    shot = plain["bodies"][0]
    assert (shot["body"], shot["number"], len(shot["fragments"])) == ("projectile", 6, 3)
    smaller = shot["smaller"]
    assert (smaller["below_particles"], smaller["number"], smaller["particles"]) == (5, 3, 5)
    assert smaller["mass_share"] == pytest.approx(5 / 27)
    assert shot["single_particles"]["number"] == 2
    assert shot["mass_distribution"]["number_at_least"] == [1, 3, 4, 6]
    assert len(found.fragments_as_dict(fewest=1)["bodies"][0]["fragments"]) == 6


@pytest.mark.parametrize("dim", [1, 2, 3])
def test_fragments_come_back_from_their_csv(tmp_path, dim):
    found = measure_snapshot(broken(dim))
    rows = read(write_fragments(found, tmp_path / "fragments.csv"))
    assert len(rows) == 7
    unit = {1: "kg/m^2", 2: "kg/m", 3: "kg"}[dim]
    for row, piece in zip(rows, [*found.fragments[0], *found.fragments[1]], strict=True):
        assert (float(row["time [s]"]), int(row["particles"])) == (1e-5, piece.count)
        assert float(row[f"mass [{unit}]"]) == piece.mass
        assert float(row["speed [m/s]"]) == piece.speed
        for axis, centre, extent in zip("xyz", piece.centre, piece.extent, strict=False):
            assert float(row[f"centre_{axis} [m]"]) == centre
            assert float(row[f"extent_{axis} [m]"]) == extent
    assert [row["fragment"] for row in rows] == ["1", "2", "3", "4", "5", "6", "1"]
    assert [row["number_at_least"] for row in rows[:6]] == ["1", "3", "3", "4", "6", "6"]
    assert [row["role"] for row in rows] == ["main body", "", "", "", "", "", "main body"]
    assert float(rows[5]["mass_share_at_least"]) == pytest.approx(1.0)


def test_histories_come_back_from_their_csv(run, tmp_path):
    found = hvisph.measure(run, at="all")
    rows = read(write_series(found, tmp_path / "series.csv"))
    assert [float(row["time [s]"]) for row in rows] == [0.0, 1e-5]
    assert [int(row["step"]) for row in rows] == [0, found.step]
    for row, moment in zip(rows, found.series, strict=True):
        for name, result in moment.results.items():
            text = row[f"{name} [{result.unit}]" if result.unit else name]
            assert (None if text == "" else float(text)) == result.value
    assert [float(row["fragments.projectile.number"]) for row in rows] == [1.0, 3.0]
    assert float(rows[1]["fragments.projectile.largest_mass_share"]) == pytest.approx(10 / 27)
    assert float(rows[1]["fragments.projectile.loose_mass_share"]) == pytest.approx(5 / 27)
    assert float(rows[1]["fragments.projectile.largest_velocity_x [m/s]"]) == pytest.approx(400.0)
    assert rows[0]["plug_velocity [m/s]"] == rows[1]["void_fraction"].strip("0123456789.e-") == ""
    assert float(rows[1]["projectile.fragment_mass_fraction"]) == found.projectile["fragment_mass_fraction"].value
    layer = found.layers[0]
    lost = layer.results["mass_loss"]
    assert float(rows[1][f"layer.{layer.body}.mass_loss [{lost.unit}]"]) == lost.value
    assert not any(name.startswith("cloud.") for name in rows[0])  # nothing is perforated


def test_one_moment_is_one_row_and_no_picture(run, tmp_path):
    found = hvisph.measure(run)
    assert len(read(write_series(found, tmp_path / "series.csv"))) == 1
    assert columns(found)["fragments.projectile.number"].values.tolist() == [3.0]
    with pytest.raises(CaseError, match="one moment"):
        series_picture(found, tmp_path / "series.png")
    with pytest.raises(OutputError, match="cannot write"):
        write_series(found, tmp_path / "nowhere/series.csv")


def test_cases_without_units_have_none_in_their_header(tmp_path):
    found = measure_snapshot(broken(1, units="none"))
    assert "residual_velocity" in read(write_series(found, tmp_path / "series.csv"))[0]
    head = read(write_fragments(found, tmp_path / "fragments.csv"))[0]
    assert {"mass", "speed", "centre_x"} < head.keys()
    assert not any("[" in name for name in head)
    assert found.fragments_as_dict()["mass_unit"] == ""


def test_every_measure_has_a_panel_of_the_picture():
    assert {measure.unit for measure in CATALOGUE.values()} <= set(KINDS.values())


def test_picture_of_all_measures(run, tmp_path, monkeypatch):
    import hvisph.visualization.curves as curves

    figures = []
    store = curves.store
    monkeypatch.setattr(curves, "store", lambda figure, path: figures.append(figure) or store(figure, path))
    file = series_picture(hvisph.measure(run, at="all"), tmp_path / "series.png")
    assert file.read_bytes().startswith(b"\x89PNG")
    labels = [axis.get_ylabel() for axis in figures[0].axes]
    # no history, no pressures; no plug, and too few particles near the shot line for a lip
    expected = ["length [mm]", "velocity [m/s]", "mass [kg/m]", "momentum [N s/m]", "ratio [-]", "number [-]"]
    assert labels == expected
    velocity = figures[0].axes[1]
    residual = next(line for line in velocity.lines if line.get_label() == "projectile: largest, axial velocity")
    np.testing.assert_allclose(residual.get_xydata(), [[0.0, 3100.0], [10.0, 400.0]])
