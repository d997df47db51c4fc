"""Set-up of a run: from a case to particles, materials and schemes."""
