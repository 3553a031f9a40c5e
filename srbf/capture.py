"""A capture on disk: the transport matrix T, (P receivers, L lights, 3), kept as one image a light and read in blocks."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy import ndarray

from srbf import schemas
from srbf.arrays import Float, Float32, Float64, Int
from srbf.compute.threads import cores, each
from srbf.errors import ImageError, InputError, ManifestError
from srbf.io import files
from srbf.io.float16 import finite_to_float32
from srbf.io.image import holds_half, read_image, read_stored, require_finite, size_of

LightKind = Literal["directional", "point"]
Role = Literal["train", "validation", "holdout"]
Quantity = Literal["irradiance", "radiance"]
Transport = Literal["combined", "indirect"]
ROLES: tuple[Role, ...] = ("train", "validation", "holdout")
MANIFEST = "capture.json"
COVERED = 0.5  # a texel of at least this coverage counts in metrics and figures
UNIT_TOLERANCE = 1e-3  # of a manifest's directions
BLOCK_BYTES = 64 << 20  # float32 images of one block: small beside the maps, large enough for a matrix product
STREAM_BYTES = 192 << 20  # images of one block of the stream, as stored: sums over lights are read and written once a block
STRIP = 16  # rows: what the EXRs compress at a time
Rows = Sequence[tuple[int, int]] | None  # (begin, end) of some, or all
Look = Callable[[int, ndarray], None]  # (position within the lights asked for, image (P, 3) as stored)


@dataclass(frozen=True)
class CapturedLight:
    """One illuminant of a capture, and the image that answers it.

    `place` of a directional light, of unit irradiance, is the unit direction towards it; of a point light, of unit irradiance at 1 m and
    inverse-square fall-off, its position in meters. `direct`, of an indirect capture, is the image of the direct diffuse light
    that `file` lacks.
    """

    place: tuple[float, float, float]
    role: Role
    file: str
    direct: str | None = None
    kind: LightKind = "directional"

    @property
    def direction(self) -> tuple[float, float, float]:
        """Towards the light; InputError of a point light, which has no one direction."""
        if self.kind != "directional":
            raise InputError(f"expected a directional light, found a point light ({self.file}): it has no one direction")
        return self.place

    @property
    def position(self) -> tuple[float, float, float]:
        """Of a point light, meters; InputError of a directional one."""
        if self.kind != "point":
            raise InputError(f"expected a point light, found a directional one ({self.file}): it has no position")
        return self.place


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
            kind: LightKind = light["kind"]
            if kind != (first := manifest["lights"][0]["kind"]):
                raise ManifestError(f"expected lights of one kind in {path}, found {first} and {kind} ones; part them into two captures")
            place = np.asarray(light["direction" if kind == "directional" else "position"], np.float64)
            if kind == "directional":
                length = float(np.linalg.norm(place))
                if not abs(length - 1) <= UNIT_TOLERANCE:
                    raise ManifestError(f"expected a unit direction of light {i} in {path}, found length {length:.4g}; normalize it")
                place = place / length
            files.inside(folder, light["file"], path)
            if "direct" in light:
                files.inside(folder, light["direct"], path)
            x, y, z = place.tolist()
            lights.append(CapturedLight((x, y, z), light["role"], light["file"], light.get("direct"), kind))
        for name in ("position", "normal", "albedo", "coverage", "ambient", "scene", "seams"):
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
    def kind(self) -> LightKind:
        """Of all its lights."""
        return self.lights[0].kind if self.lights else "directional"

    def require_directional(self, what: str) -> None:
        """InputError where the lights are not directional, which `what` needs."""
        if self.kind != "directional":
            raise InputError(f"expected a capture under directional lights for {what}, found {self.kind} lights in {self.folder}")

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
        """Unit directions from the surface to the lights; InputError where they are not directional."""
        self.require_directional("directions")
        chosen = self.lights if indices is None else [self.lights[i] for i in indices]
        return np.array([light.direction for light in chosen], np.float64).reshape(-1, 3)

    def positions(self, indices: Sequence[int] | None = None) -> Float64[ndarray, "L 3"]:
        """Positions of point lights, meters; InputError where they are directional."""
        chosen = self.lights if indices is None else [self.lights[i] for i in indices]
        return np.array([light.position for light in chosen], np.float64).reshape(-1, 3)

    def image(self, index: int) -> Float32[ndarray, "H W 3"]:
        """What the receivers answer to light `index`; ImageError on another size, a damaged file, or NaN."""
        return self._read(self.lights[index].file, 3)

    def blocks(self, indices: Sequence[int]) -> Iterator[tuple[int, Float32[ndarray, "b P 3"]]]:
        """(position of the first light within `indices`, its block of T's columns as (b, P, 3)), the next block read ahead.

        Three blocks of at most BLOCK_BYTES (or one image) are in memory at a time, however many lights there are.
        """
        size = max(1, BLOCK_BYTES // (self.width * self.height * 12))
        return self._blocks(indices, size, np.dtype(np.float32), 0)

    def stream(
        self, indices: Sequence[int], look: Look = lambda row, image: None, rows: Rows = None
    ) -> Iterator[tuple[int, Float[ndarray, "b P 3"]]]:
        """`blocks` as stored, for sums over many lights: float16 where all of `indices` are half floats, else float32; all finite.

        A block's memory is used again for the next but one: be done with it when the next is asked for. `look` sees every image
        once, warm from its file, in whatever thread read it. Memory: two blocks of STREAM_BYTES (or one image) and an image a
        core, however many lights there are. With `rows` the images have those alone, in blocks of as many lights as without.
        """
        with ThreadPoolExecutor(cores()) as readers:
            half = all(readers.map(lambda index: holds_half(self.folder / self.lights[index].file), indices))
        stored = np.dtype(np.float16 if half else np.float32)
        size = max(1, STREAM_BYTES // (self.width * self.height * 3 * stored.itemsize))
        return self._blocks(indices, size, stored, 2, look, rows)

    def sample(self, indices: Sequence[int], texels: Int[ndarray, " n"]) -> Float32[ndarray, "n L 3"]:
        """Rows of T: what receivers `texels` (flat) answer to each of `indices`. Only an image's strips with such texels are undone."""
        responses = np.empty((len(texels), len(indices), 3), np.float32)
        strips, place = np.unique(texels // self.width // STRIP, return_inverse=True)
        rows = [(int(strip) * STRIP, min((int(strip) + 1) * STRIP, self.height)) for strip in strips]
        picked = place * STRIP * self.width + texels - strips[place] * STRIP * self.width
        whole = len(rows) * STRIP >= self.height

        def read(row: int) -> None:
            responses[:, row] = self._stored(indices[row])[texels] if whole else self._stored(indices[row], rows)[picked]

        each(read, len(indices))
        return responses

    def kept(self, texels: Int[ndarray, " n"] | None = None) -> Capture:
        """The capture with all answers in memory, of some flat `texels` alone, (1, n) of them and without geometry, or of all.

        12 bytes a texel and light. What is fitted or asked many times over is read once.
        """
        whole = np.arange(self.width * self.height) if texels is None else texels
        responses = self.sample(range(len(self.lights)), whole)
        manifest, lights = self.manifest, self.lights
        if texels is not None:
            lights = tuple(replace(light, direct=None) for light in lights)  # whole images, which no longer fit
            manifest = {key: value for key, value in manifest.items() if key not in ("position", "normal", "albedo", "ambient", "seams")}
            manifest |= {"width": len(texels), "height": 1}
        coverage = self.coverage() if texels is None else self.coverage().reshape(1, -1)[:, texels]
        return InMemoryCapture(self.folder, manifest, lights, responses, coverage)

    def with_roles(self, roles: Sequence[Role | None]) -> Capture:
        """The same images under other roles, one a light; lights of role None are left out."""
        chosen = [i for i, role in enumerate(roles) if role is not None]
        lights = tuple(replace(self.lights[i], role=role) for i in chosen if (role := roles[i]) is not None)
        return self._of(lights, chosen)

    def _of(self, lights: tuple[CapturedLight, ...], chosen: Sequence[int]) -> Capture:
        return replace(self, lights=lights)

    def _blocks(
        self, indices: Sequence[int], size: int, stored: np.dtype, buffers: int, look: Look | None = None, rows: Rows = None
    ) -> Iterator[tuple[int, np.ndarray]]:
        """Blocks of `size` images of type `stored`, a thread a core reading one block ahead; in `buffers` arrays, or new ones if 0."""
        height = self.height if rows is None else sum(end - begin for begin, end in rows)
        shape = (min(size, len(indices)), self.width * height, 3)
        ring = [np.empty(shape, stored) for _ in range(buffers)]

        def read(row: int, target: np.ndarray) -> None:
            image = self._stored(indices[row], rows)
            if look is not None:
                look(row, image)
            if image.dtype == np.float16 and stored == np.float32:
                finite_to_float32(image, target)
            else:
                target[...] = image

        def start(first: int) -> tuple[int, np.ndarray, list[Future[None]]]:
            block = ring[first // size % buffers] if ring else np.empty(shape, stored)
            block = block[: len(indices) - first]
            return first, block, [readers.submit(read, first + i, target) for i, target in enumerate(block)]

        readers = ThreadPoolExecutor(cores())
        try:
            waiting = deque([start(0)] if len(indices) else [])
            while waiting:
                first, block, pending = waiting.popleft()
                if first + size < len(indices):
                    waiting.append(start(first + size))
                for done in pending:
                    done.result()
                yield first, block
        finally:
            readers.shutdown(cancel_futures=True)

    def _stored(self, index: int, rows: Rows = None) -> Float[ndarray, "n 3"]:
        """An image of T as its file has it, float16 or float32, of the right size and finite; all texels, or those of some rows."""
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

    def seam_edges(self) -> Float32[ndarray, "E 8"] | None:
        """Edges that the UV layer cuts where the surface is smooth, if there are any: u0 v0 u1 v1, v up, on one side, then on the other."""
        if "seams" not in self.manifest:
            return None
        path = self.folder / self.manifest["seams"]
        edges = read_image(path, 8)
        require_finite(edges, path)
        return edges.reshape(-1, 8)

    def _read(self, name: str, channels: int) -> np.ndarray:
        return self._checked(name, read_image, channels)

    def _checked(self, name: str, read: Callable[[Path, int], np.ndarray], channels: int) -> np.ndarray:
        path = self.folder / name
        pixels = read(path, channels)
        if pixels.shape[:2] != (self.height, self.width):
            raise ImageError(f"expected {self.width}x{self.height} texels in {path}, found {pixels.shape[1]}x{pixels.shape[0]}")
        require_finite(pixels, path)
        return pixels


@dataclass(frozen=True, eq=False)
class InMemoryCapture(Capture):
    """A capture whose answers (P, L, 3) are in memory."""

    responses: Float32[ndarray, "P L 3"]
    covered: Float32[ndarray, "H W"]

    def image(self, index: int) -> Float32[ndarray, "H W 3"]:
        return self._stored(index).reshape(self.height, self.width, 3)

    def stream(
        self, indices: Sequence[int], look: Look = lambda row, image: None, rows: Rows = None
    ) -> Iterator[tuple[int, Float[ndarray, "b P 3"]]]:
        return self._blocks(indices, max(1, STREAM_BYTES // (len(self.responses) * 12)), np.dtype(np.float32), 2, look, rows)

    def sample(self, indices: Sequence[int], texels: Int[ndarray, " n"]) -> Float32[ndarray, "n L 3"]:
        return self.responses[np.ix_(texels, np.asarray(indices, np.int64))]

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
        return self._stored(index).reshape(self.height, self.width, 3)

    def stream(
        self, indices: Sequence[int], look: Look = lambda row, image: None, rows: Rows = None
    ) -> Iterator[tuple[int, Float[ndarray, "b P 3"]]]:
        size = max(1, STREAM_BYTES // (self.width * self.height * 12))
        return self._blocks(indices, size, np.dtype(np.float32), 2, look, rows)

    def _stored(self, index: int, rows: Rows = None) -> Float32[ndarray, "n 3"]:
        direct = self.lights[index].direct
        assert direct is not None
        return super()._stored(index, rows).astype(np.float32) + self._read_rows(direct, rows)


def check_version(manifest: dict[str, Any], expected: str, path: Path) -> None:
    """ManifestError where a manifest is of another format or of a version that this srbf does not know."""
    found = manifest.get("format")
    if found != expected:
        raise ManifestError(f"expected format {expected!r} in {path}, found {found!r}")
    if manifest.get("version") != 1:
        raise ManifestError(f"expected version 1 in {path}, found {manifest.get('version')!r}; a newer srbf may read it")
