"""Arrangements of particles inside shapes, one family a file; `hvisph.geometry.filling` chooses among them."""
