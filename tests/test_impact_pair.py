"""The two bodies that meet first, and their closing speed, in any order and place."""

import numpy as np
import pytest
from small_runs import METAL

from hvisph.casefile.loader import load_case
from hvisph.precheck.impact_pair import impact_pair, plane_shock
from hvisph.precheck.regime import regime

COPPER = "copper-ofhc"


def case_of(kinematics, **bodies):
    return load_case({"kinematics": kinematics, "resolution": 0.4e-3, "bodies": bodies, "time": {"end": 1e-6}})


def disc(velocity=(0.0, 0.0), **more):
    return {"material": METAL, "shape": {"type": "disc", "diameter": 4e-3}, "velocity": list(velocity)} | more


def box(width, height, velocity=(0.0, 0.0), **more):
    return {"material": METAL, "shape": {"type": "box", "size": [width, height]}, "velocity": list(velocity)} | more


@pytest.mark.parametrize(
    ("bodies", "first", "second", "speed"),
    [
        ({"ball": disc((2000.0, 0.0)), "plate": box(2e-3, 2e-2)}, "ball", "plate", 2000.0),
        ({"plate": box(2e-3, 2e-2), "ball": disc((-2000.0, 0.0))}, "ball", "plate", 2000.0),
        # falls on a plate that lies below, beside a third that it does not meet
        (
            {"floor": box(3e-2, 2e-3, position=[0, -1e-3]), "ball": disc((0.0, -900.0), position=[0, 3e-3]),
             "post": box(2e-3, 2e-3, position=[1e-2, 4e-3])},
            "ball", "floor", 900.0,
        ),
        # oblique: across the face of the plate
        ({"ball": disc((2000.0, 3464.0)), "plate": box(2e-3, 2e-2)}, "ball", "plate", 2000.0),
        # what flies together does not meet; the one ahead does
        (
            {"sabot": box(4e-3, 4e-3, (700.0, 0.0)), "flyer": box(2e-3, 4e-3, (700.0, 0.0)), "plate": box(2e-3, 2e-2)},
            "flyer", "plate", 700.0,
        ),
        # three in a row, the last of which comes back at the second
        (
            {"a": box(2e-3, 4e-3), "b": box(2e-3, 4e-3, gap=4e-3), "c": box(2e-3, 4e-3, (-50.0, 0.0), gap=1e-3)},
            "c", "b", 50.0,
        ),
    ],
    ids=["row", "from the right", "downward", "oblique", "together", "last"],
)  # fmt: skip
def test_who_meets(bodies, first, second, speed):
    case = case_of("plane_strain", **bodies)
    met = impact_pair(case)
    assert (met.first, met.second) == (first, second)
    assert met.velocity == pytest.approx(speed, rel=1e-12)
    assert regime(case).velocity == met.velocity
    shock, _ = plane_shock(case)
    # one metal: the interface moves at half of the speed
    assert shock.interface_velocity == pytest.approx(speed / 2, rel=1e-9)


@pytest.mark.parametrize(
    "bodies",
    [
        {"ball": disc((-2000.0, 0.0)), "plate": box(2e-3, 2e-2)},
        {"ball": disc((2000.0, 0.0), position=[-1e-2, 2e-2]), "plate": box(2e-3, 1e-2, position=[0, 0])},
        {"ball": disc(), "plate": box(2e-3, 2e-2)},
        {"ball": disc((0.0, 100.0)), "plate": box(2e-3, 2e-2)},
    ],
    ids=["away", "past", "still", "along"],
)
def test_nobody_meets(bodies):
    case = case_of("plane_strain", **bodies)
    assert impact_pair(case) is None
    assert "approach" in plane_shock(case)[1]


def test_of_core_and_jacket_that_strike_at_once_the_stiffer_counts():
    round_about = {"position": [-4e-3, 0.0], "velocity": [800.0, 0.0]}
    case = case_of(
        "axisymmetric",
        jacket={"material": COPPER,
                "shape": {"type": "tube", "outer_diameter": 8e-3, "inner_diameter": 5e-3, "length": 8e-3}} | round_about,
        core={"material": "tungsten", "shape": {"type": "cylinder", "diameter": 5e-3, "length": 8e-3}} | round_about,
        plate={"material": METAL, "shape": {"type": "cylinder", "diameter": 3e-2, "length": 4e-3}, "position": [2e-3, 0]},
    )  # fmt: skip
    met = impact_pair(case)
    assert (met.first, met.second, met.velocity) == ("core", "plate", 800.0)
    assert "ballistic" in regime(case).words or "shock" in regime(case).words


@pytest.mark.parametrize(("diameter", "meets"), [(4e-3, False), (6e-3, False), (7e-3, True)])
def test_what_fits_a_tube_does_not_strike_it(diameter, meets):
    plug = {"material": METAL, "shape": {"type": "cylinder", "diameter": diameter, "length": 4e-3},
            "velocity": [300.0, 0.0], "position": [-1e-2, 0.0]}  # fmt: skip
    tube = {"material": METAL, "shape": {"type": "tube", "inner_diameter": 6e-3, "outer_diameter": 1e-2,
                                         "length": 1e-2}, "position": [0.0, 0.0]}  # fmt: skip
    assert (impact_pair(case_of("axisymmetric", plug=plug, tube=tube)) is not None) == meets


@pytest.mark.parametrize("whole", [0.0, 37.0, 90.0, 200.0])
def test_an_oblique_plate_is_met_across_its_face_however_the_shot_is_turned(whole):
    turn, tilted = np.radians(whole), np.radians(whole + 30.0)
    ahead = np.array([np.cos(turn), np.sin(turn)])
    case = case_of(
        "plane_strain",
        ball=disc((900.0 * ahead).tolist(), position=(-1e-2 * ahead).tolist(), rotation=whole),
        plate=box(2e-3, 2e-2, position=[0.0, 0.0], rotation=float(np.degrees(tilted))),
    )
    assert impact_pair(case).velocity == pytest.approx(900.0 * np.cos(np.radians(30.0)), rel=1e-12)


def test_an_oblique_plate_of_a_row_is_met_across_its_face():
    plate = {"material": METAL, "shape": {"type": "box", "size": [2e-3, 1e-2, 1e-2]}}
    ball = {"material": METAL, "shape": {"type": "sphere", "diameter": 4e-3}, "velocity": [800.0, 0.0, 0.0]}
    turn = {"angle": 60.0, "axis": [0, 1, 0]}
    assert impact_pair(case_of("three_d", ball=ball, plate=plate | {"rotation": turn})).velocity == pytest.approx(400.0)


def test_a_field_of_velocities_moves_a_body_as_its_middle(tmp_path):
    (tmp_path / "bend.csv").write_text("x,y,u,v\n-4e-3,-2e-3,100,0\n-4e-3,2e-3,200,0\n0,-2e-3,100,0\n0,2e-3,200,0\n")
    table = {"type": "table", "file": str(tmp_path / "bend.csv")}
    around = {"type": "spin", "rate": 1e5, "centre": [0.0, 1e-2]}  # its middle at 2 mm, 10 mm below the centre
    for field, speed in ((table, 150.0), (around, 1000.0), ({"type": "spin", "rate": 1e5}, None)):
        met = impact_pair(case_of("plane_strain", a=box(4e-3, 4e-3, initial_velocity=[field]), b=box(2e-3, 2e-2)))
        assert met is None if speed is None else met.velocity == pytest.approx(speed, rel=1e-9)
