"""What a user writes: models of the case file, its loader, units and the material library."""
