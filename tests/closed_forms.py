"""Receivers and occluders of closed form: a square plane, a roof's edge, a ball, a tinted pane."""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np

from srbf.io.scene_glb import KNOTS, Triangles
from srbf.visibility.receivers import Receivers

OPAQUE, GLASS = 0, 1


def quad(a: list, b: list, c: list, d: list) -> np.ndarray:
    """Two triangles, (2, 3, 3)."""
    return np.array([[a, b, c], [a, c, d]], np.float32)


def ball(radius: float, center: list, steps: int = 64) -> np.ndarray:
    """A sphere of 2 steps^2 triangles."""
    polar, turn = np.meshgrid(np.linspace(0, np.pi, steps + 1), np.linspace(0, 2 * np.pi, steps + 1), indexing="ij")
    points = np.stack([np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)], axis=2) * radius + center
    a, b, c, d = points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]
    return np.concatenate([np.stack([a, b, c], axis=2).reshape(-1, 3, 3), np.stack([a, c, d], axis=2).reshape(-1, 3, 3)]).astype(np.float32)


def flat_normals(corners: np.ndarray) -> np.ndarray:
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-20)
    return np.repeat(normal[:, None], 3, axis=1).astype(np.float32)


def build_plane(
    *occluders: np.ndarray,
    panes: tuple[np.ndarray, ...] = (),
    transmittance: np.ndarray | None = None,
    size: int = 40,
    half: float = 1.0,
    albedo: tuple[float, float, float] | None = None,
    **sampling: object,
) -> Receivers:
    """A lightmap of the square [-half, half]^2 at z = 0, row 0 at the top (+y), under opaque `occluders` and tinted `panes`."""
    x = half * (-1 + 2 * (np.arange(size) + 0.5) / size)
    position = np.zeros((size, size, 3), np.float32)
    position[..., 0], position[..., 1] = x[None, :], -x[:, None]
    normal = np.zeros_like(position)
    normal[..., 2] = 1
    h = half
    ground = np.array([[[-h, -h, 0], [3 * h, -h, 0], [-h, 3 * h, 0]]], np.float32)  # one triangle: no edge crosses a texel
    parts = [ground, *occluders, *panes]
    corners = np.concatenate(parts)
    opaque = sum(len(part) for part in parts[: 1 + len(occluders)])
    material = np.where(np.arange(len(corners)) < opaque, OPAQUE, GLASS)
    curve = np.full((KNOTS, 3), 0.5, np.float32) if transmittance is None else transmittance.astype(np.float32)
    triangles = Triangles(corners, flat_normals(corners), material, np.ones(len(corners), bool), np.stack([np.zeros_like(curve), curve]))
    images = {"position": position, "normal": normal}
    if albedo is not None:
        images["albedo"] = np.broadcast_to(np.array(albedo, np.float32), position.shape)
    return Receivers(size, size, "irradiance" if albedo is None else "radiance", images, triangles, {"sun_angle": 0.0, **sampling})


def from_above(filter: str, width: float) -> dict[str, Any]:
    """An orthographic camera 3 m above that sees the square [-1, 1]^2, with a pixel filter of `width` pixels."""
    return {
        "type": "ORTHO",
        "matrix_world": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 3], [0, 0, 0, 1]],
        "frame": [[1, 1, -1], [1, -1, -1], [-1, -1, -1], [-1, 1, -1]],
        "filter": filter,
        "filter_width": width,
    }


TURN = [-(0.5**0.5), 0.0, 0.0, 0.5**0.5]  # quaternion of a root that turns z-up to y-up


def glb(corners: np.ndarray, body: bytes | None = None, **changes: Any) -> bytes:
    """Triangles (T, 3, 3) as a .glb without normals, under a root that turns z-up to y-up; `changes` replace parts of its JSON."""
    body = np.ascontiguousarray(corners, np.float32).tobytes() if body is None else body
    document: dict[str, Any] = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [1]}],
        "nodes": [{"mesh": 0}, {"rotation": TURN, "children": [0]}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": corners.size // 3, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": corners.size * 4}],
        "buffers": [{"byteLength": corners.size * 4}],
        **changes,
    }
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(body), 0x004E4942) + body
    return struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks
