"""Total Lagrangian: reference gradients, deformation, forces that balance, and what only this form keeps."""

import numba
import numpy as np
import pytest
from composite_runs import advance

from hvisph.casefile.loader import load_case
from hvisph.core.errors import CaseError
from hvisph.diagnostics.sanity_checks import Failure, SanityChecks
from hvisph.integrators.time_step import Limit
from hvisph.setup.build import build
from hvisph.sph.kernels import CUBIC_SPLINE
from hvisph.sph.neighbours.reference_neighbours import Reference

E, NU, RHO = 70e9, 0.3, 2785.0
SPRING = {"density": RHO, "eos": {"type": "elastic", "youngs_modulus": E, "poisson_ratio": NU},
          "strength": {"type": "elastic"}}  # fmt: skip
KINEMATICS = {1: "uniaxial_strain", 2: "plane_strain", 3: "three_d"}
SHAPES = {1: {"type": "interval", "length": 6e-3}, 2: {"type": "box", "size": [5e-3, 4e-3]},
          3: {"type": "box", "size": [3e-3, 3e-3, 3.5e-3]}}  # fmt: skip


def body(dim=2, shape=None, dx=0.5e-3, material=SPRING, end=1e-6, **formulation):
    form = {"type": "total_lagrangian", "h_over_dx": 1.3} | formulation
    one = {"material": material, "shape": shape or SHAPES[dim], "position": [0.0] * dim}
    return load_case({"kinematics": KINEMATICS[dim], "resolution": dx, "formulation": form, "time": {"end": end},
                      "bodies": {"one": one}})  # fmt: skip


def mapped(setup, gradient, rate):
    """Deform a body by a linear map, with a linear velocity, and evaluate its forces."""
    particles, stepper = setup.particles, setup.stepper
    stepper.start()
    at = particles["reference_position"].copy()
    particles["position"] = at @ gradient.T
    particles["velocity"] = particles["position"] @ rate.T
    stepper.predict(0.0)
    stepper.evaluate()
    return stepper


@pytest.mark.parametrize(
    ("dim", "correction"),
    [(2, "mixed")]
    + [
        pytest.param(d, c, marks=pytest.mark.slow)
        for d, c in ((1, "mixed"), (3, "mixed"), (2, "gradient"), (3, "gradient"))
    ],
)
def test_corrected_gradients_are_exact_on_linear_fields(dim, correction):
    random = np.random.default_rng(4)
    gradient, rate = np.eye(dim) + 0.1 * random.normal(size=(dim, dim)), 1e3 * random.normal(size=(dim, dim))
    stepper = mapped(build(body(dim, correction=correction)), gradient, rate)
    assert stepper.jacobians == pytest.approx(np.linalg.det(gradient), rel=1e-12)
    assert stepper.rates[:, dim + 2 :] == pytest.approx(np.tile(rate.ravel(), (stepper.particles.count, 1)), rel=1e-9)
    assert stepper.particles["density"] == pytest.approx(RHO / np.linalg.det(gradient), rel=1e-12)


SLOW = pytest.mark.slow  # every combination compiles loops of its own
OPTIONS = [
    (2, {}),
    *[pytest.param(dim, {}, marks=SLOW) for dim in (1, 3)],
    *[
        pytest.param(dim, option, marks=SLOW)
        for dim in (1, 2, 3)
        for option in ({"correction": "none"}, {"viscosity_gradient": "reference"}, {"hourglass": 0.0})
    ],
]


def shaken(dim, options, by, speed=0.0, away=0.0):
    """The particles of a body, each displaced by some `by` [m] from its place `away`, its rates and forces."""
    random = np.random.default_rng(5)
    setup = build(body(dim, **options))
    particles, stepper = setup.particles, setup.stepper
    stepper.start()
    particles["position"] += away + by * random.normal(size=particles["position"].shape)
    particles["velocity"] = speed * random.normal(size=particles["velocity"].shape)
    stepper.predict(0.0)
    stepper.evaluate()
    return particles, stepper, particles["mass"][:, None] * stepper.rates[:, :dim]


