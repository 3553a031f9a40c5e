"""Twins of the functions that take receivers out of depth buffers."""

from __future__ import annotations

import numpy as np
from twins import EPS, UNIT, Evaluate, N, twin, vec4

from srbf.gl import depth_buffer as depth
from srbf.gl.depth_buffer import DepthCamera, depth_terms


def projection(kind: str, near: float = 0.25, far: float = 64.0) -> tuple[np.ndarray, bool]:
    """(matrix, whether its clip z starts from 0) of a wide and slightly shifted view, as graphics interfaces have it."""
    matrix = np.zeros((4, 4))
    matrix[0, 0], matrix[1, 1] = 0.5, 0.75  # half a picture is 2 wide and 1.33 high, 1 m ahead
    if kind == "orthographic":
        matrix[0, 3], matrix[1, 3], matrix[3, 3] = 0.125, -0.25, 1
        matrix[2, 2:] = -2 / (far - near), -(far + near) / (far - near)
        return matrix, False
    matrix[0, 2], matrix[1, 2], matrix[3, 2] = 0.125, -0.25, -1
    rows = {
        "opengl": (-(far + near) / (far - near), -2 * far * near / (far - near)),
        "direct3d": (-far / (far - near), -far * near / (far - near)),
        "reversed": (near / (far - near), far * near / (far - near)),
        "reversed, infinite": (0.0, near),
        "opengl, infinite": (-1.0, -2 * near),
    }
    matrix[2, 2:] = rows[kind]
    return matrix, not kind.startswith("opengl")


PROJECTIONS = ("opengl", "direct3d", "reversed", "reversed, infinite", "opengl, infinite", "orthographic")


def stored_depth(view: np.ndarray, matrix: np.ndarray, from_zero: bool) -> np.ndarray:
    """What a depth buffer holds of points (n, 3) of the camera's frame."""
    clip = np.pad(view, ((0, 0), (0, 1)), constant_values=1) @ matrix.T
    z = clip[:, 2] / clip[:, 3]
    return z if from_zero else 0.5 * z + 0.5


@twin("depth/eye_depth.glsl")
def _(evaluate: Evaluate) -> None:
    ahead = np.geomspace(0.25, 60, N)
    view = np.stack([0 * ahead, 0 * ahead, -ahead], axis=1)
    for kind in PROJECTIONS:
        matrix, from_zero = projection(kind)
        terms = depth_terms(matrix, from_zero=from_zero)
        stored = stored_depth(view, matrix, from_zero).astype(np.float32)
        numbers = ", ".join(map(repr, terms.tolist()))
        found = evaluate("depth/eye_depth.glsl", f"vec4(srbfEyeDepth(a.x, vec4({numbers})))", vec4(stored))[:, 0]
        exact = depth.eye_depth(stored.astype(float), terms)
        # near the far plane of an unreversed buffer a rounding of 1 weighs depth / near as much
        np.testing.assert_allclose(found, exact, rtol=UNIT * (1 if kind.startswith("reversed") else 60 / 0.25))
        np.testing.assert_allclose(exact, ahead, rtol=1e-4 if kind.startswith("reversed") or kind == "orthographic" else 1e-3)
    assert (
        evaluate("depth/eye_depth.glsl", "vec4(srbfEyeDepth(a.x, vec4(-0.25, 0.0, 0.0, 1.0)))", vec4([0.0, 0.0])) == np.float32(1e9)
    ).all()
    assert depth.eye_depth(np.zeros(1), np.array([-0.25, 0, 0, 1.0]))[0] == depth.FARTHEST


def _rays(seed: int) -> np.ndarray:
    """V from points in front of a camera that looks along +y, any length, up to 80 degrees off its axis."""
    rays = np.random.default_rng(seed).uniform(-1, 1, (N, 3)) * [5, 0, 5]
    return (-(rays + [0, 1, 0]) * np.geomspace(0.01, 100, N)[:, None]).astype(np.float32)


