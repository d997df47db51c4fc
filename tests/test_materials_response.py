"""The stress update: elasticity, rotation, yield, hardening, damage."""

from dataclasses import fields, replace

import numpy as np
import pytest

from hvisph.compiler.jit import python_twin
from hvisph.materials import damage, slots, strength
from hvisph.materials.damage import (
    CockcroftLatham,
    GradyKipp,
    GradySpall,
    JohnsonCookDamage,
    JohnsonHolmquistDamage,
    NoDamage,
    PressureCutoff,
    PrincipalStress,
)
from hvisph.materials.damage.orthotropic import Hashin, MaxStress
from hvisph.materials.eos import MieGrueneisen, StiffenedGas
from hvisph.materials.material_table import Material, pack
from hvisph.materials.strength import (
    CowperSymonds,
    ElasticStrength,
    JohnsonCook,
    JohnsonHolmquist,
    LinearHardening,
    NoStrength,
    Rock,
    SteinbergGuinan,
    SteinbergLund,
    VonMises,
    ZerilliArmstrong,
)
from hvisph.materials.strength.fabric import Fabric
from hvisph.materials.strength.orthotropic import Orthotropic
from hvisph.materials.stress_update import respond, rotate_by_half_angle
from hvisph.materials.thermodynamics import equilibrium_state, flow_stress, longitudinal_speed, shear_speed
from hvisph.materials.traction_limits import bearable_shear

RHO0, G, Y = 2785.0, 27.6e9, 0.3e9
GAS = StiffenedGas(5328.0, 2.0)
JC = JohnsonCook(G, 479e6, 323e6, 0.41, 0.101, 1.8, 850.0, 875.0)
STRENGTHS = [NoStrength(), ElasticStrength(G), VonMises(G, Y), LinearHardening(G, Y, 2e9), JC]
STEINBERG = (G, 0.29e9, 0.68e9, 125.0, 0.10, 65.2e-12, 0.616e-3, 1220.0, 1.97, 1.5)
LATER_STRENGTHS = [
    SteinbergGuinan(*STEINBERG),
    SteinbergLund(*STEINBERG, rate_c1=0.71e6, activation_energy=0.31, peierls_stress=0.82e9, drag=0.012e6),
    ZerilliArmstrong(G, "bcc", 65e6, 0.00698, 4.15e-4, c1=1033e6, c5=266e6, exponent=0.289, melt_temperature=1800.0),
    CowperSymonds(G, Y, 6500.0, 4.0, 0.5e9),
    Rock(G, 10e6, 1.5, 3.5e9, melt_energy=3.4e6, melt_temperature=1400.0),
    JohnsonHolmquist(G, 5.95e9, 2.92e9, 0.15e9, 0.93, 0.77, 0.088, 0.35, 0.003, 0.5),
]
LATER_DAMAGES = [
    GradyKipp(4e35, 9.0, crack_speed=1837.0, young_modulus=50e9, particle_volume=1e-9),
    GradySpall(29e6, 0.29e9),
    PrincipalStress(0.2e9, 0.3e9),
    CockcroftLatham(1e8),
    JohnsonHolmquistDamage(0.053, 0.85),
]
DAMAGES = [NoDamage(), PressureCutoff(-8e8), JohnsonCookDamage(0.45, d4=0.0138, pressure_minimum=-8e8, softening=0.3)]
M = np.uint64(0)


def material(model, harm=NoDamage(), eos=GAS):  # noqa: B008 - a frozen object without parameters
    return Material("al", RHO0, eos, model, harm)


def step(made, gradient, dt, s=(0.0,) * 6, rho=RHO0, e=0.0, plastic_strain=0.0, harm=0.0, function=respond):
    table, models = pack([made])
    s, *others = function(table, models, M, dt, rho, e, tuple(s), plastic_strain, harm, tuple(np.ravel(gradient)))
    return np.array(s), *others


def full(s):
    return np.array([[s[0], s[3], s[4]], [s[3], s[1], s[5]], [s[4], s[5], s[2]]])


