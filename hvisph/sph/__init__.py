"""Smoothed particle hydrodynamics: kernels, neighbours, pair traversal, physical terms and contact."""
