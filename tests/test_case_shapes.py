"""Cases of shapes: planes that keep mass, contact where surfaces touch, velocities, spacings, pictures, the bundled ones."""

import math
from dataclasses import replace

import numpy as np
import pytest

from hvisph.casefile.loader import bundled_cases, load_case
from hvisph.core.errors import CaseError
from hvisph.precheck.advice import advice
from hvisph.precheck.estimate import estimate, rough_count
from hvisph.precheck.impact_pair import first_contact, impact_pair
from hvisph.setup.bodies import placed_bodies
from hvisph.setup.build import build
from hvisph.setup.shapes import initial_velocity
from hvisph.visualization.setup import DrawnBody, Setup, setup_figure, setup_picture

METAL = "aluminium-howell-ball"
BASE = {"kinematics": "three_d", "resolution": "0.5 mm", "time": {"end": "1 us"}}
PLANE = {"kinematics": "plane_strain", "resolution": "0.25 mm", "time": {"end": "1 us"}}
PLATE = {"material": METAL, "shape": {"type": "box", "size": ["2 mm", "20 mm"]}}


def body(shape, **more):
    return {"material": METAL, "shape": shape} | more


def disc(**more):
    return body({"type": "disc", "diameter": "5 mm"}, **more)


def masses(data):
    return np.array([b.volumes.sum() for b in placed_bodies(load_case(data))])


@pytest.mark.parametrize("resolution", ["0.5 mm", "0.47 mm", "0.62 mm"])
def test_halves_and_quarters_equal_the_whole(resolution):
    bodies = {
        "a": body({"type": "sphere", "diameter": "6 mm"}),
        "b": body({"type": "box", "size": ["2 mm", "15 mm", "16 mm"]}),
        "c": body({"type": "difference", "whole": {"type": "cylinder", "diameter": "14 mm", "length": "3 mm"},
                   "removed": [{"shape": {"type": "cylinder", "diameter": "5 mm", "length": "9 mm"}}]}, gap="2 mm"),
    }  # fmt: skip
    data = BASE | {"bodies": bodies, "resolution": resolution}
    whole = masses(data)
    exact = np.array([math.pi / 6 * 216, 480.0, math.pi / 4 * (196 - 25) * 3]) * 1e-9
    assert whole == pytest.approx(exact, rel=2e-4)
    for planes in ([{"axis": "y"}], [{"axis": "y"}, {"axis": "z", "keep": "below"}]):
        assert masses(data | {"symmetry": planes}) * 2 ** len(planes) == pytest.approx(whole, rel=1e-9)


def test_a_wall_is_a_plane_along_a_face():
    bar = body({"type": "cylinder", "diameter": "6 mm", "length": "12 mm"}, position=["6 mm", 0, 0])
    planes = [{"axis": "x"}, {"axis": "y"}, {"axis": "z"}]
    assert masses(BASE | {"bodies": {"bar": bar}, "symmetry": planes})[0] == pytest.approx(math.pi * 27e-9, rel=1e-9)


@pytest.mark.parametrize(("shape", "rotation"), [
    ({"type": "sphere", "diameter": "5 mm"}, 30),
    ({"type": "cylinder", "diameter": "5 mm", "length": "4 mm"}, {"angle": 20, "axis": [1, 0, 0]}),
    ({"type": "ogive", "diameter": "5 mm", "nose_length": "6 mm"}, {"angle": 180, "axis": [0, 1, 1]}),
])  # fmt: skip
def test_turned_round_bodies_are_cut_like_others(shape, rotation):
    """A turn that changes nothing of a shape, or points its axis the other way, leaves planes of symmetry what they are."""
    data = BASE | {"bodies": {"b": body(shape, position=[0, 0, 0], rotation=rotation)}}
    quarter = data | {"symmetry": [{"axis": "y"}, {"axis": "z"}]}
    assert 4.0 * masses(quarter) == pytest.approx(masses(data), rel=1e-9)
    (placed,) = placed_bodies(load_case(quarter))
    x = placed.positions[:, 0]
    if shape["type"] == "ogive":  # its nose, where there is least of it, is towards -x
        assert x.mean() > 0.5 * (x.min() + x.max())


