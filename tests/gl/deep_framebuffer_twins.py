"""Twins of the functions that gather light by sparse links and from view clusters."""

from __future__ import annotations

import numpy as np
from twins import SUM, Evaluate, twin, vec4

from srbf.gl.deep_framebuffer import folded, rows_image
from srbf.visibility.near_sources import disc_factors
from srbf.visibility.packed_links import packed
from srbf.visibility.sparse_links import SparseLinks
from srbf.visibility.surface_cells import Cells


@twin("surfels/linked_light.glsl")
def _(evaluate: Evaluate) -> None:
    """Of rows whose links go on in the next row of the image, and of counts that take several links."""
    rng = np.random.default_rng(80)
    surfels, sizes = 700, rng.integers(0, 90, 120)
    counts = rng.integers(1, 600, sizes.sum()).astype(np.uint16)
    links = SparseLinks(
        np.concatenate([[0], np.cumsum(sizes)]), rng.integers(0, surfels, sizes.sum()).astype(np.uint16), counts, 512, surfels
    )
    light = rng.uniform(0, 2, (surfels, 3)).astype(np.float32)
    image, rows = packed(links)
    images = {"links": image / 255, "rows": rows_image(rows, links.rows), "light": folded(light)}
    assert images["rows"].reshape(-1, 4)[:, 1].max() > 0
    found = evaluate(
        "surfels/linked_light.glsl",
        "vec4(srbfLinkedLight(links, rows, light, int(a.x), 512.0), 0.0)",
        vec4(np.arange(120.0)),
        images={name: np.asarray(pixels, np.float32) for name, pixels in images.items()},
    )
    expected = links.matrix() @ light
    np.testing.assert_allclose(found[:, :3], expected, atol=SUM * expected.max())


@twin("surfels/surfel_visibility.glsl")
def _(evaluate: Evaluate) -> None:
    """Of a plane before a map's middle, seen at several angles, and half covered by something nearer: as rays would say."""
    rng = np.random.default_rng(82)
    width, at = 64, np.arange(200)
    middle = (np.arange(width) + 0.5) / width * 2 - 1
    for slope in ((0.0, 0.0), (0.5, -0.2), (2.0, 1.0)):  # of one over the depth, per unit of the tangent, times the depth in the middle
        plane = 1 + 0.15 * (slope[0] * middle[None, :] + slope[1] * middle[:, None])
        covered = np.where(middle[None, :] < 0, 1.5 * plane, plane)
        uv = rng.uniform(0.001, 0.999, (200, 2))
        own = 1 + 0.15 * ((2 * uv - 1) @ np.array(slope))
        shade = np.clip(0.5 - (uv[:, 0] - 0.5) * width, 0, 1)  # how much of four texels is covered
        for heights, lift, expected in ((plane, 2e-4, 1), (plane, -5e-4, 0), (plane, -0.05, 0), (covered, 2e-4, 1 - shade)):
            place = np.column_stack([uv, own * (1 + lift)])
            found = evaluate(
                "surfels/surfel_visibility.glsl",
                f"vec4(srbfSurfelVisibility(heights, ivec2({width}, 0), {width}, a.xyz))",
                vec4(place),
                images={
                    "heights": np.pad(np.abs(heights)[:, :, None], ((0, 0), (width, 0), (0, 0)), constant_values=9.0).astype(np.float32)
                },
            )[at, 0]
            np.testing.assert_allclose(found, expected, atol=2e-4 * width)


