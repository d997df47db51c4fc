"""Case files: YAML, overrides, error messages, schema and manual."""
