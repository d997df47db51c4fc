"""From a case to a finished run: build, step loop, monitors, summary."""
