"""Smoothed particle hydrodynamics: kernels, neighbours, pair traversal and pair laws."""
