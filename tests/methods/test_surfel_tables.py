"""The two matrices of a transfer asset: what they give, in steps, on disk, and as the one matrix that engines multiply by."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from made_assets import build_planes

from srbf.asset import Asset
from srbf.asset_reader import AssetReader
from srbf.errors import ImageError
from srbf.io.image import write_image
from srbf.io.packed_table import pack
from srbf.methods import surfel_tables
from srbf.methods.surfel_tables import (
    GATHER_ERROR,
    add_surfel_tables,
    albedo_of,
    gather_of,
    later_of,
    read_surfel_tables,
    weights_of_shapes,
    with_transfer,
)

RANK, SURFELS = 24, 150
SHAPES = np.geomspace(1, 1e-2, RANK).astype(np.float32)  # rms


def matrices(bounces: int = 5) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(gather (r, S), albedo (S, 3), series (r, r, 3)): columns of unlike size, shapes of weights of one size."""
    rng = np.random.default_rng(3)
    gather = (rng.normal(size=(RANK, SURFELS)) / SHAPES[:, None] * np.geomspace(1e-2, 1, SURFELS)).astype(np.float32)
    gather[0] = 4 * np.abs(gather[0])  # pictures are positive, and add up
    albedo = rng.uniform(0.1, 0.9, (SURFELS, 3)).astype(np.float32)
    feedback = rng.normal(size=(RANK, RANK, 3)) * 0.5 / np.sqrt(RANK) * (SHAPES / SHAPES[:, None])[:, :, None]
    powers = [np.stack([np.linalg.matrix_power(feedback[:, :, c], k) for c in range(3)], axis=2) for k in range(bounces)]
    return gather, albedo, np.sum(powers, axis=0).astype(np.float32)


def made() -> Asset:
    base = build_planes(6, 5, "half", 9, 14)
    asset = replace(base, manifest=dict(base.manifest), tables={})
    add_surfel_tables(asset, *matrices(), SHAPES)
    return asset


def exact(irradiance: np.ndarray) -> np.ndarray:
    gather, albedo, series = matrices()
    return np.stack([series[:, :, c] @ (gather @ (albedo[:, c] * irradiance[:, c])) for c in range(3)], axis=1)


def test_pictures_of_a_surfel_lose_what_is_told() -> None:
    asset = made()
    for surfel in (0, 70, SURFELS - 1):
        lit = np.zeros((SURFELS, 3))
        lit[surfel] = 1
        off = (weights_of_shapes(asset, lit) - exact(lit)) * SHAPES[:, None]
        assert np.linalg.norm(off) < 2.5 * GATHER_ERROR * np.linalg.norm(exact(lit) * SHAPES[:, None])


def test_many_surfels_lose_less() -> None:
    lit = np.random.default_rng(5).uniform(0, 1, (SURFELS, 3))
    off = (weights_of_shapes(made(), lit) - exact(lit)) * SHAPES[:, None]
    assert np.linalg.norm(off) < 0.06 * np.linalg.norm(exact(lit) * SHAPES[:, None])


def test_lights_together_are_lights_apart() -> None:
    asset, lit = made(), np.random.default_rng(6).uniform(0, 1, (SURFELS, 4, 3))
    together = weights_of_shapes(asset, lit)
    apart = np.stack([weights_of_shapes(asset, lit[:, i]) for i in range(4)], axis=1)
    np.testing.assert_allclose(together, apart, rtol=1e-4, atol=1e-4 * np.abs(apart).max())


def test_one_matrix_gives_the_same() -> None:
    asset, lit = made(), np.random.default_rng(7).uniform(0, 1, (SURFELS, 3))
    one = with_transfer(asset)
    assert not {"surfel_gather", "surfel_series", "surfel_albedo"} & (set(one.tables) | set(one.manifest))
    found, expected = weights_of_shapes(one, lit), weights_of_shapes(asset, lit)
    np.testing.assert_allclose(found, expected, rtol=1e-2, atol=1e-3 * np.abs(expected).max())
    assert with_transfer(one) is one


def test_without_bounces_nothing_is_left() -> None:
    base = made()
    asset = replace(base, manifest=dict(base.manifest), tables=dict(base.tables))
    surfel_tables.set_series(asset, np.zeros((RANK, RANK, 3), np.float32))
    assert (
        np.abs(weights_of_shapes(asset, np.ones((SURFELS, 3)))).max() < 1e-3 * np.abs(weights_of_shapes(base, np.ones((SURFELS, 3)))).max()
    )


def test_the_files_are_the_tables(tmp_path: Path) -> None:
    asset = made()
    for name in ("surfel_gather", "surfel_series"):
        assert asset.manifest[name]["packed"] == "rows"
        write_image(tmp_path / asset.manifest[name]["file"], pack(asset.tables[name], "rows"), "uint8", noisy=True)
    write_image(tmp_path / asset.manifest["surfel_albedo"]["file"], asset.tables["surfel_albedo"], "half")
    reader = AssetReader(tmp_path, asset.manifest)
    for name, table in read_surfel_tables(reader).items():
        np.testing.assert_array_equal(table, asset.tables[name])
    again = replace(asset, tables=read_surfel_tables(reader))
    for part in (gather_of, albedo_of, later_of):
        np.testing.assert_array_equal(part(again), part(asset))
    few = {**asset.manifest, "surfel_transfer": {"rank": RANK, "surfels": SURFELS - 1}}
    with pytest.raises(
        ImageError, match=rf"expected {SURFELS}x{RANK} or {SURFELS}x{2 * RANK} bytes in .*surfel_gather.png, found {SURFELS + 1}x"
    ):
        read_surfel_tables(AssetReader(tmp_path, few))
