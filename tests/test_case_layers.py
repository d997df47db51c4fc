"""Layers without units: Cauchy numbers in both readings, order, overlap, mixed systems of units, and what is bundled."""

import pytest

from hvisph.casefile.document import parse
from hvisph.casefile.loader import bundled_cases, dump_case, load_case
from hvisph.core.catalogues import REACH
from hvisph.core.errors import CaseError
from hvisph.setup.bodies import placed_bodies
from hvisph.setup.materials import material_of
from hvisph.sph.kernels import KERNELS


def two_layers(**changes):
    eos = {"type": "linear", "cauchy_number": 4.0}
    return {
        "units": "none",
        "kinematics": "uniaxial_strain",
        "resolution": 0.01,
        "bodies": {
            "a": {
                "material": {"density": 1.0, "eos": eos},
                "shape": {"type": "interval", "length": 0.5},
                "velocity": 1,
            },
            "b": {"material": {"density": 0.5, "eos": eos}, "shape": {"type": "interval", "length": 0.5}},
        },
        "formulation": {"type": "eulerian"},
        "time": {"end": 0.1},
    } | changes


def test_both_readings():
    case = two_layers()
    light = material_of(load_case(case).bodies["b"].material)
    assert light.eos.bulk_modulus == pytest.approx(0.5 / 4.0)
    assert light.bulk_sound_speed == pytest.approx(4.0**-0.5)  # whatever the density
    case["bodies"]["b"]["material"]["eos"] = {"type": "linear", "cauchy_number": 4.0, "definition": "density_ratio"}
    ratio = material_of(load_case(case).bodies["b"].material)
    assert ratio.eos.bulk_modulus == pytest.approx(1.0 / 4.0)
    assert ratio.bulk_sound_speed == pytest.approx((0.25 / 0.5) ** 0.5)


def test_survives_being_written_out():
    case = load_case(two_layers())
    assert load_case(parse(dump_case(case), "dumped").value) == case


@pytest.mark.parametrize(
    ("eos", "words"),
    [
        ({"type": "linear", "cauchy_number": 4.0, "bulk_modulus": 1.0}, "leave one out"),
        ({"type": "linear"}, "give the bulk modulus K or a cauchy_number"),
        ({"type": "linear", "bulk_modulus": 1.0, "definition": "density_ratio"}, "beside `cauchy_number`"),
        ({"type": "linear", "bulk_modulus": "2 GPa"}, "only plain numbers are allowed"),
        ({"type": "linear", "cauchy_number": 0}, "must be above 0"),
    ],
)
def test_refused_stiffness(eos, words):
    case = two_layers()
    case["bodies"]["a"]["material"]["eos"] = eos
    with pytest.raises(CaseError, match="bodies.a.material.eos") as caught:
        load_case(case)
    assert words in str(caught.value)


def test_mixed_systems_of_units():
    with pytest.raises(CaseError, match="only with|has a meaning only in a case with `units: none`"):
        load_case(two_layers(units="si"))
    with pytest.raises(CaseError, match=r"resolution.*`units: none`, so only plain numbers"):
        load_case(two_layers(resolution="0.1 mm"))
    case = two_layers()
    case["bodies"]["a"]["material"] = "aluminium-howell-ball"
    with pytest.raises(CaseError, match="the library is in SI"):
        load_case(case)


def test_unordered_and_overlapping_layers():
    case = two_layers()
    case["bodies"]["a"]["position"], case["bodies"]["b"]["position"] = 1.0, 0.0
    with pytest.raises(CaseError, match=r"bodies.b.position: stands left of 'a'.*from left to right"):
        placed_bodies(load_case(case))
    case["bodies"]["b"]["position"] = 1.3
    with pytest.raises(
        CaseError, match=r"bodies.a: overlaps 'b': by .* spacings or more, at \(1\.\d+\); move one"
    ) as caught:
        placed_bodies(load_case(case))
    assert "mm" not in str(caught.value)


def test_bodies_whose_particles_would_be_rounded_together_are_refused():
    case = two_layers()
    for body, place in zip("ab", (0.0, 1e20), strict=True):
        case["bodies"][body]["position"] = place
    with pytest.raises(CaseError, match=r"bodies.b: lies so far from the origin.*resolved to 1.6e\+04 only"):
        placed_bodies(load_case(case))
    case["bodies"]["b"]["position"] = 1e3
    assert len(placed_bodies(load_case(case))) == 2


def test_every_kernel_has_its_place_in_the_case_file():
    assert set(REACH) == set(KERNELS)


def test_the_published_layers():
    names = [name for name in bundled_cases() if name.startswith("published/layered/")]
    assert len(names) == 18
    case = load_case("published/layered/st_glass_st")
    assert [round(b.material.density, 4) for b in case.bodies.values()] == [1.0, 1.0, 0.2375, 1.0]
    assert [b.material.eos.cauchy_number for b in case.bodies.values()] == [3.9, 3.9, 7.6, 3.9]
    assert (case.formulation.kernel, case.formulation.h_over_dx, case.time.step) == ("gaussian", 1.2, 1e-4)
    assert case.formulation.density_dissipation.alpha == 0.3
    gap = load_case("published/layered/test_gap")
    assert (gap.bodies["alpha"].gap, gap.formulation.density_dissipation.alpha) == (0.1, 0.8)
    for name in names:
        if name.endswith("no_dissipation"):
            with_it = load_case(name.removesuffix("_no_dissipation"))
            without = load_case(name)
            assert without.formulation.density_dissipation.type == "none"
            changed = with_it.formulation.model_copy(
                update={"density_dissipation": without.formulation.density_dissipation}
            )
            assert without.model_copy(update={"title": with_it.title, "formulation": changed}) == with_it.model_copy(
                update={"formulation": changed}
            )
