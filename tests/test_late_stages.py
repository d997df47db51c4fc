"""Late stages at a low sound speed: nothing jumps, the balance closes, the step grows, the end hardly depends on them."""

import numpy as np
import pytest
from small_runs import LIQUID, METAL, assert_same_results, final, row_of

from hvisph.casefile.loader import load_case
from hvisph.compiler.jit import python_twin
from hvisph.core.errors import CaseError
from hvisph.materials import slots, thermodynamics
from hvisph.materials.eos.late import late_state
from hvisph.materials.material_table import Material, late_material, pack
from hvisph.setup.build import build
from hvisph.simulation.clock import interpolate_state
from hvisph.simulation.late_stages import LateStages
from hvisph.simulation.run import resume, run
from hvisph.sph.neighbours.particle_layout import slots as rate_slots

SAND = {"name": "sand", "density": 2000.0, "eos": {"type": "linear", "bulk_modulus": 1e8},
        "strength": {"type": "rock", "shear_modulus": 6e7, "cohesion": 0.0, "friction": 0.6, "tension": 0.0}}  # fmt: skip
POROUS = SAND | {"porosity": {"distension": 1.5, "crush": [["10 kPa", 1.5], ["50 MPa", 1]]}}


def pile(late=(), end=0.9, dx=0.05, material=SAND, **further):
    """A column of sand, 0.5 m wide and 0.6 m high beside a plane of symmetry, that falls apart on a floor."""
    return load_case({
        "kinematics": "plane_strain", "resolution": dx, "gravity": [0.0, -9.81], "late": list(late),
        "bodies": {"sand": {"material": material, "shape": {"type": "box", "size": [0.5, 0.6]}, "position": [0.25, 0.3]}},
        "symmetry": [{"axis": "x"}, {"axis": "y"}], "time": {"end": end}, "output": {"every": end / 3},
    } | further)  # fmt: skip


STAGE = {"at": 0.03, "bulk_modulus": 1e6}


@pytest.mark.parametrize("material", [SAND, POROUS])
def test_nothing_jumps_at_the_switch(material):
    """Pressure to round-off of K, deviator and yield stress exactly; the shear modulus is that of Poisson's ratio."""
    case = pile([{"at": 0.1, "bulk_modulus": "5 MPa", "nu": 0.2}], material=material)
    setup = build(case)
    particles, stepper = setup.particles, setup.stepper
    generator = np.random.default_rng(3)
    rest = setup.substances[0].density_at_rest
    particles["density"] = rest * (1.0 + generator.uniform(-2e-3, 4e-3, particles.count))
    if material is POROUS:
        particles["history_variable"] = 1.48
        particles["density"] = 2000.0 / 1.48 * (1.0 + generator.uniform(-2e-3, 1e-3, particles.count))
    particles["deviator"] = generator.normal(size=(particles.count, 4)) * 1e3
    deviator = particles["deviator"].copy()
    state = python_twin(thermodynamics.state_with_history)

    def pressures():
        columns = (particles[name].tolist() for name in ("density", "internal_energy", "damage", "history_variable"))
        return np.array([state(stepper.table, stepper.models, 0, *one)[0] for one in zip(*columns, strict=True)])

    before = np.maximum(pressures(), 0.0)
    assert before.max() > 5e4
    LateStages(case, setup).switch(0.1, 7)
    assert np.allclose(pressures(), before, atol=1e-9 * 5e6)
    assert np.array_equal(particles["deviator"], deviator)
    assert stepper.table[0, slots.SHEAR_MODULUS] == pytest.approx(1.5 * 5e6 * 0.6 / 1.2)
    share = 1.0 / 1.48 if material is POROUS else 1.0
    assert np.allclose(particles["flaw_strain"], share)


