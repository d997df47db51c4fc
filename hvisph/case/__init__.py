"""Data models of a case, their consistency checks, and physical quantities."""
