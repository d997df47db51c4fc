"""Exact solutions: Hugoniots, plate impact, layered impact."""
