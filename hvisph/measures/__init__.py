"""What is measured on a run's files alone: lengths, peaks, voids, fragments, and comparison with expected values."""
