"""The laws of motion know no place, direction, frame of reference or order of particles."""

import numpy as np
import pytest
from small_runs import DAMAGED, HARDENING, METAL, row_of

from hvisph.casefile.loader import load_case
from hvisph.output.reader import list_snapshots, read_snapshot
from hvisph.output.run_folder import RunFolder
from hvisph.setup.build import build
from hvisph.simulation.loop import Run
from hvisph.simulation.run import run, set_threads

FORMULATIONS = ["eulerian", "riemann"]
DX = 0.5e-3
STEP = 6e-9  # the same for all, so that the same steps are compared


class Quiet:
    def start(self, *_):
        pass

    progress = message = finish = compiling = start


def impact(formulation, change=None, steps=60):
    """The end of an oblique impact of three materials whose particles `change` has altered at the start."""
    case = row_of(
        [HARDENING, METAL, DAMAGED], formulation={"type": formulation}, dx=DX, speed=2000.0,
        time={"end": 1e-5, "step": STEP, "max_steps": steps}, output={"checkpoint_every": None},
        limits={"energy_drift": None, "speed_over_initial": None},
    )  # fmt: skip
    setup = build(case)
    particles = setup.particles
    particles["velocity"][particles.body == 0, 1] = 300.0
    if change is not None:
        change(particles)
    return setup, case


def end_of(formulation, folder, change=None):
    """The last snapshot of `impact`."""
    setup, case = impact(formulation, change)
    set_threads(1)
    with RunFolder.create(folder) as held:
        outcome = Run(case, setup, held, Quiet()).go()
    assert outcome.summary["status"] == "done", outcome.summary["failure"]
    return read_snapshot(list_snapshots(folder)[-1])


@pytest.fixture(scope="module", params=FORMULATIONS)
def plain(request, tmp_path_factory):
    """A formulation and the end of its impact as it stands."""
    return request.param, end_of(request.param, tmp_path_factory.mktemp("plain") / "run").fields


def assert_close(found, expected, relative):
    """All fields agree, each to `relative` of its largest value."""
    for name in (
        "position",
        "velocity",
        "density",
        "internal_energy",
        "deviator",
        "plastic_strain",
        "damage",
        "pressure",
    ):
        scale = np.abs(expected[name]).max()
        difference = np.abs(found[name] - expected[name]).max()
        assert difference <= relative * scale, f"{name}: {difference / scale:.1e}"


def turned(values, quarter_turn):
    """Vectors (n, 2) or symmetric tensors (n, 4: xx, yy, zz, xy) after a map of axes."""
    if values.ndim == 1:
        return values
    if values.shape[1] == 1:  # of an axial vector what points out of the plane
        return values * np.linalg.det(quarter_turn)
    if values.shape[1] == 2:
        return values @ quarter_turn.T
    tensor = np.zeros((len(values), 2, 2))
    tensor[:, 0, 0], tensor[:, 1, 1] = values[:, 0], values[:, 1]
    tensor[:, 0, 1] = tensor[:, 1, 0] = values[:, 3]
    tensor = quarter_turn @ tensor @ quarter_turn.T
    return np.column_stack([tensor[:, 0, 0], tensor[:, 1, 1], values[:, 2], tensor[:, 0, 1]])


def test_a_boosted_case_gives_the_same(plain, tmp_path):
    formulation, expected = plain
    boost = np.array([1234.5, -678.9])

    def boosted(particles):
        particles["velocity"] += boost

    after = end_of(formulation, tmp_path / "run", boosted)
    after.fields["velocity"] = after.fields["velocity"] - boost
    after.fields["position"] = after.fields["position"] - boost * after.time
    assert_close(after.fields, expected, 1e-9)


@pytest.mark.parametrize(
    "axes",
    [
        [[0.0, -1.0], [1.0, 0.0]],
        [[-1.0, 0.0], [0.0, -1.0]],
        [[1.0, 0.0], [0.0, -1.0]],
        [[-1.0, 0.0], [0.0, 1.0]],
    ],
    ids=["quarter_turn", "half_turn", "mirrored_y", "mirrored_x"],
)
def test_a_turned_or_mirrored_case_gives_the_same(axes, plain, tmp_path):
    formulation, expected = plain
    axes = np.array(axes)

    def change(particles):
        particles["position"] = particles["position"] @ axes.T
        particles["velocity"] = particles["velocity"] @ axes.T

    after = end_of(formulation, tmp_path / "run", change)
    fields = {name: turned(values, axes.T) for name, values in after.fields.items()}
    assert_close(fields, expected, 1e-10)


def test_a_translated_case_gives_the_same(plain, tmp_path):
    formulation, expected = plain
    shift = np.array([0.37, -1.9])  # metres, for a body of millimetres: positions keep 12 of their digits

    def change(particles):
        particles["position"] += shift

    after = end_of(formulation, tmp_path / "run", change)
    after.fields["position"] = after.fields["position"] - shift
    assert_close(after.fields, expected, 1e-9)


def test_renumbered_particles_give_the_same(plain, tmp_path):
    formulation, expected = plain
    shuffled = np.random.default_rng(5).permutation(len(expected["density"]))
    after = end_of(formulation, tmp_path / "run", lambda particles: particles.permute(shuffled))
    assert_close(after.fields, expected, 1e-10)


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_any_number_of_threads_gives_the_same_bits(formulation, tmp_path):
    # more particles than one thread's chunk, or there would be nothing to share
    case = load_case("al_al_coarse", ["time.max_steps=40", f"formulation={{type: {formulation}}}"], resolution="0.2 mm")
    for threads in (1, 2):
        run(case, tmp_path / str(threads), threads=threads)
    for name in ("history.csv", "snapshots/000000.vtkhdf", "snapshots/000001.vtkhdf"):
        assert (tmp_path / "1" / name).read_bytes() == (tmp_path / "2" / name).read_bytes()
