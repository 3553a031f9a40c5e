"""Mip levels: relit they are the relit picture filtered, no chart takes of another, nothing outside is black."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import ndimage

from srbf.asset import Asset
from srbf.export import Settings, export
from srbf.export.mips import chart_gap, levels_without_bleeding, smaller_levels
from srbf.io.containers import read_texture_array
from srbf.methods import responses
from srbf.sphere import random_directions

FLOAT32 = 1e-5  # of sums of some hundred terms about 1
EDGE_PSNR = {"half": 60.0, "uint8": 38.0, "bc7": 30.0}  # dB of chart edges; smooth maps, which blocks hold well
DIRECTIONS = random_directions(6, "hemisphere", np.random.default_rng(3))


def charts(make: Callable[..., Asset], height: int = 45, width: int = 70, **flags: object) -> Asset:
    """Smooth maps on two ragged charts, garbage outside them: what a bake leaves in a texel is not to be seen."""
    asset = make(height=height, width=width, **flags)
    y, x = np.mgrid[:height, :width]
    stored = asset.stored.copy()
    for i, layer in enumerate(stored):
        for c in range(layer.shape[2]):
            layer[..., c] = 1.5 + np.sin(x / (9 + i) + c) * np.cos(y / (7 + c) - i)
    coverage = ((x - 20) ** 2 + 1.7 * (y - 22) ** 2 < 15**2) | ((abs(x - 57) < 9.3) & (abs(y - 25 - 0.3 * x + 17) < 14))
    stored[:, ~coverage] = -50
    return replace(asset, stored=stored, images={"coverage": coverage.astype(np.float32)})


def as_level(asset: Asset, layers: np.ndarray, coverage: np.ndarray | None = None) -> Asset:
    """The asset with float layers of another size."""
    entries = [{**entry, "encoding": "float"} for entry in asset.layers]
    manifest = {**asset.manifest, "height": layers.shape[1], "width": layers.shape[2], asset.layers_key: entries}
    one = np.ones((len(layers), layers.shape[3]), np.float32)
    return replace(
        asset, manifest=manifest, stored=layers, scale=one, bias=0 * one, images={} if coverage is None else {"coverage": coverage}
    )


def slow_mean(picture: np.ndarray, coverage: np.ndarray, level: int) -> tuple[np.ndarray, np.ndarray]:
    """(mean over covered area, covered area) of every texel of a level, one after the other."""
    height, width = coverage.shape
    rows, columns = max(1, height >> level), max(1, width >> level)
    mean, area = np.zeros((rows, columns, 3)), np.zeros((rows, columns))
    for r in range(rows):
        for c in range(columns):
            top, bottom, left, right = r * height / rows, (r + 1) * height / rows, c * width / columns, (c + 1) * width / columns
            for i in range(int(top), min(height, int(np.ceil(bottom)))):
                for j in range(int(left), min(width, int(np.ceil(right)))):
                    share = (min(i + 1, bottom) - max(i, top)) * (min(j + 1, right) - max(j, left)) * coverage[i, j]
                    area[r, c] += share
                    mean[r, c] += share * picture[i, j]
    return mean / np.maximum(area, 1e-30)[..., None], area


@pytest.mark.lengthy
@pytest.mark.parametrize("method", ["maps", "planes"])
def test_a_level_relit_is_the_picture_filtered(method: str, make_asset: Callable[..., Asset], make_planes: Callable[..., Asset]) -> None:
    asset = charts(make_asset if method == "maps" else make_planes)
    if method == "maps":
        asset.images["coverage"][asset.images["coverage"] > 0] = np.linspace(0.2, 1, int(asset.images["coverage"].sum()))  # a view's
    coverage = asset.images["coverage"]
    full = responses(asset, DIRECTIONS)
    for level, layers in enumerate(smaller_levels(asset.coefficients(), coverage, 4)):
        relit = responses(as_level(asset, layers), DIRECTIONS)
        for response, picture in zip(relit, full, strict=True):
            mean, area = slow_mean(picture, coverage, level)
            np.testing.assert_allclose(response[area > 1e-9], mean[area > 1e-9], atol=FLOAT32 * np.abs(picture[coverage > 0]).max())


@pytest.mark.slow
@pytest.mark.parametrize("form", ["half", "uint8", "bc7"])
def test_chart_edges_of_the_file(form: str, make_asset: Callable[..., Asset], tmp_path: Path) -> None:
    """The written levels against the filtered pictures, at texels that are partly covered; outside, each is its nearest covered one."""
    asset = charts(make_asset, k=9, spread=0.9)
    export(asset, "dds", tmp_path / "out", Settings(form, levels=4))  # type: ignore[arg-type]
    texture, out = read_texture_array(tmp_path / "out" / "maps.dds"), Asset.open(tmp_path / "out")
    coverage = asset.images["coverage"]
    full = responses(asset, DIRECTIONS)
    peak = np.abs(full[:, coverage > 0]).max()
    for level in range(4):
        texels = texture.pixels(level)[..., :3].astype(np.float32) / (1 if form == "half" else 255)
        layers = texels * out.scale[:, None, None] + out.bias[:, None, None]
        relit = responses(as_level(asset, layers), DIRECTIONS)
        squares = []
        for response, picture in zip(relit, full, strict=True):
            mean, area = slow_mean(picture, coverage, level)
            inside = area > 1e-9
            edge = inside & ~ndimage.binary_erosion(inside)
            squares.append(np.square(response[edge] - mean[edge]).mean())
            if level:
                nearest = ndimage.distance_transform_edt(~inside, return_distances=False, return_indices=True)
                outside = response[~inside] - mean[tuple(nearest)][~inside]
                squares.append(np.square(outside).mean())
        assert 20 * np.log10(peak / np.sqrt(np.mean(squares))) > EDGE_PSNR[form], level


@pytest.mark.parametrize("gap", [1, 2, 4, 5, 7, 9, 10, 12, 19, 20, 24])
@pytest.mark.parametrize("slant", [0, 1])
def test_no_sample_of_a_chart_takes_of_another(make_asset: Callable[..., Asset], gap: int, slant: int) -> None:
    """One chart is 0 and one is 1, at every place against the grid of levels; bilinear samples all over the first stay 0."""
    for offset in range(13, 29):
        y, x = np.mgrid[:64, :96]
        left = x < offset - slant * (y > 30) * 3
        right = x >= offset + gap
        asset = make_asset(1, height=64, width=96, coefficients=np.repeat(right[None, ..., None], 3, 3).astype(np.float32))
        asset.images = {"coverage": (left | right).astype(np.float32)}
        assert chart_gap(asset.images["coverage"]) == gap
        levels = levels_without_bleeding(asset)
        assert 2.5 * 2 ** (levels - 1) <= max(gap, 2.5)
        for level, layers in enumerate(smaller_levels(asset.coefficients(), asset.images["coverage"], levels)):
            if level:
                assert_apart(layers[0, ..., 0], left, level)


def assert_apart(level_texels: np.ndarray, chart: np.ndarray, level: int) -> None:
    """Bilinear samples at the corners of the chart's texels, a hair inside."""
    rows, columns = np.nonzero(chart)
    for down, across in ((0.001, 0.001), (0.001, 0.999), (0.999, 0.001), (0.999, 0.999)):
        places = [(rows + down) / 2**level - 0.5, (columns + across) / 2**level - 0.5]
        assert ndimage.map_coordinates(level_texels, places, order=1, mode="nearest").max() == 0


