"""The verification suite: its exact flows of a gas, its judgement, and coarse forms of its problems."""

import json
from dataclasses import replace

import numpy as np
import pytest
from hvisph_validation.problems.cantilever import swing
from hvisph_validation.problems.implosion import rings
from hvisph_validation.problems.noh import Noh
from hvisph_validation.problems.tension import largest_gap
from hvisph_validation.structures import Ball, Cantilever, Shell, SpinningDisc, ThinRing
from typer.testing import CliRunner

from hvisph.cli.main import app
from hvisph.core.errors import CaseError
from hvisph.materials.strength import Orthotropic
from hvisph.verification.problem import ALL, Figure, Options, limit
from hvisph.verification.problems.shock_tubes import GasState, riemann
from hvisph.verification.runner import PROBLEMS, run_trial, verdicts, with_formulation
from hvisph.visualization.curves import label_and_scale

SOD = GasState(1.0, 0.0, 1.0), GasState(0.125, 0.0, 0.1)


def call(*arguments):
    return CliRunner().invoke(app, ["verify", *map(str, arguments)])


def test_sods_tube_is_that_of_the_textbook():
    found = riemann(*SOD, 1.4)  # Toro, table 4.2, test 1
    assert found.pressure == pytest.approx(0.30313, abs=1e-5)
    assert found.velocity == pytest.approx(0.92745, abs=1e-5)
    between = found.sample(np.array([0.92, 0.93]))["density"]
    assert between == pytest.approx([0.42632, 0.26557], abs=1e-5)


def test_panels_say_what_they_are_in():
    assert label_and_scale("radius of the inner layer", False, "m") == ("radius of the inner layer [mm]", 1e3)
    assert label_and_scale("velocity_x", False) == ("velocity x [m/s]", 1.0)
    assert label_and_scale("share", False, "") == ("share [-]", 1.0)
    with pytest.raises(ValueError, match="'radius of the inner layer' is no field: give its unit"):
        label_and_scale("radius of the inner layer", False)


@pytest.mark.parametrize("states", [SOD, (GasState(1.0, 0.0, 1000.0), GasState(1.0, 0.0, 0.01)),
                                    (GasState(1.0, -2.0, 0.4), GasState(1.0, 2.0, 0.4))])  # fmt: skip
def test_a_riemann_problem_keeps_mass_momentum_and_energy(states):
    g, reach = 1.4, 60.0
    left, right = states
    found = riemann(left, right, g)
    speed = np.linspace(-reach, reach, 2_000_001)
    flow = found.sample(speed)
    energy = 0.5 * flow["density"] * flow["velocity"] ** 2 + flow["pressure"] / (g - 1.0)
    totals = [flow["density"], flow["density"] * flow["velocity"], energy]

    def fluxes(s):
        e = 0.5 * s.density * s.velocity**2 + s.pressure / (g - 1.0)
        return np.array([s.density * s.velocity, s.density * s.velocity**2 + s.pressure, s.velocity * (e + s.pressure)])

    def held(s):
        return np.array([s.density, s.density * s.velocity, 0.5 * s.density * s.velocity**2 + s.pressure / (g - 1.0)])

    after = np.array([np.trapezoid(total, speed) for total in totals])
    before = reach * (held(left) + held(right)) + fluxes(left) - fluxes(right)
    # jumps between two samples: half a step of the largest state
    assert after == pytest.approx(before, abs=1e-4 * max(left.pressure, 1.0))


def test_a_mirrored_riemann_problem_is_the_mirror_image():
    left, right = SOD
    one, other = riemann(left, right, 1.4), riemann(right, left, 1.4)
    speed = np.linspace(-2.0, 2.0, 1001) + 1e-7
    a, b = one.sample(speed), other.sample(-speed)
    assert a["density"] == pytest.approx(b["density"], rel=1e-12)
    assert a["velocity"] == pytest.approx(-b["velocity"], abs=1e-12)


