"""Vector lanes of compiled loops: arithmetic, masks, gathers and the neighbour filter."""