@pytest.mark.parametrize(("shape", "more"), [
    ({"type": "box", "size": ["2 mm", "20 mm"]}, {"rotation": 30}),
    ({"type": "box", "size": ["2 mm", "20 mm"]}, {"position": [0, "1 mm"]}),
    ({"type": "polygon", "points": [[0, "-3 mm"], ["4 mm", "-3 mm"], [0, "5 mm"]]}, {}),
])  # fmt: skip
def test_bodies_that_are_not_symmetric_are_refused_with_the_remedy(shape, more):
    with pytest.raises(CaseError, match=r"bodies.b: .*leave the plane out"):
        placed_bodies(load_case(PLANE | {"bodies": {"b": body(shape, **more)}, "symmetry": [{"axis": "y"}]}))


@pytest.mark.parametrize("angle", [0.0, 20.0, 45.0, 60.0])
def test_contact_with_a_turned_plate_is_where_the_surfaces_touch(angle):
    """Its box would have it 5 mm farther away at 45 degrees: 1.6 us at 3.1 km/s."""
    bodies = {"a": disc(velocity=["3.1 km/s", 0]), "b": PLATE | {"rotation": angle, "gap": "3.1 mm"}}
    placed = placed_bodies(load_case(PLANE | {"bodies": bodies}))
    time, one, other = first_contact(placed)
    assert (one, other) == ("a", "b")
    # particles that stand in each other's way cost a third of a spacing
    assert time == pytest.approx(1e-6, abs=0.35 * 0.25e-3 / 3100 + 1e-12)


def test_a_speed_and_an_angle_become_components():
    for angle, direction in ((0, (1, 0)), ("30 deg", (math.sqrt(0.75), 0.5)), (-90, (0, -1))):
        case = load_case(PLANE | {"bodies": {"a": disc(velocity={"speed": "2 km/s", "angle": angle})}})
        assert case.bodies["a"].velocity == pytest.approx([2000 * c for c in direction], abs=1e-9)
    ball = body({"type": "sphere", "diameter": "5 mm"}, velocity={"speed": 100, "angle": 90})
    assert load_case(BASE | {"bodies": {"a": ball}}).bodies["a"].velocity == pytest.approx((0, 100, 0), abs=1e-9)
    with pytest.raises(CaseError, match="velocity"):
        load_case(PLANE | {"bodies": {"a": disc(velocity={"speed": "2 mm"})}})
    with pytest.raises(CaseError, match="a speed and an angle"):
        load_case(PLANE | {"bodies": {"a": disc(velocity={"angle": 3})}})


def test_fields_of_velocity(tmp_path):
    (tmp_path / "v.csv").write_text("x,y,u,v\n-1,-1,0,-1\n1,-1,2,-1\n-1,1,0,1\n1,1,2,1\n")
    fields = [
        {"type": "uniform", "velocity": [1, 0]},
        {"type": "spin", "rate": 100},
        {"type": "linear", "gradient": [[50, 0], [0, -50]]},
        {"type": "radial", "speed": 4, "radius": "1 mm", "power": 1},
        {"type": "table", "file": str(tmp_path / "v.csv")},
    ]
    case = load_case(PLANE | {"bodies": {"a": disc(initial_velocity=fields, position=["2 mm", "1 mm"])}})
    particles = build(case).particles
    x, y = (particles["position"] - [2e-3, 1e-3]).T
    px, py = particles["position"].T
    expected = np.stack([1 - 100 * y + 50 * x + 4e3 * x + 1 + px, 100 * x - 50 * y + 4e3 * y + py], axis=1)
    assert particles["velocity"] == pytest.approx(expected, abs=1e-12)


