"""Measures of a run from its files alone: lengths, peaks, voids, fragments, comparison with expected values."""
