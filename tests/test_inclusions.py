"""Spheres of a second material in a body: masses, sizes, places, the same for any spacing and turn; errors."""

import numpy as np
import pytest
from small_runs import assert_same_results, final

from hvisph.casefile.loader import load_case
from hvisph.core.errors import CaseError
from hvisph.geometry.placement import ball_volume, draw_diameters, owner_of, place_spheres
from hvisph.geometry.shapes import Sphere
from hvisph.setup.bodies import placed_bodies
from hvisph.setup.build import build
from hvisph.simulation.run import resume, run

SOIL = {"name": "soil", "density": 2000.0, "eos": {"type": "linear", "bulk_modulus": 1e9},
        "strength": {"type": "rock", "shear_modulus": 5e8, "cohesion": 1e5, "friction": 0.6}}  # fmt: skip
STONE = SOIL | {"name": "stone", "density": 3000.0, "eos": {"type": "linear", "bulk_modulus": 3e10}}
BOULDERS = {"material": STONE, "diameters": [1.0, 3.0], "volume": 0.25, "seed": 4}


def case_of(dim=3, dx=0.3, inclusions=None, rotation=None, **further):
    shape = {"type": "sphere", "diameter": 10.0} if dim == 3 else {"type": "disc", "diameter": 10.0}
    body = {"material": SOIL, "shape": shape, "inclusions": inclusions or BOULDERS, "position": [0.0] * dim}
    if rotation:
        body["rotation"] = rotation
    plain = {"kinematics": {2: "plane_strain", 3: "three_d"}[dim], "resolution": dx, "bodies": {"rubble": body},
             "time": {"end": 1e-4}}  # fmt: skip
    return load_case(plain | further)


@pytest.mark.parametrize("dim", [2, 3])
def test_masses_are_exact_per_material(dim):
    """25 % or, by less than the smallest sphere, below it; both materials have the density at rest."""
    setup = build(case_of(dim))
    particles, volume = setup.particles, ball_volume(10.0, dim)
    stone = particles.material == setup.materials.index("stone")
    share = particles["mass"][stone].sum() / 3000.0 / volume
    assert 0.25 - ball_volume(3.0, dim) / volume < share <= 0.25
    assert particles["mass"][~stone].sum() == pytest.approx(2000.0 * (1.0 - share) * volume, rel=1e-12)
    assert set(particles["density"][stone]) == {3000.0}
    assert set(particles["density"][~stone]) == {2000.0}
    assert set(particles.body) == {0}


def test_spheres_are_where_they_are_at_any_spacing():
    """The same centres and diameters; the seed and the body's name make others."""
    shape = Sphere(10.0)
    centres, diameters = place_spheres(shape, (1.0, 3.0), -3.0, 0.3, 1, "a")
    assert (np.diff(diameters) <= 0.0).all()
    assert (shape.distance(centres) <= -0.5 * diameters).all()
    apart = np.sqrt(((centres[:, None] - centres[None]) ** 2).sum(axis=2)) + 1e9 * np.eye(len(centres))
    assert (apart >= 0.5 * (diameters[:, None] + diameters[None])).all()
    for seed, name in ((2, "a"), (1, "b")):
        assert not np.array_equal(place_spheres(shape, (1.0, 3.0), -3.0, 0.3, seed, name)[1], diameters)
    coarse, fine = (placed_bodies(case_of(dx=dx))[0] for dx in (0.3, 0.15))
    shares = [body.volumes[-body.included :].sum() / body.volumes.sum() for body in (coarse, fine)]
    assert shares[0] == pytest.approx(shares[1], rel=1e-12)
    centre = coarse.positions[-coarse.included :].mean(axis=0), fine.positions[-fine.included :].mean(axis=0)
    assert np.allclose(*centre, atol=0.3)  # spheres of 1 m and spacings of 0.3 m: a particle more or less


def test_spheres_turn_with_the_body():
    """By 37 degrees: the owner of each particle is the one of its place before the turn."""
    turned = placed_bodies(case_of(2, rotation="37 deg"))[0]
    c, s = np.cos(np.radians(37.0)), np.sin(np.radians(37.0))
    back = turned.positions @ np.array([[c, -s], [s, c]])
    shape = turned.surface.shape
    centres, diameters = place_spheres(shape, (1.0, 3.0), -3.0, 0.25, 4, "rubble")
    inside = owner_of(back, centres, diameters) >= 0
    assert np.array_equal(np.flatnonzero(inside), np.arange(len(back) - turned.included, len(back)))


