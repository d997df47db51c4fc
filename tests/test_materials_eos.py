"""Equations of state: ambient state, known points, derivatives, behaviour beyond validity."""

from math import sqrt

import numpy as np
import pytest

from hvisph.core.errors import CaseError
from hvisph.materials import isentrope, slots
from hvisph.materials.eos import (
    MODULES,
    REGISTRY,
    Elastic,
    Grid,
    IdealGas,
    JonesWilkinsLee,
    Linear,
    MieGrueneisen,
    Murnaghan,
    Polynomial,
    StiffenedGas,
    Table,
    Tillotson,
    UsUpTable,
    pressure_and_sound_speed,
)
from hvisph.materials.material_table import Material, pack

RHO0 = 2785.0
ALUMINIUM = Tillotson(75.2e9, 65e9, 0.5, 1.63, 5e6, 5.0, 5.0, 3e6, 13.9e6, expansion="full")


def tabulated(material, heat_capacity=900.0):
    """A table of another equation of state: p and e of density and temperature, as a laboratory would give it."""
    rho = np.concatenate([np.geomspace(1.0, 1000.0, 20), np.linspace(1200.0, 9000.0, 196), np.geomspace(9500, 3e4, 12)])
    heat = np.concatenate([[0.0], np.geomspace(50.0, 2e5, 120)])
    curve = material.whole_row[slots.CURVE : isentrope.HEATS : isentrope.WIDTH]
    axis = material.density * np.linspace(isentrope.LOWEST, isentrope.HIGHEST, isentrope.POINTS)
    energy = np.interp(rho, axis, curve)[:, None] + heat_capacity * heat
    pressure = np.array([[material.pressure(r, e) for e in of_r] for r, of_r in zip(rho, energy, strict=True)])
    return Grid(rho, heat, pressure, energy)


MODELS = [
    Linear(79.06e9),
    Elastic(74.17e9, 0.344),
    StiffenedGas(5328.0, 2.0),
    MieGrueneisen(5328.0, 2.0, 1.338),
    UsUpTable(((0.0, 5328.0), (800.0, 6200.0), (1500.0, 6300.0), (4000.0, 10000.0)), 2.0),
    MieGrueneisen(5328.0, 2.0, 1.2, s2=0.3, s3=-0.1, a=0.48),
    MieGrueneisen(5328.0, 2.0, 1.2, s2=-0.1, a=0.48, linear_expansion=True),
    IdealGas(1.4, 2e5),
    ALUMINIUM,
    Polynomial(79.06e9, 131.2e9, 50e9, 2.0, 0.48),
    Murnaghan(26.7e9, 4.0),
    Murnaghan(26.7e9, 4.0, 1.5),
    JonesWilkinsLee(371.2e9, 3.231e9, 4.15, 0.95, 0.30, 7e9, RHO0),
    Table(tabulated(Material("al", 2700.0, ALUMINIUM)), RHO0),
]


def identify(model):
    return f"{model.name}-{getattr(model, 's2', '')}"


@pytest.mark.parametrize("model", MODELS, ids=identify)
def test_a_body_at_rest_is_at_its_ambient_state(model):
    material = Material("x", RHO0, model)
    at_rest = material.pressure(RHO0, model.ambient_energy)
    if model.name not in ("ideal_gas", "jwl", "table"):  # these are under pressure at rest
        assert at_rest == 0.0
    c = sqrt(material.sound_speed_squared(RHO0, model.ambient_energy))
    assert c == pytest.approx(material.bulk_sound_speed, rel=1e-14)  # two roundings


@pytest.mark.parametrize("model", MODELS, ids=identify)
@pytest.mark.parametrize("compression", [0.4, 0.9, 0.99, 1.001, 1.1, 1.4])
@pytest.mark.parametrize("e", [0.0, 1e5, 4e6])
def test_sound_speed_is_the_slope_of_an_isentrope(model, compression, e):
    material = Material("x", RHO0, model)
    rho, step = compression * RHO0, 1e-5 * compression * RHO0
    # Along an isentrope de = p drho / rho^2; a midpoint gradient keeps the second order.
    p = material.pressure(rho, e)
    slope = p / rho**2
    curvature = (material.pressure(rho + step, e + slope * step) - p) / step / rho**2 - 2.0 * p / rho**3

    def on_isentrope(d):
        return material.pressure(rho + d, e + slope * d + 0.5 * curvature * d * d)

    difference = (on_isentrope(step) - on_isentrope(-step)) / (2.0 * step)
    scale = material.bulk_sound_speed**2
    # Central difference: error of order (step/rho)^2 = 1e-10, and rounding 1e-16/1e-5.
    assert abs(material.sound_speed_squared(rho, e) - difference) < 1e-7 * (scale + abs(difference))


