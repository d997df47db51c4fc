"""Integer tags of models in compiled loops; common models come first, as `material_table.bind_models` requires.

Every loop contains the common equations of state, strengths and damage. If a material of a case has another model, its
loops contain all models, by the flag `FURTHER`. A further material thus needs no further loop; results and speed are
the same by both (`tests/test_materials_fitted.py`).
"""

# Equations of state
LINEAR, ELASTIC, STIFFENED_GAS, MIE_GRUENEISEN, IDEAL_GAS = range(5)
TILLOTSON, POLYNOMIAL, MURNAGHAN, JWL, TABLE, US_UP_TABLE, LATE = range(5, 12)

# Strength
NO_STRENGTH, ELASTIC_STRENGTH, VON_MISES, LINEAR_HARDENING, JOHNSON_COOK = range(5)
STEINBERG_GUINAN, STEINBERG_LUND, ZERILLI_ARMSTRONG, COWPER_SYMONDS, ROCK, JOHNSON_HOLMQUIST = range(5, 11)
ORTHOTROPIC, FABRIC = range(11, 13)  # anisotropic ones come last

# Damage
NO_DAMAGE, PRESSURE_CUTOFF, JOHNSON_COOK_DAMAGE = range(3)
GRADY_KIPP, GRADY_SPALL, PRINCIPAL_STRESS, COCKCROFT_LATHAM, CRUSHING = range(3, 8)
HASHIN, MAX_STRESS = range(8, 10)

FURTHER = True  # models beyond the common ones, pores and fracture energies among them
