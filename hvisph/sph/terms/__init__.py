"""Physical terms of the pair laws, one a file: formula, source, constants."""
