"""Experiments beside runs: sets of shots that were fired, computed as sweeps, and how far off they are."""
