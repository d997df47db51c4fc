"""Pair laws."""
