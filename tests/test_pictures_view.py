"""Pictures of all particles: what hides what, copies at mirrors, and the commands that draw them."""

import numpy as np
import pytest
from typer.testing import CliRunner

from hvisph.casefile.loader import load_case
from hvisph.cli.main import app
from hvisph.output.reader import list_snapshots, read_snapshot
from hvisph.simulation.run import run
from hvisph.visualization.camera import copies, revolve, rotate_view, visible_discs


def brute(place, radius, extent, width):
    """The nearest disc at every pixel, one by one."""
    left, right, bottom, top = extent
    scale = width / (right - left)
    height = round((top - bottom) * scale)
    index, depth = np.full((height, width), -1), np.full((height, width), -np.inf)
    reach = max(radius * scale, 0.5)
    for k, (x, y, z) in enumerate(place):
        column, row = np.rint((x - left) * scale - 0.5), np.rint((y - bottom) * scale - 0.5)
        for r in range(height):
            for c in range(width):
                square = reach**2 - (r - row) ** 2 - (c - column) ** 2
                if square >= 0.0 and z * scale + np.sqrt(square) > depth[r, c]:
                    index[r, c], depth[r, c] = k, z * scale + np.sqrt(square)
    return index


@pytest.mark.parametrize("radius", [0.01, 0.08, 0.2])
def test_the_nearest_disc_is_seen_at_every_pixel(radius):
    place = np.random.default_rng(4).random((60, 3))
    extent = (-0.1, 1.1, -0.1, 1.0)
    assert np.array_equal(visible_discs(place, radius, extent, 48).index, brute(place, radius, extent, 48))


def test_turning_keeps_lengths_and_looks_where_it_says():
    x = np.random.default_rng(5).random((20, 3))
    assert np.allclose(np.linalg.norm(rotate_view(x, 37.0, 20.0), axis=1), np.linalg.norm(x, axis=1), rtol=1e-13)
    assert np.allclose(rotate_view(x, 0.0, 0.0), x)
    front = rotate_view(np.eye(3), -90.0, 0.0)  # along the shot: x comes towards the eye, z goes to the left
    assert np.allclose(front, [[0, 0, 1], [0, 1, 0], [-1, 0, 0]], atol=1e-15)


