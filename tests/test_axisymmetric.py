"""Solids of revolution: exact properties about the axis, and requirements of a case."""

import numpy as np
import pytest
from small_runs import METAL, TWO, assert_same_results, final

import hvisph
from hvisph.case.consistency import axisymmetric_warnings
from hvisph.case.formulations.options import NoArtificialStress
from hvisph.casefile.loader import load_case
from hvisph.core.errors import CaseError
from hvisph.integrators.particle_steps import hoop_signal
from hvisph.output.reader import list_snapshots, read_snapshot
from hvisph.precheck.advice import advice
from hvisph.setup.build import build
from hvisph.simulation.run import run
from hvisph.sph.kernels import CUBIC_SPLINE

FORMS = {
    "consistent": {"type": "riemann"},
    "printed": {"type": "riemann", "variant": "original"},
    "standard": {"type": "eulerian", "viscosity": {"type": "monaghan", "alpha": 1, "beta": 2},
                 "artificial_stress": {"type": "gray"}},
}  # fmt: skip
GOLD = {**METAL, "density": 19300.0}
# Far from all else, and of another spacing: with it a single body has the loops of those that meet.
BEAD = {"material": GOLD, "shape": {"type": "sphere", "diameter": 3e-3}, "position": [-40e-3, 0.0, 0.0]}


def shot(form="consistent", **further):
    """A sphere that meets a disc, friction between them."""
    formulation = {**FORMS[form], "contact": {"type": "frictional", "friction": 0.3}}
    bodies = {
        "shot": {"material": METAL, "shape": {"type": "sphere", "diameter": 4e-3}, "velocity": [3000.0, 0.0, 0.0]},
        "disc": {"material": GOLD, "shape": {"type": "cylinder", "diameter": 8e-3, "length": 3e-3}},
    }
    plain = {"kinematics": "axisymmetric", "resolution": 0.5e-3, "bodies": bodies, "formulation": formulation,
             "time": {"end": 1e-6}}  # fmt: skip
    return load_case(plain | further)


@pytest.mark.parametrize("formulation", FORMS)
def test_uniform_pressure_is_static_and_disorder_conserves(formulation):
    bodies = {"rod": {"material": METAL, "internal_energy": 1e6,
                      "shape": {"type": "cylinder", "diameter": 20e-3, "length": 16e-3}}}  # fmt: skip
    setup = build(shot(formulation, bodies=bodies | {"bead": BEAD}))
    stepper, particles = setup.stepper, setup.particles
    stepper.start()
    x, rod = particles["position"], particles.body == 0
    inside = (np.abs(x[:, 0] - x[rod, 0].mean()) < 4e-3) & (x[:, 1] < 6e-3)
    assert np.count_nonzero(x[inside, 1] < 0.5e-3) > 4  # the axis is among them
    rates = stepper.rates[stepper.place]
    natural = stepper.pressures[rod].mean() / (METAL["density"] * 0.5e-3)
    assert np.abs(rates[inside, :2]).max() < 1e-13 * natural  # round-off of sums of 20 neighbours


@pytest.mark.parametrize("formulation", FORMS)
def test_pairs_conserve_energy_and_axial_momentum_between_bodies(formulation):
    setup = build(shot(formulation))
    stepper, particles = setup.stepper, setup.particles
    random = np.random.default_rng(3)
    count = particles.count
    particles["position"][:] += 0.1 * 0.5e-3 * random.normal(size=(count, 2))
    particles["velocity"][:] += 300.0 * random.normal(size=(count, 2))
    particles["deviator"][:] = 1e8 * random.normal(size=(count, 4))
    particles["deviator"][:, 2] = -particles["deviator"][:, 0] - particles["deviator"][:, 1]
    stepper.start()
    rates, m = stepper.rates[stepper.place], particles["mass"]
    force, power = m[:, None] * rates[:, :2], m * rates[:, 2]
    work = (force * particles["velocity"]).sum(axis=1)
    # sums over some hundred rings
    assert abs((work + power).sum()) < 1e-13 * np.abs(work).sum()
    assert abs(force[:, 0].sum()) < 1e-13 * np.abs(force[:, 0]).sum()


def test_rings_have_the_mass_of_the_solids():
    particles = build(shot()).particles
    masses = np.bincount(particles.body, particles["mass"])
    expected = METAL["density"] * np.pi * 4e-3**3 / 6, GOLD["density"] * np.pi * 4e-3**2 * 3e-3
    assert masses == pytest.approx(expected, rel=1e-12)
    assert particles["position"][:, 1].min() > 0.2e-3


