"""SPH-projection (Farahani 2009)."""
