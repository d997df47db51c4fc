"""Time integrators and named time-step criteria."""
