"""Parallel work: threads of this machine, and workers of a Dask cluster."""
