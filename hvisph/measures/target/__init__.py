"""Measures of targets: hole, perforation, damage, plug, impulse."""
