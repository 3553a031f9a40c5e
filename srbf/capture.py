"""A capture on disk: the transport matrix T, (P receivers, L lights, 3), kept as one image a light and read in blocks."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy import ndarray

from srbf import files, schemas
from srbf.arrays import Float32, Float64
from srbf.errors import ImageError, ManifestError
from srbf.image import read_image, require_finite, size_of

Role = Literal["train", "validation", "holdout"]
Quantity = Literal["irradiance", "radiance"]
Transport = Literal["combined", "indirect"]
ROLES: tuple[Role, ...] = ("train", "validation", "holdout")
MANIFEST = "capture.json"
COVERED = 0.5  # a texel of at least this coverage counts in metrics and figures
UNIT_TOLERANCE = 1e-3  # of a manifest's directions
BLOCK_BYTES = 64 << 20  # images of one block: small beside the maps, large enough for a matrix product


@dataclass(frozen=True)
class CapturedLight:
    """One illuminant of a capture: a directional light of unit irradiance, and the image that answers it.

    `direct`, of an indirect capture, is the image of the direct diffuse light that `file` lacks.
    """

    direction: tuple[float, float, float]
    role: Role
    file: str
    direct: str | None = None


@dataclass(frozen=True)
class Capture:
    """An opened capture; images are read when asked for. `manifest` is capture.json as it stands."""

    folder: Path
    manifest: dict[str, Any]
    lights: tuple[CapturedLight, ...]

    @staticmethod
    def open(folder: Path | str) -> Capture:
        """Read and check capture.json; ManifestError in one line where it breaks the format. Keys not known are ignored."""
        folder = Path(folder)
        path = folder / MANIFEST
        if not path.is_file():
            raise ManifestError(f"expected a capture with a {MANIFEST} at {folder}, found none; bake or import one first")
        manifest = files.read_json(path)
        check_version(manifest, "srbf-capture", path)
        schemas.check(manifest, "capture", str(path))
        lights = []
        for i, light in enumerate(manifest["lights"]):
            length = float(np.linalg.norm(light["direction"]))
            if not abs(length - 1) <= UNIT_TOLERANCE:
                raise ManifestError(f"expected a unit direction of light {i} in {path}, found length {length:.4g}; normalise it")
            files.inside(folder, light["file"], path)
            if "direct" in light:
                files.inside(folder, light["direct"], path)
            unit = np.asarray(light["direction"], np.float64) / length
            direction = (float(unit[0]), float(unit[1]), float(unit[2]))
            lights.append(CapturedLight(direction, light["role"], light["file"], light.get("direct")))
        for name in ("position", "normal", "albedo", "coverage", "ambient", "scene"):
            if name in manifest:
                files.inside(folder, manifest[name], path)
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
    def has_direct(self) -> bool:
        """Whether every light has its direct image beside it, so that the combined answer can be told."""
        return all(light.direct is not None for light in self.lights)

    def combined(self) -> Capture:
        """The same capture with the direct light put back; itself where it is combined. ManifestError where direct images lack."""
        if self.transport == "combined":
            return self
        if not self.has_direct:
            raise ManifestError(f"expected a direct image of every light in {self.folder}, found lights without; bake it again")
        return CombinedCapture(self.folder, {**self.manifest, "transport": "combined"}, self.lights)

    def scene(self) -> bytes | None:
        """The .glb of receivers and occluders, where the capture has one."""
        if "scene" not in self.manifest:
            return None
        path = self.folder / self.manifest["scene"]
        if not path.is_file():
            raise ManifestError(f"expected the scene's triangles at {path}, found no such file; bake again")
        return path.read_bytes()

    @property
    def source_bits(self) -> int | None:
        """Bits a channel of the photographs this capture came from, where it says so."""
        return self.manifest.get("source", {}).get("bits")

    def indices(self, role: Role) -> list[int]:
        """Which lights have this role, in order."""
        return [i for i, light in enumerate(self.lights) if light.role == role]

    def directions(self, indices: Sequence[int] | None = None) -> Float64[ndarray, "L 3"]:
        """Unit directions from the surface to the lights."""
        chosen = self.lights if indices is None else [self.lights[i] for i in indices]
        return np.array([light.direction for light in chosen], np.float64).reshape(-1, 3)

    def image(self, index: int) -> Float32[ndarray, "H W 3"]:
        """What the receivers answer to light `index`; ImageError on another size, a damaged file, or NaN."""
        return self._read(self.lights[index].file, 3)

    def blocks(self, indices: Sequence[int]) -> Iterator[tuple[int, Float32[ndarray, "b P 3"]]]:
        """(position of the first light within `indices`, its block of T's columns as (b, P, 3)), the next block read ahead.

        Three blocks of at most BLOCK_BYTES (or one image) are in memory at a time, however many lights there are.
        """
        texels = self.width * self.height
        size = max(1, BLOCK_BYTES // (texels * 12))
        spans = [indices[i : i + size] for i in range(0, len(indices), size)]
        with ThreadPoolExecutor(max_workers=2) as readers:

            def read(span: Sequence[int]) -> np.ndarray:
                block = np.empty((len(span), texels, 3), np.float32)
                for row, index in zip(block, span, strict=True):
                    row[:] = self.image(index).reshape(texels, 3)
                return block

            pending = [readers.submit(read, span) for span in spans[:2]]
            for number in range(len(spans)):
                block = pending.pop(0).result()
                if number + 2 < len(spans):
                    pending.append(readers.submit(read, spans[number + 2]))
                yield number * size, block

    def geometry(self, name: Literal["position", "normal", "albedo"]) -> Float32[ndarray, "H W 3"] | None:
        """World position (m), unit normal or albedo of every receiver, where the capture has it."""
        return self._read(self.manifest[name], 3) if name in self.manifest else None

    def coverage(self) -> Float32[ndarray, "H W"]:
        """How much of each texel is real, 0 to 1; all 1 where the capture says nothing."""
        if "coverage" not in self.manifest:
            return np.ones((self.height, self.width), np.float32)
        return self._read(self.manifest["coverage"], 1)[:, :, 0]

    def ambient(self) -> Float32[ndarray, "H W 3"] | None:
        """What the scene shows with no light of the capture, where it emits."""
        return self._read(self.manifest["ambient"], 3) if "ambient" in self.manifest else None

    def _read(self, name: str, channels: int) -> np.ndarray:
        path = self.folder / name
        found = size_of(path)
        if found != (self.height, self.width):
            raise ImageError(f"expected {self.width}x{self.height} texels in {path}, found {found[1]}x{found[0]}")
        pixels = read_image(path, channels)
        require_finite(pixels, path)
        return pixels


class CombinedCapture(Capture):
    """An indirect capture whose images have their direct light added."""

    def image(self, index: int) -> Float32[ndarray, "H W 3"]:
        direct = self.lights[index].direct
        assert direct is not None
        return super().image(index) + self._read(direct, 3)


def check_version(manifest: dict[str, Any], expected: str, path: Path) -> None:
    """ManifestError where a manifest is of another format or of a version that this srbf does not know."""
    found = manifest.get("format")
    if found != expected:
        raise ManifestError(f"expected format {expected!r} in {path}, found {found!r}")
    if manifest.get("version") != 1:
        raise ManifestError(f"expected version 1 in {path}, found {manifest.get('version')!r}; a newer srbf may read it")
