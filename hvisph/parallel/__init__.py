"""Distributed runs: communication, domain decomposition and halo exchange."""