def test_what_is_thin_flies_on_without_pressure():
    case = pile([STAGE])
    setup = build(case)
    setup.particles["density"][:5] = 0.4 * 2000.0
    LateStages(case, setup).switch(0.1, 7)
    assert np.isinf(setup.particles["history_variable"][:5]).all()
    between = interpolate_state(setup.particles.data.copy(), setup.particles, 0.4, 1e-6)
    assert np.isinf(between["history_variable"][:5]).all()
    row = slots.values(late_material(setup.substances[0], 1e6, 0.25).whole_row)
    p, c = python_twin(late_state)(3000.0, np.inf, row)
    assert p == -1e6  # the limit to tension makes it zero
    assert 0.0 < c < 0.11 * np.sqrt(1e6 / 2000.0)


def test_a_stage_that_is_too_soft_stops_the_run(tmp_path):
    """A metal under 6 GPa: the message says which modulus would do."""
    case = row_of([METAL, METAL], 2, time={"end": 5e-7}, late=[{"at": 1e-7, "bulk_modulus": 1e9}])
    outcome = run(case, tmp_path / "run")
    assert outcome.summary["status"] == "failed"
    assert (
        "above a tenth of its bulk modulus of 1e+09 Pa; begin later, or give" in outcome.summary["failure"]["message"]
    )


def test_a_pile_of_sand_ends_alike_from_either_time(tmp_path):
    """A hundredth of the bulk modulus from 0.03 s or from 0.06 s: longer steps, one foot, 3 % as asked.

    The floor has no friction, so that the pile runs far. Particles that pass it are put back, which lifts them: 5e-4 of
    the energy at the softer stage, 1e-6 without one.
    """
    feet, steps = [], []
    for number, late in enumerate(([], [STAGE], [STAGE | {"at": 0.06}])):
        outcome = run(pile(late), tmp_path / str(number))
        assert outcome.exit_code == 0
        assert abs(outcome.summary["conservation"]["energy_drift"]) < 1e-3
        x = final(tmp_path / str(number)).fields["position"]
        feet.append(np.quantile(x[:, 0], 0.98))
        steps.append(outcome.summary["steps"])
    assert feet[0] > 0.55  # it has spread
    assert feet[1] == pytest.approx(feet[2], rel=0.03)  # as asked
    assert feet[1] == pytest.approx(feet[0], rel=0.05)
    assert steps[0] > 4 * steps[1]


def test_the_balance_closes_across_the_switch(tmp_path):
    """Blocks of sand that meet at 0.4 m/s, the second stage while they are pressed: energy to round-off."""
    block = {"material": SAND, "shape": {"type": "box", "size": [0.5, 0.5]}}
    case = load_case({
        "kinematics": "plane_strain", "resolution": 0.05,
        "bodies": {"one": block | {"velocity": [0.4, 0.1]}, "other": block},
        "late": [{"at": 1e-3, "bulk_modulus": 5e7}, {"at": 3e-3, "bulk_modulus": 5e6}],
        "time": {"end": 2e-2}, "output": {"every": 2e-2},
    })  # fmt: skip
    summary = run(case, tmp_path / "run").summary
    assert summary["status"] == "done"
    assert abs(summary["conservation"]["energy_drift"]) < 1e-12
    assert abs(summary["conservation"]["momentum_drift"]) < 1e-12


def test_energy_that_softer_sand_gives_back_is_told(tmp_path):
    """A uniform pressure and deviator by hand; the shock warning, and the default modulus of 30 times the pressure."""
    setup = build(case := pile([{"at": 0.1}, {"at": 0.2, "bulk_modulus": 1e6}]))
    particles, stepper = setup.particles, setup.stepper
    particles["density"], particles["deviator"] = 2000.0 * (1.0 + 1e-3), 0.0
    particles["deviator"][:, 0], particles["deviator"][:, 1] = 2e3, -2e3
    late = LateStages(case, setup)
    stepper.rates[:] = 0.0
    assert "warning" not in late.switch(0.1, 7)
    modulus = 30.0 * 1e5
    assert stepper.late[1] == pytest.approx(modulus, rel=1e-9)
    volume, squares = float((particles["mass"] / particles["density"]).sum()), 8e6
    shear = 1.5 * modulus * 0.5 / 1.25
    by_hand = volume * (0.5 * 1e10 * (1.0 / modulus - 1e-8) + 0.25 * squares * (1.0 / shear - 1.0 / 6e7))
    assert stepper.late[0] == pytest.approx(by_hand, rel=1e-6)
    stepper.rates[:, rate_slots(2)["R_APPROACH"]] = 2.3  # c_new is 22.4 m/s
    particles["density"] = 2000.0
    assert "close at 2.3 m/s, above a tenth" in late.switch(0.2, 9)


