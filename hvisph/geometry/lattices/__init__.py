"""Particle lattices inside shapes; `hvisph.geometry.filling` selects among them."""
