"""A made room whose objects emit and are repainted, as it lies on disk, and what numpy knows of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from cloud_assets import PATCHES, Room

from srbf.methods.surface_changes import Surfaces

MOST = 0.245  # of entries: a bounce keeps 0.77 of the light of the shape that fades last, and 0.95 with a red wall, too much for 64 bounces


def with_surfaces(made: Room, bounces: int | None) -> tuple[Room, Surfaces]:
    """A room `with_transfer` whose two objects can change, and what numpy knows of them."""
    rng = np.random.default_rng(13)
    rank = made.manifest["surfel_transfer"]["rank"]
    gather, sent = (rng.uniform(0, MOST, (rank, PATCHES)).astype(np.float32) for _ in range(2))
    albedo = rng.uniform(0.1, 0.9, (PATCHES, 3)).astype(np.float32)
    shares = rng.uniform(0, 0.5, (2, PATCHES)).astype(np.float32)
    emission = rng.uniform(0, 0.5, (rank, 2, 3)).astype(np.float32)
    feedback = np.stack([(gather * albedo[:, c]) @ sent.T for c in range(3)], axis=2)
    tables, keys = Surfaces(gather, sent, feedback, shares, albedo, ("Wall", "Screen"), bounces, emission).stored()
    files = {name: (table.astype(np.float32), "half") for name, table in tables.items()}
    stored = {keys[name]["file"]: image for name, image in files.items()}
    stored["surface_albedo.exr"] = (stored["surface_albedo.exr"][0].reshape(1, PATCHES, 3), "half")
    changed = replace(made, manifest={**made.manifest, **keys}, files={**made.files, **stored})
    return changed, Surfaces.of_tables(keys, tables)
