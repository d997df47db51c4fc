"""Pairwise numerics: kernels, neighbours, the traversal and its pair laws."""
