"""Published formulations: the passes that make a step of each."""
