"""Bodies to particle positions and volumes."""