def test_a_level_too_many_does_bleed() -> None:
    """So that the rule is not merely timid: a gap of two texels of a level, at the worst place, seen from either chart."""
    bled = 0
    for offset in range(13, 29):
        _, x = np.mgrid[:64, :96]
        left, right = x < offset, x >= offset + 8
        for chart, other, place in ((left, right, offset - 0.001), (right, left, offset + 8.001)):
            layers = np.repeat(other[None, ..., None], 3, 3).astype(np.float32)
            level = smaller_levels(layers, (chart | other).astype(np.float32), 3)[2][0, ..., 0]
            bled += ndimage.map_coordinates(level, [np.full(1, 8.0), np.array([place / 4 - 0.5])], order=1).max() > 0
    assert bled


def test_how_many_levels(make_asset: Callable[..., Asset], make_planes: Callable[..., Asset], tmp_path: Path) -> None:
    asset = make_asset(height=24, width=40)
    asset.images["coverage"][:] = 1
    assert levels_without_bleeding(asset) == 6  # one chart: down to a texel
    assert chart_gap(np.ones((3, 3), np.float32)) is None is chart_gap(np.zeros((3, 3), np.float32))
    corners = np.zeros((9, 9), np.float32)
    corners[1, 1] = corners[6, 5] = 1
    assert chart_gap(corners) == 4  # aslant: the larger of the two distances, less one
    clustered = make_planes(clusters=4, patches=True)
    assert levels_without_bleeding(clustered) == 1
    told = export(clustered, "ktx2", tmp_path / "clusters")
    assert told.levels == 1 and any("different clusters have no mean" in note for note in told.notes)
    assert Asset.open(tmp_path / "clusters").manifest["source"]["export"]["notes"] == list(told.notes)
    vertices = replace(asset, manifest={**asset.manifest, "source": {"receiver": {"kind": "vertices"}}})
    assert levels_without_bleeding(vertices) == 1
    asset.images["coverage"][:, 10:14] = 0
    told = export(asset, "dds", tmp_path / "more", Settings("uint8", levels=3))
    assert told.levels == 3 and any("charts share texels" in note for note in told.notes)
