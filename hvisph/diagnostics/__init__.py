"""Diagnostics of a run: balances, extremes, sanity checks and the summary."""
