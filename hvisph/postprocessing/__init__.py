"""Runs as objects, comparison of runs, exact solutions of cases, sheets of materials."""
