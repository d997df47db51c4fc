"""What every room needs: errors, the state, compiled tensor algebra, numba's options."""