CONDENSED = [
    MieGrueneisen(5328.0, 2.0, 1.338),
    UsUpTable(((0.0, 5328.0), (800.0, 6200.0), (1500.0, 6300.0), (4000.0, 10000.0)), 2.0),
    MieGrueneisen(3940.0, 2.02, 1.489, a=0.48),
    Polynomial(79.06e9, 131.2e9, 50e9, 2.0),
    Murnaghan(26.7e9, 4.0, 1.5),
]


@pytest.mark.parametrize("model", CONDENSED, ids=identify)
def test_condensed_matter_that_expands_keeps_its_sound_speed_at_rest_density(model):
    """The share of the pressure that is left falls from 1 without a slope: hot matter has one sound speed at rho0."""
    material = Material("x", RHO0, model)
    for e in (0.0, 5e6):
        p, c = ([f((1.0 + side) * RHO0, e) for side in (-1e-9, 1e-9)]
                for f in (material.pressure, material.sound_speed_squared))  # fmt: skip
        assert p[0] == pytest.approx(p[1], abs=1e-8 * RHO0 * material.bulk_sound_speed**2)
        assert c[0] == pytest.approx(c[1], rel=1e-7)


@pytest.mark.parametrize("model", CONDENSED, ids=identify)
def test_hot_debris_at_half_a_percent_of_its_density_pushes_no_more_than_a_gas(model):
    material, e = Material("x", RHO0, model), 2e7
    shares = np.array([0.5, 0.05, 0.005, 5e-4])
    p = np.array([material.pressure(share * RHO0, e) for share in shares])
    assert (np.diff(p) < 0.0).all()
    assert (p > 0.0).all()
    assert (p[1:] < 2.0 / 3.0 * shares[1:] * RHO0 * e * (1.0 + 6.0 * shares[1:])).all()
    c = sqrt(material.sound_speed_squared(0.005 * RHO0, e))
    assert c < 1.1 * sqrt(2.0 / 3.0 * 5.0 / 3.0 * e)  # a gas of single atoms with all of the energy
    assert abs(material.pressure(1e-9 * RHO0, 0.0)) < 1e-7 * RHO0 * material.bulk_sound_speed**2


def test_the_printed_line_of_expansion_keeps_its_thermal_pressure():
    material = Material("x", RHO0, MieGrueneisen(5328.0, 2.0, 1.338, linear_expansion=True))
    p = material.pressure(0.005 * RHO0, 2e7)
    assert p == pytest.approx(RHO0 * (5328.0**2 * -0.995 + 2.0 * 2e7), rel=1e-14)
    assert sqrt(material.sound_speed_squared(0.005 * RHO0, 2e7)) > 2e5  # [m/s]


@pytest.mark.parametrize("model", MODELS, ids=identify)
def test_compiled_dispatch_agrees_with_each_models_own_functions(model):
    material = Material("x", RHO0, model)
    row = slots.values(material.whole_row)
    for rho in (0.7 * RHO0, RHO0, 1.3 * RHO0):
        p, c = pressure_and_sound_speed(model.tag, rho, 3e5, row)
        own = material.pressure(rho, 3e5)
        # a few roundings of the largest term
        assert p == pytest.approx(own, rel=1e-12, abs=1e-12 * 79e9)
        square = max(material.sound_speed_squared(rho, 3e5), row[slots.SOUND_SPEED_SQUARED_FLOOR])
        assert c == pytest.approx(sqrt(square), rel=1e-12)


def test_mie_grueneisen_returns_its_reference_hugoniot():
    """On the Hugoniot p = rho0 U u and e = u^2/2 with U = c0 + s u: the model must give p back."""
    material = Material("al", RHO0, MieGrueneisen(5328.0, 2.0, 1.338))
    for u in (100.0, 1550.0, 3000.0):
        shock = 5328.0 + 1.338 * u
        rho = RHO0 * shock / (shock - u)
        assert material.pressure(rho, 0.5 * u * u) == pytest.approx(RHO0 * shock * u, rel=1e-11)