def test_copies_and_rings_stand_for_the_whole():
    x = np.random.default_rng(6).random((10, 3))
    place, owner = copies(x, (1, 2))
    assert len(place) == 40
    assert np.allclose(np.abs(place), np.abs(x[owner]))
    assert np.allclose(place[:, 1:].sum(axis=0), 0.0, atol=1e-13)
    rings = np.column_stack([np.linspace(0.0, 1.0, 8), np.linspace(0.0, 2.0, 8)])
    place, owner = revolve(rings, 0.05)
    assert np.allclose(np.hypot(place[:, 1], place[:, 2]), rings[owner, 1], rtol=1e-13)
    assert np.allclose(np.bincount(owner), np.maximum((2.0 * np.pi * rings[:, 1] / 0.05).astype(int), 1))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A coarse impact in plane strain."""
    case = load_case("al_al_coarse", ["time.end=1us", "output.every=0.5us"], "0.5 mm")
    return run(case, tmp_path_factory.mktemp("view") / "impact").folder


def test_a_picture_shows_the_extent_of_what_there_is():
    """A few particles fly far ahead, and belong to the cloud."""
    from hvisph.output.snapshot import Snapshot

    rng = np.random.default_rng(7)
    cloud = rng.normal(size=(5000, 3)) * [1.0, 0.5, 0.5]
    cloud[:2] = [[9.0, 0.0, 0.0], [0.0, 7.0, 0.0]]
    zero = np.zeros(5000, int)
    shot = Snapshot(
        0.0, 0, 3, {"position": cloud}, zero, zero, np.arange(5000), ["cloud"], ["metal"], {"spacing": 0.01}
    )
    shows_it_all(shot, ())


def shows_it_all(shot, planes):
    """At least 95 % of the extent of all particles is in the picture, seen from the side, the front or turned."""
    from hvisph.visualization.particles import Look, Moment, _project, extent_of

    for view in ("side", "front", "3d"):
        moments, look = [Moment(shot, planes)], Look(view=view)
        projected = [_project(moment, look) for moment in moments]
        left, right, bottom, top = extent_of(projected, moments, look)
        low, high = projected[0][0].min(axis=0), projected[0][0].max(axis=0)
        assert min(right, high[0]) - max(left, low[0]) >= 0.95 * (high[0] - low[0])
        assert min(top, high[1]) - max(bottom, low[1]) >= 0.95 * (high[1] - low[1])


@pytest.mark.parametrize("kind", ["rings", "quarter"])
def test_the_cloud_of_a_whipple_shield_is_in_the_picture(kind, tmp_path):
    cut = "{base: aluminium-howell-ball, damage: {type: pressure_cutoff, pressure: -2 GPa, permanent: true}}"
    settings = ["time.end=3us", "output.every=1us", "bodies.bumper.shape.diameter=12 mm",
                "bodies.wall.shape.diameter=14 mm", f"bodies.projectile.material={cut}", f"bodies.bumper.material={cut}",
                "formulation={type: eulerian}"]  # fmt: skip
    name = {"rings": "shapes/whipple_shield_axisymmetric", "quarter": "shapes/whipple_shield"}[kind]
    shot = run(load_case(name, settings, "0.33 mm"), tmp_path / "shield")
    assert shot.summary["answer"].startswith("bumper: perforated")
    assert shot.summary["cloud"]["measures"]["cloud_mass"]["value"] > 0.0
    for path in list_snapshots(shot.folder):
        shows_it_all(read_snapshot(path), () if kind == "rings" else (1, 2))


@pytest.mark.parametrize(
    "options",
    [["--at", "0us,1us"], ["--field", "velocity_x", "--view", "3d"], ["--field", "body"],
     ["--field", "pressure", "--range", "0,1e9", "--zoom", "2"], ["--bodies", "target"], ["--log", "--field", "internal_energy"]],
)  # fmt: skip
def test_pictures_are_drawn(folder, tmp_path, options):
    target = tmp_path / "picture.png"
    result = CliRunner().invoke(app, ["plot", str(folder), *options, "-o", str(target)])
    assert result.exit_code == 0, result.output
    assert target.stat().st_size > 10_000


def test_an_animation_has_all_moments(folder, tmp_path):
    from PIL import Image

    target = tmp_path / "run.gif"
    assert CliRunner().invoke(app, ["animate", str(folder), "-o", str(target)]).exit_code == 0
    assert Image.open(target).n_frames == 3


@pytest.mark.parametrize(
    ("options", "said"),
    [(["--field", "presure"], "did you mean 'pressure'"), (["--view", "top"], "no view"), (["--range", "2,1"], "lower"),
     (["--zoom", "0"], "factor"), (["--bodies", "targt"], "did you mean"), (["--at", "2 mm"], "time")],
)  # fmt: skip
def test_what_cannot_be_drawn_is_said(folder, options, said, tmp_path):
    result = CliRunner().invoke(app, ["plot", str(folder), *options, "-o", str(tmp_path / "p.png")])
    assert result.exit_code == 2
    assert said in result.output


@pytest.mark.parametrize("turn", [0.0, 2.0, 30.0, -45.0, 70.0, -70.0])
def test_an_oblique_plate_is_seen_from_where_it_is_struck(turn):
    """The eye stands before the struck face of a half of the model; a plate across the shot shows what flies behind it."""
    from hvisph.visualization.camera import facing_the_struck_side, rotate_view

    grid = np.stack(np.meshgrid([0.0, 1.0], np.arange(-14.0, 15.0), np.arange(10.0), indexing="ij"), -1).reshape(-1, 3)
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    plate = grid @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    position = np.concatenate([plate, [[-5.0, 0.0, 1.0], [-5.0, 0.0, 2.0]]])
    velocity = np.zeros_like(position)
    velocity[-2:] = [2000.0, 0.0, 30.0]
    seen_from = facing_the_struck_side(position, velocity, np.ones(len(position)), (2,))
    if abs(turn) < 5.0:
        assert seen_from is None
        return
    assert rotate_view(np.array([[-c, -s, 0.0]]), *seen_from)[0, 2] > 0.2
    assert facing_the_struck_side(position, 0.0 * velocity, np.ones(len(position)), (2,)) is None