def test_spacings_of_their_own_carry_their_own_lengths():
    bodies = {"a": disc(), "b": PLATE | {"resolution": "0.5 mm"}}
    particles = build(load_case(PLANE | {"bodies": bodies})).particles
    h, volume = particles["smoothing_length"], particles["mass"] / particles["density"]
    assert h / np.sqrt(volume) == pytest.approx(1.2, rel=0.01)  # the default h over dx, and masses by 1 %
    assert h[particles.body == 1].min() > 1.9 * h[particles.body == 0].max() > 0
    with pytest.raises(CaseError, match="spacings of a body's own need the formulation eulerian or riemann"):
        load_case(PLANE | {"bodies": bodies, "formulation": {"type": "total_lagrangian"}})


def test_two_planes_on_one_axis():
    planes = [{"axis": "y", "at": "-5 mm"}, {"axis": "y", "at": "5 mm", "keep": "below"}]
    plate = body({"type": "box", "size": ["3 mm", "10 mm"]})
    assert masses(PLANE | {"bodies": {"a": plate}, "symmetry": planes}) == pytest.approx([30e-6])
    with pytest.raises(CaseError, match="closer than twice the kernel's support"):
        load_case(PLANE | {"bodies": {"a": plate}, "symmetry": [planes[0], planes[1] | {"at": "-4.5 mm"}]})


def test_particles_from_a_file(tmp_path):
    (tmp_path / "p.csv").write_text("x,y,mass\n0,0,2e-3\n1,0,3e-3\n0,1,5e-3\n")
    shape = {"type": "particles", "file": str(tmp_path / "p.csv"), "unit": "1 mm"}
    (placed,) = placed_bodies(load_case(PLANE | {"bodies": {"a": body(shape, position=[0, 0])}}))
    assert placed.volumes * 2785 == pytest.approx([2e-3, 3e-3, 5e-3])
    assert placed.positions.tolist() == [[0, 0], [1e-3, 0], [0, 1e-3]]
    (tmp_path / "p.csv").write_text("x,y\n0,0\n")
    with pytest.raises(CaseError, match="no column mass; it has x, y"):
        placed_bodies(load_case(PLANE | {"bodies": {"a": body(shape)}}))


@pytest.mark.parametrize("more", [{}, {"temperature": 700.0}, {"material": {"base": "copper-ofhc", "porosity": {
    "distension": 2.0, "elastic_pressure": 1e7, "solid_pressure": 1e9}}}])  # fmt: skip
def test_particles_of_a_file_weigh_what_it_says(more, tmp_path):
    """Warm and porous bodies are thinner: their particles are as much wider."""
    (tmp_path / "p.csv").write_text("x,y,mass\n0,0,2e-3\n0.5,0,3e-3\n0,0.5,2e-3\n")
    shape = {"type": "particles", "file": str(tmp_path / "p.csv"), "unit": "1 mm"}
    setup = build(load_case(PLANE | {"bodies": {"a": {"material": "copper-ofhc", "shape": shape} | more}}))
    assert setup.particles["mass"] == pytest.approx([2e-3, 3e-3, 2e-3], rel=1e-12)


@pytest.mark.parametrize(
    ("text", "unit", "said"),
    [
        ("x,y,mass\n0,0,2e-3\n1,0,2e-3\n0,1,2e-3\n1,0,2e-3\n", "1 mm", "two particles at one place, those of lines 2 and 4"),
        ("x,y,mass\n0,0,2e-3\n1,0,2e-3\n0,1,2e-3\n", "1 m", "are 1 m apart, and by their masses .* 0.000847 m wide"),
        ("", "1 mm", "is empty"),
    ],
)  # fmt: skip
def test_particles_that_cannot_be_meant_are_refused(text, unit, said, tmp_path):
    (tmp_path / "p.csv").write_text(text)
    shape = {"type": "particles", "file": str(tmp_path / "p.csv"), "unit": unit}
    with pytest.raises(CaseError, match=rf"bodies\.a\.shape\.file: .*{said}"):
        placed_bodies(load_case(PLANE | {"bodies": {"a": body(shape)}}))


