"""Errors, particle state, and catalogues of fields, measures, kernels and kinematics."""
