"""Arrangements of particles inside shapes, one family a file; `hvisph.geometry.fill` chooses among them."""
