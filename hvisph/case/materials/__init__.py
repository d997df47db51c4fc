"""Case models of materials: equation of state, strength, damage, thermal properties."""
