"""Whether a capture's train images are filtered before a fit: where that lowers the error at the validation lights, by more than chance."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float64, Int
from srbf.capture import COVERED, Capture
from srbf.encode.denoised_capture import Surface, denoised
from srbf.encode.plane_filter import NEIGHBORS
from srbf.errors import InputError
from srbf.evaluation.errors_by_role import evaluate
from srbf.light_images import STRIP
from srbf.methods.protocol import Method

Denoise = Literal["auto", "on", "off"]

TRIED_TEXELS = 1 << 13  # at most, by which two fits are compared
FEW_TEXELS = 1 << 15  # a lightmap of no more is not cut into tiles
FEWEST_TEXELS = 1 << 10  # within tiles
TILE, MARGIN = 32, 4  # texels: how wide tiles are, and how many about them they are filtered with
TILES = 4  # a strip of rows
FEWEST_LIGHTS = 4  # validation lights whose gains tell how far they scatter
CERTAINTY = 2.0  # standard errors of the mean gain, which it must exceed
WORTH = 0.05  # dB, the least gain besides


def filtered(
    method: Method, capture: Capture, denoise: Denoise = "auto", say: Callable[[str], None] = lambda line: None, by_blocks: bool = False
) -> Capture:
    """The capture that a method is to fit: with less noise (see `srbf.encode.denoised_capture`) where `denoise` says so, else itself.

    `auto`: two fits to a sample of the texels are compared on the validation lights. The filter is kept if their pooled PSNR rises by
    WORTH, and their mean one by that and by CERTAINTY standard errors. Of a method that takes minutes, it is not. Lightmaps under
    directional lights and of patches have it. InputError on `on` for others, and with `by_blocks` of rows, fitted without their neighbors.
    """
    if denoise not in get_args(Denoise):
        raise InputError(f"expected `denoise` auto, on or off, found {denoise!r}")
    if denoise == "off":
        return capture
    lacking = _lacking(capture, by_blocks)
    if lacking is not None and denoise == "on":
        raise InputError(f"expected a lightmap under directional lights or of patches with `denoise=on`, found {lacking}; leave it out")
    if lacking is not None or (denoise == "auto" and not (method.quick and len(capture.indices("validation")) >= FEWEST_LIGHTS)):
        return capture
    if denoise == "on":
        clean = denoised(capture)
        if clean is None:
            raise InputError(f"expected texels with positions and normals for `denoise=on`, found none or hardly any in {capture.folder}")
        return clean
    part = _Part.of(capture)
    if part is None:
        return capture
    before, after = part.errors(method)
    gains = 20 * np.log10(np.maximum(before, 1e-30) / np.maximum(after, 1e-30))
    least = max(WORTH, CERTAINTY * float(gains.std(ddof=1)) / np.sqrt(len(gains)))
    pooled = 20 * float(np.log10(np.linalg.norm(before) / max(float(np.linalg.norm(after)), 1e-30)))
    kept = float(gains.mean()) > least and pooled > WORTH
    verb = "gain" if kept else "would change by"
    clean = denoised(capture) if kept else None
    say(f"{'denoised' if kept else 'not denoised'}: validation lights of a sample {verb} {gains.mean():.2f} dB, {pooled:.2f} dB pooled")
    return clean or capture


def _lacking(capture: Capture, by_blocks: bool) -> str | None:
    """What is there in place of a lightmap's images that neighbors may be averaged of."""
    receivers = [entry for entry in (capture.manifest.get("receiver"), *capture.manifest.get("receivers", [])) if entry is not None]
    kinds = {entry["kind"] for entry in receivers}
    if by_blocks:
        return "`dask`, which fits rows without their neighbors"
    if capture.is_cubemap:
        return "a capture by rays"
    if capture.kind not in ("directional", "patch"):
        return f"{capture.kind} lights"
    return None if kinds == {"lightmap"} else " and ".join(sorted(kinds)) or "images without a receiver"


@dataclass(frozen=True, eq=False)
class _Part:
    """Some texels of a capture in memory, without held-out lights, with their noise and without; `tried`: those that are compared."""

    noisy: Capture
    quiet: Capture
    tried: Int[ndarray, " n"]
    covered: int

    @staticmethod
    def of(capture: Capture) -> _Part | None:
        """None where they cannot be filtered."""
        surface = Surface.of(capture)
        if surface is None:
            return None
        covered = capture.coverage() >= COVERED
        texels, inside = _tiles(covered)
        if len(texels) <= NEIGHBORS:
            return None
        roles = [None if light.role == "holdout" else light.role for light in capture.lights]
        noisy = capture.with_roles(roles).load(texels)
        quiet = surface.denoised(noisy, np.arange(len(texels)), texels)
        if quiet is None:
            return None
        tried = np.flatnonzero(inside)
        if len(tried) > TRIED_TEXELS:
            tried = np.sort(np.random.default_rng(0).choice(tried, TRIED_TEXELS, replace=False))
        return _Part(noisy, quiet, tried, int(np.count_nonzero(covered)))

    def errors(self, method: Method) -> tuple[Float64[ndarray, " V"], Float64[ndarray, " V"]]:
        """RMSE under each validation light of a fit to the texels, with noise and without."""
        tried = method.on_sample(self.covered / len(self.tried))
        noisy, quiet = (one.load(self.tried) for one in (self.noisy, self.quiet))
        unseen = noisy.with_roles([light.role if light.role == "validation" else None for light in noisy.lights])  # no train light is read
        found = []
        for trial in (noisy, quiet):
            errors = evaluate(tried.encode(trial), unseen, roles=("validation",))
            found.append(np.array([light["rmse"] for light in errors["lights"]]))
        return found[0], found[1]


def _tiles(covered: Bool[ndarray, "H W"]) -> tuple[Int[ndarray, " n"], Bool[ndarray, " n"]]:
    """Covered texels of some tiles and about them, and whether each is inside one: all of a small lightmap.

    Tiles lie in strips of rows, so that other rows are not read.
    """
    texels = np.flatnonzero(covered)
    if len(texels) <= FEW_TEXELS:
        return texels, np.ones(len(texels), bool)
    random = np.random.default_rng(0)
    height, width = covered.shape
    inside, around = np.zeros_like(covered), np.zeros_like(covered)
    per_strip = np.add.reduceat(covered.sum(axis=1), np.arange(0, height, STRIP))
    for strip in random.permutation(np.flatnonzero(per_strip >= TILE)):
        top = int(strip) * STRIP
        rows = slice(top, min(top + STRIP, height))
        columns = np.flatnonzero(covered[rows].any(axis=0))
        for middle in random.choice(columns, min(TILES, len(columns)), replace=False):
            left = max(0, int(middle) - TILE // 2)
            inside[top + MARGIN : rows.stop - MARGIN, left : left + TILE] = True
            around[rows, max(0, left - MARGIN) : min(width, left + TILE + MARGIN)] = True
        if np.count_nonzero(inside & covered) >= TRIED_TEXELS:
            break
    if np.count_nonzero(inside & covered) < FEWEST_TEXELS:
        return texels, np.ones(len(texels), bool)
    texels = np.flatnonzero(around & covered)
    return texels, inside.ravel()[texels]
