"""Warnings at the end of a run."""

from functools import partial

import numpy as np
import pytest

from hvisph.casefile.loader import library, load_material
from hvisph.diagnostics.warnings import ValidityRange, final_warnings, undamaged_crack_share
from hvisph.materials.eos import IdealGas
from hvisph.materials.material_table import Material
from hvisph.materials.validity_limits import outside_range, range_of
from hvisph.output.snapshot import Snapshot
from hvisph.setup.materials import material_of

DX = 1e-3


def snapshot(position, velocity=0.0, energy=0.0, body=0):
    n = len(position)
    fields = {
        "position": position, "velocity": np.full(position.shape, velocity), "mass": np.full(n, 2700 * DX**2),
        "density": np.full(n, 2700.0), "internal_energy": np.broadcast_to(energy, n).astype(float),
    }  # fmt: skip
    zero = np.zeros(n, dtype=int)
    return Snapshot(0.0, 0, 2, fields, zero + body, zero, np.arange(n), ["plate"], ["metal"], {})


@pytest.fixture
def plate():
    x, y = np.meshgrid(np.arange(20) * DX, np.arange(10) * DX)
    return np.column_stack([x.ravel(), y.ravel()])


def said(now, start, whole=True):
    return final_warnings(now, start, ["plate"], [whole], DX)


def test_a_sound_body_has_nothing_to_say(plate):
    start = snapshot(plate, velocity=100.0)
    assert said(start, start) == []


def test_mass_outside_the_domain_is_missing_from_measures(plate):
    (text,) = said(snapshot(plate[:-50]), snapshot(plate))
    assert text == "25 % of the mass has left the `domain`: measures do not contain it"


def test_clumped_pairs(plate):
    moved = plate.copy()
    moved[:6:2] = moved[1:6:2] + 0.1 * DX
    (text,) = said(snapshot(moved), snapshot(plate))
    assert "plate: 3 % of its particles" in text
    assert "clumped" in text


def test_particles_turned_inside_out(plate):
    now = snapshot(plate)
    now.fields["density"][[3, 7]] *= -1.0
    (text,) = said(now, snapshot(plate))
    assert "plate: 2 of its particles are inverted" in text


def test_a_solid_that_tears_says_so_unless_it_may_fail(plate):
    torn = plate + np.where(plate[:, :1] > 14.5 * DX, 5 * DX, 0.0)
    (text,) = said(snapshot(torn), snapshot(plate))
    assert "25 % of it has separated" in text
    assert said(snapshot(torn), snapshot(plate), whole=False) == []
    assert said(snapshot(torn), snapshot(torn)) == []  # it was in pieces from the start


def test_cracks_between_sound_particles_are_told(plate):
    """Ten rows part between columns 14 and 15: by a failed column, and in the rows where none has failed."""
    now = snapshot(plate + np.where(plate[:, :1] > 14.5 * DX, 5 * DX, 0.0))
    for sound in (0, 1, 10):
        now.fields["damage"] = np.where((np.abs(plate[:, 0] - 15 * DX) < 0.5 * DX) & (plate[:, 1] > (sound - 0.5) * DX), 1.0, 0.2)  # fmt: skip
        texts = final_warnings(now, snapshot(plate), ["plate"], [False], DX, cracks=[True])
        assert [text[:34] for text in texts] == (["plate: torn_without_damage 100 %: "] if sound == 10 else [])
        share, torn = undamaged_crack_share(now.fields["position"], plate, now.fields["damage"], DX)
        assert (share, torn) == (pytest.approx(0.1 * sound), sound)


def test_a_plate_that_is_cut_in_two_has_not_torn(plate):
    halves = plate + np.where(plate[:, :1] > 9.5 * DX, 5 * DX, 0.0)
    halves[:10] -= 40 * DX  # and of which 5 % are gone
    cut, torn = snapshot(halves), snapshot(halves)
    cut.fields["plastic_strain"] = np.where(np.abs(plate[:, 0] - 9.5 * DX) < 2 * DX, 1.2, 0.1)
    torn.fields["plastic_strain"] = np.full(len(plate), 0.05)
    (text,) = said(cut, snapshot(plate))
    assert "5 % of it has separated" in text
    (text,) = said(torn, snapshot(plate))
    assert "50 % of it has separated" in text


def test_rings_clump_by_their_sections_whatever_their_radius(plate):
    """A ring's mass goes round the axis: taken for that of the plane, 100 m of rock clumped, and dust never did."""
    for scale in (1e-6, 1.0, 1e6):
        spread = scale * (plate + np.array([0.0, 0.5 * DX]))
        pushed = spread + np.where(np.arange(len(plate))[:, None] % 2 == 0, 0.8 * scale * DX, 0.0) * [1.0, 0.0]
        found = []
        for position in (spread, pushed):
            now = snapshot(position)
            now.metadata["kinematics"] = "axisymmetric"
            now.fields["mass"] = now.fields["density"] * (scale * DX) ** 2 * 2.0 * np.pi * position[:, 1]
            found.append(
                [text for text in final_warnings(now, now, ["plate"], [False], scale * DX) if "clumped" in text]
            )
        assert found[0] == []
        assert len(found[1]) == 1


def test_internal_energy_below_zero(plate):
    start = snapshot(plate, velocity=100.0)
    energy = np.zeros(len(plate))
    energy[3] = -0.5e4 * len(plate)
    (text,) = said(snapshot(plate, 100.0, energy), start)
    assert "negative internal energies" in text