def test_two_stages_are_resumed_with_the_same_bits(tmp_path):
    case = pile([{"at": 0.03}, {"at": 0.06, "bulk_modulus": 2e5}], end=0.12, dx=0.1)
    whole = run(case, tmp_path / "whole")
    count = whole.summary["steps"]
    for number, part in enumerate((count // 3, count - 3)):
        short = case.model_copy(update={"time": case.time.model_copy(update={"max_steps": part})})
        run(short, tmp_path / str(number))
        resume(tmp_path / str(number), max_steps=10**6)
        assert_same_results(tmp_path / "whole", tmp_path / str(number))


def test_a_run_is_extended_within_a_stage(tmp_path):
    """The particles are predicted with the materials of the stage: the run ends as one to that end within 1e-5."""
    for end in (0.12, 0.1):
        run(pile([{"at": 0.03}, {"at": 0.06, "bulk_modulus": 2e5}], end=end, dx=0.1), tmp_path / str(end))
    extended = resume(tmp_path / "0.1", end=0.12)
    assert extended.summary["status"] == "done"
    whole, parts = (final(tmp_path / str(end)).fields["position"] for end in (0.12, 0.1))
    assert np.abs(parts - whole).max() < 1e-5


def test_stages_that_begin_by_themselves(tmp_path):
    """Blocks that have met: each stage a tenth of the one before; the same bits after a resume; none while they fly."""
    block = {"material": SAND | {"strength": {"type": "none"}}, "shape": {"type": "box", "size": [0.5, 0.5]}}
    case = pile([{"at": "auto"}, {"at": "auto"}, {"at": "auto", "bulk_modulus": 1.0}], dx=0.1,
                bodies={"one": block | {"velocity": [0.4, 0.0]}, "other": block}, symmetry=[], gravity=None)  # fmt: skip
    whole = run(case, tmp_path / "whole")
    log = (tmp_path / "whole" / "run.log").read_text()
    assert log.count("late stage from") == 2
    assert "bulk modulus 1e+07 Pa" in log
    assert "bulk modulus 1e+06 Pa" in log
    assert "1 late stage (at: auto) did not begin" in log
    assert abs(whole.summary["conservation"]["energy_drift"]) < 1e-12
    short = case.model_copy(update={"time": case.time.model_copy(update={"max_steps": whole.summary["steps"] - 3})})
    run(short, tmp_path / "short")
    resume(tmp_path / "short", max_steps=10**6)
    assert_same_results(tmp_path / "whole", tmp_path / "short")


@pytest.mark.parametrize(("late", "further", "words"), [
    ([STAGE | {"at": 2.0}], {}, "not within the run"),
    ([STAGE, STAGE], {}, "not later than that"),
    ([STAGE, {"at": 0.1, "bulk_modulus": 2e6}], {}, "not below that of the stage"),
    ([STAGE], {"formulation": {"type": "total_lagrangian"}}, "riemann or eulerian"),
    ([{"at": "auto"}, STAGE], {}, "after a stage that begins by itself"),
    ([STAGE | {"bulk_modulus": 1e12}], {}, "above that of 'sand', 1e\\+08 Pa"),
    ([STAGE | {"bulk_modulus": 1e5}], {"settle": 0.1}, "below ten times the pressure at the bottom, 1.08e\\+04 Pa"),
])  # fmt: skip
def test_what_is_refused(late, further, words):
    with pytest.raises(CaseError, match=words):
        build(pile(late, **further))


def test_matter_without_strength_has_none_in_a_late_stage():
    made = Material("water", 1000.0, LIQUID_EOS := build(row_of([LIQUID], 2)).substances[0].eos)
    assert made.eos is LIQUID_EOS
    late = late_material(made, 1e6, 0.25)
    assert late.shear_modulus == 0.0
    assert pack([late])[1][0, 0] == late.eos.tag
