"""Equations of state, strength, damage, and the stress update.

`material_table.Material` is the material of a body and `material_table.pack` turns materials into
the arrays that compiled loops read; `stress_update` advances the stress.
"""
