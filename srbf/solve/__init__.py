"""Solvers, one algorithm per file, independent of lights."""
