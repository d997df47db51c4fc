"""Which passes make a step, for each published formulation."""
