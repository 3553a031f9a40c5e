"""What a bake has rendered so far, on disk: a running sum per light, from which the capture's images are written."""

from __future__ import annotations

import shutil
import time
import zipfile
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32
from srbf.bake.planned_lights import PlannedLight
from srbf.errors import ImageError
from srbf.io import files

ACCUMULATION = "accumulation"
LATE = 30.0  # seconds that a shared folder may take to show what another machine wrote
POLL = 0.25


@dataclass(frozen=True)
class Sum:
    """The sum of a light's `samples` samples, rendered in `passes` passes; arrays (H, W, 3) float32, None where not kept.

    whole: sum over samples of all light. direct: of an indirect capture, its direct diffuse part. squares: sum over passes of the pass's
    samples times the square of the image that the pass alone gives; the noise of validation lights is estimated from it. harmonics:
    (H, W, 3 K), those of the radiance toward every viewer. noise: relative RMSE of the mean by its few samples, None of one pass.
    """

    passes: int
    samples: int
    whole: Float32[ndarray, "H W 3"] | None
    direct: Float32[ndarray, "H W 3"] | None = None
    squares: Float32[ndarray, "H W 3"] | None = None
    harmonics: Float32[ndarray, "H W M"] | None = None
    noise: float | None = None

    def with_pass(
        self, samples: int, whole: ndarray, direct: ndarray | None, squares: bool, harmonics: Float32[ndarray, "H W M"] | None = None
    ) -> Sum:
        """The sum with one more pass, of which `whole`, `direct` (H, W, 3) and `harmonics` are the means over `samples` samples."""
        own = whole if direct is None else whole - direct
        return Sum(
            self.passes + 1,
            self.samples + samples,
            _added(self.whole, whole * np.float32(samples)),
            None if direct is None else _added(self.direct, direct * np.float32(samples)),
            _added(self.squares, own**2 * np.float32(samples)) if squares else None,
            None if harmonics is None else _added(self.harmonics, harmonics * np.float32(samples)),
            self._noise_with(samples, own) if self.passes else None,
        )

    def _noise_with(self, samples: int, own: Float32[ndarray, "H W 3"]) -> float | None:
        """Noise of the mean with one more pass, of which `own` is the mean, by how far that is from the mean of those before.

        The difference of means of n and m samples has the variance s^2 (1/n + 1/m), the mean of all s^2 / (n + m). Small passes, whose
        samples spread less evenly, weigh little, unlike in `noise_variance`. None of a black image.
        """
        if self.whole is None:
            return None
        before, total = (self.whole if self.direct is None else self.whole - self.direct) / np.float32(self.samples), self.samples + samples
        variance = float(((own - before) ** 2).mean(dtype=np.float64)) * self.samples * samples / total**2
        mean = (self.samples * before + samples * own) / np.float32(total)
        power = float((mean**2).mean(dtype=np.float64)) - variance
        return float(np.sqrt(variance / max(power, variance))) if variance > 0 else None

    @property
    def mean(self) -> Float32[ndarray, "H W 3"]:
        assert self.whole is not None
        return self.whole / np.float32(self.samples)

    @property
    def direct_mean(self) -> Float32[ndarray, "H W 3"] | None:
        return None if self.direct is None else self.direct / np.float32(self.samples)

    @property
    def harmonics_mean(self) -> Float32[ndarray, "H W M"] | None:
        return None if self.harmonics is None else self.harmonics / np.float32(self.samples)

    def noise_variance(self) -> Float32[ndarray, "H W 3"]:
        """Unbiased variance of the mean, from the differences of the passes: (sum s x^2 - (sum s x)^2 / S) / ((passes - 1) S)."""
        assert self.whole is not None and self.squares is not None and self.passes > 1
        own = self.whole if self.direct is None else self.whole - self.direct
        spread = self.squares - own * own / np.float32(self.samples)
        return np.maximum(spread, 0) / np.float32((self.passes - 1) * self.samples)


NOTHING = Sum(0, 0, None)
PARTS = ("whole", "direct", "squares", "harmonics")  # of a sum, in order


