"""Lengths, histories and pictures from a run's files."""
