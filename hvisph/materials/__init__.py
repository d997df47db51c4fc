"""Equations of state, strength, damage, and the stress update.

`table.Material` names what a body is made of; `table.pack` turns materials into the
arrays that compiled loops read; `response.respond` is the stress update.
"""
