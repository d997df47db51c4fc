"""Time integration: schemes, the pass that carries every particle on, and the criteria of the next step."""
