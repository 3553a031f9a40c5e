"""A capture on disk: the transport matrix T, (P receivers, L lights, 3), stored as one image per light and read in blocks."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy import ndarray

from srbf import schemas
from srbf.arrays import Bool, Float, Float32, Float64, Int
from srbf.captured_light import ROLES as ROLES
from srbf.captured_light import CapturedLight, LightKind, Role
from srbf.channels import channels_of
from srbf.compute.threads import cores, each
from srbf.errors import InputError, ManifestError
from srbf.io import files
from srbf.io.image import holds_half
from srbf.io.image_blocks import blocks
from srbf.receiver_images import MANIFEST, ReceiverImages, Rows

COVERED = 0.5  # a texel of at least this coverage counts in metrics and figures
BLOCK_BYTES = 64 << 20  # float32 images of one block: small beside the maps, large enough for a matrix product
STREAM_BYTES = 192 << 20  # images of one block of the stream, as stored: sums over lights are read and written once a block
STRIP = 16  # rows: what the EXRs compress at a time
OnImage = Callable[[int, ndarray], None]  # (position within the lights requested, image (P, 3) as stored)


@dataclass(frozen=True)
class Capture(ReceiverImages):
    """An opened capture; images are read on request.

    Parameters
    ----------
    folder
        Holds capture.json and the images.
    manifest
        The content of capture.json.
    lights
        One per image: direction or position, role, file.

    Examples
    --------
    >>> capture.width, capture.height, len(capture.lights)
    (8, 6, 48)
    >>> capture.quantity, capture.transport, capture.kind
    ('irradiance', 'combined', 'directional')
    """

    lights: tuple[CapturedLight, ...]

    @staticmethod
    def open(folder: Path | str) -> Capture:
        """Read and check capture.json; keys not known to this version are ignored.

        Parameters
        ----------
        folder
            Holds capture.json: what a bake or an import wrote.

        Returns
        -------
        Capture
            No image is read yet.

        Raises
        ------
        ManifestError
            In one line, where there is no capture.json or it breaks the format.

        Examples
        --------
        >>> Capture.open(folder / "capture").lights == capture.lights
        True
        """
        folder = Path(folder)
        path = folder / MANIFEST
        if not path.is_file():
            raise ManifestError(f"expected a capture with a {MANIFEST} at {folder}, found none; bake or import one first")
        manifest = files.read_json(path)
        schemas.check_version(manifest, "srbf-capture", path)
        schemas.check(manifest, "capture", str(path))
        lights = [CapturedLight.of_manifest(entry, f"light {i} in {path}") for i, entry in enumerate(manifest["lights"])]
        if "cubemap" in manifest:
            from srbf.cubemap_capture import CubemapCapture, train_lights

            lights = [*train_lights(manifest["cubemap"]), *lights]
        if not (lights or "surfels" in manifest or "gather" in manifest):
            raise ManifestError(f"expected one or more lights in {path}, found none; bake or import again")
        texels = manifest["width"] * manifest["height"]
        for i, light in enumerate(lights):
            if light.kind != lights[0].kind and (light.kind != "point" or light.role == "train"):
                raise ManifestError(
                    f"expected lights of one kind in {path}, and point lights that measure them, found {lights[0].kind} and {light.kind} "
                    "lights; split them into two captures"
                )
            if isinstance(light.region, tuple) and max(light.region) >= texels:
                raise ManifestError(f"expected receivers below {texels} in the region of light {i} in {path}, found {max(light.region)}")
            for name in light.files:
                files.inside(folder, name, path)
        terms = (manifest["harmonics"]["order"] + 1) ** 2 if "harmonics" in manifest else 0
        for i, light in enumerate(lights):
            if len(light.harmonics) != terms:
                raise ManifestError(f"expected {terms} images of harmonics of light {i} in {path}, found {len(light.harmonics)}")
        named = [file for _, file in channels_of(manifest, str(path)).values()]
        for name in [*named, *(manifest[key] for key in ("scene", "seams") if key in manifest)]:
            files.inside(folder, name, path)
        if "cubemap" in manifest:
            files.inside(folder, manifest["cubemap"]["bounces"], path)
            return CubemapCapture(folder, manifest, tuple(lights))
        return Capture(folder, manifest, tuple(lights))

    @property
    def kind(self) -> LightKind:
        """The kind of its train lights, which are listed first; the lights that measure a fit may be point lights whatever it is. `surfel`
        where a transfer operator stands in for train lights, `pool` where a deep framebuffer does.
        """
        if "gather" in self.manifest:
            return "pool"
        if "surfels" in self.manifest:
            return "surfel"
        return self.lights[0].kind if self.lights else "directional"

    @property
    def is_cubemap(self) -> bool:
        """Whether its train lights are the texels of a cubemap, whose images are made on request."""
        return "cubemap" in self.manifest

    def require_directional(self, what: str) -> None:
        """InputError where the lights are not directional, which `what` needs."""
        if self.kind != "directional":
            raise InputError(f"expected a capture under directional lights for {what}, found {self.kind} lights in {self.folder}")

    @property
    def has_direct(self) -> bool:
        """Whether every light has a direct image, so that the combined response can be computed."""
        return self.has_direct_of(ROLES)

    def has_direct_of(self, roles: Sequence[Role]) -> bool:
        """Whether every light of the roles has a direct image."""
        return all(light.direct is not None for light in self.lights if light.role in roles)

    def combined(self, roles: Sequence[Role] = ROLES) -> Capture:
        """The same capture with the direct light added to every image; itself where it is combined.

        Parameters
        ----------
        roles
            Whose lights must have a direct image; images of others cannot be read.

        Returns
        -------
        Capture
            Of `transport` combined.

        Raises
        ------
        ManifestError
            Where an indirect capture lacks direct images.

        Examples
        --------
        >>> capture.combined() is capture
        True
        """
        if self.transport == "combined":
            return self
        if not self.has_direct_of(roles):
            raise ManifestError(f"expected a direct image of every light in {self.folder}, found lights without; bake it again")
        return CombinedCapture(self.folder, {**self.manifest, "transport": "combined"}, self.lights)

    def indices(self, role: Role) -> list[int]:
        """Indices of the lights of a role, in order.

        Parameters
        ----------
        role
            `train`: fitted. `validation`: random lights that choices look at. `holdout`: random lights that measure the error.

        Returns
        -------
        list
            Of integers, from 0 to the number of lights; empty where the capture has no such light.

        Examples
        --------
        >>> len(capture.indices("train")), capture.indices("validation"), capture.indices("holdout")[:2]
        (40, [], [40, 41])
        """
        return [i for i, light in enumerate(self.lights) if light.role == role]

    def directions(self, indices: Sequence[int] | None = None) -> Float64[ndarray, "L 3"]:
        """Unit directions from the surface to the lights.

        Parameters
        ----------
        indices
            Of lights; None: all.

        Returns
        -------
        ndarray
            (L, 3) float64, in Blender's world: z up.

        Raises
        ------
        InputError
            Where the lights are not directional.

        Examples
        --------
        >>> directions = capture.directions(capture.indices("train"))
        >>> directions.shape, bool((directions[:, 2] > 0).all())
        ((40, 3), True)
        """
        self.require_directional("directions")
        chosen = self.lights if indices is None else [self.lights[i] for i in indices]
        return np.array([light.direction for light in chosen], np.float64).reshape(-1, 3)

    def positions(self, indices: Sequence[int] | None = None) -> Float64[ndarray, "L 3"]:
        """Positions of point lights.

        Parameters
        ----------
        indices
            Of lights; None: all.

        Returns
        -------
        ndarray
            (L, 3) float64 in the world, m.

        Raises
        ------
        InputError
            Where the lights are directional.

        Examples
        --------
        >>> capture.positions()
        Traceback (most recent call last):
        srbf.errors.InputError: ...
        """
        chosen = self.lights if indices is None else [self.lights[i] for i in indices]
        return np.array([light.position for light in chosen], np.float64).reshape(-1, 3)

    @property
    def gloss(self) -> int | None:
        """Order of the spherical harmonics of the viewer's direction; None where radiance was captured toward one viewer alone."""
        return self.manifest["harmonics"]["order"] if "harmonics" in self.manifest else None

    def harmonics(self, index: int) -> Float32[ndarray, "K H W 3"]:
        """Coefficients of the radiance toward any viewer under one light, see `srbf.basis.exitant_harmonics`.

        Parameters
        ----------
        index
            Of the light, from 0.

        Returns
        -------
        ndarray
            (K, H, W, 3) float32, K = (order + 1)^2; (0, H, W, 3) where the capture has none.

        Raises
        ------
        ImageError
            As of `image`.
        """
        images = [self._read_rows(file, None).astype(np.float32) for file in self.lights[index].harmonics]
        return np.array(images, np.float32).reshape(-1, self.height, self.width, 3)

    def of_harmonics(self) -> Capture:
        """A capture whose lights are the harmonics of this one's, light by light, K of each: T of K L columns."""
        lights = (replace(light, file=file, direct=None, harmonics=()) for light in self.lights for file in light.harmonics)
        manifest = {key: value for key, value in self.manifest.items() if key != "harmonics"}
        return Capture(self.folder, manifest, tuple(lights))

    def image(self, index: int) -> Float32[ndarray, "H W 3"]:
        """The receivers' responses to one light: a column of T.

        Parameters
        ----------
        index
            Of the light, from 0.

        Returns
        -------
        ndarray
            (H, W, 3) float32, linear, row 0 at the top; of the capture's quantity, under a light of unit irradiance
            (a point light's at 1 m).

        Raises
        ------
        ImageError
            On another size, a damaged file or NaN.
        InputError
            Where the image covers a region only.

        Examples
        --------
        >>> capture.image(0).shape
        (6, 8, 3)
        """
        self.require_whole([index])
        return self._read(self.lights[index].file, 3)

    def partial_image(self, index: int) -> tuple[Float32[ndarray, "H W 3"], Bool[ndarray, "H W"]]:
        """The responses to one light, and the region that its image holds. Values outside the region are not looked at: they may be NaN.

        Parameters
        ----------
        index
            Of the light, from 0.

        Returns
        -------
        responses
            (H, W, 3) float32, 0 outside the region.
        region
            (H, W) bool; all receivers where the light names none.

        Raises
        ------
        ImageError
            As of `image`.

        Examples
        --------
        >>> responses, region = capture.partial_image(0)
        >>> responses.shape, bool(region.all())
        ((6, 8, 3), True)
        """
        light = self.lights[index]
        known = self.region(index)
        if known is None:
            return self.image(index), np.ones((self.height, self.width), bool)
        return self._partial(light.file, known), known

    def region(self, index: int) -> Bool[ndarray, "H W"] | None:
        """Which receivers the image of a light holds. A mask file holds those above 0.

        Parameters
        ----------
        index
            Of the light, from 0.

        Returns
        -------
        ndarray or None
            (H, W) bool; None where it holds all.

        Raises
        ------
        ImageError
            Where the mask is damaged, missing, or of another size.

        Examples
        --------
        >>> capture.region(0) is None
        True
        """
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
        """Blocks of T's columns; the next block is read ahead.

        Memory: three blocks of at most BLOCK_BYTES (or one image), however many lights there are.

        Parameters
        ----------
        indices
            Of lights.

        Yields
        ------
        tuple
            The position of the block's first light within `indices`, and the block: (b, P, 3) float32, finite, P = H W.

        Raises
        ------
        ImageError
            As of `image`.
        InputError
            Where an image covers a region only.

        Examples
        --------
        >>> [(first, block.shape) for first, block in capture.blocks(capture.indices("train"))]
        [(0, (40, 48, 3))]
        """
        size = max(1, BLOCK_BYTES // (self.width * self.height * 12))
        return self._blocks(indices, size, np.dtype(np.float32), 0)

    def stream(
        self, indices: Sequence[int], on_image: OnImage = lambda row, image: None, rows: Rows = None
    ) -> Iterator[tuple[int, Float[ndarray, "b P 3"]]]:
        """`blocks` as stored, for sums over many lights. A block is valid until the next iteration: its memory is used again.

        Memory: two blocks of STREAM_BYTES (or one image) and an image per core, however many lights there are.

        Parameters
        ----------
        indices
            Of lights.
        on_image
            Gets every image once, as (position within `indices`, (P, 3) as stored), straight from its file, in the thread that read it.
        rows
            Ranges (begin, end) of rows; the images have only those, in blocks of as many lights as without. None: all.

        Yields
        ------
        tuple
            The position of the block's first light within `indices`, and the block: (b, P, 3), finite; float16 where all of `indices` are
            half floats, else float32.

        Raises
        ------
        ImageError
            As of `image`.
        InputError
            Where an image covers a region only.

        Examples
        --------
        >>> total = np.zeros((48, 3))
        >>> for first, block in capture.stream(capture.indices("train")):
        ...     total += block.sum(axis=0)
        >>> [block.shape for _, block in capture.stream([0, 1], rows=[(0, 2)])]
        [(2, 16, 3)]
        """
        with ThreadPoolExecutor(cores()) as readers:
            half = all(readers.map(lambda index: holds_half(self.folder / self.lights[index].file), indices))
        stored = np.dtype(np.float16 if half else np.float32)
        size = max(1, STREAM_BYTES // (self.width * self.height * 3 * stored.itemsize))
        return self._blocks(indices, size, stored, 2, on_image, rows)

    def sample(self, indices: Sequence[int], texels: Int[ndarray, " n"]) -> Float32[ndarray, "n L 3"]:
        """Rows of T: the responses of some receivers to some lights.

        Only the strips of rows that hold such texels are decompressed.

        Parameters
        ----------
        indices
            Of lights.
        texels
            (n,) flat indices of receivers, row by row from the top.

        Returns
        -------
        ndarray
            (n, L, 3) float32.

        Raises
        ------
        ImageError
            As of `image`.
        InputError
            Where an image covers a region only.

        Examples
        --------
        >>> rows = capture.sample([0, 1, 2], np.array([5, 17]))
        >>> rows.shape, bool((rows[0, 1] == capture.image(1)[0, 5]).all())
        ((2, 3, 3), True)
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
        """The capture with its responses in memory: 12 bytes per receiver and light.

        Parameters
        ----------
        texels
            (n,) flat indices of receivers: they alone, as an image (1, n) with no channel but coverage. None: all receivers.

        Returns
        -------
        Capture
            Reads no image again.

        Raises
        ------
        InputError
            Where an image covers a region only.

        Examples
        --------
        >>> small = capture.load(np.array([5, 17]))
        >>> small.image(0).shape, len(small.lights)
        ((1, 2, 3), 48)
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
        """The same images with other roles.

        Parameters
        ----------
        roles
            One per light; lights of role None are left out.

        Returns
        -------
        Capture
            Of the lights that have a role, in order.

        Examples
        --------
        >>> half = capture.with_roles(["train" if i % 2 == 0 else "holdout" for i in range(48)])
        >>> len(half.indices("train")), len(half.indices("holdout"))
        (24, 24)
        """
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
