"""Consistency of a case: checks of its parts against each other."""
