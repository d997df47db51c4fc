"""Bodies of orthotropic solids and fabrics: shear waves, waves off the axes, a disc in rotation, a cloth that is struck
transversely, a turned body; axes and modes in files and pictures; areal densities. Resumed runs are in
`test_checkpoint`, processes in `test_processes`."""

import h5py
import numpy as np
import pytest
from matplotlib.image import imread
from small_runs import CLOTH, struck_laminate
from test_anisotropy import FAR, RAW, SOLID, SPACING, Point, about, tensor
from typer.testing import CliRunner

from hvisph.casefile.loader import dump_case, load_case
from hvisph.cli.main import app
from hvisph.compiler.jit import python_twin
from hvisph.compiler.tensors3d import quaternion_rotation
from hvisph.core.errors import CaseError
from hvisph.materials.porosity import Porosity
from hvisph.materials.strength import Fabric
from hvisph.output.reader import list_snapshots, read_snapshot
from hvisph.setup.build import build
from hvisph.simulation.run import run
from hvisph.visualization.particles import Look, Moment, view_picture

MATRIX = python_twin(quaternion_rotation)


def stepped(setup, end, step=None, watch=lambda time: None):
    """Step a built case to `end` [s], with `step` [s] or the step that is allowed; call `watch` after each."""
    stepper, criteria, time = setup.stepper, setup.criteria, 0.0

    def limit(most):
        found = criteria.limit(stepper.lengths, stepper.signals, stepper.rates, stepper.place, stepper.particles.id)
        return step or min(found.dt, most)

    stepper.start()
    now = limit(np.inf)
    stepper.predict(now)
    while time < end:
        stepper.evaluate()
        following = limit(1.1 * now)
        stepper.complete(now, following)
        time, now = time + now, following
        watch(time)


# Material axes along x and y, the component of x or y that moves, speed, and how well it is known: the start, a step
# within a spacing, rings for some spacings more where the wave is slow.
SLANTED = np.array([1.0, 1.0, 0.0]) / np.sqrt(2.0)
POLARISED = [((0, 1, 0), (0, 0, 1), 1, 1633.0, 0.04), ((1, 0, 0), (0, 0, 1), 1, 2000.0, 0.04),
             ((1, 0, 0), (0, 1, 0), 1, 2309.4, 0.04), (SLANTED, (-SLANTED[0], SLANTED[0], 0), 0, 5126.1, 0.02)]  # fmt: skip


# With twice the spacings all four are within 1 %.
@pytest.mark.parametrize("spacings", [36, pytest.param(72, marks=pytest.mark.slow)])
@pytest.mark.parametrize(("along", "across", "moving", "speed", "tolerance"), POLARISED)
def test_shear_waves_and_a_wave_between_the_axes(along, across, moving, speed, tolerance, spacings):
    # Half of a strip between planes moves in the polarisation of a wave along x; what momentum passes its middle is
    # rho c u/2 t, until waves come in from the free sides.
    triad = np.array([along, across, np.cross(along, across)])  # x, y, z in material components
    size, up = np.array([spacings, spacings, 6]) * SPACING, 5.0
    squares, modes = np.linalg.eigh(SOLID.christoffel(triad[0]) / 1500.0)
    k = np.argmin(np.abs(np.sqrt(squares) - speed))
    assert np.sqrt(squares[k]) == pytest.approx(speed, abs=0.1)
    polarised = triad @ modes[:, k]
    polarised *= np.sign(polarised[moving])
    fast = np.sqrt(np.linalg.eigvalsh(SOLID.christoffel(triad[1]))[2] / 1500.0)
    one, two, _ = triad.T.tolist()
    planes = [{"axis": "z", "at": s * size[2] / 2, "keep": side} for s, side in ((-1, "above"), (1, "below"))]
    block = {"material": RAW, "position": [0, 0, 0], "axes": {"one": one, "two": two},
             "shape": {"type": "box", "size": size.tolist()}}  # fmt: skip
    setup = build(load_case({"kinematics": "three_d", "resolution": SPACING, "time": {"end": 1e-5}, "symmetry": planes,
                             "bodies": {"block": block} | FAR}))  # fmt: skip
    particles = setup.particles
    x = particles["position"]
    middle = particles.id[(np.abs(x[:, 1]) < 3 * SPACING) & (x[:, 0] > 0.0)]
    particles["velocity"] = np.where((x[:, :1] < 0.0) & (x[:, :1] > -0.1), up, 0.0) * polarised
    path = []

    def watch(time):
        inside = np.isin(particles.id, middle)
        path.append((time, (particles["mass"][inside] * (particles["velocity"][inside] @ polarised)).sum()))

    stepped(setup, 14 / 36 * spacings * SPACING / fast, watch=watch)
    times, momenta = np.array(path).T
    late = times > 0.4 * times[-1]
    rate = np.polyfit(times[late], momenta[late], 1)[0]
    tolerance = tolerance if spacings == 36 else 0.01
    assert 2.0 * rate / (1500.0 * up * 6 * SPACING * size[2]) == pytest.approx(speed, rel=tolerance)


