"""Twins of the functions of compressed depths."""

from __future__ import annotations

import numpy as np
from twins import SUM, UNIT, Evaluate, N, twin, units, vec4

from srbf.visibility.hemisphere_map import SIDE, place_of
from srbf.visibility.pca_textures import pca_textures
from srbf.visibility.pca_visibility import BIAS, PcaVisibility

POINTS, CLUSTERS, COEFFICIENTS = 3000, 3, 6  # more points than fit into a row
EDGE = 1e-4  # m: nearer to a light than so much, a depth is on either side of it


def made() -> PcaVisibility:
    """Random depths of 1 to 3 m."""
    rng = np.random.default_rng(41)
    rows = (CLUSTERS, COEFFICIENTS + 1)
    span = np.where(np.arange(COEFFICIENTS + 1) == 0, 1.0, 0.2) * np.ones(rows)
    low = np.where(np.arange(COEFFICIENTS + 1) == 0, 1.5, -0.1) * np.ones(rows)
    return PcaVisibility(
        units(POINTS, 42),
        rng.integers(CLUSTERS, size=POINTS),
        rng.integers(256, size=(POINTS, COEFFICIENTS)).astype(np.uint8),
        rng.integers(256, size=(*rows, SIDE * SIDE)).astype(np.uint8),
        low.astype(np.float32),
        span.astype(np.float32),
        5.0,
    )


@twin("shadow/hemisphere_place.glsl")
def _(evaluate: Evaluate) -> None:
    axes = np.concatenate([np.eye(3), -np.eye(3)]).astype(np.float32)
    normal = np.concatenate([units(N, 43), axes, np.array([[0.8, 0.6, 1e-9], [0.8, 0.6, -1e-9]], np.float32)])
    toward = units(len(normal), 44)
    toward[-8:-2] = axes  # along the normal: the middle of the map
    found = evaluate("shadow/hemisphere_place.glsl", "vec4(srbfHemispherePlace(a.xyz, b.xyz), 0.0, 0.0)", vec4(toward), vec4(normal))[:, :2]
    above = np.einsum("nc,nc->n", toward, normal) > 0.01
    np.testing.assert_allclose(found[above], place_of(toward, normal)[above], atol=64 * UNIT)
    np.testing.assert_allclose(found[-8:-2], 0.5, atol=8 * UNIT)
    assert above.sum() > N / 3


@twin("shadow/pca_depth.glsl")
def _(evaluate: Evaluate) -> None:
    visibility = made()
    coefficients, bases, groups = pca_textures(visibility)
    assert coefficients.shape[0] > 1, "rows are folded"
    rng = np.random.default_rng(45)
    point, texel = rng.integers(POINTS, size=N), rng.integers(SIDE * SIDE, size=N)
    expression = f"vec4(srbfPcaDepth(coefficients, bases, int(a.x), int(a.y), {groups}, int(a.z)))"
    rows = vec4(np.column_stack([point, visibility.clusters[point], texel]))
    found = evaluate("shadow/pca_depth.glsl", expression, rows, images={"coefficients": coefficients, "bases": bases})[:, 0]
    np.testing.assert_allclose(found, visibility.depths(point, texel[:, None])[:, 0], atol=SUM)


@twin("shadow/pca_visibility.glsl")
def _(evaluate: Evaluate) -> None:
    visibility = made()
    coefficients, bases, groups = pca_textures(visibility)
    rng = np.random.default_rng(46)
    point = rng.integers(POINTS, size=N)
    toward = units(N, 47)
    toward *= np.where(np.einsum("nc,nc->n", toward, visibility.normals[point]) < 0, -1, 1)[:, None]
    distance = rng.uniform(1.5, 2.7, N).astype(np.float32)
    place = place_of(toward, visibility.normals[point]).astype(np.float32)
    expression = f"vec4(srbfPcaVisibility(coefficients, bases, int(a.x), int(a.y), {groups}, b.xy, a.z))"
    rows = vec4(np.column_stack([point, visibility.clusters[point], distance])), vec4(np.pad(place, ((0, 0), (0, 1))))
    found = evaluate("shadow/pca_visibility.glsl", expression, *rows, images={"coefficients": coefficients, "bases": bases})[:, 0]
    every = np.arange(SIDE * SIDE)
    gap = np.abs(visibility.depths(point, np.tile(every, (N, 1))) - (1 - BIAS) * distance[:, None]).min(axis=1)
    expected = visibility.visible(point, toward, distance)
    clear = np.abs(found - expected) < EDGE
    assert (clear | (gap < EDGE)).all() and clear.mean() > 0.98
    assert {0.0, 1.0} < set(np.round(found, 4).tolist()), "and shares between"
