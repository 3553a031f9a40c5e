"""Where shadow maps are looked up: points of every texel, and more of the pixels that show several surfaces."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64, Int
from srbf.visibility.embree import EmbreeTriangles, has_embree
from srbf.visibility.lightmap_points import LightmapPoints, Points
from srbf.visibility.pixel_points import several_surfaces
from srbf.visibility.rays import RayTracer, Samples
from srbf.visibility.receivers import Receivers

FINE, COARSE = 4, 2  # points per side of the footprint, per texel
FINE_TEXELS = 1 << 16  # of the largest image with FINE points
EDGE_POINTS, EDGE_PARTS = 64, 8  # of a pixel with several surfaces, and in how many parts, as a light with a size looks at them
SHADOW_POINTS, SHADOW_BUDGET = 128, 16  # of a pixel that the edge of a shadow crosses; in the mean over the image, at most
BATCH = 1 << 20  # of such points at a time
STEP, DARK = 0.1, 0.05  # between such a pixel and a neighbor, over the brighter one; and over the mean irradiance


@dataclass(frozen=True, eq=False)
class LookupPoints:
    """`layers`: a point of each of the P texels, with weights that sum to 1 over the layers; 0 of the texels `edges`.

    `parts`: the points of these, which count by their shares: a pixel with several surfaces shows each as much as it reflects.
    """

    layers: list[Points]
    edges: Int[ndarray, " E"]
    parts: list[Samples]
    _tracer: RayTracer | None = None

    @staticmethod
    def of(receivers: Receivers) -> LookupPoints:
        """On the mesh; in a view where the rays of its pixels meet it, without embreex or a known camera along the slopes of its maps."""
        size = receivers.width * receivers.height
        grid = _grid(FINE if size <= FINE_TEXELS else COARSE)
        if receivers.camera is not None and has_embree():
            return _of_view(receivers, RayTracer(receivers), grid)
        by_rays = has_embree() and receivers.camera is None and receivers.triangles.lightmap is None
        places = LightmapPoints(receivers, EmbreeTriangles(receivers.triangles.corners).first_hit if by_rays else None)
        found = [places.at(np.arange(size), np.broadcast_to(place, (size, 2))) for place in grid]
        total = np.sum([points.weight for points in found], axis=0)
        return LookupPoints([_weighed(points, points.weight / total) for points in found], np.zeros(0, np.int64), [])

    def of_shadows(self, irradiance: Float32[ndarray, "H W 3"]) -> Iterator[tuple[Int[ndarray, " e"], list[Samples]]]:
        """More points of the pixels of a view, other than `edges`, that the edge of a shadow or of a spot crosses, and those pixels.

        About BATCH points at a time.
        """
        from scipy import ndimage

        image = irradiance.max(axis=2)
        own = (np.sum([layer.weight for layer in self.layers], axis=0) > 0).reshape(image.shape)
        if self._tracer is None or not image[own].any():
            return
        high = ndimage.maximum_filter(np.where(own, image, 0), 3)
        step = high - ndimage.minimum_filter(np.where(own, image, np.inf), 3)
        pixels = np.flatnonzero(own & (step > np.maximum(STEP * high, DARK * image[own & (image > 0)].mean(dtype=np.float64))))
        count = min(SHADOW_POINTS, SHADOW_BUDGET * image.size // max(1, len(pixels)))
        batch = max(1, BATCH // count)
        for start in range(0, len(pixels), batch):
            part = pixels[start : start + batch]
            yield part, [self._tracer.samples(part, range(count))]


def _of_view(receivers: Receivers, tracer: RayTracer, grid: Float64[ndarray, "g 2"]) -> LookupPoints:
    size = receivers.width * receivers.height
    position, normal = (receivers.images[name].reshape(-1, 3) for name in ("position", "normal"))
    coverage = receivers.images.get("coverage")
    covered = np.flatnonzero(np.ones(size, bool) if coverage is None else coverage.ravel() > 0)
    has_center = np.linalg.norm(normal, axis=1) > 0.5
    edges = np.union1d(several_surfaces(tracer, covered, position, has_center), np.intersect1d(tracer.edges(), covered))
    found = [tracer.samples_at(np.arange(size), np.broadcast_to(place, (size, 2))) for place in grid]
    plain = np.zeros(size, bool)
    plain[covered] = True
    plain[edges] = False
    total = np.maximum(np.sum([samples.weight for samples in found], axis=0), 1)
    layers = [_weighed(samples, np.where(plain, samples.weight / total, 0)) for samples in found]
    each = EDGE_POINTS // EDGE_PARTS
    parts = [tracer.samples(edges, range(first, first + each)) for first in range(0, EDGE_POINTS if len(edges) else 0, each)]
    return LookupPoints(layers, edges, parts, tracer)


def _grid(side: int) -> Float64[ndarray, "g 2"]:
    return (np.stack(np.meshgrid(np.arange(side), np.arange(side)), axis=-1).reshape(-1, 2) + 0.5) / side


def _weighed(points: Points | Samples, weight: Float32[ndarray, " n"]) -> Points:
    return Points(weight.astype(np.float32), points.point, points.normal, points.face, points.lift, points.triangle)
