"""Text output of the command line: tables, progress, numbers with units."""
