"""What is around a run: several of them side by side, and the exact solution of a case."""
