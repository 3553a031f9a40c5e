"""A capture on disk: the transport matrix T, (P receivers, L lights, 3), stored as one image per light and read in blocks."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy import ndarray

from srbf import schemas
from srbf.arrays import Bool, Float, Float32, Float64, Int
from srbf.captured_light import ROLES as ROLES
from srbf.captured_light import CapturedLight, LightKind, Role
from srbf.channels import Channel, channels_of
from srbf.compute.threads import cores, each
from srbf.errors import ImageError, InputError, ManifestError
from srbf.io import files
from srbf.io.image import holds_half, read_image, read_stored, require_finite, size_of
from srbf.io.image_blocks import blocks

Quantity = Literal["irradiance", "radiance"]
Transport = Literal["combined", "indirect"]
MANIFEST = "capture.json"
COVERED = 0.5  # a texel of at least this coverage counts in metrics and figures
BLOCK_BYTES = 64 << 20  # float32 images of one block: small beside the maps, large enough for a matrix product
STREAM_BYTES = 192 << 20  # images of one block of the stream, as stored: sums over lights are read and written once a block
STRIP = 16  # rows: what the EXRs compress at a time
Rows = Sequence[tuple[int, int]] | None  # (begin, end) of some, or all
OnImage = Callable[[int, ndarray], None]  # (position within the lights requested, image (P, 3) as stored)


@dataclass(frozen=True)
class Capture:
    """An opened capture; images are read on request. `manifest` is the content of capture.json."""

    folder: Path
    manifest: dict[str, Any]
    lights: tuple[CapturedLight, ...]

    @staticmethod
    def open(folder: Path | str) -> Capture:
        """Read and check capture.json; keys not known to this version are ignored.

        Raises ManifestError, in one line, where there is none or it breaks the format.
        """
        folder = Path(folder)
        path = folder / MANIFEST
        if not path.is_file():
            raise ManifestError(f"expected a capture with a {MANIFEST} at {folder}, found none; bake or import one first")
        manifest = files.read_json(path)
        check_version(manifest, "srbf-capture", path)
        schemas.check(manifest, "capture", str(path))
        lights = [CapturedLight.of_manifest(entry, f"light {i} in {path}") for i, entry in enumerate(manifest["lights"])]
        texels = manifest["width"] * manifest["height"]
        for i, light in enumerate(lights):
            if light.kind != lights[0].kind:
                raise ManifestError(
                    f"expected lights of one kind in {path}, found {lights[0].kind} and {light.kind} lights; split them into two captures"
                )
            if isinstance(light.region, tuple) and max(light.region) >= texels:
                raise ManifestError(f"expected receivers below {texels} in the region of light {i} in {path}, found {max(light.region)}")
            for name in light.files:
                files.inside(folder, name, path)
        named = [file for _, file in channels_of(manifest, str(path)).values()]
        for name in [*named, *(manifest[key] for key in ("scene", "seams") if key in manifest)]:
            files.inside(folder, name, path)
        return Capture(folder, manifest, tuple(lights))

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

    @property
    def kind(self) -> LightKind:
        """The kind of all its lights."""
        return self.lights[0].kind if self.lights else "directional"

    def require_directional(self, what: str) -> None:
        """InputError where the lights are not directional, which `what` needs."""
        if self.kind != "directional":
            raise InputError(f"expected a capture under directional lights for {what}, found {self.kind} lights in {self.folder}")

    @property
    def has_direct(self) -> bool:
        """Whether every light has a direct image, so that the combined response can be computed."""
        return all(light.direct is not None for light in self.lights)

    def combined(self) -> Capture:
        """The same capture with the direct light added; itself where it is combined. ManifestError where direct images are missing."""
        if self.transport == "combined":
            return self
        if not self.has_direct:
            raise ManifestError(f"expected a direct image of every light in {self.folder}, found lights without; bake it again")
        return CombinedCapture(self.folder, {**self.manifest, "transport": "combined"}, self.lights)

    def scene(self) -> bytes | None:
        """The bytes of the .glb of receivers and occluders; None where the capture has none. ManifestError where the file is missing."""
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

    def indices(self, role: Role) -> list[int]:
        """Indices of the lights of this role, in order."""
        return [i for i, light in enumerate(self.lights) if light.role == role]

    def directions(self, indices: Sequence[int] | None = None) -> Float64[ndarray, "L 3"]:
        """Unit directions from the surface to the lights `indices` (default: all); InputError where they are not directional."""
        self.require_directional("directions")
        chosen = self.lights if indices is None else [self.lights[i] for i in indices]
        return np.array([light.direction for light in chosen], np.float64).reshape(-1, 3)

    def positions(self, indices: Sequence[int] | None = None) -> Float64[ndarray, "L 3"]:
        """Positions of the point lights `indices` (default: all), m; InputError where they are directional."""
        chosen = self.lights if indices is None else [self.lights[i] for i in indices]
        return np.array([light.position for light in chosen], np.float64).reshape(-1, 3)

    def image(self, index: int) -> Float32[ndarray, "H W 3"]:
        """The receivers' responses to light `index`.

        Raises ImageError for another size, a damaged file or NaN, InputError where the image covers a region only.
        """
        self.require_whole([index])
        return self._read(self.lights[index].file, 3)

    def partial_image(self, index: int) -> tuple[Float32[ndarray, "H W 3"], Bool[ndarray, "H W"]]:
        """(responses to light `index`, 0 outside its region; the region). The region is all receivers where the light names none.

        Values outside the region are not looked at: they may be NaN. ImageError as of `image`.
        """
        light = self.lights[index]
        known = self.region(index)
        if known is None:
            return self.image(index), np.ones((self.height, self.width), bool)
        return self._partial(light.file, known), known

    def region(self, index: int) -> Bool[ndarray, "H W"] | None:
        """Which receivers the image of light `index` holds; None where it holds all. A mask file holds those above 0."""
        region = self.lights[index].region
        if region is None:
            return None
        if isinstance(region, str):
            return self._read(region, 1)[:, :, 0] > 0
        known = np.zeros(self.height * self.width, bool)
        known[list(region)] = True
        return known.reshape(self.height, self.width)

    def require_whole(self, indices: Sequence[int]) -> None:
        """InputError where the image of one of the lights `indices` covers a region only."""
        for index in indices:
            light = self.lights[index]
            if light.region is not None:
                raise InputError(
                    f"expected an image of all receivers of {self.folder} for light {index}, found {light.file} with a region only; "
                    "complete the capture first (srbf complete)"
                )

    def blocks(self, indices: Sequence[int]) -> Iterator[tuple[int, Float32[ndarray, "b P 3"]]]:
        """Blocks of T's columns: (position of the block's first light within `indices`, the block), the next block read ahead.

        Memory: three blocks of at most BLOCK_BYTES (or one image), however many lights there are. InputError where an image covers a
        region only.
        """
        size = max(1, BLOCK_BYTES // (self.width * self.height * 12))
        return self._blocks(indices, size, np.dtype(np.float32), 0)

    def stream(
        self, indices: Sequence[int], on_image: OnImage = lambda row, image: None, rows: Rows = None
    ) -> Iterator[tuple[int, Float[ndarray, "b P 3"]]]:
        """`blocks` as stored, for sums over many lights: float16 where all of `indices` are half floats, else float32; all finite.

        A block is valid until the next iteration: its memory is used again. `on_image` gets every image once, straight from
        its file, in the thread that read it. With `rows` the images have only those, in blocks of as many lights as without.
        Memory: two blocks of STREAM_BYTES (or one image) and an image per core, however many lights there are. InputError where an
        image covers a region only.
        """
        with ThreadPoolExecutor(cores()) as readers:
            half = all(readers.map(lambda index: holds_half(self.folder / self.lights[index].file), indices))
        stored = np.dtype(np.float16 if half else np.float32)
        size = max(1, STREAM_BYTES // (self.width * self.height * 3 * stored.itemsize))
        return self._blocks(indices, size, stored, 2, on_image, rows)

    def sample(self, indices: Sequence[int], texels: Int[ndarray, " n"]) -> Float32[ndarray, "n L 3"]:
        """Rows of T: responses of the receivers `texels` (flat indices) to the lights `indices`.

        Only the strips of rows that hold such texels are decompressed. InputError where an image covers a region only.
        """
        self.require_whole(indices)
        responses = np.empty((len(texels), len(indices), 3), np.float32)
        strips, place = np.unique(texels // self.width // STRIP, return_inverse=True)
        rows = [(int(strip) * STRIP, min((int(strip) + 1) * STRIP, self.height)) for strip in strips]
        picked = place * STRIP * self.width + texels - strips[place] * STRIP * self.width
        whole = len(rows) * STRIP >= self.height

        def read(row: int) -> None:
            responses[:, row] = self._stored(indices[row])[texels] if whole else self._stored(indices[row], rows)[picked]

        each(read, len(indices))
        return responses

    def load(self, texels: Int[ndarray, " n"] | None = None) -> Capture:
        """The capture with all responses in memory: of all receivers, or of the flat `texels` alone, as an image (1, n).

        The latter has no channel but coverage. Memory: 12 bytes per receiver and light. InputError where an image covers a region only.
        """
        whole = np.arange(self.width * self.height) if texels is None else texels
        responses = self.sample(range(len(self.lights)), whole)
        manifest, lights = self.manifest, self.lights
        if texels is not None:
            lights = tuple(replace(light, direct=None) for light in lights)  # whole images, which no longer fit
            of_whole_images = {*self.channels, "channels", "seams"} - {"coverage"}
            manifest = {key: value for key, value in manifest.items() if key not in of_whole_images}
            manifest |= {"width": len(texels), "height": 1}
        coverage = self.coverage() if texels is None else self.coverage().reshape(1, -1)[:, texels]
        return InMemoryCapture(self.folder, manifest, lights, responses, coverage)

    def with_roles(self, roles: Sequence[Role | None]) -> Capture:
        """The same images with other `roles`, one per light; lights of role None are left out."""
        chosen = [i for i, role in enumerate(roles) if role is not None]
        lights = tuple(replace(self.lights[i], role=role) for i in chosen if (role := roles[i]) is not None)
        return self._of(lights, chosen)

    def _of(self, lights: tuple[CapturedLight, ...], chosen: Sequence[int]) -> Capture:
        return replace(self, lights=lights)

    def _blocks(
        self, indices: Sequence[int], size: int, stored: np.dtype, buffers: int, on_image: OnImage | None = None, rows: Rows = None
    ) -> Iterator[tuple[int, np.ndarray]]:
        """Blocks of `size` images of type `stored`, see `srbf.io.image_blocks`."""
        self.require_whole(indices)
        height = self.height if rows is None else sum(end - begin for begin, end in rows)

        def read(row: int) -> ndarray:
            image = self._stored(indices[row], rows)
            if on_image is not None:
                on_image(row, image)
            return image

        return blocks(read, len(indices), self.width * height, size, stored, buffers)

    def _stored(self, index: int, rows: Rows = None) -> Float[ndarray, "n 3"]:
        """An image of T as stored, float16 or float32, of the right size and finite; all texels, or those of some rows."""
        return self._read_rows(self.lights[index].file, rows)

    def _read_rows(self, name: str, rows: Rows) -> Float[ndarray, "n 3"]:
        if rows is None:
            return self._checked(name, read_stored, 3).reshape(-1, 3)
        path = self.folder / name
        if size_of(path) != (self.height, self.width):
            self._checked(name, read_stored, 3)  # says what is wrong
        pixels = read_stored(path, 3, rows)
        require_finite(pixels, path)
        return pixels.reshape(-1, 3)

    @property
    def channels(self) -> dict[str, Channel]:
        """The channels that the capture holds beside its lights' images, by name."""
        return {name: channel for name, (channel, _) in self._channel_files.items()}

    def channel(self, name: str) -> Float32[ndarray, "H W C"] | None:
        """The image of a channel (`srbf.channels` has components and units); None where the capture lacks it. ImageError as of `image`."""
        if name not in self._channel_files:
            return None
        channel, file = self._channel_files[name]
        return self._read(file, channel.components)

    def geometry(self, name: Literal["position", "normal", "albedo"]) -> Float32[ndarray, "H W 3"] | None:
        """World position (m), unit normal or albedo of every receiver; None where the capture lacks it."""
        return self.channel(name)

    def coverage(self) -> Float32[ndarray, "H W"]:
        """The covered part of each texel, 0 to 1; 1 where the capture does not say. Read once, and not to be written to."""
        return self._coverage

    def ambient(self) -> Float32[ndarray, "H W 3"] | None:
        """The receivers with all lights of the capture off; None where the scene does not emit."""
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
        """Edges that the UV layer cuts where the surface is smooth: u0 v0 u1 v1, v up, on one side, then on the other; None without any."""
        if "seams" not in self.manifest:
            return None
        path = self.folder / self.manifest["seams"]
        edges = read_image(path, 8)
        require_finite(edges, path)
        return edges.reshape(-1, 8)

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


