"""Verification: problems with an exact solution, run by every formulation that can, found against exact."""
