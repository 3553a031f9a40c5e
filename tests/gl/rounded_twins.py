"""Twins of what shadow maps share on the mesh: the plane of a receiver before a light inside the scene, and the lift of smooth surfaces."""

from __future__ import annotations

import numpy as np
from twins import UNIT, Evaluate, N, twin, units, vec4

from srbf.visibility import point_shadow, shadow


@twin("shadow/point_shadow_slope.glsl")
def _(evaluate: Evaluate) -> None:
    """And it is the slope of `place`: two places of a plane differ by it."""
    rng = np.random.default_rng(33)
    across, up, ahead = np.eye(3)
    normal = units(N, 34).astype(float)
    vector = np.column_stack([rng.uniform(-1, 1, (N, 2)), rng.uniform(0.5, 2, N)]).astype(np.float32)
    steepest = np.full(N, 3.0)
    expression = "vec4(srbfPointShadowSlope(a.xyz, b.xyz, vec3(1, 0, 0), vec3(0, 1, 0), 3.0), 0.0, 0.0)"
    found = evaluate("shadow/point_shadow_slope.glsl", expression, vec4(vector), vec4(normal))[:, :2]
    expected = point_shadow.slope(vector.astype(float), normal, across, up, steepest)
    np.testing.assert_allclose(found, expected, atol=1e-4)
    clear = (np.abs(expected) < 3).all(axis=1) & (np.abs(expected) > 0).any(axis=1)
    step = np.cross(normal, rng.normal(size=(N, 3))) * 0.05  # in the plane
    one, two = (point_shadow.place(v, across, up, ahead, 1.0) for v in (vector.astype(float), vector + step))
    rise = 2 * ((two - one)[:, :2] * expected).sum(axis=1)  # places are half a tangent
    np.testing.assert_allclose((two - one)[clear, 2], rise[clear], atol=1e-9)
    assert clear.sum() > N / 2


@twin("shadow/rounded_share.glsl")
def _(evaluate: Evaluate) -> None:
    NoL, NgL = np.random.default_rng(35).uniform(-0.3, 0.5, (2, 4 * N)).astype(np.float32)
    found = evaluate("shadow/rounded_share.glsl", "vec4(srbfRoundedShare(a.x, a.y))", vec4(NoL, NgL))[:, 0]
    np.testing.assert_allclose(found, shadow.rounded_share(NoL.astype(float), NgL.astype(float)), atol=32 * UNIT)
    assert {0.0, 1.0} < set(np.round(found, 6))
