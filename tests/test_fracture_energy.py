"""Fracture energy: the work of a crack is that of the material, at any width of its band and in any mode."""

import numpy as np
import pytest

from hvisph.casefile.loader import load_case
from hvisph.casefile.material_library import load_material, material_names
from hvisph.core.errors import CaseError
from hvisph.materials.damage import CockcroftLatham, JohnsonCookDamage, PressureCutoff
from hvisph.materials.damage.fracture_energy import FractureEnergy, fracture_work
from hvisph.materials.eos import Linear
from hvisph.materials.material_table import Material
from hvisph.materials.strength import VonMises
from hvisph.precheck.advice import advice
from hvisph.setup.build import build
from hvisph.setup.material_point import drive

ENERGY, YIELD, BULK, SHEAR = 20e3, 350e6, 74e9, 27.6e9
WIDTHS = (1e-4, 1e-3, 4e-3)


def metal(damage, fitted=0.0):
    strength = VonMises(shear_modulus=SHEAR, yield_stress=YIELD)
    return Material("metal", 2703.0, Linear(BULK), strength, damage, fracture=FractureEnergy(ENERGY, fitted))


def work_from(record, onset, volume):
    """Work of pressure and plastic flow from a record on, per volume, by the trapezoidal rule."""
    q, p, d_strain = record["von_mises_stress"][onset:], record["pressure"][onset:], record["plastic_strain"][onset:]
    plastic = (0.5 * (q[1:] + q[:-1]) * np.diff(d_strain)).sum()
    return plastic - (0.5 * (p[1:] + p[:-1]) * np.diff(volume[onset:])).sum()


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("damage", [JohnsonCookDamage(d1=0.02), CockcroftLatham(2e6)])
def test_a_band_in_shear_takes_the_fracture_energy(damage, width):
    """Trapezoids follow a linear softening exactly; what is left is the last step: 1e-6 at so many steps."""
    failure = 0.03 if isinstance(damage, JohnsonCookDamage) else 0.06
    strain = np.sqrt(3.0) * (failure + 2.2 * ENERGY / (width * YIELD))
    record = drive(metal(damage), "shear", 1e4, strain, 4000, width=width)
    onset = np.flatnonzero(record["damage"] > 0.0)[0] - 1
    assert record["damage"][-1] == 1.0
    assert work_from(record, onset, 0.0 * record.strain) * width == pytest.approx(ENERGY, rel=1e-6)


@pytest.mark.parametrize("width", WIDTHS)
def test_a_band_in_tension_takes_the_fracture_energy(width):
    """Also beyond the width at which it would snap back, 2 E' G_f/p_0^2 = 1.4 mm, where its strength is less."""
    strength, modulus = 1.8e9, BULK + 4.0 * SHEAR / 3.0
    record = drive(metal(PressureCutoff(-strength, True)), "uniaxial_strain", 1e5,
                   strength / BULK + 2.5 * ENERGY / (width * 0.7e9), 8000, width=width)  # fmt: skip
    onset = int((-record["pressure"]).argmax())
    borne = min(strength, np.sqrt(2.0 * modulus * ENERGY / width))
    assert -record["pressure"][onset] == pytest.approx(borne, rel=1e-3)
    assert record["damage"][-1] == 1.0
    assert work_from(record, onset, record.strain) * width == pytest.approx(ENERGY, rel=2e-5)  # beyond l_max: 1e-5


def test_the_fitted_width_counts_where_the_metal_softens_alone():
    """Perfect plasticity never softens: L_0 changes nothing."""
    plain, fitted = (drive(metal(JohnsonCookDamage(d1=0.02), l_0), "shear", 1e4, 0.06, 300) for l_0 in (0.0, 1e-4))
    assert np.array_equal(plain.values, fitted.values)


# Strength beside the weak row over its own: gradients of Total Lagrangian bodies share the crack among three rows.
BESIDE = {"riemann": 3.0, "total_lagrangian": 1.5}


def bar(formulation, dx, turn=0.0):
    """Energy of the band of a bar with a weak row, over that of the crack, and the largest damage."""
    length, width, rate, end = 40e-3, 4e-3, 3e3, 20e-6
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    material = {"density": 2703.0, "eos": {"type": "mie_gruneisen", "sound_speed": 5240.0, "s1": 1.4, "gamma": 1.97},
                "strength": {"type": "von_mises", "shear_modulus": SHEAR, "yield_stress": 5e9},
                "damage": {"type": "johnson_cook", "d1": 0.5, "fracture_energy": ENERGY}}  # fmt: skip
    body = {"material": material, "shape": {"type": "box", "size": [length, width]}, "rotation": f"{turn} deg"}
    setup = build(load_case({"kinematics": "plane_strain", "resolution": dx, "bodies": {"bar": body},
                             "time": {"end": end}, "formulation": {"type": formulation}}))  # fmt: skip
    stepper, particles = setup.stepper, setup.particles
    axis = np.array([c, s])
    along = (particles["position"] - particles["position"].mean(axis=0)) @ axis
    along = along - along[np.abs(along).argmin()]
    particles["velocity"] = rate * along[:, None] * axis
    weak = np.where(np.abs(along) < 0.5 * dx, 1.0, BESIDE[formulation])
    particles["onset_damage"] = 1.0
    particles["onset_flow_stress"], particles["onset_tension"] = weak * YIELD, weak * YIELD / np.sqrt(3.0)
    stepper.start()
    band, time = particles.id[np.abs(along) < 3.5 * dx], 0.0
    while time < end:
        dt = setup.criteria.limit(stepper.lengths, stepper.signals, stepper.rates, stepper.place, particles.id).dt
        dt = min(dt, *(0.3 * one[0] for one in stepper.limits()), end)
        stepper.predict(dt)
        stepper.evaluate()
        stepper.complete(dt, dt)
        time += dt
    chosen = np.isin(particles.id, band)
    work = fracture_work(particles["mass"], np.full(len(chosen), 2703.0), particles["damage"],
                         particles["onset_tension"], particles["band_width"], np.full(len(chosen), ENERGY))  # fmt: skip
    return work[chosen].sum() / (ENERGY * width), particles["damage"].max()