HASHIN = {"type": "hashin", "fibre_tension": 1.2e9, "fibre_compression": 1e9, "matrix_tension": 6e7,
          "matrix_compression": 2e8, "shear": 8e7, "transverse_shear": 7e7}  # fmt: skip


@pytest.mark.parametrize("formulation", ["riemann", "eulerian", "total_lagrangian"])
def test_a_turned_body_gives_the_turned_result(formulation):
    ends = []
    for degrees in (0, 37):
        turn = about((1, 2, 3), np.radians(degrees))
        body = {"material": RAW | {"damage": HASHIN}, "shape": {"type": "box", "size": [4e-3] * 3}, "position": [0, 0, 0],
                "axes": {"one": "x", "two": "y"}, "rotation": {"angle": f"{degrees} deg", "axis": [1, 2, 3]}}  # fmt: skip
        setup = build(load_case({"kinematics": "three_d", "resolution": 0.5e-3, "formulation": {"type": formulation},
                                 "bodies": {"block": body}, "time": {"end": 1e-6, "step": 1e-8}}))  # fmt: skip
        p = setup.particles
        gradient = 4e4 * np.random.default_rng(2).normal(size=(3, 3))
        p["velocity"] = p["position"] @ turn @ gradient.T @ turn.T
        stepped(setup, 1.95e-7, 1e-8)
        order = np.argsort(p.id)
        stress = turn.T @ np.array([tensor(s) for s in p["deviator"][order]]) @ turn
        axes = turn.T @ np.array([np.reshape(MATRIX(tuple(q)), (3, 3)) for q in p["material_axes"][order]])
        ends.append([p["velocity"][order] @ turn, stress, axes, p["density"][order], p["failure_modes"][order]])
    for straight, other in zip(*ends, strict=True):
        assert np.abs(straight - other).max() <= 1e-12 * np.abs(straight).max()
    assert (ends[0][-1] > 0.0).any()


def test_yarns_turn_as_material_lines():
    # Out-of-plane shear by gamma stretches a yarn to sqrt(1 + gamma^2) and turns it by atan(gamma); R turns by half.
    gamma, steps = 0.3, 200
    point = Point(Fabric((20e9, 10e9), (4e9, 4e9)), porosity=Porosity(3.0, 1e6, 1e9))
    for _ in range(steps):
        shear = np.zeros((3, 3))
        shear[2, 0] = gamma / steps
        stress = point.step(shear)
    line = np.array([1.0, 0.0, gamma]) / np.sqrt(1.0 + gamma**2)
    assert MATRIX(point.axes[:4])[0::3] == pytest.approx(line, abs=gamma / steps)  # first order in the step
    tension = 20e9 * 0.5 * np.log(1.0 + gamma**2)
    assert line @ stress @ line == pytest.approx(tension, rel=0.01)


def smith(strain, c):
    """Return the velocity [m/s] that strains a yarn with waves of `c` [m/s] so, struck transversely."""
    return c * np.sqrt(2.0 * strain * np.sqrt(strain * (1.0 + strain)) - strain**2)