@pytest.mark.parametrize(("dim", "options"), OPTIONS)
def test_forces_balance_pair_by_pair_and_power_is_their_work(dim, options):
    particles, stepper, force = shaken(dim, options, 2e-5, speed=100.0)
    assert np.abs(force.sum(axis=0)).max() < 1e-13 * np.abs(force).sum()
    work, heat = (force * particles["velocity"]).sum(), (particles["mass"] * stepper.rates[:, dim]).sum()
    assert heat == pytest.approx(-work, rel=1e-10)


@pytest.mark.parametrize(("dim", "options"), OPTIONS)
def test_what_round_off_leaves_of_small_strains_far_away_balances_too(dim, options):
    _, _, force = shaken(dim, options, 1e-10, away=0.1)
    # errors of 1e-16 E would be 1e-9 of these forces; what both sides of a pair round alike cancels
    assert np.abs(force.sum(axis=0)).max() < 1e-13 * np.abs(force).sum()


def test_spatial_viscosity_dissipates_in_every_pair():
    setup = build(body(2, viscosity={"type": "monaghan", "alpha": 1.0, "beta": 2.0}))
    random = np.random.default_rng(6)
    setup.stepper.start()
    setup.particles["velocity"] = 300.0 * random.normal(size=setup.particles["velocity"].shape)
    setup.stepper.predict(0.0)
    setup.stepper.evaluate()
    assert (setup.stepper.rates[:, 2] >= 0.0).all()  # no stress yet: all power is the viscosity's


def test_rigid_rotation_leaves_no_stress():
    turn = np.array([[0.0, -1.0], [1.0, 0.0]])
    stepper = mapped(build(body()), turn, np.zeros((2, 2)))
    assert np.abs(stepper.pressures).max() < 1e-9 * E
    assert np.abs(stepper.rates[:, :2]).max() < 1e-9 * E / RHO / 1e-3


def spinning(turns, alpha=0.2):
    setup = build(
        body(
            shape={"type": "disc", "diameter": 10e-3},
            viscosity={"type": "monaghan", "alpha": alpha, "beta": 0.4},
        )
    )
    particles = setup.particles
    period = 2e-4
    omega, x = 2.0 * np.pi / period, particles["position"]
    particles["velocity"] = omega * np.column_stack([-x[:, 1], x[:, 0]])

    def spin():
        x, u = particles["position"], particles["velocity"]
        return float((particles["mass"] * (x[:, 0] * u[:, 1] - x[:, 1] * u[:, 0])).sum())

    before = spin()
    energy, _ = advance(setup, turns * period)
    return (spin() - before) / before, energy / (0.5 * omega * before), setup


def test_spinning_disc_keeps_angular_momentum_and_energy():
    change, energy, setup = spinning(0.5)
    assert abs(change) < 1e-6 / 40
    assert abs(energy) < 1e-13
    # the stress is that of the spin alone, rho omega^2 R^2 at most
    limit = RHO * (2.0 * np.pi / 2e-4 * 5e-3) ** 2
    assert np.abs(setup.particles["deviator"]).max() < limit


@pytest.mark.slow
def test_spinning_disc_over_twenty_turns():
    change, energy, _ = spinning(20)
    assert abs(change) < 1e-6
    assert abs(energy) < 1e-12


def beam_period(cells):
    """Period of a free-free beam's first bending mode over that of Euler and Bernoulli."""
    length, height = 16e-3, 2e-3
    dx = height / cells
    setup = build(body(shape={"type": "box", "size": [length, height]}, dx=dx, h_over_dx=1.3, hourglass=0.0,
                       viscosity={"type": "monaghan", "alpha": 0.02, "beta": 0.0}))  # fmt: skip
    particles = setup.particles
    k = 4.730041 / length
    at = particles["position"][:, 0] + 0.5 * length
    ratio = (np.cosh(k * length) - np.cos(k * length)) / (np.sinh(k * length) - np.sin(k * length))
    shape = np.cosh(k * at) + np.cos(k * at) - ratio * (np.sinh(k * at) + np.sin(k * at))
    particles["velocity"][:, 1] = 1.0 * shape
    modulus = E / (1.0 - NU**2)  # plane strain
    theory = 2.0 * np.pi / (k**2 * height * np.sqrt(modulus / (12.0 * RHO)))
    amplitude, times, clock = [], [], [0.0]

    def watch(one):
        v = one.particles["velocity"][:, 1]
        at = one.particles["reference_position"][:, 0] + 0.5 * length
        mode = np.cosh(k * at) + np.cos(k * at) - ratio * (np.sinh(k * at) + np.sin(k * at))
        amplitude.append(float((v * mode).sum()))

    step = 0.2 * 1.3 * dx / 6500.0
    stepper = setup.stepper
    stepper.start()
    stepper.predict(step)
    while clock[0] < 1.3 * theory:
        stepper.evaluate()
        stepper.complete(step, step)
        clock[0] += step
        times.append(clock[0])
        watch(setup)
    sign = np.flatnonzero(np.diff(np.sign(amplitude)) != 0)[:2]
    return 2.0 * (times[sign[1]] - times[sign[0]]) / theory