def test_cubic_hugoniot_solves_its_us_up_relation():
    """U = c0 + s1 u + s2 u^2/U + s3 u^3/U^2 (Steinberg): with gamma0 = a = 0 the pressure is p_H."""
    s1, s2, s3, c0 = 1.2, 0.3, -0.1, 5328.0
    material = Material("x", RHO0, MieGrueneisen(c0, 0.0, s1, s2=s2, s3=s3))
    # Without gamma the model's p = rho0 c0^2 mu (1 + mu)/D^2 is exactly rho0 U u at u/U = x.
    for x in (0.05, 0.2, 0.35):
        shock = c0 / (1.0 - x * (s1 + x * (s2 + x * s3)))
        rho = RHO0 / (1.0 - x)
        assert material.pressure(rho, 0.0) == pytest.approx(RHO0 * shock * shock * x, rel=1e-11)


def test_mie_grueneisen_stays_finite_and_rising_beyond_the_limiting_compression():
    material = Material("al", RHO0, MieGrueneisen(5328.0, 2.0, 1.338))
    rho = np.linspace(1.0, 12.0, 400) * RHO0
    p = np.array([material.pressure(r, 0.0) for r in rho])
    assert np.isfinite(p).all()
    assert (np.diff(p) > 0.0).all()


@pytest.mark.parametrize("model", MODELS, ids=identify)
def test_sound_speed_is_never_below_a_tenth_of_the_ambient_one(model):
    material = Material("x", RHO0, model)
    row = slots.values(material.whole_row)
    for rho in (0.02 * RHO0, 0.3 * RHO0, 5.0 * RHO0):
        for e in (-1e6, 0.0, 1e7):
            _, c = pressure_and_sound_speed(model.tag, rho, e, row)
            assert c >= 0.1 * material.bulk_sound_speed * (1 - 1e-12)


def test_functions_of_a_table_outlive_the_material_that_they_are_of():
    def function():
        return Material("x", RHO0, MODELS[-1]).pressure_function()

    of_both = function()
    rows = [np.full_like(Material("x", RHO0, MODELS[-1]).whole_row, np.nan) for _ in range(8)]  # where it may have been
    assert of_both(3000.0, 1e6) == Material("x", RHO0, MODELS[-1]).pressure(3000.0, 1e6)
    assert np.isnan(rows).all()


def test_a_value_that_is_no_number_stays_none():
    for model in MODELS:
        row = Material("x", RHO0, model).whole_row
        p, _ = pressure_and_sound_speed(model.tag, np.nan, np.nan, slots.values(row))
        assert np.isnan(p)


def test_registry_names_every_model_and_every_tag_is_its_own():
    assert set(REGISTRY) == {model.name for model in MODELS}
    assert set(MODULES) == {*REGISTRY, "late"}  # of late stages, which no material has by itself
    assert len({model.tag for model in REGISTRY.values()}) == len(REGISTRY)


def test_packing_puts_every_field_in_its_own_slot():
    """Changing any one field must change the packed row, inside the block of the model's kind."""
    changed = StiffenedGas(5000.0, 2.0)
    table, models = pack([Material("a", RHO0, StiffenedGas(5328.0, 2.0)), Material("b", RHO0, changed)])
    assert table.shape == (2, slots.SLOT_COUNT + isentrope.LENGTH)
    assert table.dtype == np.float64
    assert models.dtype == np.int64
    assert (table[0] != table[1])[: slots.SLOT_COUNT].nonzero()[0].tolist() == [
        slots.SOUND_SPEED_SQUARED_FLOOR,
        slots.EOS[0],
    ]


def test_a_gas_without_energy_is_refused():
    with pytest.raises(CaseError):
        IdealGas(1.4, 0.0)


@pytest.mark.parametrize("order", [1, 2, 3])
def test_points_of_a_hugoniot_are_fitted_by_a_curve_of_any_order(order):
    """Points of a known curve give its coefficients back, and no residuals; too few of them are refused."""
    from hvisph.case.materials.eos import MieGruneisenEos

    c0, s = 3145.0, [1.8, -0.9, 0.7][:order]
    points = []
    for up in np.linspace(300.0, 4000.0, 9):
        us = c0 + 2.0 * up
        for _ in range(200):
            us = c0 + sum(one * up * (up / us) ** k for k, one in enumerate(s))
        points.append((up, us))
    eos = MieGruneisenEos(us_up=tuple(points), us_up_order=order, gamma=1.4)
    assert eos.hugoniot == pytest.approx((c0, *s, *[0.0] * (3 - order)), rel=1e-9)
    assert np.abs(eos.residuals).max() < 1e-6
    with pytest.raises(ValueError, match="particle velocities at least"):
        MieGruneisenEos(us_up=tuple(points[:order]), us_up_order=order, gamma=1.4)
