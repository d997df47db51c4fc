"""Riemann (contact) SPH."""
