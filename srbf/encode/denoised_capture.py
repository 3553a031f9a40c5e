"""A capture of a lightmap whose train images are denoised, all by one linear filter.

The leading components of T guide the filter: the noise of single images is averaged out in them, and the shadow edges of all lights are
there. The noise per texel is estimated from combinations of the images that contain almost no picture. See `plane_filter`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float, Float32, Int
from srbf.capture import COVERED, Capture
from srbf.captured_light import CapturedLight
from srbf.encode.model_selection import sampled_texels
from srbf.encode.plane_filter import MEDIAN, NEIGHBORS, Neighbors, off_planes, plane_filter
from srbf.io.image_blocks import blocks
from srbf.light_images import OnImage
from srbf.receiver_images import Rows
from srbf.solve.pca import principal_axes
from srbf.solve.streamed_product import StreamedProduct

SAMPLE_TEXELS = 1 << 14  # by which components are found
GUIDES = 6  # leading components that guide the filter
SHOWN = 24  # leading components that may hold some of the picture
NOISES = 16  # random combinations of the images without these
LEAST_NOISE = 1e-6  # of the median texel's, so that a black texel has a scale

Axes = Float32[ndarray, "S N"]  # of responses, N = 3 L numbers


@dataclass(frozen=True, eq=False)
class DenoisedCapture(Capture):
    """`of`, with the train images filtered: texel `texels[i]` is row i of `rows`, sparse (n, n), times these texels."""

    of: Capture
    texels: Int[ndarray, " n"]
    rows: Any

    def image(self, index: int) -> Float32[ndarray, "H W 3"]:
        self.require_whole([index])
        return self._stored(index).astype(np.float32).reshape(self.height, self.width, 3)

    def partial_image(self, index: int) -> tuple[Float32[ndarray, "H W 3"], Bool[ndarray, "H W"]]:
        return self.image(index), np.ones((self.height, self.width), bool)

    def channel(self, name: str) -> Float32[ndarray, "H W C"] | None:
        return self.of.channel(name)

    def coverage(self) -> Float32[ndarray, "H W"]:
        return self.of.coverage()

    def sample(self, indices: Sequence[int], texels: Int[ndarray, " n"]) -> Float32[ndarray, "n L 3"]:
        place = np.full(self.width * self.height, -1, np.int64)
        place[self.texels] = np.arange(len(self.texels))
        inside = np.flatnonzero(place[texels] >= 0)
        rows = self.rows[place[texels[inside]]]
        near = np.unique(rows.indices)
        found = self.of.sample(indices, np.concatenate([texels, self.texels[near]]))
        responses, around = found[: len(texels)], found[len(texels) :]
        rows = rows[:, near]
        for column in (column for column, index in enumerate(indices) if self.lights[index].role == "train"):
            responses[inside, column] = rows @ around[:, column]
        return responses

    def _stored_type(self, indices: Sequence[int]) -> np.dtype:
        return np.dtype(np.float32)

    def _stored(self, index: int, rows: Rows = None) -> Float[ndarray, "n 3"]:
        return self._part(self._filtered(index, self.of._stored(index)), rows)

    def _filtered(self, index: int, image: Float[ndarray, "P 3"]) -> Float[ndarray, "P 3"]:
        if self.lights[index].role != "train":
            return image
        filtered = image.astype(np.float32)
        filtered[self.texels] = self.rows @ filtered[self.texels]
        return filtered

    def _part(self, image: Float[ndarray, "P 3"], rows: Rows) -> Float[ndarray, "n 3"]:
        return image if rows is None else np.concatenate([image[begin * self.width : end * self.width] for begin, end in rows])

    def _blocks(
        self, indices: Sequence[int], size: int, stored: np.dtype, buffers: int, on_image: OnImage | None = None, rows: Rows = None
    ) -> Iterator[tuple[int, np.ndarray]]:
        """As of any capture; `on_image` sees the images with their noise."""
        self.require_whole(indices)
        height = self.height if rows is None else sum(end - begin for begin, end in rows)

        def read(row: int) -> ndarray:
            image = self.of._stored(indices[row])
            if on_image is not None:
                on_image(row, self._part(image, rows))
            return self._part(self._filtered(indices[row], image), rows)

        return blocks(read, len(indices), self.width * height, size, stored, buffers)

    def _of(self, lights: tuple[CapturedLight, ...], chosen: Sequence[int]) -> Capture:
        return replace(self, lights=lights, of=self.of._of(lights, chosen))


def denoised(capture: Capture) -> DenoisedCapture | None:
    """The capture without the noise of its train images; None where it has no positions and normals, or hardly any texels.

    A sample and a pass of the train images are read. Memory: some 0.5 kB per texel while the filter is made, then 136 bytes; and 12 bytes
    per light and sampled texel.
    """
    surface = Surface.of(capture)
    texels = np.flatnonzero(capture.coverage().ravel() >= COVERED)
    return None if surface is None else surface.denoised(capture, texels)


@dataclass(frozen=True, eq=False)
class Surface:
    """Places (m) and unit normals of all texels of a capture."""

    positions: Float32[ndarray, "P 3"]
    normals: Float32[ndarray, "P 3"]

    @staticmethod
    def of(capture: Capture) -> Surface | None:
        """None where the capture lacks them."""
        positions, normals = capture.geometry("position"), capture.geometry("normal")
        return None if positions is None or normals is None else Surface(positions.reshape(-1, 3), normals.reshape(-1, 3))

    def denoised(self, capture: Capture, texels: Int[ndarray, " n"], places: Int[ndarray, " n"] | None = None) -> DenoisedCapture | None:
        """`capture` without the noise of its train images at `texels`; `places`: among all texels, where it holds some of these alone.

        None of hardly any texels.
        """
        own = texels if places is None else places
        if len(texels) <= NEIGHBORS:
            return None
        neighbors = Neighbors.of(self.positions[own], self.normals[own])
        shown, noise = _features(capture, texels, _leading_axes(capture))
        squares, enough = off_planes(neighbors, shown), neighbors.enough
        if not enough.any():
            return None
        local = neighbors.median((noise**2).mean(axis=1))
        local = np.maximum(local, LEAST_NOISE * max(float(np.median(local)), 1e-30))[:, None]
        variance = local * (np.median((squares / local)[enough], axis=0) / np.float32(MEDIAN))
        rows = plane_filter(neighbors, shown, variance)
        return DenoisedCapture(capture.folder, capture.manifest, capture.lights, capture, texels, rows)


def _leading_axes(capture: Capture) -> Axes:
    """The SHOWN leading axes of the train images' responses about their mean, of a sample of the texels."""
    train = capture.indices("train")
    rows = capture.sample(train, sampled_texels(capture, SAMPLE_TEXELS)).reshape(-1, 3 * len(train))
    rows -= rows.mean(axis=0)
    return principal_axes(rows, min(SHOWN, rows.shape[1] - 1))[0]


def _features(capture: Capture, texels: Int[ndarray, " n"], axes: Axes) -> tuple[Float32[ndarray, "n G"], Float32[ndarray, "n E"]]:
    """(leading components of the train images, combinations of them that are hardly more than noise) at `texels`."""
    train = capture.indices("train")
    random = np.random.default_rng(0).standard_normal((NOISES, axes.shape[1]), np.float32)
    random -= random @ axes.T @ axes
    product = StreamedProduct(np.concatenate([axes[:GUIDES], random]).reshape(-1, len(train), 3))
    for first, block in capture.stream(train):
        product.add(first, block)
    features = product.result[:, texels].T
    shown, noise = np.ascontiguousarray(features[:, :GUIDES]), np.ascontiguousarray(features[:, GUIDES:])
    return shown, noise - noise.mean(axis=0)  # axes are those of T about its mean