def von_mises_stress(s):
    return np.sqrt(1.5 * np.sum(full(s) ** 2))


def random_deviator(generator, size):
    tensor = generator.standard_normal((3, 3))
    tensor = tensor + tensor.T
    tensor -= np.eye(3) * np.trace(tensor) / 3.0
    tensor *= size / np.sqrt(1.5 * np.sum(tensor**2))
    return tensor[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]


LATER = [(m, NoDamage()) for m in LATER_STRENGTHS] + [(VonMises(G, Y), h) for h in LATER_DAMAGES[:4]]
SHEARED = GradyKipp(4e35, 9.0, 0, 1837.0, 50e9, 1e-9, brittle_ductile=1.23e9, brittle_plastic=2.35e9)
LATER += [
    (LATER_STRENGTHS[-2], SHEARED),
    (LATER_STRENGTHS[-1], LATER_DAMAGES[-1]),
    (LATER_STRENGTHS[-2], LATER_DAMAGES[0]),
]
# All pairs but damage by plastic strain without any strength, which Material refuses.
PAIRS = [(m, h) for m in STRENGTHS for h in DAMAGES if m.name != "none" or h.name != "johnson_cook"]


@pytest.mark.parametrize(("model", "harm"), PAIRS + LATER, ids=lambda x: x.name)
@pytest.mark.parametrize("eos", [GAS, MieGrueneisen(5328.0, 2.0, 1.338, a=0.48)], ids=lambda x: x.name)
def test_compiled_update_agrees_with_its_plain_twin(model, harm, eos):
    generator = np.random.default_rng(3)
    for size in (0.1, 0.9):
        arguments = {
            "gradient": generator.standard_normal((3, 3)) * 1e5,
            "dt": 2e-8,
            "s": random_deviator(generator, size * Y),
            "rho": RHO0 * (1 + 0.1 * generator.standard_normal()),
            "e": 2e5,
            "plastic_strain": 0.02,
            "harm": 0.1,
        }
        made = material(model, harm, eos)
        fast = step(made, **arguments)
        slow = step(made, **arguments, function=python_twin(respond))
        for a, b in zip(fast, slow, strict=True):
            # fastmath reorders sums: a few roundings, of terms of the size of the moduli
            np.testing.assert_allclose(a, b, rtol=1e-11, atol=1e-12 * 79e9 * (np.ndim(a) > 0) + 1e-12)


@pytest.mark.parametrize("model", STRENGTHS[1:], ids=lambda x: x.name)
def test_no_time_leaves_an_admissible_deviator_to_the_last_bit(model):
    generator = np.random.default_rng(5)
    for _ in range(20):
        s = random_deviator(generator, 0.99 * Y)
        out = step(material(model), generator.standard_normal((3, 3)) * 1e5, 0.0, s)
        assert (out[0] == s).all()
        assert out[1] == 0.0


def test_a_returned_deviator_is_not_returned_again():
    s, strain, *_ = step(material(VonMises(G, Y)), np.diag([-1e5, 0, 0]), 1e-6)
    again, strain_again, *_ = step(material(VonMises(G, Y)), np.zeros((3, 3)), 0.0, s, plastic_strain=strain)
    assert (again == s).all()
    assert strain_again == strain


def test_elastic_increment_is_hooke_in_every_component():
    gradient = np.array([[3.0, 1.0, -2.0], [1.0, -1.0, 0.5], [-2.0, 0.5, 4.0]])
    s, *_ = step(material(ElasticStrength(G)), gradient, 1e-6)
    expected = 2 * G * 1e-6 * (gradient - np.eye(3) * np.trace(gradient) / 3)
    np.testing.assert_allclose(full(s), expected, rtol=1e-14, atol=1e-9)


