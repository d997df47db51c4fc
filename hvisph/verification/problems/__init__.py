"""Quick verification problems, one a file; the folder `validation` of a source checkout has more."""
