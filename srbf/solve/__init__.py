"""Solvers, one algorithm a file; they know nothing of light."""