@pytest.mark.slow
def test_beam_period_converges():
    # Timoshenko's beam, 8 times as long as high, in plane strain with a shear coefficient of 5/6
    timoshenko = 1.0566
    errors = [beam_period(cells) - timoshenko for cells in (4, 8, 12)]
    assert 0.0 < errors[2] < 0.05
    orders = np.diff(np.log(errors)) / np.diff(np.log([1 / 4, 1 / 8, 1 / 12]))
    assert (orders > 1.7).all()  # second order, 1.9 measured


def test_symmetry_plane_gives_the_half_of_the_whole():
    def bar(symmetric):
        size = [4e-3, 4e-3]
        one = {
            "material": SPRING,
            "shape": {"type": "box", "size": size},
            "velocity": [30.0, 0.0],
            "position": [-2e-3, 0.0],
        }
        two = {"material": SPRING, "shape": {"type": "box", "size": size}, "position": [2e-3, 0.0]}
        return build(load_case({
            "kinematics": "plane_strain", "resolution": 0.5e-3, "bodies": {"one": one, "two": two},
            "time": {"end": 1e-6},
            "formulation": {"type": "total_lagrangian"}, "symmetry": [{"axis": "y"}] if symmetric else [],
        }))  # fmt: skip

    whole, half = bar(False), bar(True)
    step = 2e-8
    for setup in (whole, half):
        setup.stepper.start()
        setup.stepper.predict(step)
        for _ in range(40):
            setup.stepper.evaluate()
            setup.stepper.complete(step, step)

    def sorted_upper(setup):
        particles = setup.particles
        upper = particles["reference_position"][:, 1] > 0
        at = particles["reference_position"][upper]
        return particles.data[upper][np.lexsort((at[:, 0].round(7), at[:, 1].round(7)))]

    # sums in another order: round-off
    scale = np.abs(whole.particles.data).max(axis=0) + 1e-30
    assert np.abs((sorted_upper(whole) - sorted_upper(half)) / scale).max() < 1e-8


def test_removal_empties_lists_and_keeps_gradients_exact():
    x = np.stack(np.meshgrid(np.arange(8.0), np.arange(8.0)), -1).reshape(-1, 2)
    lists = Reference(x, np.ones(64), np.zeros(64, int), np.arange(64), 64, CUBIC_SPLINE, 1.3, True, True)
    gone = np.zeros(64, bool)
    gone[27] = True
    lists.remove(gone)
    assert not (lists.indices == 27).any()
    assert (lists.indices[lists.starts[27] : lists.starts[28]] == 64).all()
    slopes, shapes = lists.kernels[lists.codes, :2], lists.kernels[lists.codes, 2]
    field = x @ np.array([2.0, -3.0])
    for i in (26, 28, 35):
        row = slice(int(lists.starts[i]), int(lists.starts[i + 1]))
        near = lists.indices[row]
        keep = near < 64
        g = slopes[row][keep] @ lists.matrix[i].T + shapes[row][keep][:, None] * lists.vector[i]
        assert ((field[near[keep]] - field[i])[:, None] * g).sum(axis=0) == pytest.approx([2.0, -3.0], rel=1e-12)