@dataclass(frozen=True, eq=False)
class InMemoryCapture(Capture):
    """A capture whose responses (P, L, 3) are in memory, with its coverage."""

    responses: Float32[ndarray, "P L 3"]
    covered: Float32[ndarray, "H W"]

    def image(self, index: int) -> Float32[ndarray, "H W 3"]:
        return self._stored(index).reshape(self.height, self.width, 3)

    def stream(
        self, indices: Sequence[int], on_image: OnImage = lambda row, image: None, rows: Rows = None
    ) -> Iterator[tuple[int, Float[ndarray, "b P 3"]]]:
        return self._blocks(indices, max(1, STREAM_BYTES // (len(self.responses) * 12)), np.dtype(np.float32), 2, on_image, rows)

    def sample(self, indices: Sequence[int], texels: Int[ndarray, " n"]) -> Float32[ndarray, "n L 3"]:
        return self.responses[np.ix_(texels, np.asarray(indices, np.int64))]

    def channel(self, name: str) -> Float32[ndarray, "H W C"] | None:
        return self.covered[:, :, None] if name == "coverage" else super().channel(name)

    def coverage(self) -> Float32[ndarray, "H W"]:
        return self.covered

    def _stored(self, index: int, rows: Rows = None) -> Float32[ndarray, "n 3"]:
        if rows is None:
            return self.responses[:, index]
        return np.concatenate([self.responses[begin * self.width : end * self.width, index] for begin, end in rows])

    def _of(self, lights: tuple[CapturedLight, ...], chosen: Sequence[int]) -> Capture:
        return replace(self, lights=lights, responses=self.responses[:, list(chosen)])


class CombinedCapture(Capture):
    """An indirect capture whose images have their direct light added."""

    def image(self, index: int) -> Float32[ndarray, "H W 3"]:
        self.require_whole([index])
        return self._stored(index).reshape(self.height, self.width, 3)

    def stream(
        self, indices: Sequence[int], on_image: OnImage = lambda row, image: None, rows: Rows = None
    ) -> Iterator[tuple[int, Float[ndarray, "b P 3"]]]:
        size = max(1, STREAM_BYTES // (self.width * self.height * 12))
        return self._blocks(indices, size, np.dtype(np.float32), 2, on_image, rows)

    def partial_image(self, index: int) -> tuple[Float32[ndarray, "H W 3"], Bool[ndarray, "H W"]]:
        image, known = super().partial_image(index)
        direct = self.lights[index].direct
        assert direct is not None
        return (image, known) if self.lights[index].region is None else (image + self._partial(direct, known), known)

    def _stored(self, index: int, rows: Rows = None) -> Float32[ndarray, "n 3"]:
        direct = self.lights[index].direct
        assert direct is not None
        return super()._stored(index, rows).astype(np.float32) + self._read_rows(direct, rows)


def check_version(manifest: dict[str, Any], expected: str, path: Path) -> None:
    """ManifestError where a manifest has another format, or a version not known to this srbf."""
    found = manifest.get("format")
    if found != expected:
        raise ManifestError(f"expected format {expected!r} in {path}, found {found!r}")
    if manifest.get("version") != 1:
        raise ManifestError(f"expected version 1 in {path}, found {manifest.get('version')!r}; a newer srbf may read it")