@pytest.mark.parametrize("axis", [(0, 0, 1.0), (1.0, 0, 0), (0.6, -0.3, 0.74)])
def test_rigid_rotation_turns_the_stress_with_the_body(axis):
    """A spin by a whole turn in 400 steps: the stress must arrive where the body does."""
    axis = np.array(axis) / np.linalg.norm(axis)
    w = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    start = random_deviator(np.random.default_rng(1), 0.5 * Y)
    steps, angle = 100, np.pi / 2
    s, dt = start, 1e-6
    for _ in range(steps):
        s, *_ = step(material(ElasticStrength(G)), w * angle / steps / dt, dt, s)
    turn = np.eye(3) + np.sin(angle) * w + (1 - np.cos(angle)) * w @ w
    expected = turn @ full(start) @ turn.T
    np.testing.assert_allclose(full(s), expected, atol=1e-12 * Y)
    assert von_mises_stress(s) == pytest.approx(0.5 * Y, rel=1e-12)  # an exact rotation keeps the size


def test_rotation_in_the_plane_is_the_same_in_both_branches():
    generator = np.random.default_rng(7)
    s = random_deviator(generator, 1.0)
    flat = rotate_by_half_angle.py_func(tuple(s), (0.0, 0.0, 0.3))
    # a tilt far below rounding sends it through the general branch
    np.testing.assert_allclose(rotate_by_half_angle.py_func(tuple(s), (1e-300, 0.0, 0.3)), flat, atol=1e-15)


def test_uniaxial_strain_yields_at_the_elastic_limit_and_holds_two_thirds_of_y():
    s, strain, *_ = step(material(VonMises(G, Y)), np.diag([-1.0, 0, 0]), 0.99 * Y / (2 * G))
    assert strain == 0.0  # the Hugoniot elastic limit is at a strain of Y/(2G)
    s, strain, *_ = step(material(VonMises(G, Y)), np.diag([-1.0, 0, 0]), 0.02)
    assert s[0] == pytest.approx(-2 * Y / 3, rel=1e-12)
    assert s[1] == pytest.approx(Y / 3, rel=1e-12)
    # plastic part of the deviatoric strain: 2/3 (0.02 - Y/(2G))
    assert strain == pytest.approx(2 / 3 * (0.02 - Y / (2 * G)), rel=1e-12)


@pytest.mark.parametrize("model", [LinearHardening(G, Y, 16.2e9), VonMises(G, Y)])
def test_hardening_ends_on_the_new_yield_surface(model):
    s, strain, *_ = step(material(model), np.array([[0, 3e4, 0], [0, 0, 0], [0, 0, -1e4]]), 1e-6)
    hardening = getattr(model, "hardening_modulus", 0.0)
    assert strain > 0.0
    assert von_mises_stress(s) == pytest.approx(Y + hardening * strain, rel=1e-12)


def test_johnson_cook_stays_inside_its_surface_and_near_it():
    rate, dt = 2e4, 1e-7
    gradient = np.zeros((3, 3))
    gradient[0, 1] = gradient[1, 0] = rate * np.sqrt(3) / 2  # equivalent rate is `rate`
    s, strain = np.zeros(6), 0.0
    for _ in range(200):
        s, strain, *_ = step(material(JC), gradient, dt, s, plastic_strain=strain, e=1e5)
    t = 1e5 / 875 / 550
    surface = (479e6 + 323e6 * strain**0.41) * (1 + 0.101 * np.log(rate)) * (1 - t**1.8)
    reached = von_mises_stress(s)
    assert reached <= surface * (1 + 1e-12)
    assert reached == pytest.approx(surface, rel=1e-4)  # the secant's second-order error
    # all strain beyond the elastic part is plastic
    assert strain == pytest.approx(200 * dt * rate - reached / (3 * G), rel=1e-12)


def test_johnson_cook_rate_has_a_floor_and_melting_takes_all_strength():
    slow = step(material(JC), np.diag([-1.0, 0.5, 0.5]) * 1e-3, 30.0)
    assert von_mises_stress(slow[0]) == pytest.approx(479e6 + 323e6 * slow[1] ** 0.41, rel=0.02)
    molten = step(material(JC), np.diag([-1e5, 0.5e5, 0.5e5]), 1e-6, e=875 * 600.0)
    assert von_mises_stress(molten[0]) == pytest.approx(0.0, abs=1e-3)
    assert material(JC).temperature(RHO0, 875 * 100.0) == pytest.approx(400.0)
    cold = Material("al", RHO0, GAS, JC, total_energy=True)
    assert cold.temperature(1.2 * RHO0, -1e5) == 300.0


