"""Time integration: schemes, particle update and time-step criteria."""