def test_a_table_of_velocities_that_is_missing_is_told_with_its_place(tmp_path):
    table = {"type": "table", "file": str(tmp_path / "none.csv")}
    case = load_case(PLANE | {"bodies": {"a": PLATE | {"initial_velocity": [table]}}})
    (placed,) = placed_bodies(case)
    with pytest.raises(CaseError, match=r"bodies\.a\.initial_velocity\.0\.file: there is no file"):
        _ = placed.velocity
    assert impact_pair(case) is None


@pytest.mark.parametrize("dim", [1, 2, 3])
def test_a_picture_of_the_set_up(dim, tmp_path):
    points = np.stack(np.meshgrid(*[np.arange(4.0)] * dim, indexing="ij"), axis=-1).reshape(-1, dim) * 1e-3
    bodies = [
        DrawnBody("a", "a: copper", points, np.full(len(points), 1e-3), np.full(dim, 100.0), points[:, 0] > 2e-3),
        DrawnBody("b", "b: steel", points + 5e-3, np.full(len(points), 1e-3), np.zeros(dim), points[:, 0] < 0),
    ]
    setup = Setup("set-up", bodies, [(0, 0.0)], {"gauge": [1e-3] * dim}, ["first contact at 3 us"])
    path = setup_picture(setup, tmp_path / "setup.png")
    assert path.stat().st_size > 10_000


def test_rings_are_drawn_as_a_whole_section_and_a_view():
    points = np.stack(np.meshgrid(np.arange(4.0), np.arange(4.0) + 0.5, indexing="ij"), axis=-1).reshape(-1, 2) * 1e-3
    rod = DrawnBody("rod", "rod: copper", points, np.full(16, 1e-3), np.array([100.0, 0.0]), points[:, 0] > 2e-3)
    section, view = setup_figure(Setup("rings", [rod], axisymmetric=True)).axes
    (shown,) = section.collections
    assert len(shown.get_offsets()) == 2 * 16
    assert sorted(set(np.round(shown.get_offsets()[:, 1], 3))) == [-3.5, -2.5, -1.5, -0.5, 0.5, 1.5, 2.5, 3.5]
    # what is kilometres long and fast is told in kilometres
    large = replace(rod, positions=1e6 * rod.positions, spacing=1e6 * rod.spacing, velocity=np.array([15e3, 0.0]))
    section = setup_figure(Setup("asteroid", [large], axisymmetric=True)).axes[0]
    assert section.get_xlabel() == "x [km]"
    assert "15 km/s" in [text.get_text() for text in section.texts]
    # three quarters of each circumference, a particle a spacing
    (turned,) = view.collections
    assert len(turned.get_offsets()) == 4 * sum(int(1.5 * np.pi * r) for r in (0.5, 1.5, 2.5, 3.5))


@pytest.mark.parametrize("name", [name for name in bundled_cases() if name.startswith("shapes/")])
def test_bundled_cases_of_shapes_weigh_what_their_shapes_do(name):
    pytest.importorskip("trimesh")
    for placed in placed_bodies(load_case(name)):
        assert placed.volumes.sum() == pytest.approx(placed.requested_volume, rel=1e-9)