def test_pressure_cutoff_limits_tension_only():
    made = material(VonMises(G, Y), PressureCutoff(-8e8))
    assert step(made, np.zeros((3, 3)), 0.0, rho=0.9 * RHO0)[3] == -8e8
    free = step(material(VonMises(G, Y)), np.zeros((3, 3)), 0.0, rho=1.1 * RHO0)[3]
    assert step(made, np.zeros((3, 3)), 0.0, rho=1.1 * RHO0)[3] == free > 0


def test_damage_adds_up_to_failure_and_leaves_compression():
    made = material(VonMises(G, Y), JohnsonCookDamage(0.45))
    gradient = np.diag([2e5, -1e5, -1e5])
    s, strain, harm = np.zeros(6), 0.0, 0.0
    while harm < 1.0:
        s, strain, harm, p, _ = step(made, gradient, 1e-8, s, 0.98 * RHO0, 0.0, strain, harm)
        if harm < 1.0:
            assert harm == pytest.approx(strain / 0.45, rel=1e-10)
            assert p < 0
    assert harm == 1.0
    assert 0.45 <= strain < 0.453  # one step's strain is 0.002
    assert (s == 0).all()
    assert p == 0.0
    later = step(made, gradient, 1e-8, s, 1.1 * RHO0, 0.0, strain, harm)
    assert (later[0] == 0).all()
    assert later[1] == strain
    assert later[3] > 0


@pytest.mark.parametrize(("friction", "left"), [(0.0, 0.0), (slots.KEEPS_STRESS, 0.7)])
def test_coupled_damage_takes_its_share_of_the_yield_stress(friction, left):
    made = replace(material(VonMises(G, Y), JohnsonCookDamage(0.45, softening=0.3)), failed_friction=friction)
    gradient = np.zeros((3, 3))
    gradient[0, 1] = 1e5  # simple shear, 0.0006 of plastic strain a step
    s, strain, harm = np.zeros(6), 0.0, 0.0
    while harm < 1.0:
        before = harm
        s, strain, harm, *_ = step(made, gradient, 1e-8, s, RHO0, 0.0, strain, harm)
        if 0.0 < harm < 1.0:
            assert np.sqrt(1.5 * (full(s) ** 2).sum()) == pytest.approx(Y * (1.0 - 0.3 * before), rel=1e-12)
            table, models = pack([made])
            shear = flow_stress(table, models, M, RHO0, 0.0, 0.0, strain, before, 1e5)[0]
            assert shear == pytest.approx(Y * (1.0 - 0.3 * before), rel=1e-12)
    assert strain == pytest.approx(0.45, abs=0.0012)
    for _ in range(3):
        s, strain, harm, *_ = step(made, gradient, 1e-8, s, RHO0, 0.0, strain, harm)
    assert np.sqrt(1.5 * (full(s) ** 2).sum()) == pytest.approx(left * Y)


@pytest.mark.parametrize(("p", "expected"), [(-1.0, 0.1 + 0.5 * np.exp(-2.0)), (1.0, 0.1 + 0.5 * np.exp(2.0))])
def test_fracture_strain_follows_triaxiality_rate_and_heat(p, expected):
    row = material(JC, JohnsonCookDamage(0.1, 0.5, -2.0, 0.02, 1.5)).row()
    function = damage.johnson_cook.fracture_strain.py_func
    assert function(p, 1.0, np.log(0.5), 0.0, row) == pytest.approx(expected)
    assert function(p, 1.0, np.log(1e4), 0.4, row) == pytest.approx(expected * (1 + 0.02 * np.log(1e4)) * 1.6)
    assert function(-9.0, 1.0, 0.0, 0.0, row) == function(-1.5, 1.0, 0.0, 0.0, row)  # held at 1.5
    assert np.isfinite(function(1e10, 0.0, 0.0, 0.0, row))


