"""Functions of materials without the models that a case has not: the same numbers, and nothing of those models."""

import numpy as np
import pytest
from test_materials_eos import MODELS, identify
from test_materials_response import DAMAGES, GAS, JC, LATER_DAMAGES, LATER_STRENGTHS, RHO0, STRENGTHS, M, material

from hvisph.compiler.jit import python_twin
from hvisph.materials import stress_update, thermodynamics, traction_limits
from hvisph.materials.eos import IdealGas
from hvisph.materials.material_table import Material, bind_models, pack
from hvisph.materials.porosity import Porosity

PORES = Porosity(1.3, 1e8, 1e9)
METALS = [material(JC, DAMAGES[2]), material(STRENGTHS[2])]
OTHERS = {
    "strength": [material(one) for one in LATER_STRENGTHS],
    "damage": [material(STRENGTHS[2], one) for one in LATER_DAMAGES],
    "pores": [Material("foam", RHO0, GAS, STRENGTHS[2], porosity=PORES)],
}


def states(count):
    generator = np.random.default_rng(4)
    for _ in range(count):
        rho, e = RHO0 * generator.uniform(0.9, 1.4), 10.0 ** generator.uniform(1.0, 7.0)
        s = tuple(1e8 * generator.standard_normal(6))
        s = (s[0], s[1], -s[0] - s[1], *s[3:])
        yield rho, e, s, generator.uniform(0.0, 0.3), generator.choice([0.0, 0.4, 1.0]), generator


def compare(made, packed_with):
    """Compare the functions fitted to `packed_with` with the general ones, for the first of it."""
    table, models = pack([made, *packed_with])
    answers = []
    for name in ("update_stress", "flow_stress", "state_with_history", "shear_modulus", "bearable_tension"):
        general = (
            getattr(stress_update, name, None) or getattr(thermodynamics, name, None) or getattr(traction_limits, name)
        )
        answers.append((name, python_twin(general), python_twin(bind_models(general, table, models))))
    for rho, e, s, strain, damage, generator in states(40):
        l = tuple(1e5 * generator.standard_normal(9))
        memory = (1.2, 1e-4, 2.0, 1.0, 1e3)
        arguments = {
            "update_stress": (1e-8, rho, e, s, strain, damage, memory, l),
            "flow_stress": (rho, e, 1e9, strain, damage, 1e4),
            "state_with_history": (rho, e, damage, 1.2),
            "shear_modulus": (rho, e, 1e9),
            "bearable_tension": (s, damage),
        }
        for name, general, own in answers:
            assert own(table, models, M, *arguments[name]) == general(table, models, M, *arguments[name]), name


@pytest.mark.parametrize("made", [material(a, b) for a in STRENGTHS[1:] for b in DAMAGES], ids=str)
def test_common_models_have_the_general_numbers(made):
    compare(made, [])


@pytest.mark.parametrize("kind", OTHERS)
def test_rare_models_have_the_general_numbers(kind):
    for made in OTHERS[kind]:
        compare(made, METALS)
    compare(METALS[0], OTHERS[kind])


@pytest.mark.parametrize("eos", MODELS, ids=identify)
def test_equations_of_state_have_the_general_numbers(eos):
    compare(material(STRENGTHS[2], eos=eos), METALS)


def test_one_loop_holds_the_common_models_and_one_all():
    """A material of another pair needs no third loop."""
    common, general = bind_models(stress_update.update_stress, *pack(METALS)), stress_update.update_stress
    for model in (*MODELS, *LATER_STRENGTHS, *LATER_DAMAGES):
        made = material(model) if model in LATER_STRENGTHS else material(JC, model)
        made = material(JC, eos=model) if model in MODELS else made
        wanted = common if model in MODELS and model.tag <= IdealGas.tag else general
        assert bind_models(stress_update.update_stress, *pack([made])) is wanted, model
    porous = Material("foam", RHO0, GAS, JC, porosity=PORES)
    assert bind_models(stress_update.update_stress, *pack([porous])) is general
