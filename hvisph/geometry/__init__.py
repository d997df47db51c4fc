"""Shapes of bodies, and their particle positions and volumes."""