@twin("surfels/disc_factor.glsl")
def _(evaluate: Evaluate) -> None:
    """Of discs on all sides, also behind the receiver or turned away."""
    rng = np.random.default_rng(83)
    toward, normals, facing = rng.normal(size=(3, 200, 3)).astype(np.float32)
    normals, facing = (own / np.linalg.norm(own, axis=1, keepdims=True) for own in (normals, facing))
    areas = rng.uniform(1e-4, 1, 200).astype(np.float32)
    found = evaluate(
        "surfels/disc_factor.glsl", "vec4(srbfDiscFactor(a.xyz, b.xyz, c.xyz, a.w))", vec4(toward, areas), vec4(normals), vec4(facing)
    )
    expected = np.concatenate(
        [
            disc_factors(
                np.zeros((1, 3), np.float32),
                normals[i : i + 1],
                Cells(toward[i : i + 1], facing[i : i + 1], areas[i : i + 1], facing[i : i + 1], np.zeros(1, np.int64)),
            )[0]
            for i in range(200)
        ]
    )
    assert 20 < (expected > 0).sum() < 180
    np.testing.assert_allclose(found[:, 0], expected, rtol=1e-4, atol=1e-7)


@twin("surfels/near_light.glsl")
def _(evaluate: Evaluate) -> None:
    """Of surfels in several cells, which receivers see in part, on three rows of receivers."""
    rng = np.random.default_rng(84)
    count, slots, rows, across = 12, 4, 3, 5
    places, facing = rng.normal(size=(2, count, 3)).astype(np.float32)
    facing /= np.linalg.norm(facing, axis=1, keepdims=True)
    areas, radiosity = rng.uniform(1e-3, 0.1, count).astype(np.float32), rng.uniform(0, 2, (count, 3)).astype(np.float32)
    slot = rng.integers(0, slots, count)
    seen = rng.choice(np.array([0, 0.25, 1]), (slots, rows, across))
    sources = np.stack([np.column_stack(row) for row in ((places, areas), (facing, slot), (radiosity, areas))])
    at = np.stack(np.meshgrid(np.arange(across), np.arange(rows)), axis=-1).reshape(-1, 2)
    receivers, normals = rng.normal(size=(2, len(at), 3)).astype(np.float32)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    found = evaluate(
        "surfels/near_light.glsl",
        f"vec4(srbfNearLight(sources, {count}, seen, {rows}, ivec2(c.xy), a.xyz, b.xyz), 0.0)",
        vec4(receivers),
        vec4(normals),
        vec4(at.astype(np.float32), np.zeros(len(at))),
        images={"sources": sources.astype(np.float32), "seen": seen.reshape(slots * rows, across, 1).astype(np.float32)},
    )
    factors = disc_factors(receivers, normals, Cells(places, facing, areas, radiosity, np.arange(count)))
    expected = (factors * seen[slot[None], at[:, 1:], at[:, :1]]) @ radiosity
    assert (expected > 0).any() and (expected == 0).any()
    np.testing.assert_allclose(found[:, :3], expected, rtol=1e-4, atol=1e-6)


@twin("methods/deep_framebuffer.glsl")
def _(evaluate: Evaluate) -> None:
    rng = np.random.default_rng(81)
    clusters, layers, side = 900, 7, 9
    light = rng.uniform(0, 2, (clusters, 3)).astype(np.float32)
    chosen, weights = rng.integers(0, clusters, (layers, side, side)), rng.integers(0, 256, (layers, side, side))
    weights[:, 0, 0] = 0  # a pixel of nothing
    neighbors = np.stack([chosen & 255, chosen >> 8, weights], axis=-1) / 255
    neighbors = np.concatenate([np.ones_like(neighbors[:1]), neighbors])  # a layer before
    at = np.stack(np.meshgrid(np.arange(side), np.arange(side)), axis=-1).reshape(-1, 2)
    found = evaluate(
        "methods/deep_framebuffer.glsl",
        f"vec4(srbfNeighborLight(neighbors, 1, {layers}, light, ivec2(a.xy)), 0.0)",
        vec4(at.astype(np.float32), np.zeros(len(at))),
        images={"neighbors": neighbors.astype(np.float32), "light": folded(light)},
    )
    expected = np.einsum("khw,khwc->hwc", weights, light[chosen]) / np.maximum(weights.sum(axis=0), 1)[..., None]
    np.testing.assert_allclose(found[:, :3], expected[at[:, 1], at[:, 0]], atol=SUM * expected.max())
    assert not found[0].any()
