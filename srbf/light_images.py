"""The images of a capture's lights, read on request: whole, in blocks of lights, or some receivers of all."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float, Float32, Int
from srbf.captured_light import CapturedLight
from srbf.compute.threads import cores, each
from srbf.errors import ImageError, InputError
from srbf.io.image import holds_half, read_image, require_finite
from srbf.io.image_blocks import blocks
from srbf.receiver_images import ReceiverImages, Rows
from srbf.receiver_share import Share
from srbf.texel_interpolation import interpolation

BLOCK_BYTES = 64 << 20  # float32 images of one block: small beside the maps, large enough for a matrix product
STREAM_BYTES = 192 << 20  # images of one block of the stream, as stored: sums over lights are read and written once a block
STRIP = 16  # rows: what the EXRs compress at a time
OnImage = Callable[[int, ndarray], None]  # (position within the lights requested, image (P, 3) as stored)


class Interpolations:
    """Maps from shares of a capture's texels to all of them, made on first use and kept for captures that are made of it."""

    def __init__(self) -> None:
        self._made: dict[Share, Any] = {}
        self._lock = threading.Lock()

    def of(self, images: LightImages, share: Share) -> Any:
        """(P, K) sparse, see `interpolation`."""
        with self._lock:
            if share not in self._made:
                known = np.zeros((images.height, images.width), bool)
                known[share.indices] = True
                self._made[share] = interpolation(known, images.coverage(), images.channel("position"), images.channel("normal"))
            return self._made[share]

    def __reduce__(self) -> tuple[type[Interpolations], tuple[()]]:
        return Interpolations, ()


@dataclass(frozen=True)
class LightImages(ReceiverImages):
    """What a capture holds of each light: the columns of T.

    `lights`: direction or position, role and file of each. Where a light has a `share` of the texels, the others are interpolated
    whenever its image is read.
    """

    lights: tuple[CapturedLight, ...]
    operators: Interpolations = field(default_factory=Interpolations, kw_only=True, compare=False, repr=False)

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
        light = self.lights[index]
        if light.share is None:
            return self._read(light.file, 3)
        return self._rows_of(index, light.file, None).astype(np.float32, copy=False).reshape(self.height, self.width, 3)

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
        stored = self._stored_type(indices)
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

    def _stored_type(self, indices: Sequence[int]) -> np.dtype:
        """Of `_stored` of these lights: float16 where all are, and whole."""
        if any(self.lights[index].share is not None for index in indices):
            return np.dtype(np.float32)
        with ThreadPoolExecutor(cores()) as readers:
            half = all(readers.map(lambda index: holds_half(self.folder / self.lights[index].file), indices))
        return np.dtype(np.float16 if half else np.float32)

    def _stored(self, index: int, rows: Rows = None) -> Float[ndarray, "n 3"]:
        """An image of T as stored, float16 or float32, of the right size and finite; all texels, or those of some rows."""
        return self._rows_of(index, self.lights[index].file, rows)

    def _rows_of(self, index: int, file: str, rows: Rows) -> Float[ndarray, "n 3"]:
        """The image `file` of a light, as stored where it is whole."""
        share = self.lights[index].share
        if share is None:
            return self._read_rows(file, rows)
        image, operator = self._shared(share, file), self.operators.of(self, share)
        if rows is None:
            return operator @ image
        return np.concatenate([operator[begin * self.width : end * self.width] @ image for begin, end in rows])

    def _shared(self, share: Share, file: str) -> Float32[ndarray, "K 3"]:
        """The texels that the image of a share has."""
        path = self.folder / file
        image = read_image(path, 3)
        width, height = share.size(self.width, self.height)
        if image.shape[:2] != (height, width):
            raise ImageError(f"expected {width}x{height} texels of a share in {path}, found {image.shape[1]}x{image.shape[0]}")
        require_finite(image, path)
        return image.reshape(-1, 3)
