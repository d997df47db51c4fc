"""Contact (Riemann) SPH."""
