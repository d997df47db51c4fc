"""Parameter sweeps: design, workers and analysis."""
