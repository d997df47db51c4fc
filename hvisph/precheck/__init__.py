"""Checks and estimates before a run: impact pair, regime, advice, cost."""