def test_a_cloth_that_is_struck_transversely(tmp_path):
    # Smith, McCrackin & Schiefer 1958, Text. Res. J. 28, 288: strain and inflow behind the longitudinal wave, and the
    # kink, which runs at c sqrt(e/(1 + e)) along the yarn. Force over modulus is ln(1 + e)/(1 + e) here, 3 % below e.
    strain, c, length, dx = 0.02, np.sqrt(20e9 / 900.0), 40e-3, 0.4e-3
    end, width = 0.8 * length / c, 6 * dx
    planes = [{"axis": "z", "at": side * width / 2, "keep": keep} for side, keep in ((-1, "above"), (1, "below"))]
    strong = CLOTH | {"strength": CLOTH["strength"] | {"tensile_strength": [4e9, 4e9]}}
    case = load_case({
        "kinematics": "three_d", "resolution": dx, "symmetry": [*planes, {"axis": "y", "at": 0.0, "keep": "above"}],
        "bodies": {"strip": {"material": strong, "position": [0, 0, 0], "axes": {"one": "y", "two": "z"},
                             "shape": {"type": "box", "size": [4 * dx, 2 * length, width]}}},
        "clamped": [{"box": {"max": [1, 1.5 * dx, 1]}, "velocity": [smith(strain, c), 0, 0]}],
        "time": {"end": end}, "output": {"every": end},
    })  # fmt: skip
    before, now = (read_snapshot(file) for file in list_snapshots(run(case, tmp_path / "run", threads=1).folder))
    y, fields = before.fields["position"][:, 1], now.fields
    kink = c * np.sqrt(strain / (1.0 + strain)) * end
    flat = (y > 2.0 * kink) & (y < 0.5 * c * end)
    pulled = (fields["deviator"][:, :3].sum(axis=1) * 900.0 / fields["density"])[flat].mean()
    assert pulled == pytest.approx(20e9 * strain, rel=0.05)
    assert -fields["velocity"][flat, 1].mean() == pytest.approx(c * strain, rel=0.08)
    # the momentum across is that of what the kink has passed; it is four layers wide
    across = (fields["mass"] * fields["velocity"][:, 0]).sum() / fields["mass"].sum() * length
    assert across == pytest.approx(kink * smith(strain, c), rel=0.15)


@pytest.fixture(scope="module")
def struck(tmp_path_factory):
    """The folder of a run with orthotropic and fabric bodies, its snapshots in both formats."""
    case = struck_laminate(output={"every": 1.5e-6, "formats": ["hdf5", "vtu"]})
    return run(case, tmp_path_factory.mktemp("struck") / "run", threads=1).folder


def test_axes_and_modes_are_in_files_and_pictures(struck, tmp_path):
    first, last = (read_snapshot(path) for path in list_snapshots(struck))
    axes, modes = (last.fields[name] for name in ("material_axes", "failure_modes"))
    bodies = [last.body == k for k in range(3)]
    # 120 degrees about their diagonal turn x, y, z into y, z, x
    assert np.abs(first.fields["material_axes"][~bodies[0]] @ np.full(4, 0.5)) == pytest.approx(1.0, abs=1e-12)
    assert np.linalg.norm(axes, axis=1) == pytest.approx(np.where(bodies[0], 0.0, 1.0), abs=1e-12)  # metal has none
    assert not modes[bodies[0]].any()
    assert all((modes[one] > 0.0).any() and set(modes[one]) <= set(range(8)) for one in bodies[1:])
    h5, vtu = struck / "snapshots" / "000001.vtkhdf", struck / "vtu" / "000001.vtu"
    other = read_snapshot(vtu)
    for name in ("material_axes", "failure_modes"):
        np.testing.assert_array_equal(other.fields[name], last.fields[name])
    with h5py.File(h5) as file:
        stored = {one: file["VTKHDF/PointData"][one] for one in ("material_axes", "failure_modes")}
        assert [one.attrs["units"] for one in stored.values()] == ["", ""]
        assert "fibre" in stored["failure_modes"].attrs["meaning"]
    for field in ("failure_modes", "material_axes_x"):
        image = imread(view_picture([Moment(last)], tmp_path / f"{field}.png", Look(field)))[..., :3]
        assert (image.min(axis=2) < 0.9).mean() > 0.02


def test_check_prints_areal_densities(tmp_path):
    (tmp_path / "case.yaml").write_text(dump_case(struck_laminate()))
    found = CliRunner().invoke(app, ["check", str(tmp_path / "case.yaml")])
    assert found.exit_code == 0, found.output
    said = " ".join(found.output.split())
    for words in ("0.135 g/cm^2", "0.3 g/cm^2"):  # 1.5 mm of 900 kg/m^3, 2 mm of 1500
        assert words in said


def test_the_elastic_variant_is_refused():
    # It extrapolates stress with isotropic moduli.
    case = struck_laminate(formulation={"type": "riemann", "variant": "elastic"})
    with pytest.raises(CaseError, match="isotropic moduli"):
        build(case)