def test_a_case_in_3d_becomes_axisymmetric_by_one_key():
    bodies = {"ball": {"material": METAL, "shape": {"type": "sphere", "diameter": 4e-3}, "velocity": [3e3, 0.0, 0.0]}}
    solid = {"resolution": 0.5e-3, "bodies": bodies, "symmetry": [{"axis": "y"}, {"axis": "z"}], "time": {"end": 1e-6}}
    assert len(load_case(solid | {"kinematics": "three_d"}).symmetry) == 2
    assert load_case(solid | {"kinematics": "axisymmetric"}).symmetry == ()


@pytest.mark.parametrize(("place", "change"), [
    ("formulation.contact.type", {"formulation": {"type": "total_lagrangian", "contact": {"type": "penalty"}}}),
    ("kinematics", {"formulation": {"type": "projection"}}),
    ("symmetry.0", {"symmetry": [{"axis": "y", "at": 1e-3}]}),
    ("formulation.correction", {"formulation": {"type": "eulerian", "correction": {"type": "gradient"},
                                                "momentum_form": "product"}}),
])  # fmt: skip
def test_what_has_no_axisymmetric_form_is_refused(place, change):
    with pytest.raises(CaseError) as refused:
        shot(**change)
    assert place in str(refused.value)


@pytest.mark.parametrize(("key", "value"), [("velocity", [3000.0, 1.0]), ("position", [0.0, 1e-3]), ("rotation", 30)])
def test_bodies_off_the_axis_are_refused(key, value):
    body = {"material": METAL, "shape": {"type": "sphere", "diameter": 4e-3}, key: value}
    with pytest.raises(CaseError, match=f"bodies.ball.{key}"):
        shot(bodies={"ball": body})


@pytest.mark.parametrize(("scheme", "key", "solid"), [
    ({"type": "eulerian"}, "viscosity_in_shear", "reduced"),
    ({"type": "adaptive", "conversion": {"strain": 0.3}}, "artificial_stress", NoArtificialStress()),
])  # fmt: skip
def test_rings_leave_out_what_no_hoop_balances(scheme, key, solid):
    disc = {"material": METAL, "shape": {"type": "disc", "diameter": 4e-3}}
    plane = {"kinematics": "plane_strain", "bodies": {"one": disc}}
    assert getattr(shot(formulation=scheme).formulation, key) == solid
    assert getattr(shot(formulation=scheme, **plane).formulation, key) != solid
    given = {"viscosity_in_shear": "full"} if key == "viscosity_in_shear" else {"artificial_stress": {"type": "gray"}}
    case = shot(formulation=scheme | given)
    assert getattr(case.formulation, key) != solid
    assert ("run away" in " ".join(axisymmetric_warnings(case))) == (key == "artificial_stress")


def test_a_graded_plate_of_rings_answers_as_one_of_even_spacing(tmp_path):
    """A third of the particles, and the same residual velocity within 2 %: nothing comes back from the coarse rim."""
    bodies = {
        "shot": {"material": METAL, "shape": {"type": "sphere", "diameter": 4e-3}, "velocity": [3000.0, 0.0, 0.0]},
        "plate": {"material": METAL, "shape": {"type": "cylinder", "diameter": 0.1, "length": 2e-3}},
    }
    found = {}
    for name, change in (("even", {}), ("graded", {"grading": {"fine": [None, 12e-3, 12e-3], "coarsest": 4e-3}})):
        changed = bodies | {"plate": bodies["plate"] | change}
        ran = run(shot(bodies=changed, time={"end": 4e-6}, output={"every": 4e-6}), tmp_path / name, threads=1)
        found[name] = final(tmp_path / name)
        assert abs(ran.summary["conservation"]["energy_drift"]) < 1e-13
    assert found["graded"].count < 0.4 * found["even"].count  # the sphere's fifty among them
    speeds, masses = {}, {}
    for name, last in found.items():
        own = last.body == 0
        speeds[name] = last.fields["mass"][own] @ last.fields["velocity"][own, 0] / last.fields["mass"][own].sum()
        masses[name] = last.fields["mass"].sum()
    assert masses["graded"] == pytest.approx(masses["even"], rel=1e-12)
    assert speeds["graded"] == pytest.approx(speeds["even"], rel=0.02)


def test_only_what_flat_faces_bound_is_graded():
    grading = {"fine": [None, 4e-3], "coarsest": 1e-3}
    ball = {"material": METAL, "shape": {"type": "sphere", "diameter": 8e-3}, "grading": grading}
    with pytest.raises(CaseError, match="in axisymmetric cases a cylinder, a tube and a ring of a box are graded"):
        shot(bodies={"ball": ball})


