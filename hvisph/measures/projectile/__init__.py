"""Measures of the projectile and of bars."""
