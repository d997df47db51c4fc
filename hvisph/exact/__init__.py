"""Exact solutions that results are checked against: Hugoniots, plate impact, layered impact."""
