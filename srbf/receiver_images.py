"""The images of a capture's receivers: channels such as position and coverage, UV seams, the scene, and how files are checked."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float, Float32
from srbf.channels import Channel, channels_of
from srbf.errors import ImageError, ManifestError
from srbf.io import files
from srbf.io.image import read_image, read_stored, require_finite, size_of
from srbf.probe_grid import ProbeGrid, probes_of

Quantity = Literal["irradiance", "radiance"]
Transport = Literal["combined", "indirect"]
MANIFEST = "capture.json"
Rows = Sequence[tuple[int, int]] | None  # (begin, end) of some, or all


@dataclass(frozen=True)
class ReceiverImages:
    """What a capture's folder holds beside the lights' images; read on request.

    `folder` holds capture.json and the images, `manifest` is the content of capture.json.
    """

    folder: Path
    manifest: dict[str, Any]

    @property
    def width(self) -> int:
        return self.manifest["width"]

    @property
    def height(self) -> int:
        return self.manifest["height"]

    @property
    def quantity(self) -> Quantity:
        return self.manifest["quantity"]

    @property
    def transport(self) -> Transport:
        return self.manifest.get("transport", "combined")

    def patches(self) -> Float32[ndarray, "2 N 4"]:
        """The cells of the surfaces that patch lights emit from, in rows (x, y, z, area) and (normal, patch).

        Returns
        -------
        ndarray
            (2, N, 4) float32, meters and square meters.

        Raises
        ------
        ManifestError
            Where the capture names none.
        ImageError
            On a damaged file.
        """
        if "patches" not in self.manifest:
            raise ManifestError(
                f"expected patches of the surfaces in {self.folder / MANIFEST}, found none; bake a `light_set` patches or cloud"
            )
        path = self.folder / self.manifest["patches"]["file"]
        image = read_image(path, 4)
        require_finite(image, path)
        if len(image) != 2:
            raise ImageError(f"expected 2 rows in {path}, found {len(image)}")
        return image

    def probes(self) -> ProbeGrid | None:
        """Where the probes of the capture are.

        Returns
        -------
        ProbeGrid or None
            None where its receivers are others.

        Raises
        ------
        ImageError
            On a damaged file.

        Examples
        --------
        >>> capture.probes() is None
        True
        """

        def pixels(name: str, channels: int) -> Float32[ndarray, "H W C"]:
            path = files.inside(self.folder, name, self.folder / MANIFEST)
            image = read_image(path, channels)
            require_finite(image, path)
            return image

        return probes_of(self.manifest.get("receiver", {}), pixels)

    def scene(self) -> bytes | None:
        """The triangles of receivers and occluders.

        Returns
        -------
        bytes or None
            Of a .glb; None where the capture has none.

        Raises
        ------
        ManifestError
            Where the file is missing.

        Examples
        --------
        >>> capture.scene() is None
        True
        """
        if "scene" not in self.manifest:
            return None
        path = self.folder / self.manifest["scene"]
        if not path.is_file():
            raise ManifestError(f"expected the scene's triangles at {path}, found no such file; bake again")
        return path.read_bytes()

    @property
    def source_bits(self) -> int | None:
        """Bits per channel of the photographs that this capture was made of; None where it does not say."""
        return self.manifest.get("source", {}).get("bits")

    @property
    def channels(self) -> dict[str, Channel]:
        """The channels that the capture holds beside its lights' images, by name."""
        return {name: channel for name, (channel, _) in self._channel_files.items()}

    def channel(self, name: str) -> Float32[ndarray, "H W C"] | None:
        """The image of a channel, beside those of the lights.

        Parameters
        ----------
        name
            A channel of `srbf.channels`, which has components and units.

        Returns
        -------
        ndarray or None
            (H, W, C) float32; None where the capture lacks the channel.

        Raises
        ------
        ImageError
            As of `image`.

        Examples
        --------
        >>> capture.channel("position").shape, capture.channel("normal") is None
        ((6, 8, 3), True)
        """
        if name not in self._channel_files:
            return None
        channel, file = self._channel_files[name]
        return self._read(file, channel.components)

    def geometry(self, name: Literal["position", "normal", "albedo"]) -> Float32[ndarray, "H W 3"] | None:
        """World position (m), unit normal or albedo of every receiver.

        Parameters
        ----------
        name
            `position`, `normal` or `albedo`.

        Returns
        -------
        ndarray or None
            (H, W, 3) float32; None where the capture lacks it.

        Raises
        ------
        ImageError
            As of `image`.

        Examples
        --------
        >>> capture.geometry("position")[5, 7].tolist()
        [7.0, 5.0, 0.0]
        """
        return self.channel(name)

    def coverage(self) -> Float32[ndarray, "H W"]:
        """The covered part of each texel. Read once, and not to be written to.

        Returns
        -------
        ndarray
            (H, W) float32, 0 to 1; 1 everywhere where the capture does not say.

        Raises
        ------
        ImageError
            As of `image`.

        Examples
        --------
        >>> float(capture.coverage().min())
        1.0
        """
        return self._coverage

    def ambient(self) -> Float32[ndarray, "H W 3"] | None:
        """The receivers with all lights of the capture off.

        Returns
        -------
        ndarray or None
            (H, W, 3) float32; None where the scene does not emit.

        Raises
        ------
        ImageError
            As of `image`.

        Examples
        --------
        >>> capture.ambient() is None
        True
        """
        return self.channel("ambient")

    @cached_property
    def _channel_files(self) -> dict[str, tuple[Channel, str]]:
        return channels_of(self.manifest, str(self.folder / MANIFEST))

    @cached_property
    def _coverage(self) -> Float32[ndarray, "H W"]:
        image = self.channel("coverage")
        coverage = np.ones((self.height, self.width), np.float32) if image is None else image[:, :, 0]
        coverage.flags.writeable = False
        return coverage

    def seam_edges(self) -> Float32[ndarray, "E 8"] | None:
        """Edges that the UV layer cuts where the surface is smooth.

        Returns
        -------
        ndarray or None
            (E, 8) float32: u0 v0 u1 v1, v up, on one side, then on the other; None without any.

        Raises
        ------
        ImageError
            Where the file is damaged, missing, or not finite.

        Examples
        --------
        >>> capture.seam_edges() is None
        True
        """
        if "seams" not in self.manifest:
            return None
        path = self.folder / self.manifest["seams"]
        edges = read_image(path, 8)
        require_finite(edges, path)
        return edges.reshape(-1, 8)

    def _read_rows(self, name: str, rows: Rows) -> Float[ndarray, "n 3"]:
        if rows is None:
            return self._checked(name, read_stored, 3).reshape(-1, 3)
        path = self.folder / name
        if size_of(path) != (self.height, self.width):
            self._checked(name, read_stored, 3)  # says what is wrong
        pixels = read_stored(path, 3, rows)
        require_finite(pixels, path)
        return pixels.reshape(-1, 3)

    def _read(self, name: str, components: int) -> np.ndarray:
        return self._checked(name, read_image, components)

    def _partial(self, name: str, region: Bool[ndarray, "H W"]) -> Float32[ndarray, "H W 3"]:
        """An image with zeros outside `region`, finite within."""
        pixels = np.where(region[:, :, None], self._sized(name, read_image, 3), np.float32(0))
        require_finite(pixels, self.folder / name)
        return pixels

    def _checked(self, name: str, read: Callable[[Path, int], np.ndarray], components: int) -> np.ndarray:
        pixels = self._sized(name, read, components)
        require_finite(pixels, self.folder / name)
        return pixels

    def _sized(self, name: str, read: Callable[[Path, int], np.ndarray], components: int) -> np.ndarray:
        path = self.folder / name
        pixels = read(path, components)
        if pixels.shape[:2] != (self.height, self.width):
            raise ImageError(f"expected {self.width}x{self.height} texels in {path}, found {pixels.shape[1]}x{pixels.shape[0]}")
        return pixels
