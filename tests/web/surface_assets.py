"""A made room whose objects emit and are repainted, as it lies on disk, and what numpy knows of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from cloud_assets import PATCHES, Room

from srbf.io.packed_table import pack
from srbf.methods.surface_changes import OF_SURFELS, Surfaces

MOST = 0.245  # of entries: a bounce keeps 0.77 of the light of the shape that fades last, and 0.95 with a red wall, too much for 64 bounces
STEP = 2.0**-12  # of entries of gather: more of them than a byte tells


def with_surfaces(made: Room, bounces: int | None) -> tuple[Room, Surfaces]:
    """A room `with_transfer` whose two objects can change, its table in two matrices, and what numpy knows of them."""
    rng = np.random.default_rng(13)
    rank = made.manifest["surfel_transfer"]["rank"]
    gather, sent = (np.round(rng.uniform(0, MOST, (rank, PATCHES)) / STEP).astype(np.float32) * np.float32(STEP) for _ in range(2))
    albedo = rng.uniform(0.1, 0.9, (PATCHES, 3)).astype(np.float16).astype(np.float32)
    shares = rng.uniform(0, 0.5, (2, PATCHES)).astype(np.float32)
    emission = rng.uniform(0, 0.5, (rank, 2, 3)).astype(np.float32)
    feedback = np.stack([(gather * albedo[:, c]) @ sent.T for c in range(3)], axis=2)
    surfaces = Surfaces(gather, sent, feedback, shares, albedo, ("Wall", "Screen"), bounces, emission)
    tables, keys = surfaces.stored()
    for name in OF_SURFELS:
        del tables[name], keys[name], keys["surfaces"]["scales"][name]
    units = 2.0 ** rng.integers(-2, 1, (1, PATCHES, 1))
    own = {
        "surfel_gather": {"file": "surfel_gather.png", "packed": "rows", "scale": 0.5},
        "surfel_albedo": {"file": "surfel_albedo.exr", "scale": 2.0},
        "surfel_series": {"file": "surfel_series.exr", "scale": 1.0},
        "surfel_transfer": {"rank": rank, "surfels": PATCHES},
    }
    files = {
        **{keys[name]["file"]: (table.astype(np.float32), "half") for name, table in tables.items()},
        "surfel_gather.png": (pack((gather / units[0, :, 0])[:, :, None].astype(np.float16), "rows"), "uint8"),
        "surfel_albedo.exr": (np.concatenate([albedo[None], units], axis=2).astype(np.float32), "half"),
        "surfel_series.exr": (surfaces.series() - np.eye(rank)[:, :, None].astype(np.float32), "float"),
    }
    changed = replace(made, manifest={**made.manifest, **keys, **own}, files={**made.files, **files})
    return changed, Surfaces.of_tables(keys, tables, gather, albedo)