@pytest.mark.parametrize("regular", [True, False])
def test_kernels_of_a_lattice_are_tabled_and_those_of_others_kept_one_by_one(regular):
    x = 3.7 + np.stack(np.meshgrid(np.arange(8.0), np.arange(8.0)), -1).reshape(-1, 2) / 3.0
    volume = np.where(np.arange(64) < 32, 0.1, 0.12)
    if not regular:
        x += 0.01 * np.random.default_rng(2).normal(size=x.shape)
        volume = np.random.default_rng(3).uniform(0.1, 0.12, 64)
    lists = Reference(x, volume, np.zeros(64, int), np.arange(64), 64, CUBIC_SPLINE, 1.3 / 3.0, True, True)
    true = lists.indices < 64
    # of two volumes the 20 places within 2.6 spacings; or every entry; no neighbour; and a row to be read in pairs
    assert len(lists.kernels) == 2 + (2 * 20 if regular else true.sum())
    assert (lists.kernels[0] == 0.0).all()
    assert (lists.codes[~true] == 0).all()
    own = np.repeat(np.arange(64), np.diff(lists.starts).astype(int))[true]
    near = lists.indices[true]
    d = x[own] - x[near]
    r = np.linalg.norm(d, axis=1)
    slope = [CUBIC_SPLINE.derivative(one, 1.3 / 3.0, 2) / one for one in r]
    shape = [CUBIC_SPLINE.value(one, 1.3 / 3.0, 2) for one in r]
    # places over h are rounded to 1e-12; kernels that vanish at their rim have no relative error there
    slopes = lists.kernels[lists.codes[true], :2]
    of_pair = {(a, b): one for a, b, one in zip(own, near, slopes, strict=True) if volume[a] == volume[b]}
    assert all((of_pair[a, b] == -of_pair[b, a]).all() for a, b in of_pair)
    np.testing.assert_allclose(slopes, (volume[near] * slope)[:, None] * d, rtol=1e-10, atol=1e-10)
    np.testing.assert_allclose(lists.kernels[lists.codes[true], 2], volume[near] * shape, rtol=1e-10, atol=1e-10)


def test_entries_beside_a_lattice_have_rows_of_their_own_and_the_lattice_its_table():
    x = np.stack(np.meshgrid(np.arange(12.0), np.arange(8.0)), -1).reshape(-1, 2)
    x[::11] += 0.01 * np.random.default_rng(2).normal(size=x[::11].shape)
    count = len(x)
    lists = Reference(x, np.ones(count), np.zeros(count, int), np.arange(count), count, CUBIC_SPLINE, 1.3, True, True)
    own = np.repeat(np.arange(count), np.diff(lists.starts).astype(int))
    true = lists.indices < count
    moved = np.append(np.isin(np.arange(count), np.arange(count)[::11]), False)
    alone = true & (moved[own] | moved[lists.indices])
    assert (lists.codes[true & ~alone] <= 20).all()
    assert sorted(lists.codes[alone]) == list(range(21, 21 + alone.sum()))
    d = x[own[true]] - x[lists.indices[true]]
    slope = [CUBIC_SPLINE.derivative(r, 1.3, 2) / r for r in np.linalg.norm(d, axis=1)]
    np.testing.assert_allclose(
        lists.kernels[lists.codes[true], :2], np.array(slope)[:, None] * d, rtol=1e-10, atol=1e-10
    )


@pytest.mark.parametrize("courant", [0.3, 0.5])
def test_what_is_squeezed_below_the_courant_number_sets_shorter_steps(courant):
    """Sheared by g at the same volume the speed of sound is that at rest, and |F^-1|^2 = 2 + g^2."""
    speed = {}
    for shear in (0.0, 1.5, 6.0):
        case = body()
        setup = build(case.model_copy(update={"time": case.time.model_copy(update={"cfl": courant})}))
        mapped(setup, np.array([[1.0, shear], [0.0, 1.0]]), np.zeros((2, 2)))
        speed[shear] = setup.stepper.signals.copy()
    assert speed[1.5] == pytest.approx(speed[0.0], rel=1e-9)  # some of the step's reserve is gone, no more
    assert speed[6.0] == pytest.approx(courant * np.sqrt(1.0 + 6.0**2) * speed[0.0], rel=1e-9)