def test_rings_graded_along_x_stay_still_on_the_axis(tmp_path):
    """An elastic rod strikes a wall: nothing swings where the rings at the axis are much nearer to it than h.

    With the step of the fine rings alone 13 % of the energy had been taken out of particles after 60 us, peaks 241 GPa.
    """
    elastic = {**METAL, "strength": METAL["strength"] | {"yield_stress": 1e12}}
    rod = {"material": elastic, "shape": {"type": "cylinder", "diameter": 10e-3, "length": 40e-3},
           "position": [-20e-3, 0.0], "velocity": [220.0, 0.0],
           "grading": {"fine": [4e-3, None], "coarsest": 4e-3, "face": "rear"}}  # fmt: skip
    case = shot(bodies={"rod": rod, "bead": BEAD | {"position": [-80e-3, 0.0, 0.0]}}, resolution=1e-3,
                symmetry=[{"axis": "x", "keep": "below"}], time={"end": 60e-6},
                output={"every": 60e-6})  # fmt: skip
    ran = run(case, tmp_path / "rod", threads=1)
    last = final(tmp_path / "rod")
    assert ran.summary["failure"] is None
    least = last.fields["internal_energy"][last.body == 0].min()
    assert least > -1e-2 * 0.5 * 220.0**2, "rounding and limits of the scheme, no swinging"
    assert np.abs(last.fields["pressure"][last.body == 0]).max() < 8e9  # 4.1 in the flat impact of the wave


def test_the_step_follows_the_radius():
    # stable limits of c dt/r: 0.63 in a corner at h/r = 2.4, 0.63 inside at 9.6; a tenth of margin, and no more than a third
    assert 0.67 * 0.63 < 0.3 * 2.4 / hoop_signal(2.4, 1.0) < 0.9 * 0.63
    assert 0.6 * 0.63 < 0.3 * 9.6 / hoop_signal(9.6, 1.0) < 0.9 * 0.63


@pytest.mark.parametrize("poisson", [0.0, 0.025, 0.27])
def test_an_elastic_cylinder_comes_to_rest(poisson, tmp_path):
    """No motion grows in the corner of the axis and a free face (with steps a quarter longer it does within 10 us)."""
    bulk = 30e9
    rock = {"density": 2700.0, "eos": {"type": "linear", "bulk_modulus": bulk},
            "strength": {"type": "elastic", "shear_modulus": 1.5 * bulk * (1 - 2 * poisson) / (1 + poisson)}}  # fmt: skip
    body = {"material": rock, "shape": {"type": "cylinder", "length": 8e-3, "diameter": 8e-3},
            "initial_velocity": [{"type": "linear", "gradient": [[0.02, 0.0], [0.0, 0.0]]}]}  # fmt: skip
    case = load_case({"kinematics": "axisymmetric", "resolution": 1e-3, "bodies": {"rock": body},
                      "time": {"end": 60e-6}, "output": {"every": 60e-6}})  # fmt: skip
    assert run(case, tmp_path / "run", threads=1).summary["failure"] is None
    speeds = [np.abs(read_snapshot(path).fields["velocity"]).max() for path in list_snapshots(tmp_path / "run")]
    assert speeds[-1] < 0.5 * speeds[0]


def test_rings_in_shear_have_less_of_the_viscosity_but_at_the_axis():
    rod = {"material": METAL, "shape": {"type": "cylinder", "diameter": 12e-3, "length": 4e-3}}
    setup = build(shot("standard", bodies={"rod": rod, "bead": BEAD}))
    particles, stepper = setup.particles, setup.stepper
    stepper.start()
    whole = stepper.rows[:, stepper.pairs.slots["C"]].copy()  # at rest
    r, h = particles["position"][:, 1], particles["smoothing_length"]
    particles["velocity"] = np.column_stack([1e4 * r, np.zeros(len(r))])
    stepper.predict(0.0)
    stepper.evaluate()
    stepper.predict(0.0)
    left = stepper.rows[:, stepper.pairs.slots["C"]] / whole
    inside = (np.abs(particles["position"][:, 0] - 2e-3) < 0.5e-3) & (r < 4e-3)
    assert left[inside] == pytest.approx(np.maximum(0.1, 1.0 - 0.5 * r / h)[inside], rel=1e-6)


LAGRANGIAN = {"type": "adaptive", "reference_update_strain": 0.1, "conversion": {"strain": 0.3}}


@pytest.mark.parametrize(("form", "integrator"), [("consistent", "leapfrog"), ("standard", "predictor_corrector"),
                                                  (LAGRANGIAN, "leapfrog")])  # fmt: skip
def test_an_impact_keeps_its_budgets_and_resumes_with_the_same_bits(form, integrator, tmp_path):
    further = {"formulation": form} if isinstance(form, dict) else {}
    case = shot("standard" if further else form, time={"end": 1e-6, "integrator": integrator}, output={"every": 5e-7},
                **further)  # fmt: skip
    drifts = run(case, tmp_path / "whole", threads=1).summary["conservation"]
    assert abs(drifts["energy_drift"]) < 1e-13
    assert abs(drifts["momentum_drift"]) < 1e-13
    run(case.model_copy(update={"time": case.time.model_copy(update={"max_steps": 21})}), tmp_path / "parts", threads=1)
    hvisph.resume(tmp_path / "parts", max_steps=0, threads=TWO)
    assert_same_results(tmp_path / "whole", tmp_path / "parts")
    last = final(tmp_path / "whole")
    assert last.fields["position"][:, 1].min() > 0.0
    assert last.metadata["shot"]["whole"]["kind"] == "revolution"