@pytest.mark.parametrize("dim", [1, 2, 3])
def test_noh_keeps_mass_and_energy(dim):
    exact, time = Noh(5.0 / 3.0, dim), 0.6
    r = np.linspace(0.0, 0.4, 400_001)[1:]
    flow = exact.sample(r, time)
    share = r ** (dim - 1) * np.gradient(r)
    # what lies within r = 0.4 began within r = 1
    assert (share * flow["density"]).sum() == pytest.approx(1.0 / dim, rel=1e-4)
    energy = 0.5 * flow["density"] * flow["velocity"] ** 2 + flow["pressure"] / (2.0 / 3.0)
    assert (share * energy).sum() == pytest.approx(0.5 / dim, rel=1e-4)


@pytest.mark.parametrize("dim", [2, 3])
def test_a_shell_spends_its_motion_on_plastic_work(dim):
    """The equation of motion of a rigid-plastic shell, followed in time, comes to rest where the energy says."""
    shell = Shell(dim, 60e-3, 75e-3, 42e-3, 2700.0, 0.25e9)
    start = np.linspace(shell.inner, shell.outer, 2001)
    a, v, dt = shell.inner, -shell.speed, 1e-7
    factor = 2.0 / np.sqrt(3.0) if dim == 2 else 2.0

    def inertia(face):
        r = shell.radius(start, face)  # u = v (face/r)^(d-1)
        return np.trapezoid((face / r) ** (2 * dim - 2) * r ** (dim - 1), r)

    while v < 0.0:
        r = shell.radius(start, a)
        # strain grows by factor |u|/r; d/dt of inertia v^2/2 is minus its power
        power = shell.yield_stress / shell.density * factor * np.trapezoid(a ** (dim - 1) / r, r)
        slope = (inertia(1.0001 * a) - inertia(0.9999 * a)) / (0.0002 * a)
        v += dt * (power - 0.5 * slope * v * v) / inertia(a)
        a += dt * v
    assert a == pytest.approx(shell.stop, rel=2e-3)


def test_rings_fill_a_quarter():
    places, volumes = rings(60e-3, 75e-3, 1.5e-3)
    assert volumes.sum() == pytest.approx(0.25 * np.pi * (75e-3**2 - 60e-3**2), rel=1e-12)
    assert (places > 0.0).all()


def test_timoshenkos_cantilever():
    """The limit of slenderness, and the first-order correction by Rayleigh's quotient."""
    slender = Cantilever(1.0, 1e-3, 2700.0, 70e9, 0.33)
    assert slender.period == pytest.approx(slender.slender_period, rel=1e-5)
    assert slender.shape(np.array([0.0, 1.0])) == pytest.approx([0.0, 1.0], abs=1e-12)
    stubby = Cantilever(16e-3, 1e-3, 2700.0, 70e9, 0.33)
    rotation = 1.0 / (12.0 * 16.0**2)
    shear = rotation * 2.0 / (1.0 - 0.33) / (5.0 / 6.0)
    # 4.648: integral of the squared first derivative over that of the square, and of the third's over the second's
    assert stubby.period / stubby.slender_period == pytest.approx(1.0 + 0.5 * 4.648 * (rotation + shear), rel=1e-4)


def test_a_swing_is_read_from_its_record():
    time = np.linspace(0.0, 5.0, 4000)
    period, left = swing(time, np.exp(-0.04 * time) * np.cos(2.0 * np.pi * time / 1.05), 1.0, 5.0)
    assert period == pytest.approx(1.05, rel=1e-6)
    assert left == pytest.approx(np.exp(-0.2), rel=1e-6)


def test_the_largest_gap_of_a_lattice_with_a_hole():
    x = np.stack(np.meshgrid(np.arange(11.0), np.arange(11.0)), -1).reshape(-1, 2) - 5.0
    assert largest_gap(x, 4.0) == pytest.approx(np.sqrt(2.0))
    assert largest_gap(x[np.abs(x).sum(axis=1) > 0.0], 4.0) == pytest.approx(2.0)
    assert largest_gap(np.array([[0.0], [1.0], [2.5]]), 5.0) == 1.5


def test_figures_judge_shares_values_limits_and_what_is_no_number():
    assert Figure("stress", 1.009, 1.0, 0.01).passed
    assert not Figure("stress", 1.011, 1.0, 0.01).passed
    assert Figure("speed", 1.4, 0.0, 0.03, "m/s", 50.0).passed
    assert not Figure("speed", 1.6, 0.0, 0.03, "m/s", 50.0).passed
    assert limit("drift", -1.0, 0.1).passed
    assert not limit("drift", 0.2, 0.1).passed
    assert not Figure("stress", float("nan"), 1.0, 0.01).passed
    plain = Figure("stress", float("inf"), 1.0, 0.01).as_dict()
    assert plain["found"] is None
    assert plain["passed"] is False


