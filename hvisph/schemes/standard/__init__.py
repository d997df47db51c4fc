"""Standard SPH with artificial viscosity."""
