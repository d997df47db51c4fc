"""Neighbour search and traversal of pairs."""