class Accumulation:
    """The folder of running sums, one file per light, each written atomically; counts are read once.

    A light's file is written after its images. After a kill the images may therefore be one pass ahead; that pass is rendered again and
    gives bit-identical output.
    """

    def __init__(self, folder: Path, lights: Sequence[PlannedLight]) -> None:
        self._folder = folder / ACCUMULATION
        files.make_folder(self._folder)
        self._known = {light.index: self._read_counts(light.index) for light in lights}

    def passes(self, light: PlannedLight) -> int:
        return self._known[light.index][0]

    def samples(self, light: PlannedLight) -> int:
        return self._known[light.index][1]

    def checksum(self, light: PlannedLight) -> str:
        """Checksum of the light's images when they were written."""
        return self._known[light.index][3]

    def noise(self, light: PlannedLight) -> float | None:
        """Of the light's image, see `Sum`."""
        return self._known[light.index][4]

    def can_grow(self, light: PlannedLight) -> bool:
        """Whether another pass can be added: there is none yet, or the sum is kept."""
        return self._known[light.index][2] or self.passes(light) == 0

    def read(self, light: PlannedLight) -> Sum:
        """The sum of `light`; an empty one where its file is missing or damaged."""
        with suppress(OSError, ValueError, KeyError, zipfile.BadZipFile), np.load(self._path(light.index)) as stored:
            passes, samples = (int(n) for n in stored["counts"])
            whole, direct, squares, harmonics = (stored.get(name) for name in PARTS)
            return Sum(passes, samples, whole, direct, squares, harmonics, _noise_in(stored))
        return NOTHING

    def write(self, light: PlannedLight, total: Sum, keep: bool, checksum: str = "") -> None:
        """Write `total`, whose images have this `checksum`; without `keep` only its counts."""
        arrays = {name: getattr(total, name) for name in PARTS} if keep else {}
        with files.atomic_path(self._path(light.index)) as temporary:
            counts = np.array([total.passes, total.samples])
            arrays["noise"] = None if total.noise is None else np.array(total.noise)
            np.savez(temporary, counts=counts, checksum=np.array(checksum), **{k: v for k, v in arrays.items() if v is not None})
        self._known[light.index] = (total.passes, total.samples, keep, checksum, total.noise)

    def forget(self, light: PlannedLight) -> None:
        """Drop the sum of `light`, so that it is rendered from the start."""
        self._path(light.index).unlink(missing_ok=True)
        self._known[light.index] = (0, 0, False, "", None)

    def refresh(self, light: PlannedLight, passes: int = 0, patience: float = 0.0) -> bool:
        """Read the counts of `light` again, which another process may have written; True where it has at least `passes` passes.

        A shared folder may show late what another machine wrote: waits up to `patience` seconds.
        """
        deadline = time.monotonic() + patience
        while True:
            self._known[light.index] = self._read_counts(light.index)
            if self.passes(light) >= passes or time.monotonic() >= deadline:
                return self.passes(light) >= passes
            time.sleep(POLL)

    def _path(self, index: int) -> Path:
        return self._folder / f"{index:04d}.npz"

    def _read_counts(self, index: int) -> tuple[int, int, bool, str, float | None]:
        """(passes, samples, whether the sum is kept, checksum of the images, noise); zeros where the file is missing or damaged."""
        path = self._path(index)
        with suppress(OSError, ValueError, KeyError, zipfile.BadZipFile), zipfile.ZipFile(path) as archive:
            if archive.testzip() is None:
                with np.load(path) as stored:
                    passes, samples = (int(n) for n in stored["counts"])
                    return passes, samples, "whole" in stored, str(stored["checksum"]), _noise_in(stored)
        return 0, 0, False, "", None


def save_array(path: Path, array: ndarray) -> None:
    """Write an array for the bake's own use, with a checksum."""
    with files.atomic_path(path) as temporary:
        np.savez(temporary, array=array)


def load_array(path: Path) -> ndarray:
    """Read an array of `save_array`; ImageError where it is damaged."""
    try:
        with np.load(path) as stored:
            return stored["array"]
    except (OSError, ValueError, KeyError, zipfile.BadZipFile) as error:
        raise ImageError(f"cannot read {path}: {error}") from error


def remove(folder: Path) -> None:
    """Delete a capture's accumulation folder: no samples can be added to it after that."""
    shutil.rmtree(folder / ACCUMULATION, ignore_errors=True)


def _noise_in(stored: Mapping[str, ndarray]) -> float | None:
    """None where an older bake wrote the file."""
    return float(stored["noise"]) if "noise" in stored else None


def _added(total: ndarray | None, part: ndarray) -> Float32[ndarray, "H W C"]:
    part = np.asarray(part, np.float32)
    return part if total is None else total + part