@pytest.mark.parametrize("dim", [1, 2, pytest.param(3, marks=pytest.mark.slow)])
def test_hourglass_control_gives_its_own_limit_of_the_step(dim):
    setup = build(body(dim, hourglass=50.0, h_over_dx=1.4))
    stepper = setup.stepper
    stepper.start()
    x, h, volume = setup.particles["reference_position"], 1.4 * 0.5e-3, stepper.reference.volume[0]
    apart = np.linalg.norm(x[:, None] - x, axis=-1)
    near = (apart > 0.0) & (apart < 2.0 * h * (1.0 - 1e-9))
    sums = [
        sum(volume * CUBIC_SPLINE.value(r, h, dim) / r**2 for r in row[ok]) for row, ok in zip(apart, near, strict=True)
    ]
    ((time, name, particle),) = stepper.limits()
    assert (name, time) == (
        "hourglass",
        pytest.approx(2.0 / np.sqrt(2.0 * 50.0 * E / (RHO * dim) * max(sums)), rel=1e-9),
    )
    assert sums[particle] == pytest.approx(max(sums), rel=1e-9)
    unheld = build(body(dim, hourglass=0.0))
    unheld.stepper.start()
    assert unheld.stepper.limits() == []


@pytest.mark.parametrize("hourglass", [10.0, 50.0])
@pytest.mark.parametrize("dim", [1, 2, pytest.param(3, marks=pytest.mark.slow)])
def test_noise_in_a_body_at_rest_dies_out_at_the_default_step(dim, hourglass):
    """By the signal's criterion alone a bar with a coefficient of 50 stops at 0.31, its plane form at 0.46."""
    case = body(dim, hourglass=hourglass, h_over_dx=1.4)
    setup = build(case)
    velocity = setup.particles["velocity"]
    velocity[...] = 1e-3 * np.random.default_rng(1).normal(size=velocity.shape)
    advance(setup, 1.0, cfl=case.time.cfl, steps=200)
    assert np.sqrt((setup.particles["velocity"] ** 2).mean()) < 0.5e-3


def test_inverted_particle_stops_with_its_place():
    case = body()
    setup = build(case)
    setup.stepper.start()
    watch = SanityChecks(setup, case.limits)
    setup.particles["position"][:, 0] *= -1.0  # every particle is inverted
    setup.stepper.predict(0.0)
    setup.stepper.evaluate()
    ((time, name, particle),) = setup.stepper.limits()
    assert (time, name) == (0.0, "inverted")
    with pytest.raises(Failure, match="J <= 0") as caught:
        watch.check_step(setup.subdomain.reduce_limit(Limit(time, name, particle), 0, False), 1e-6, 7)
    assert caught.value.particle == setup.particles.id[particle]
    assert len(caught.value.position) == 2


def test_conversion_needs_a_formulation_that_uses_it():
    with pytest.raises(CaseError, match="only particles of the formulation 'adaptive' turn"):
        body(conversion={"strain": 0.85})
    with pytest.raises(CaseError, match="no body has a formulation of its own"):
        load_case({"kinematics": "plane_strain", "resolution": 5e-4, "formulation": {"type": "eulerian"},
                   "bodies": {"one": {"material": SPRING, "shape": SHAPES[2], "formulation": "total_lagrangian"}},
                   "time": {"end": 1e-6}})  # fmt: skip


def test_threads_do_not_change_a_bit():
    threads = (1, min(2, numba.config.NUMBA_NUM_THREADS))
    states = []
    for number in threads:
        numba.set_num_threads(number)
        setup = build(body(2, end=1e-6))
        setup.particles["velocity"] = 1e4 * setup.particles["position"][:, [1, 0]]
        advance(setup, 1e-6)
        states.append(setup.particles.data.copy())
    numba.set_num_threads(numba.config.NUMBA_NUM_THREADS)
    assert (states[0] == states[1]).all()


def stretched(setup, by):
    """Bring a body to places that a linear map gives, as the stage that is to come."""
    particles = setup.particles
    particles["position"] = particles["reference_position"] @ by.T
    setup.stepper.predict(0.0)


def test_volume_goes_on_where_neighbours_leave():
    random = np.random.default_rng(3)
    stepper = (setup := build(body())).stepper
    stepper.start()
    particles = setup.particles
    particles["position"] += 5e-5 * random.normal(size=particles["position"].shape)
    stepper.predict(0.0)
    stepper.evaluate()
    before = stepper.jacobians.copy()
    gone = random.uniform(size=particles.count) < 0.1
    stepper._leave(gone)
    stepper._classify()
    stepper.evaluate()
    stays = ~stepper.loose
    assert (stepper.loose >= gone).all()
    assert np.abs(stepper.swellings[stays] - 1.0).max() > 1e-2  # the lists do see another volume
    assert stepper.jacobians[stays] == pytest.approx(before[stays], rel=1e-12)


