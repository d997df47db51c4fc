"""Measures of debris: fragments, cloud, witness plate, voids."""
