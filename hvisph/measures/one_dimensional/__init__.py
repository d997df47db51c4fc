"""Measures of one-dimensional impacts and of single histories."""