def test_numbers_follow_the_power_law():
    """N(>D) ~ D^-3 between 1 and 4: medians of 20,000 draws; the statistical error is 1 %."""
    drawn = draw_diameters((1.0, 4.0), -3.0, 2, 6e4, np.random.default_rng(1))
    share = (drawn > 2.0).mean()
    assert share == pytest.approx((2.0**-3 - 4.0**-3) / (1.0 - 4.0**-3), rel=0.05)
    assert np.isclose(drawn[0], 4.0, rtol=0.05)
    assert drawn[-1] >= 1.0


@pytest.mark.parametrize(("inclusions", "words"), [
    ({"volume": 0.6}, "0.55"),
    ({"diameters": [0.5, 3.0]}, "below three spacings, 0.9 m"),
    ({"diameters": [3.0, 1.0]}, "give the smallest first"),
    ({"diameters": [1.0, 11.0]}, "does not fit a body 10 m thick"),
    ({"volume": 1e-4}, "holds no sphere"),
    ({"diameters": [2.9, 3.0], "volume": 0.55}, "no free place"),
])  # fmt: skip
def test_what_is_refused(inclusions, words):
    with pytest.raises(CaseError, match=words):
        placed_bodies(case_of(inclusions=BOULDERS | inclusions))


@pytest.mark.parametrize(("settings", "words"), [
    ({"symmetry": [{"axis": "z"}]}, "not symmetric about a plane"),
    ({"kinematics": "axisymmetric"}, "would be tori"),
])  # fmt: skip
def test_cases_without_random_spheres(settings, words):
    body = {"material": SOIL, "shape": {"type": "sphere", "diameter": 10.0}, "inclusions": BOULDERS}
    plain = {"kinematics": "three_d", "resolution": 0.3, "bodies": {"rubble": body}, "time": {"end": 1.0}}
    with pytest.raises(CaseError, match=words):
        load_case(plain | settings)


def test_a_base_is_written_out():
    inclusions = BOULDERS | {"material": {"base": "basalt", "damage": {"type": "none"}}}
    assert case_of(inclusions=inclusions).bodies["rubble"].inclusions.material.damage.type == "none"
    with pytest.raises(CaseError, match=r"bodies.rubble.inclusions.material.base.*unknown"):
        case_of(inclusions=BOULDERS | {"material": {"base": "no such rock"}})


def test_a_run_with_inclusions_is_resumed_with_the_same_bits(tmp_path):
    """Flaws are dealt to the boulders alone; energy is kept to round-off; the body is one."""
    stone = STONE | {"damage": {"type": "grady_kipp", "weibull_k": 1e12, "weibull_m": 9.0}}
    case = case_of(2, inclusions=BOULDERS | {"material": stone}, time={"end": 4e-3}, output={"every": 1e-3})
    field = {"initial_velocity": [{"type": "radial", "speed": -5.0, "radius": 5.0, "power": 1.0}]}
    plain = case.model_dump(mode="json")
    plain["bodies"]["rubble"] |= field
    # far from all else: with it the rubble has the loops of bodies that meet
    plain["bodies"]["far"] = {"material": SOIL, "shape": {"type": "box", "size": [1.5, 1.5]}, "position": [100.0, 0.0]}
    case = load_case({key: value for key, value in plain.items() if value is not None})
    outcome = run(case, tmp_path / "whole")
    assert abs(outcome.summary["conservation"]["energy_drift"]) < 1e-12
    flaws = final(tmp_path / "whole").fields["flaws"]
    number = final(tmp_path / "whole").material
    assert (flaws[number == 1] >= 1.0).all()
    run(case.model_copy(update={"time": case.time.model_copy(update={"max_steps": 9})}), tmp_path / "part")
    resume(tmp_path / "part", max_steps=10**6)
    assert_same_results(tmp_path / "whole", tmp_path / "part")