@pytest.mark.parametrize("formulation", ["riemann", "total_lagrangian"])
def test_a_bar_breaks_by_one_crack_at_any_spacing(formulation):
    """What the band takes in crack energy, rows beside it included, agrees between spacings; straight or turned."""
    works = [bar(formulation, dx) for dx in (1e-3, 0.5e-3)] + [bar(formulation, 1e-3, 37.0)]
    assert [damage for _, damage in works] == [1.0] * 3
    energies = np.array([work for work, _ in works])
    assert np.ptp(energies) < 0.15 * energies.mean()
    assert energies.mean() == pytest.approx(1.1, abs=0.25)


def case_with(damage, **further):
    material = {"density": 2703.0, "eos": {"type": "linear", "bulk_modulus": BULK},
                "strength": {"type": "von_mises", "shear_modulus": SHEAR, "yield_stress": YIELD}}  # fmt: skip
    body = {"material": material | {"damage": damage} | further, "shape": {"type": "box", "size": [1e-2, 1e-2]}}
    return load_case({"kinematics": "plane_strain", "resolution": 1e-3, "bodies": {"a": body}, "time": {"end": 1e-6}})


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        ({"type": "johnson_cook", "d1": 0.1, "fracture_energy": 1e4, "toughness": 3e7}, "either fracture_energy or"),
        ({"type": "johnson_cook", "d1": 0.1, "fracture_energy": -1.0}, "out of range"),
        ({"type": "johnson_cook", "d1": 0.1, "fitted_at": 1e-3}, "belongs to a fracture energy"),
        ({"type": "johnson_cook", "d1": 0.1, "toughness": "material"}, "no fracture_toughness"),
        ({"type": "pressure_cutoff", "pressure": -1e9, "fracture_energy": 1e4}, "requires permanent"),
        (
            {"type": "cockcroft_latham", "critical_work": 1e8, "toughness": 3e7, "failed_strength": "unchanged"},
            "soften",
        ),
    ],
)
def test_bad_fracture_energies_are_refused(damage, message):
    with pytest.raises(CaseError, match=message):
        case_with(damage)


@pytest.mark.parametrize(("name", "dx", "told"), [("aluminium-6061-t6", 1e-3, "l_max = 0.695 mm"),
                                                  ("aluminium-6061-t6", 0.4e-3, ""),
                                                  ("aluminium-6061-t6", 10e-6, "lattice separates"),
                                                  ("aluminium-7075-t6", 0.5e-3, "three times")])  # fmt: skip
@pytest.mark.parametrize("formulation", ["riemann", "total_lagrangian"])
def test_widths_of_bands_are_checked_and_the_remedy_passes(name, dx, told, formulation):
    """6061-T6: 2 E' G_f/p_0^2 of 10.7 kJ/m^2 and 1.8 GPa is 0.695 mm; bands of Total Lagrangian are 3 dx."""
    wide = 3.0 if formulation == "total_lagrangian" else 1.0
    body = {"material": {"base": name, "damage": {"toughness": "material"}},
            "shape": {"type": "box", "size": [1e-2, 1e-2]}, "velocity": [10.0, 0.0]}  # fmt: skip
    case = {"kinematics": "plane_strain", "resolution": dx / wide, "bodies": {"a": body}, "time": {"end": 1e-6},
            "formulation": {"type": formulation}}  # fmt: skip
    texts = [text for text in advice(load_case(case)) if "bands" in text]
    assert len(texts) == (told != "")
    for text in texts:
        assert told in text
        key, _, finer = text.rsplit("'", 2)[1].partition("=")
        assert not [one for one in advice(load_case(case | {key: finer})) if "bands" in one]


def test_the_library_keeps_its_models_and_offers_its_toughness():
    for name in material_names():
        material = load_material(name)
        assert not getattr(material.damage, "breaks", False)
        if material.fracture_toughness is not None:
            damage = material.damage.model_dump(exclude_unset=True) | {"toughness": "material"}
            case_with(damage, base=name, density=material.density, eos=material.eos.model_dump(exclude_unset=True),
                      strength=material.strength.model_dump(exclude_unset=True))  # fmt: skip


def test_a_toughness_is_a_fracture_energy():
    """G_f = K^2 (1 - nu^2)/E, Irwin; 29 MPa m^0.5 of an aluminium alloy are some 11 kJ/m^2."""
    young = 9.0 * BULK * SHEAR / (3.0 * BULK + SHEAR)
    energy = 29e6**2 * (1.0 - (young / (2.0 * SHEAR) - 1.0) ** 2) / young
    for damage, further in (({"toughness": 29e6}, {}), ({"toughness": "material"}, {"fracture_toughness": 29e6})):
        case = case_with({"type": "johnson_cook", "d1": 0.1} | damage, **further)
        (compliance,) = build(case).stepper.table[:, 27]
        assert 0.5 / compliance == pytest.approx(energy, rel=1e-12)
