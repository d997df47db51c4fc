"""Reference frame of measures: axis, bodies, roles and initial geometry."""