def test_a_fit_that_leaves_nothing_goes_on_as_voids_grow():
    held = JohnsonCookDamage(-0.77, 1.45, -0.47, 0.0, 1.6)
    grown = replace(held, void_growth=True)
    function = damage.johnson_cook.fracture_strain.py_func
    start = grown.void_growth_from
    triaxiality = np.linspace(-2.0, 4.0, 601)
    fit, law = (
        np.array([function(-t, 1.0, 0.0, 0.0, material(JC, model).row()) for t in triaxiality])
        for model in (held, grown)
    )
    below = triaxiality <= start
    assert np.array_equal(fit[below], law[below])
    slope = np.gradient(np.log(law), triaxiality)
    assert slope.min() == pytest.approx(-1.5, rel=1e-9)  # never faster, and so from `start` on without a kink
    assert slope[triaxiality > start + 0.02] == pytest.approx(np.full((triaxiality > start + 0.02).sum(), -1.5))
    assert slope[below][-2] == pytest.approx(-1.5, abs=0.03)
    assert function(-1.4, 1.0, 0.0, 0.5, material(JC, grown).row()) == pytest.approx(
        1.8 * function(-1.4, 1.0, 0.0, 0.0, material(JC, grown).row())
    )
    assert function(-1.0, 0.0, 0.0, 0.0, material(JC, grown).row()) == damage.johnson_cook.FRACTURE_STRAIN_FLOOR


def test_wave_speeds_and_state_without_a_step():
    table, models = pack([material(VonMises(G, Y))])
    p, c = equilibrium_state(table, models, M, RHO0, 0.0, 0.0)
    assert (p, c) == (0.0, 5328.0)
    assert longitudinal_speed(c, RHO0, G) == pytest.approx(np.sqrt(5328.0**2 + 4 * G / (3 * RHO0)))
    assert shear_speed(RHO0, G) == pytest.approx(np.sqrt(G / RHO0))
    assert equilibrium_state(table, models, M, 0.9 * RHO0, 0.0, 1.0)[0] == 0.0


def test_row_reader_covers_every_slot():
    table, _ = pack([material(JC, DAMAGES[2]), material(VonMises(G, Y))])
    for m in range(2):
        assert slots.parameters(table, np.uint64(m)) == (*table[m, : slots.SLOT_COUNT], table[m].ctypes.data)


CONTRACT = [
    *STRENGTHS,
    *DAMAGES,
    *LATER_STRENGTHS,
    *LATER_DAMAGES[1:],
    MieGrueneisen(5328.0, 2.0, 1.3, 0.1, 0.1, 0.1),
    GAS,
]


@pytest.mark.parametrize("model", CONTRACT, ids=lambda x: type(x).__name__)
def test_every_parameter_reaches_the_table(model):
    before = np.zeros(slots.SLOT_COUNT)
    model.pack(before, RHO0)
    for field in fields(model):
        value = getattr(model, field.name)
        if (
            isinstance(value, bool | str)
            or field.name == "tension"
            or (value == 0.0 and type(model) in map(type, LATER_STRENGTHS))
        ):
            continue
        changed = replace(model, **{field.name: value + 0.25 * abs(value) if value > 0 else value - 0.5})
        after = np.zeros(slots.SLOT_COUNT)
        changed.pack(after, RHO0)
        assert (before != after).any(), field.name


# Models with directions, which have tests of their own.
ANISOTROPIC = [Orthotropic((60e9, 30e9, 12e9), (0.25, 0.3, 0.2), (8e9, 6e9, 4e9), 12e9), Fabric((5e9, 5e9), (1e9, 1e9))]
CRITERIA = [Hashin(1.2e9, 1e9, 6e7, 2e8, 8e7, 8e7), MaxStress((1e9,) * 3, (1e9,) * 3, (1e8,) * 3)]


