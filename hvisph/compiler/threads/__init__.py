"""Threads of compiled loops: the parallel loop, its primitives and the guard against forks."""
