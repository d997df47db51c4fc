"""How a case is read and explained: YAML text, overrides, errors with their place, schema and manual."""
