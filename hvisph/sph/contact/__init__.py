"""Contact between bodies."""
