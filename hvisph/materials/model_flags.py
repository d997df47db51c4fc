"""Flag of rare models, which the compiled loops of common materials leave out.

Every loop contains the common equations of state, strengths and damage. If a material of a case has another model, its
loops contain all models. A further material thus needs no further loop; results and speed are the same by both
(`tests/test_materials_fitted.py`).
"""

FURTHER = True  # models beyond the common ones of `tags`, pores and fracture energies among them