def test_vapour_that_flies_alone_keeps_its_pressure_and_says_so(plate):
    start = snapshot(plate, velocity=2000.0)
    moved = plate.copy()
    moved[:2] -= [[40 * DX, 0.0], [80 * DX, 0.0]]
    now = snapshot(moved, 2000.0)
    now.fields |= {"pressure": np.zeros(len(plate)), "smoothing_length": np.full(len(plate), 1.2 * DX)}
    assert said(now, start, whole=False) == []
    now.fields["pressure"][:2] = 5e9  # of 200 particles: 1.9 MJ/kg of each beside 2 x 2 MJ/kg (two components) of all
    (text,) = said(now, start, whole=False)
    assert "1 % of the mass are isolated" in text
    assert "at up to 5 GPa" in text
    assert "keep 0.46 % of the initial energy" in text
    now.fields["position"][:2] = plate[:2]  # with neighbours it may expand
    assert said(now, start, whole=False) == []


def aluminium(damage=False):
    material = material_of(load_material("aluminium-6061-t6"))
    found = range_of(material)
    return ValidityRange(partial(outside_range, material), found.words, None if damage else found.tension)


def pulled(plate, time, share, pressure=0.0, density=2700.0):
    now = snapshot(plate)
    chosen = np.arange(len(plate)) < share * len(plate)
    now.fields["density"] = np.where(chosen, density, 2700.0)
    now.fields["pressure"] = np.where(chosen, pressure, 0.0)
    now.time = time
    return now


def test_what_leaves_the_range_of_its_material_says_so_once(plate):
    moments = [pulled(plate, k * 1e-6, share, density=1200.0) for k, share in enumerate((0.0, 0.01, 0.05, 0.02))]
    *before, last = moments
    (text,) = final_warnings(last, moments[0], ["plate"], [True], DX, [aluminium()], before)
    assert "5 % of its mass has left the range of its material at 2 us, first at 1 us" in text
    assert "density above 1815 and below 7712 kg/m^3, temperature above 1 K" in text
    assert final_warnings(moments[0], moments[0], ["plate"], [True], DX, [aluminium()], []) == []


def test_tension_beyond_what_a_material_bears_is_named_with_place_and_time(plate):
    moments = [pulled(plate, k * 1e-6, 0.1, pressure=p) for k, p in enumerate((-1e9, -4e9, -2e9))]
    *before, last = moments
    (text,) = final_warnings(last, moments[0], ["plate"], [True], DX, [aluminium()], before)
    assert "tension of up to 4 GPa" in text
    assert "at (0, 0) mm and 1 us" in text
    assert "spalls below 2.69 GPa" in text
    assert final_warnings(last, moments[0], ["plate"], [True], DX, [aluminium(damage=True)], before) == []
    before[1].fields["pressure"][-1] = np.nan  # of a run that failed there
    assert final_warnings(last, moments[0], ["plate"], [True], DX, [aluminium()], before) == [text]


EXPLOSIVES = {"c-4", "composition-b", "pbx-9404", "petn", "tnt"}


@pytest.mark.parametrize("name", [*library()][::4])
def test_a_material_at_rest_and_behind_a_shock_is_within_its_range(name):
    material = material_of(load_material(name))
    bulk = material.density * material.bulk_sound_speed**2
    found = range_of(material)
    rest = np.array([material.density]), np.array([material.eos.ambient_energy])
    assert not outside_range(material, *rest, np.array([300.0])).any()
    assert found.least_density < 0.95 * material.density < 1.05 * material.density < found.greatest_density
    if name in EXPLOSIVES:  # whose products are a gas
        return
    assert 1e-3 * bulk < found.tension <= 0.1 * bulk
    loosest = 1.0 / material.porosity.distension if material.porosity else 1.0
    assert outside_range(material, np.array([0.4 * loosest, 4.0]) * material.density, np.zeros(2)).all()


def test_what_has_failed_may_be_as_thin_as_its_voids_make_it():
    metal = material_of(load_material("copper-ofhc"))
    thin, zero = np.full(4, 0.3 * metal.density), np.zeros(4)
    pressure, damage = np.array([0.0, -1e8, 0.0, 1e8]), np.array([1.0, 0.0, 0.5, 1.0])
    outside = outside_range(metal, thin, zero, None, pressure, damage)
    assert outside.tolist() == [False, True, True, True]
    assert outside_range(metal, 5.0 * thin, zero, None, pressure, damage).tolist() == [False] * 4
    assert outside_range(metal, 11.0 * thin, zero, None, 0.0 * pressure, np.ones(4)).all()  # pressed beyond its range


def test_ends_of_each_kind_of_model():
    vapour = material_of(load_material("aluminium-tillotson"))
    density, energy = np.array([300.0, 300.0, 2700.0]), np.array([2e7, 1e5, -4e6])
    assert outside_range(vapour, density, energy).tolist() == [False, True, True]
    gas = Material("gas", 1.2, IdealGas(1.4, 2e5))
    assert outside_range(gas, np.array([1e-3, 30.0, 1.0]), np.array([1e4, 1e9, -1.0])).tolist() == [False, False, True]
    metal = material_of(load_material("copper-ofhc"))
    one, zero = np.array([metal.density]), np.zeros(1)
    assert outside_range(metal, one, zero, np.array([1.0])).all()  # held at 1 K: too cold to be true
    assert not outside_range(metal, one, zero, np.array([np.nan])).any()
