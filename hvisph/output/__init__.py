"""Snapshots, histories, the run folder and their reader."""
