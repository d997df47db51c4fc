"""HTML report of one or several runs in a single file."""
