"""The probes of a bake: found in the scene before it is planned, handed to workers, and written beside the images."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from srbf.basis.irradiance_harmonics import FACETS, facet_normals
from srbf.errors import InputError
from srbf.io import files
from srbf.probe_grid import ProbeGrid
from srbf.visibility.embree import EmbreeTriangles
from srbf.visibility.probe_nearness import nearness_atlas

PROBES_FILE = "probes.npz"  # of a worker's job
WIDEST = 16_384  # texels of an image's side


def grid_of(facts: dict[str, Any], seed: int) -> ProbeGrid:
    """The probes that a scene's facts tell of, see `blender_bake.scene_query`; how far each sees is traced here.

    InputError where their image would be too large.
    """
    from scipy.spatial import cKDTree

    told, arrays = facts["probes"], facts["arrays"]
    x, y, z = (int(count) for count in told["counts"])
    if max(FACETS * x, y * z) > WIDEST:
        raise InputError(f"expected an image of at most {WIDEST} texels per side, found {FACETS * x}x{y * z}; use probes farther apart")
    places, valid = arrays["probe_places"].reshape(-1, 3).astype(np.float32), arrays["probe_valid"].ravel() > 0
    sources = np.flatnonzero(valid)[cKDTree(places[valid]).query(places)[1]]
    sources[valid] = np.flatnonzero(valid)  # of probes that were moved to one place, each has its own
    spacing = float(told["spacing"])
    nearness = nearness_atlas(EmbreeTriangles(arrays["occluders"]), places, sources, seed)
    x0, y0, z0 = (float(value) for value in told["origin"])
    return ProbeGrid((x0, y0, z0), spacing, (x, y, z), places[sources], sources, nearness)


def write_job(grid: ProbeGrid, path: Path) -> dict[str, Any]:
    """What a worker needs of the probes, into the file `path`; the job's receiver."""
    with files.atomic_path(path) as temporary, open(temporary, "wb") as file:
        np.savez(file, counts=np.array(grid.counts), spacing=grid.spacing, places=grid.places, valid=grid.valid, normals=facet_normals())
    return {"kind": "probes", "file": str(path.resolve()), "described": grid.described()}


def facts_line(grid: ProbeGrid, moved: int) -> str:
    """What was found, in a line."""
    x, y, z = grid.counts
    return (
        f"{int(grid.valid.sum())} probes on a grid of {x}x{y}x{z} nodes {grid.spacing:g} m apart, {moved} moved off surfaces; "
        f"{int((~grid.valid).sum())} nodes are in geometry or outside"
    )