def test_a_mesh_of_sheet_is_named_a_unit_stands_alone_and_a_bad_file_names_its_body(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    box, inner = trimesh.creation.box((20, 20, 20)), trimesh.creation.box((17, 17, 17))
    box.export(tmp_path / "solid.stl")
    inner.invert()
    trimesh.util.concatenate([box, inner]).export(tmp_path / "shell.stl")

    def case(name):
        body = {"material": METAL, "shape": {"type": "mesh", "file": str(tmp_path / name), "unit": "mm"}}
        return load_case(
            {"kinematics": "three_d", "resolution": "1 mm", "bodies": {"part": body}, "time": {"end": 1e-6}}
        )

    assert not [text for text in advice(case("solid.stl")) if "walls" in text]
    (text,) = [text for text in advice(case("shell.stl")) if "walls" in text]
    assert "1.49 mm" in text  # 2 (20^3 - 17^3)/(6 (20^2 + 17^2))
    box.update_faces([k > 0 for k in range(12)])
    box.export(tmp_path / "open.stl")
    for asked in (rough_count, advice):
        with pytest.raises(CaseError, match=r"bodies\.part\.shape\.file: .* not closed"):
            asked(case("open.stl"))


def test_directions_may_be_letters():
    def case(axis):
        body = {"material": METAL, "shape": {"type": "box", "size": [4e-3] * 3}, "rotation": {"angle": 30, "axis": axis},
                "initial_velocity": [{"type": "spin", "rate": 10.0, "axis": axis}]}  # fmt: skip
        return load_case({"kinematics": "three_d", "resolution": "1 mm", "bodies": {"a": body}, "time": {"end": 1e-6}})

    assert case("y") == case([0, 1, 0])
    with pytest.raises(CaseError, match=r"rotation\.axis: 'w' is no axis: write x, y, z, or a direction"):
        case("w")


def test_a_body_with_a_place_is_told_where_it_stands():
    """One of a row a little off its neighbour's face is said to touch it; what has a place stands there."""
    ball = {"material": METAL, "shape": {"type": "disc", "diameter": "5 mm"}, "velocity": ["2 km/s", 0.0]}
    plate = {"material": METAL, "shape": {"type": "box", "size": ["4 mm", "20 mm"]}}
    case = {"kinematics": "plane_strain", "resolution": "0.5 mm", "time": {"end": 1e-6}}
    assert estimate(load_case(case | {"bodies": {"ball": ball, "plate": plate}})).bodies[0].along[1] == 0.0
    ball |= {"position": ["-2.4 mm", 0.0]}
    placed = {"ball": ball, "plate": plate | {"position": ["2 mm", 0.0]}}
    assert estimate(load_case(case | {"bodies": placed})).bodies[0].along == pytest.approx((-4.9e-3, 0.1e-3))


def test_fields_of_half_a_body_are_those_of_the_whole():
    def ball(field, **further):
        body = {"material": METAL, "shape": {"type": "sphere", "diameter": "6 mm"}, "position": [0.0, 0.0, 0.0],
                "initial_velocity": [field]}  # fmt: skip
        return placed_bodies(load_case({"kinematics": "three_d", "resolution": "1 mm", "bodies": {"ball": body},
                                       "time": {"end": "1 us"}} | further))[0]  # fmt: skip

    outward = {"type": "radial", "speed": 100.0, "radius": "3 mm", "power": 1}
    half = ball(outward, symmetry=[{"axis": "z"}, {"axis": "y"}])
    velocity = initial_velocity(half.model, half.positions, half.middle)
    assert velocity == pytest.approx(half.positions * 100.0 / 3e-3, rel=1e-9)
    spin = {"type": "spin", "rate": 3e4, "axis": [0.0, 0.0, 1.0]}
    ball(spin, symmetry=[{"axis": "z"}])
    with pytest.raises(CaseError, match=r"bodies.ball.initial_velocity.0.*no mirror image"):
        ball(spin, symmetry=[{"axis": "y"}])


def test_a_radial_field_of_rings_is_about_the_axis():
    ball = {"material": METAL, "shape": {"type": "sphere", "diameter": "6 mm"}, "position": [0.0, 0.0],
            "initial_velocity": [{"type": "radial", "speed": 100.0, "radius": "3 mm", "power": 1}]}  # fmt: skip
    body = placed_bodies(load_case({"kinematics": "axisymmetric", "resolution": "1 mm", "bodies": {"ball": ball},
                                   "time": {"end": "1 us"}}))[0]  # fmt: skip
    velocity = initial_velocity(body.model, body.positions, body.middle)
    assert velocity == pytest.approx(body.positions * 100.0 / 3e-3, rel=1e-9)