def test_parts_of_a_solid_stand_in_the_half_plane():
    """As bodies do: a third coordinate is zero and may be left out."""
    parts = [{"shape": {"type": "cylinder", "diameter": 4e-3, "length": 6e-3}, "position": [-3e-3, 0]},
             {"shape": {"type": "cone", "diameter": 4e-3, "length": 4e-3}, "position": [0, 0, 0]}]  # fmt: skip
    bullet = {"material": METAL, "shape": {"type": "union", "parts": parts}, "velocity": [800.0, 0.0]}
    row = {"type": "repeat", "shape": {"type": "cylinder", "diameter": 8e-3, "length": 3e-3},
           "vectors": [[5e-3, 0]], "counts": [2]}  # fmt: skip
    case = shot(bodies={"bullet": bullet, "plates": {"material": METAL, "shape": row}})
    assert [part.position for part in case.bodies["bullet"].shape.parts] == [(-3e-3, 0.0, 0.0), (0.0, 0.0, 0.0)]
    assert case.bodies["plates"].shape.vectors == ((5e-3, 0.0, 0.0),)


def test_unlimited_tension_in_the_hoop_direction_is_warned_of():
    gas = {"density": 1.2, "eos": {"type": "ideal_gas", "gamma": 1.4}}
    for material, warned in ((METAL, True), (gas, False), ("steel-4340", False)):
        ball = {"material": material, "shape": {"type": "sphere", "diameter": 4e-3}, "internal_energy": 2e5}
        texts = advice(shot(bodies={"ball": ball}, formulation={"type": "riemann"}))
        assert any("hoop direction" in text for text in texts) == warned


def test_rings_that_leave_the_domain_are_parked_off_the_axis(tmp_path):
    ball = {"ball": {"material": METAL, "shape": {"type": "sphere", "diameter": 4e-3}, "velocity": [3000.0, 0.0]}}
    case = shot(bodies=ball | {"bead": BEAD}, domain={"max": [4.5e-3, None]})
    run(case, tmp_path / "run", threads=1)
    summary = hvisph.open_run(tmp_path / "run").summary
    assert summary["status"] == "done"
    assert 0 < summary["conservation"]["retired_particles"] < summary["particles"]
    assert abs(summary["conservation"]["energy_drift"]) < 1e-12


def test_a_lone_ring_is_not_pressed_as_it_nears_the_axis(tmp_path):
    """The least density, of a ring alone, grows as 1/r: a crumb of the plate came to 341 GPa, with no force on it."""
    torus = {"type": "ring", "section": {"type": "disc", "diameter": 6e-3}, "radius": 10e-3}
    case = shot(resolution=0.5e-3, time={"end": 4.2e-6}, formulation={"type": "riemann"}, bodies={
        "ring": {"material": "copper-ofhc", "shape": torus, "velocity": [3e3, 0.0, 0.0]},
        "plate": {"material": "aluminium-6061-t6", "shape": {"type": "cylinder", "diameter": 60e-3, "length": 10e-3}}})  # fmt: skip
    summary = run(case, tmp_path / "torus").summary
    assert summary["status"] == "done"
    pressures = summary["pressures"]
    assert pressures["highest"] < 3.0 * pressures["impedance_match"]  # 9.4 times before, 2.3 now


def test_thin_rings_beside_dense_ones_do_not_thin_each_other_without_end(tmp_path):
    """Water struck at 10 km/s, by standard SPH: by its rate alone the density of two rings passed zero (step 96)."""
    water = {"base": "water-tillotson", "strength": {"type": "none"}}
    flyer, target = ({"type": "cylinder", "diameter": 12e-3, "length": length} for length in (4e-3, 6e-3))
    case = shot("standard", resolution=0.4e-3, time={"end": 0.6e-6}, bodies={
        "flyer": {"material": water, "shape": flyer, "velocity": [10e3, 0.0, 0.0]},
        "target": {"material": water, "shape": target}})  # fmt: skip
    ran = run(case, tmp_path / "water")
    assert ran.summary["status"] == "done"
    assert abs(ran.summary["conservation"]["energy_drift"]) < 1e-12
    state = final(ran.folder)
    alone = state.fields["mass"] / (2.0 * np.pi * np.abs(state.fields["position"][:, 1]))
    alone /= state.fields["smoothing_length"] ** 2
    assert (state.fields["density"] > 0.999 * alone * CUBIC_SPLINE.value(0.0, 1.0, 2)).all()
