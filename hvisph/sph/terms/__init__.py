"""Pair laws, one a file."""
