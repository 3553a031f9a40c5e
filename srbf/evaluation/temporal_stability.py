"""Temporal stability under one light that sweeps between the captured directions: popping, flicker, ghosting of shadow edges."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float, Float32, Float64, Int
from srbf.asset import Asset
from srbf.basis.gaussian import GaussianBasis
from srbf.capture import COVERED, Capture
from srbf.errors import InputError
from srbf.io import files
from srbf.io.image import write_image
from srbf.light_domain import Directions, domain_of_capture
from srbf.light_images import BLOCK_BYTES
from srbf.methods import responses
from srbf.receiver_images import MANIFEST
from srbf.solve.least_squares import StreamedLeastSquares
from srbf.sphere import Domain

Reference = Callable[[np.ndarray], np.ndarray]  # (b, 3) unit directions -> (b, P, 3) true responses of the swept texels

FRAMES = 240
TEXELS = 4096  # in a sweep; its curves differ by about 1 % from those of all texels
BRIGHT_SHARE = 0.25  # of the reference's largest mean brightness; dimmer frames are left out of the relative brightness error
EDGE_RATE = 2.0  # of the fastest change of an unshadowed Lambert surface; a faster change is a passing shadow edge
DENSE_SPREAD, DENSE_RIDGE = 0.9, 0.1  # of a dense reference: spread over light spacing, ridge


@dataclass(frozen=True, eq=False)
class Motion:
    """Measures of a sweep of C great circles by F frames over n texels with responses a, clamped at 0; a step joins two frames.

    change         |a_{s+1} - a_s| over texels and colors, of the relit image and of the reference (C, F-1)
    brightness     mean of a over texels and colors, of both (C, F)
    flicker        relit minus reference brightness, high-passed: minus its best affine function of direction per circle, over the
                   mean reference brightness (C, F)
    ghost, edge    sums over texels and steps of |change of relit - change of reference| at shadow-edge texels while no edge passes, and
                   of |change of reference| while one passes (C, F-1)

    Ideal values, in the order below: 1, 1, 0, 0, 0, 1.

    change_ratio         rms relit change over rms reference change: above 1 flicker and popping, below 1 lag
    largest_step         the largest relit change over the reference's, or over its rms where that is larger: popping
    brightness_error     largest |relit / reference - 1| of brightness, in frames with BRIGHT_SHARE of the reference's maximum
    largest_flicker      largest |flicker|
    ghosting             sum of ghost over sum of edge: the share of the shadow edges' contrast that changes at the wrong time; 0 if no
                         edge passed. Sums instead of squares weight slow fades of a shadow like quick ones
    edge_kept            relit change projected on the reference's while edges pass: the share of the edges' change at the right time;
                         1 if no edge passed

    A shadow edge passes a texel in the steps in which the reference changes EDGE_RATE times faster than the texel's peak times the
    angle moved, which bounds every unshadowed Lambert surface (|d cos| <= |d angle|): penumbrae narrower than about 1 / EDGE_RATE rad.
    One step on either side also counts as passing. The definitions of flicker and ghosting are ours.
    """

    directions: Float64[ndarray, "C F 3"]
    relit_change: Float64[ndarray, "C S"]
    reference_change: Float64[ndarray, "C S"]
    relit_brightness: Float64[ndarray, "C F"]
    reference_brightness: Float64[ndarray, "C F"]
    flicker: Float64[ndarray, "C F"]
    ghost: Float64[ndarray, "C S"]
    edge: Float64[ndarray, "C S"]
    change_ratio: float
    largest_step: float
    brightness_error: float
    largest_flicker: float
    ghosting: float
    edge_kept: float
    edge_texels: float  # share of the texels that a shadow edge passes

    def as_dict(self) -> dict[str, Any]:
        """The measures as JSON values; curves are nested lists."""
        return {key: value.tolist() if isinstance(value, ndarray) else value for key, value in asdict(self).items()}


def great_circles(domain: Domain, frames: int = FRAMES, circles: int | None = None) -> Float64[ndarray, "C F 3"]:
    """`frames` directions in total along great circles, at even speed: `Directions.paths`."""
    return np.stack([path for _, path in Directions(domain).paths(frames, circles)])


def sampled_texels(covered: Bool[ndarray, "H W"], count: int = TEXELS, seed: int = 0) -> Int[ndarray, " n"]:
    """Row-major indices of at most `count` covered texels, random without repetition, ascending; InputError if none is covered."""
    indices = np.flatnonzero(covered)
    if not len(indices):
        raise InputError("expected covered texels, found none")
    if len(indices) > count:
        indices = np.sort(np.random.default_rng(seed).choice(indices, count, replace=False))
    return indices


def dense_reference(capture: Capture, texels: Int[ndarray, " n"]) -> Reference:
    """Responses of `texels` interpolated from all N train images: as many Gaussians as lights, spread 0.9 sqrt(area / N), ridge 0.1.

    This is the best reference between the captured directions. Where shadows are narrower than the light spacing
    (srbf.evaluation.light_spacing measures that), it shows ghosting itself, and a ratio to it compares an asset with the images.
    Centers are a Fibonacci set, on a hemisphere extended slightly below the horizon. With centers at the lights, the gaps of a
    Hammersley set give a Lambert plane a brightness error of 5 % at this ridge; here it is 1 %. Memory: about (N, n, 3) float32.
    InputError without train lights.
    """
    train = capture.indices("train")
    if not train:
        raise InputError(f"expected train lights in {capture.folder}, found none")
    domain = domain_of_capture(capture)
    coordinates = domain.captured(capture, train)
    spacing = float(np.sqrt((2 if domain.manifest()["domain"] == "hemisphere" else 4) * np.pi / len(train)))
    basis = GaussianBasis(domain.dense_centers(coordinates), DENSE_SPREAD * spacing)
    solve = StreamedLeastSquares(basis.evaluate(coordinates), DENSE_RIDGE)
    for first, block in capture.blocks(train):
        solve.add(first, np.ascontiguousarray(block[:, texels]).reshape(len(block), -1))
    coefficients = solve.solve()  # (K, 3 n)
    return lambda chosen: (basis.evaluate(chosen).astype(np.float32) @ coefficients).reshape(len(chosen), -1, 3)


def sweep(asset: Asset, reference: Reference, texels: Int[ndarray, " n"], directions: Float64[ndarray, "C F 3"] | None = None) -> Motion:
    """Move a white light along `directions` (great circles over the asset's domain by default) and compare with `reference`.

    `texels` are row-major indices; `reference` returns these texels only. All frames are relit completely, in blocks.
    Memory: twice (C F, n, 3) float32.
    """
    path = great_circles(asset.domain) if directions is None else directions
    flat = path.reshape(-1, 3)
    relit = np.empty((len(flat), len(texels), 3), np.float32)
    truth = np.empty_like(relit)
    for start, images in _responses(asset, flat):
        block = slice(start, start + len(images))
        relit[block] = images.reshape(len(images), -1, 3)[:, texels]
        truth[block] = reference(flat[block])
    return compare(path, relit.reshape(*path.shape[:2], -1, 3), truth.reshape(*path.shape[:2], -1, 3))


def compare(directions: Float64[ndarray, "C F 3"], relit: Float32[ndarray, "C F n 3"], reference: Float32[ndarray, "C F n 3"]) -> Motion:
    """The measures of `Motion` from responses along a sweep; both are clamped at 0 first."""
    relit, reference = np.maximum(relit, 0), np.maximum(reference, 0)
    relit_steps, reference_steps = np.diff(relit, axis=1), np.diff(reference, axis=1)  # (C, S, n, 3)
    relit_change, reference_change = _norm(relit_steps), _norm(reference_steps)
    brightness, true_brightness = relit.mean(axis=(2, 3), dtype=np.float64), reference.mean(axis=(2, 3), dtype=np.float64)
    mean, brightest = float(true_brightness.mean()), float(true_brightness.max())
    rms = float(np.sqrt((reference_change**2).mean()))
    if mean <= 0 or rms <= 0:
        raise InputError("expected a reference that changes along the sweep, found a constant or black one; check the capture")
    flicker = _without_affine(directions, brightness - true_brightness) / mean
    bright = true_brightness >= BRIGHT_SHARE * brightest
    passing = _passing(directions, reference, reference_steps)  # (C, S, n)
    edge_texels = passing.any(axis=(0, 1))  # (n,)
    wrong = np.abs(relit_steps - reference_steps).sum(axis=-1)
    right = np.abs(reference_steps).sum(axis=-1)
    ghost = np.where(~passing & edge_texels, wrong, 0).sum(axis=-1, dtype=np.float64)
    edge = np.where(passing, right, 0).sum(axis=-1, dtype=np.float64)
    due = np.where(passing[..., None], reference_steps, 0)
    power = float(np.einsum("csnk,csnk->", due, due, dtype=np.float64))
    return Motion(
        directions=directions,
        relit_change=relit_change,
        reference_change=reference_change,
        relit_brightness=brightness,
        reference_brightness=true_brightness,
        flicker=flicker,
        ghost=ghost,
        edge=edge,
        change_ratio=float(np.sqrt((relit_change**2).mean())) / rms,
        largest_step=float((relit_change / np.maximum(reference_change, rms)).max()),
        brightness_error=float(np.abs(brightness[bright] / true_brightness[bright] - 1).max()),
        largest_flicker=float(np.abs(flicker).max()),
        ghosting=float(ghost.sum() / edge.sum()) if edge_texels.any() else 0.0,
        edge_kept=float(np.einsum("csnk,csnk->", due, relit_steps, dtype=np.float64)) / power if power > 0 else 1.0,
        edge_texels=float(edge_texels.mean()),
    )


def lambert_sweep(encode: Callable[[Capture], Asset], directions: Float64[ndarray, "L 3"]) -> Motion:
    """The sweep of a method on an unshadowed Lambert plane facing up, T = max(0, z), captured under lights at unit `directions`.

    An asset's basis may depend on its images, so it cannot be tested on another surface. The method therefore encodes a capture of the
    plane, a few texels under the same lights, and is compared with the exact cosine.
    """
    with tempfile.TemporaryDirectory(prefix="srbf-") as name:
        capture = lambert_capture(Path(name) / "capture", directions)
        asset = encode(capture)
        texels = sampled_texels(capture.coverage() >= COVERED)
        return sweep(asset, lambda path: _cosines(path, len(texels)), texels)


def lambert_capture(folder: Path, directions: Float64[ndarray, "L 3"], side: int = 4) -> Capture:
    """Write the capture of an unshadowed Lambert plane facing up: all lights are train lights, the images have side x side texels."""
    files.make_folder(folder / "lights")
    lights = []
    for i, direction in enumerate(directions):
        file = f"lights/{i:04d}.exr"
        write_image(folder / file, _cosines(direction[None], side * side).reshape(side, side, 3), "float")
        lights.append({"kind": "directional", "direction": direction.tolist(), "role": "train", "file": file})
    manifest = {"format": "srbf-capture", "version": 1, "quantity": "irradiance", "width": side, "height": side, "lights": lights}
    files.write_json(folder / MANIFEST, manifest)
    return Capture.open(folder)


def frames(asset: Asset, directions: Float64[ndarray, "C F 3"] | None = None) -> Iterator[Float32[ndarray, "H W 3"]]:
    """The images of the sweep in order, for a clip: clamped, with ambient; in blocks."""
    path = great_circles(asset.domain) if directions is None else directions
    ambient = asset.images.get("ambient")
    for _, images in _responses(asset, path.reshape(-1, 3)):
        for image in np.maximum(images, 0):
            yield image if ambient is None else image + ambient


def _responses(asset: Asset, directions: np.ndarray) -> Iterator[tuple[int, np.ndarray]]:
    at_a_time = max(1, BLOCK_BYTES // (asset.width * asset.height * 12))
    for start in range(0, len(directions), at_a_time):
        yield start, responses(asset, directions[start : start + at_a_time])


def _cosines(directions: np.ndarray, texels: int) -> Float32[ndarray, "b n 3"]:
    return np.broadcast_to(np.maximum(directions[:, 2], 0)[:, None, None], (len(directions), texels, 3)).astype(np.float32)


def _norm(steps: np.ndarray) -> Float64[ndarray, "C S"]:
    return np.sqrt(np.einsum("csnk,csnk->cs", steps, steps, dtype=np.float64))


def _without_affine(directions: np.ndarray, values: np.ndarray) -> Float64[ndarray, "C F"]:
    """`values` along each circle minus their least-squares fit by 1, x, y, z: removes a gain, an offset or a tilt of the light."""
    left = np.empty_like(values)
    for row, path, curve in zip(left, directions, values, strict=True):
        affine = np.column_stack([np.ones(len(path)), path])
        row[:] = curve - affine @ np.linalg.lstsq(affine, curve, rcond=None)[0]
    return left


def _passing(directions: np.ndarray, reference: Float[ndarray, "C F n 3"], steps: np.ndarray) -> Bool[ndarray, "C S n"]:
    """Mask of passing shadow edges: the step exceeds EDGE_RATE times the texel's peak times the angle moved; dilated by one step."""
    chord = np.linalg.norm(np.diff(directions, axis=1), axis=-1)  # (C, S), the angle for small steps
    peak = reference.sum(axis=-1).max(axis=(0, 1))  # (n,)
    steep = np.abs(steps.sum(axis=-1)) > EDGE_RATE * peak * chord[:, :, None]
    passing = steep.copy()
    passing[:, 1:] |= steep[:, :-1]
    passing[:, :-1] |= steep[:, 1:]
    return passing
