"""Total Lagrangian SPH."""
