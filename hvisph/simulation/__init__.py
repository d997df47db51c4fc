"""A run: from a case to its objects, the step loop, monitors, files and summary."""