@pytest.mark.parametrize("name", PROBLEMS)
def test_every_problem_makes_cases_that_its_formulations_take(name):
    problem = PROBLEMS[name]
    assert set(problem.formulations) <= set(ALL)
    assert len({trial.name for trial in problem.trials(Options())}) == len(list(problem.trials(Options())))
    for trial in problem.trials(Options(quick=True)):
        for start in trial.starts:
            if not start.case.get("formulation"):  # not every formulation has every contact and correction
                with_formulation(start, problem.formulations[0], ())


def test_the_blind_set_has_twenty_problems():
    assert len(list(PROBLEMS["blind"].trials(Options()))) == 20


def test_a_good_scheme_passes_and_is_told_from_a_wrong_answer():
    """Stress and density of the mass form obey the jump conditions; against 3 % more they do not."""
    problem = PROBLEMS["hugoniot"]
    trial = next(iter(problem.trials(Options(quick=True))))
    good = run_trial(problem, trial, "eulerian", ["formulation.density_form=mass"], threads=1)
    assert good.status == "done"
    assert [f.name for f in good.figures if not f.passed and "energy" not in f.name] == []
    wrong = replace(trial, figures=lambda runs: (replace(f, exact=1.03 * f.exact) for f in trial.figures(runs)))
    bad = run_trial(problem, wrong, "eulerian", ["formulation.density_form=mass"], threads=1)
    assert not bad.passed


def test_what_cannot_run_is_refused_and_what_stops_fails():
    problem = PROBLEMS["bars"]
    trial = next(iter(problem.trials(Options(quick=True))))
    refused = run_trial(problem, trial, "eulerian", ["formulation.contact.friction_of_the_moon=1"], threads=1)
    assert refused.status == "refused"
    assert "friction_of_the_moon" in refused.message
    assert refused.passed is None
    stopped = run_trial(problem, trial, "eulerian", ["limits.energy_drift=1e-30"], threads=1)
    assert (stopped.status, stopped.passed) == ("failed", False)
    assert "energy" in stopped.message


def test_trials_are_chosen_by_their_names(tmp_path):
    found = list(verdicts(PROBLEMS["bars"], ["eulerian", "projection"], Options(quick=True), only="1d gap dx",
                          keep=tmp_path, threads=1))  # fmt: skip
    assert [(v.trial, v.formulation) for v in found] == [("1D gap dx", "eulerian")]
    assert (tmp_path / "bars/eulerian/1D_gap_dx/0/summary.json").is_file()


def test_command_lists_runs_and_refuses(tmp_path):
    listed = call()
    assert listed.exit_code == 0
    assert all(name in listed.stdout for name in PROBLEMS)
    done = call("sod", "--quick", "--formulation", "eulerian", "--json", "--pictures", tmp_path, "--threads", 1)
    assert done.exit_code in (0, 1)
    (verdict,) = json.loads(done.stdout)
    assert verdict["status"] == "done"
    assert {"name", "found", "exact", "tolerance", "passed"} <= set(verdict["figures"][0])
    assert list(tmp_path.glob("sod.*.png"))
    assert "hugoniot" in call("hugonot").stderr
    assert call("sod", "--formulation", "lagrange").exit_code == 2
    assert call("sod", "--resolution", "1 kg").exit_code == 2
    nothing = call("sod", "--formulation", "projection")
    assert nothing.exit_code == 1
    assert "no trial could run" in nothing.stdout
    wrong = call("sod", "--quick", "--formulation", "eulerian", "--set", "formulation.limitr=minmod")
    assert wrong.exit_code == 1
    assert "cannot run" in wrong.stdout
    assert "passed" not in wrong.stdout
    assert "no trial's name holds 'blast'; there are: " in call("sod", "--only", "blast").stderr


