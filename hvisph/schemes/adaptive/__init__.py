"""Adaptive Total Lagrangian-Eulerian SPH (Young 2021)."""