@twin("depth/ray_length.glsl")
def _(evaluate: Evaluate) -> None:
    to_eye, ahead = _rays(36), np.geomspace(0.1, 100, N).astype(np.float32)
    found = evaluate("depth/ray_length.glsl", "vec4(srbfRayLength(b.x, a.xyz, vec3(0.0, 1.0, 0.0)))", vec4(to_eye), vec4(ahead))[:, 0]
    expected = depth.ray_length(ahead, to_eye, np.array([0.0, 1.0, 0.0]))
    np.testing.assert_allclose(found, expected, rtol=UNIT)
    assert (expected > 3 * ahead).any()


@twin("depth/point_on_ray.glsl")
def _(evaluate: Evaluate) -> None:
    to_eye, length = _rays(37), np.geomspace(0.1, 100, N).astype(np.float32)
    eye = np.float32([0.5, -2, 1])
    found = evaluate("depth/point_on_ray.glsl", "vec4(srbfPointOnRay(vec3(0.5, -2.0, 1.0), a.xyz, b.x), 0.0)", vec4(to_eye), vec4(length))
    expected = depth.point_on_ray(np.broadcast_to(eye, to_eye.shape), to_eye, length)
    np.testing.assert_allclose(found[:, :3], expected, atol=UNIT * 100)
    np.testing.assert_allclose(np.linalg.norm(expected - eye, axis=1), length, rtol=1e-6)


@twin("depth/receiver_from_depth.glsl")
def _(evaluate: Evaluate) -> None:
    """Points all over a turned camera's picture, its corners included, come back; closed form of the projection, not of its inverse."""
    rng = np.random.default_rng(38)
    place = np.concatenate([rng.uniform(-1, 1, (N - 4, 2)), [[-1, -1], [1, -1], [-1, 1], [1, 1]]]).astype(np.float32)
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    turn[:, 0] *= np.linalg.det(turn)
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = turn, [0.5, -1, 2]
    ahead = rng.uniform(0.5, 8, N)
    for kind in PROJECTIONS:
        matrix, from_zero = projection(kind)
        camera = DepthCamera.of(pose, matrix, from_zero=from_zero)
        shift = matrix[:2, 3] if camera.orthographic else -matrix[:2, 2]
        sideways = (place - shift) / np.diag(matrix)[:2] * (1 if camera.orthographic else ahead[:, None])
        view = np.column_stack([sideways, -ahead])
        clip = np.pad(view, ((0, 0), (0, 1)), constant_values=1) @ matrix.T
        np.testing.assert_allclose(clip[:, :2] / clip[:, 3:], place, atol=1e-6)
        world = view @ turn.T + pose[:3, 3]
        stored = stored_depth(view, matrix, from_zero)
        np.testing.assert_allclose(depth.receivers(stored, place, camera), world, atol=1e-9)
        vectors = (camera.eye, camera.forward, camera.center, camera.across, camera.up)
        members = [f"vec3({', '.join(map(repr, vector.tolist()))})" for vector in vectors]
        members += [f"vec4({', '.join(map(repr, camera.depth_terms.tolist()))})", repr(float(camera.orthographic))]
        expression = f"vec4(srbfReceiverFromDepth(b.x, a.xy, SrbfCamera({', '.join(members)})), 0.0)"
        rows = vec4(place[:, :1], place[:, 1:]), vec4(stored)
        found = evaluate("depth/receiver_from_depth.glsl", expression, *rows)[:, :3]
        rounding = EPS * (8**2 / 0.25 if not kind.startswith("reversed") else 8)  # of a sample near 1, as depth
        reach = 1 if camera.orthographic else np.linalg.norm(view, axis=1, keepdims=True) / ahead[:, None]
        assert (np.abs(found - world) <= 4 * (rounding if kind != "orthographic" else 64 * EPS) * reach + 16 * UNIT).all()