@pytest.mark.parametrize(
    ("registry", "models"),
    [
        (strength.REGISTRY, STRENGTHS + LATER_STRENGTHS + ANISOTROPIC),
        (damage.REGISTRY, DAMAGES + LATER_DAMAGES + CRITERIA),
    ],
)
def test_registries_name_every_model_and_tags_differ(registry, models):
    assert {m.name: type(m) for m in models} == registry
    assert len({m.tag for m in registry.values()}) == len(registry)


def cold_metals():
    from hvisph.casefile.material_library import library_of
    from hvisph.setup.materials import material_of

    return [
        material(JC, DAMAGES[2]),
        *(material_of(library_of().load(n)) for n in ("aluminium-6061-t6", "copper-ofhc")),
    ]


@pytest.mark.parametrize("made", cold_metals(), ids=lambda made: made.name)
def test_cold_metal_below_its_least_yield_stress_is_not_asked_for_its_temperature(made):
    """Same bits as with all of it computed; no state below the energy is warmer than what the stress stands for."""
    table, models = pack([made])
    asked = table.copy()
    asked[0, slots.SURE_ENERGY] = -np.inf
    limit, sure = table[0, slots.SURE_ENERGY], table[0, slots.SURE_STRESS]
    rng, elastic = np.random.default_rng(5), 0
    for _ in range(300):
        rho, e = made.density * rng.uniform(0.8, 1.3), limit * rng.uniform(-0.2, 1.1)
        if e < limit:
            warm = (made.temperature(rho, e) - table[0, slots.ROOM_TEMPERATURE]) * table[0, slots.INVERSE_MELT_RANGE]
            assert made.strength.yield_stress * (1.0 - max(warm, 0.0) ** made.strength.thermal_exponent) >= sure
        s = sure * rng.uniform(-0.6, 0.6, 6)
        state = (1e-9, rho, e, (s[0], s[1], -s[0] - s[1], *s[3:]), rng.uniform(0.0, 0.3), rng.uniform(0.0, 0.9))
        gradient = tuple(1e5 * rng.standard_normal(9))
        respond_ = python_twin(respond)
        short, whole = (respond_(given, models, 0, *state, gradient) for given in (table, asked))
        assert short == whole
        elastic += e < limit and short[1] == state[4]
    assert elastic > 50


def test_johnson_cook_hardens_by_a_series_as_by_a_power():
    row = pack([material(JC)])[0][0]
    harder, power = python_twin(strength.hardening), python_twin(strength.yield_stress)
    for share in (1e-9, 1e-3, 0.02, 0.04, 0.05, 3.0):
        flow, after = (0.7 * power(JC.tag, 0.2 * (1.0 + grown), 0.9, 0.0, row) for grown in (0.0, share))
        assert harder(JC.tag, 0.2 * share, 0.2, flow, 0.9, 0.0, 0.7, row) == pytest.approx(
            after - flow, rel=3e-7, abs=3e-7
        )


def test_a_particle_that_flows_bears_the_shear_of_its_yield_surface():
    """Its deviator, on the surface up to the secant's second order, in place of the yield stress computed anew."""
    made = cold_metals()[1]
    table, models = pack([made])
    gradient = tuple(3e5 * np.array([1.0, 0.4, 0.0, 0.2, -1.1, 0.0, 0.0, 0.0, 0.1]))
    s, strain, damage, p, _ = python_twin(respond)(table, models, 0, 2e-8, 2750.0, 1e5, (2e8, -1e8, -1e8, 5e7, 0.0, 0.0), 0.1, 0.2, gradient)  # fmt: skip
    assert strain > 0.1
    found = [python_twin(bearable_shear)(table, models, 0, 2750.0, 1e5, p, s, strain, flowed, damage, gradient)
             for flowed in (True, False)]  # fmt: skip
    assert found[0] == pytest.approx(found[1], rel=1e-4)
    assert python_twin(bearable_shear)(table, models, 0, 2750.0, 1e5, p, s, strain, True, 1.0, gradient) == 0.0