def test_a_particle_whose_list_makes_no_sense_leaves_too():
    stepper = (setup := build(body())).stepper
    stepper.start()
    particles, dx = setup.particles, 0.5e-3
    x = particles["reference_position"]
    corner = int(np.lexsort(x.T)[0])
    offset = x - x[corner]
    east, north = (int(np.argmin(np.linalg.norm(offset - one, axis=1))) for one in ([dx, 0.0], [0.0, dx]))
    particles["position"][east, 0] -= 2.0 * dx  # what the two alone say of the corner is turned inside out
    stepper.predict(0.0)
    gone = np.linalg.norm(offset, axis=1) < 4.0 * dx
    gone[[corner, east, north]] = False
    stepper._leave(gone)
    assert stepper.loose[corner]


def test_renewed_reference_changes_no_density_and_no_strain():
    setup = build(body(reference_update_strain=0.1))
    stepper = setup.stepper
    stepper.start()
    turn = np.array([[0.8, -0.6], [0.6, 0.8]])
    first, second = np.diag([1.3, 0.9]), np.array([[1.0, 0.25], [0.0, 1.1]])
    stretched(setup, turn @ first)
    stepper.evaluate()
    density, strain = setup.particles["density"].copy(), stepper.strains.copy()
    stepper._renew()
    stepper._classify()
    stepper.evaluate()
    assert setup.particles["density"] == pytest.approx(density, rel=1e-12)
    assert stepper.jacobians == pytest.approx(np.ones(setup.particles.count), rel=1e-12)
    assert stepper.strains == pytest.approx(strain, rel=1e-9)
    assert np.abs(stepper.latest).max() < 1e-9
    # what follows counts from the start of the run
    stretched(setup, second)
    stepper.evaluate()
    whole = np.eye(3)
    whole[:2, :2] = second @ turn @ first
    green = 0.5 * (whole.T @ whole - np.eye(3))
    green -= np.trace(green) / 3.0 * np.eye(3)
    assert stepper.strains == pytest.approx(np.sqrt(2.0 / 3.0 * (green**2).sum()), rel=1e-9)


def test_nothing_passes_a_plane_and_its_energy_stays():
    metal = SPRING | {"strength": {"type": "von_mises", "yield_stress": 0.1e9}}
    setup = build(load_case({
        "kinematics": "plane_strain", "resolution": 0.5e-3, "formulation": {"type": "total_lagrangian"},
        "bodies": {"one": {"material": metal, "shape": {"type": "box", "size": [4e-3, 3e-3]}, "position": [2e-3, 0.0],
                           "velocity": [-400.0, 0.0]}},
        "symmetry": [{"axis": "x"}], "time": {"end": 3e-6}}))  # fmt: skip
    particles, deepest = setup.particles, []
    total = 0.5 * (particles["mass"] * 400.0**2).sum()
    # a particle that nothing holds would fly through
    setup.stepper.start()
    loose = int(np.argmin(particles["position"][:, 0]))

    def watch(one):
        deepest.append(one.particles["position"][:, 0].min())

    drift, _ = advance(setup, 2e-6, watch=watch)
    stepper = setup.stepper
    gone = np.zeros(particles.count, bool)
    gone[loose] = True
    stepper._leave(gone)
    stepper._classify()
    particles["velocity"][loose] = [-1000.0, 0.0]
    before = (particles["mass"] * (particles["internal_energy"] + 0.5 * (particles["velocity"] ** 2).sum(axis=1))).sum()
    for _ in range(40):
        stepper.evaluate()
        stepper.complete(2e-8, 2e-8)
        watch(setup)
    after = (particles["mass"] * (particles["internal_energy"] + 0.5 * (particles["velocity"] ** 2).sum(axis=1))).sum()
    assert min(deepest) > 0.0
    assert abs(drift) < 1e-12 * total
    assert after == pytest.approx(before, rel=1e-12)
