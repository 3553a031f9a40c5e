"""Twins of the functions of shadow maps of lights inside the scene."""

from __future__ import annotations

import numpy as np
from twins import UNIT, Evaluate, N, twin, vec4

from srbf.visibility import point_shadow


@twin("shadow/cube_face.glsl")
def _(evaluate: Evaluate) -> None:
    edges = np.array([[1, 1, 0], [-1, 1, 0], [0, 2, -2], [3, 3, 3], [-1, -1, -1], [1, 0, 0], [0, 0, -1], [0, -1, 0]])
    vectors = np.concatenate([np.random.default_rng(31).normal(size=(N, 3)), edges]).astype(np.float32)
    found = evaluate("shadow/cube_face.glsl", "vec4(float(srbfCubeFace(a.xyz)))", vec4(vectors))[:, 0]
    np.testing.assert_array_equal(found, point_shadow.cube_face(vectors))
    assert set(found) == set(range(6))
    assert found[N : N + 5].tolist() == [0, 1, 2, 0, 1], "an edge belongs to one face"


@twin("shadow/point_shadow_place.glsl")
def _(evaluate: Evaluate) -> None:
    """And one over the depth of a plane is linear on the map."""
    rng = np.random.default_rng(32)
    across, up = np.array([0.6, 0.8, 0.0]), np.array([0.0, 0.0, 1.0])
    ahead = np.cross(across, up)
    depth = np.geomspace(0.1, 30, N)
    vectors = (depth[:, None] * (ahead + rng.uniform(-1, 1, (N, 1)) * across + rng.uniform(-1, 1, (N, 1)) * up)).astype(np.float32)
    axes = ", ".join(f"vec3({', '.join(map(repr, axis.tolist()))})" for axis in (across, up, ahead))
    found = evaluate("shadow/point_shadow_place.glsl", f"vec4(srbfPointShadowPlace(a.xyz, {axes}, 1.25), 0.0)", vec4(vectors))[:, :3]
    expected = point_shadow.place(vectors.astype(float), across, up, ahead, 1.25)
    np.testing.assert_allclose(found[:, :2], expected[:, :2], atol=4 * UNIT)
    np.testing.assert_allclose(found[:, 2], expected[:, 2], rtol=4 * UNIT)
    plane = 2 * ahead + rng.uniform(-1, 1, (N, 2)) @ np.array([across + 0.3 * ahead, up - 0.2 * ahead])
    u, v, nearness = point_shadow.place(plane, across, up, ahead, 1.25).T
    fitted = np.linalg.lstsq(np.stack([u, v, np.ones(N)], axis=1), nearness, rcond=None)
    assert fitted[1][0] < 1e-20
