"""What a camera sees, from its depth buffer: P = E - d V / |V|, d the ray's length [Wong2005, "Point-Source Shader"].

Matrices are as OpenGL has them: column vectors, a camera looks along its -z, x to the right and y up; clip w is -z or, orthographic, 1.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float32, Float64
from srbf.errors import InputError

FARTHEST = 1e9  # meters: where a depth buffer holds nothing


@dataclass(frozen=True, eq=False)
class DepthCamera:
    """A camera as the shaders' SrbfCamera: `center`, `across` and `up` lead from the eye to the picture's middle, from there to its right
    edge and to its upper one, 1 m ahead in perspective, sideways only where the view is orthographic.

    All in the asset's frame, meters; `forward` is unit, `depth_terms` are `depth_terms` of the projection.
    """

    eye: Float64[ndarray, " 3"]
    forward: Float64[ndarray, " 3"]
    center: Float64[ndarray, " 3"]
    across: Float64[ndarray, " 3"]
    up: Float64[ndarray, " 3"]
    depth_terms: Float64[ndarray, " 4"]
    orthographic: bool

    @staticmethod
    def of(world_from_view: Float64[ndarray, "4 4"], projection: Float64[ndarray, "4 4"], *, from_zero: bool) -> DepthCamera:
        """From a pose without scale and a projection matrix, off-center ones included; `from_zero`: clip z is 0 to 1, not -1 to 1.

        InputError where clip w is neither -z nor 1, or the projection turns or shears the picture.
        """
        if projection[3].tolist() not in ([0, 0, -1, 0], [0, 0, 0, 1]):
            raise InputError(f"expected a projection whose last row is 0 0 -1 0 or 0 0 0 1, found {projection[3].tolist()}")
        if projection[0, 1] or projection[1, 0] or not projection[0, 0] * projection[1, 1]:
            raise InputError("expected a projection that leaves x and y apart, found one that turns or shears them")
        right, upward, back = world_from_view[:3, :3].T
        orthographic = projection[3, 3] == 1
        shift = -projection[:2, 3] if orthographic else projection[:2, 2]
        center = right * shift[0] / projection[0, 0] + upward * shift[1] / projection[1, 1]
        return DepthCamera(
            world_from_view[:3, 3],
            -back,
            center if orthographic else center - back,
            right / projection[0, 0],
            upward / projection[1, 1],
            depth_terms(projection, from_zero=from_zero),
            bool(orthographic),
        )


@dataclass(frozen=True, eq=False)
class DepthView:
    """A camera and its depth buffer, samples in [0, 1], row 0 at the top of the picture."""

    samples: Float32[ndarray, "H W"]
    camera: DepthCamera


def depth_terms(projection: Float64[ndarray, "4 4"], *, from_zero: bool) -> Float64[ndarray, " 4"]:
    """(a, b, c, d) such that the depth along the view axis is |(a + b s) / (c + d s)| for a stored sample s in [0, 1].

    From rows 3 and 4 of any projection: perspective or orthographic, reversed or not, its far plane at infinity or not. `from_zero`: clip
    z is 0 to 1 (Direct3D, Metal, Vulkan, WebGPU), not -1 to 1 (OpenGL, WebGL).
    """
    (z, offset), (w, one) = projection[2, 2:], projection[3, 2:]
    scale, start = (1.0, 0.0) if from_zero else (2.0, -1.0)  # clip z = start + scale s
    return np.array([one * start - offset, one * scale, z - w * start, -w * scale])


def eye_depth(stored: Float[ndarray, "*shape"], terms: Float64[ndarray, " 4"]) -> Float64[ndarray, "*shape"]:
    """Depth along the view axis, meters, of samples in [0, 1]; at most FARTHEST."""
    sample = np.asarray(stored, np.float64)
    above, below = np.abs(terms[0] + terms[1] * sample), np.abs(terms[2] + terms[3] * sample)
    return np.where(above < below * FARTHEST, above / np.maximum(below, 1e-300), FARTHEST)


def ray_length(
    depth: Float[ndarray, "*shape"], to_eye: Float[ndarray, "*shape 3"], forward: Float[ndarray, " 3"]
) -> Float64[ndarray, "*shape"]:
    """Distance from the eye to a point at a depth along the view axis: depth over the cosine between ray and axis."""
    return depth * np.linalg.norm(to_eye, axis=-1) / -(to_eye @ np.asarray(forward, np.float64))


def point_on_ray(
    eye: Float[ndarray, "*shape 3"], to_eye: Float[ndarray, "*shape 3"], length: Float[ndarray, "*shape"]
) -> Float64[ndarray, "*shape 3"]:
    """P = E - d V / |V|, V from the point to the eye, d the ray's length, never the depth along the view axis."""
    return eye - length[..., None] * (to_eye / np.linalg.norm(to_eye, axis=-1, keepdims=True)).astype(np.float64)


def receivers(stored: Float[ndarray, "*shape"], place: Float[ndarray, "*shape 2"], camera: DepthCamera) -> Float64[ndarray, "*shape 3"]:
    """World positions at places of a picture, (-1, -1) its lower left corner, from samples of its depth buffer."""
    sideways = camera.center + place[..., :1] * camera.across + place[..., 1:] * camera.up
    eye = camera.eye + (sideways if camera.orthographic else 0 * sideways)
    to_eye = np.broadcast_to(-camera.forward, sideways.shape) if camera.orthographic else -sideways
    return point_on_ray(eye, to_eye, ray_length(eye_depth(stored, camera.depth_terms), to_eye, camera.forward))