def test_a_setting_that_is_wrong_is_named():
    trial = next(iter(PROBLEMS["sod"].trials(Options(quick=True))))
    with pytest.raises(CaseError, match="limitr"):
        with_formulation(trial.starts[0], "riemann", ["formulation.limitr=minmod"])


# What holds in its coarse form: problem, formulation. What does not is in docs/verification.md.
HOLDS = [("separation", "riemann"), pytest.param("spacings", "riemann", marks=pytest.mark.slow), ("friction", "riemann"), ("tension", "riemann"), ("symmetry", "riemann"),
         ("symmetry", "eulerian"), ("spinning_disc", "total_lagrangian"),
         ("orthotropic_disc", "total_lagrangian")]  # fmt: skip
# What misses by a hair there: spacings of 1 to 4 reflect 6.01 % of a wave for 6, and of 1 to 2 in the plane 3.001 for 3, a
# first-order error at twice the spacing (2.7 and 2.1 % in the full forms).
MISSES = {(name, trial): ["reflected over incident velocity"]
          for name, trial in (("spacings", "1D, 1:4"), ("spacings", "2D, 1:2"))}  # fmt: skip


@pytest.mark.parametrize("formulation", ["riemann", "eulerian", "total_lagrangian"])
def test_impacts_know_neither_direction_nor_frame(formulation):
    for trial in ("rotated by 37 degrees", "moving frame, 10 km/s"):
        (verdict,) = verdicts(PROBLEMS["invariance"], [formulation], Options(quick=True), only=trial, threads=1)
        assert verdict.passed, verdict.as_dict()


@pytest.mark.parametrize(("formulation", "trial"), [("total_lagrangian", "sphere"), ("total_lagrangian", "uniform"),
                                                    ("eulerian", "torus"), ("riemann", "torus"),
                                                    ("riemann", "mirrored"), ("riemann", "10 km/s"),
                                                    ("total_lagrangian", "10 km/s")])  # fmt: skip
def test_rings_breathe_rest_and_know_no_frame(formulation, trial):
    (verdict,) = verdicts(PROBLEMS["axisymmetric_bodies"], [formulation], Options(quick=True), only=trial, threads=1)
    assert verdict.passed, verdict.as_dict()


def test_balls_and_rings_breathe_as_the_textbooks_say():
    assert Ball(1.0, 1.0, 1.0, 0.25).root == pytest.approx(0.816 * np.pi, abs=2e-4 * np.pi)  # Lamb 1882, four digits
    assert ThinRing(2.0, 1.0, 4.0).period == pytest.approx(2.0 * np.pi)
    steel = Orthotropic((200e9,) * 3, (0.3,) * 3, (200e9 / 2.6,) * 3, 200e9 / 1.2)
    (centre, *_), _ = SpinningDisc(1.0, 8000.0, 100.0, steel.compliance).state(0.0, 0.0)
    assert centre == pytest.approx(3.3 / 8.0 * 8000.0 * 100.0**2)  # Timoshenko & Goodier


@pytest.mark.parametrize(("name", "formulation"), HOLDS)
def test_coarse_forms_that_hold(name, formulation):
    for verdict in verdicts(PROBLEMS[name], [formulation], Options(quick=True), threads=1):
        assert verdict.status == "done", verdict.message
        known = MISSES.get((name, verdict.trial), [])
        assert not [f"{f.name}: {f.found:.4g}" for f in verdict.figures if not f.passed and f.name not in known]


@pytest.mark.parametrize("name", ["elastic_ring", "spinning_disc", "cantilever", "rebound"])
def test_the_elastic_variant_keeps_the_energy_of_elastic_bodies(name):
    """Figures of the coarse forms; those below are coarser than the tolerances of the problems."""
    problem = PROBLEMS[name]
    (trial,) = problem.trials(Options(quick=True))
    found = {
        f.name: f for f in run_trial(problem, trial, "riemann", ["formulation.variant=elastic"], threads=1).figures
    }
    if name == "cantilever":  # 8 particles high, the clamp 4 long: 10 % softer
        assert found.pop("period").off < 0.12
    if name == "rebound":  # contact of first order: the default has 0.53
        assert found.pop("restitution").found > 0.65
    assert found or name == "rebound"
    assert [f.name for f in found.values() if not f.passed] == []
