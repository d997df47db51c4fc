"""Compilation of loops and scalar functions by numba, with vector lanes, tensors and a cache."""
