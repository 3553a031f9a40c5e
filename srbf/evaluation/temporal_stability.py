"""How a relit picture moves while one light sweeps between the captured directions: pops, pulsing brightness, ghosts of shadow edges."""

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
from srbf.capture import BLOCK_BYTES, COVERED, MANIFEST, Capture
from srbf.errors import InputError
from srbf.io import files
from srbf.io.image import write_image
from srbf.light_domain import Directions, domain_of_capture
from srbf.methods import responses
from srbf.solve.least_squares import StreamedLeastSquares
from srbf.sphere import Domain

Reference = Callable[[np.ndarray], np.ndarray]  # (b, 3) unit directions -> (b, P, 3) true answers of the swept texels

FRAMES = 240
TEXELS = 4096  # a sweep looks at: its curves differ by a per cent or so from those of all texels
DIM = 0.25  # of the reference's greatest mean brightness: below it the relative error of brightness is not asked for
STEEP = 2.0  # times as fast as any unshadowed Lambert surface can change: a shadow edge passes
DENSE_SPREAD, DENSE_RIDGE = 0.9, 0.1  # of a dense reference: spread over the lights' spacing, ridge


@dataclass(frozen=True, eq=False)
class Motion:
    """What a sweep of C great circles by F frames showed of n texels, whose answers a are clamped at 0; steps join frames of a circle.

    change         |a_{s+1} - a_s| over texels and colors, of the relit picture and of the reference (C, F-1)
    brightness     mean of a over texels and colors, of both (C, F)
    ripple         relit less reference brightness, high-passed: less the best affine function of direction a circle, over the mean
                   reference brightness (C, F)
    ghost, edge    sums over texels and steps of |change of relit - change of reference| at shadow-edge texels while no edge passes, and
                   of |change of reference| while one does (C, F-1)

    The figures of a perfect relighter are 1, 1, 0, 0, 0, 1:

    change_ratio         rms relit change over rms reference change: above 1 it boils and pops, below 1 it drags
    largest_step         the largest relit change over the reference's own, or its rms where that is larger: a pop
    brightness_error     largest |relit / reference - 1| of brightness, where the reference has DIM of its greatest
    largest_ripple       largest |ripple|: pulsing
    ghosting             sum of ghost over sum of edge: how much of the shadow edges' contrast comes or goes at the wrong time; 0 where
                         no edge passed. Sums, not squares: a fade of a shadow over many frames is seen as well as a quick one
    edge_kept            relit change projected on the reference's while edges pass: how much of the edges' own change is shown when it
                         is due. Without shadows nothing ghosts, and nothing is kept; 1 where no edge passed

    A shadow edge passes a texel in the steps in which the reference changes STEEP times faster than the texel's peak times the angle
    moved, which bounds every unshadowed Lambert surface (|d cos| <= |d angle|): penumbrae narrower than about 1 / STEEP rad. One step
    on either side of them still counts as passing. The definitions of ripple and ghosting are ours.
    """

    directions: Float64[ndarray, "C F 3"]
    relit_change: Float64[ndarray, "C S"]
    reference_change: Float64[ndarray, "C S"]
    relit_brightness: Float64[ndarray, "C F"]
    reference_brightness: Float64[ndarray, "C F"]
    ripple: Float64[ndarray, "C F"]
    ghost: Float64[ndarray, "C S"]
    edge: Float64[ndarray, "C S"]
    change_ratio: float
    largest_step: float
    brightness_error: float
    largest_ripple: float
    ghosting: float
    edge_kept: float
    edge_texels: float  # fraction of the texels that a shadow edge passes

    def as_dict(self) -> dict[str, Any]:
        """JSON: curves as nested lists beside the figures."""
        return {key: value.tolist() if isinstance(value, ndarray) else value for key, value in asdict(self).items()}


def great_circles(domain: Domain, frames: int = FRAMES, circles: int | None = None) -> Float64[ndarray, "C F 3"]:
    """`frames` directions in all along great circles of even speed: `Directions.paths`."""
    return np.stack([path for _, path in Directions(domain).paths(frames, circles)])


def sampled_texels(covered: Bool[ndarray, "H W"], count: int = TEXELS, seed: int = 0) -> Int[ndarray, " n"]:
    """Row-major indices of at most `count` covered texels, random without repetition, ascending; InputError where none is covered."""
    indices = np.flatnonzero(covered)
    if not len(indices):
        raise InputError("expected covered texels to sweep a light over, found none")
    if len(indices) > count:
        indices = np.sort(np.random.default_rng(seed).choice(indices, count, replace=False))
    return indices


def dense_reference(capture: Capture, texels: Int[ndarray, " n"]) -> Reference:
    """The answers of `texels` by all N train images interpolated: as many Gaussians as lights, spread 0.9 sqrt(area / N), ridge 0.1.

    What a capture knows of directions between its own; where its shadows are narrower than the spacing of its lights it ghosts itself
    (srbf.evaluation.light_spacing tells), and a ratio to it says how much worse a smaller asset moves than the images themselves would.
    Centers stand on a Fibonacci set, on a hemisphere continued a little below its horizon: on the lights themselves a Hammersley set's
    gaps make a Lambert plane's brightness err by 5 % at this ridge, here by 1 %. Memory: about (N, n, 3) float32. InputError without
    train lights.
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

    `texels` are row-major indices; `reference` answers for them alone. All of the frames are relit whole, in blocks; what is kept of
    both is (C F, n, 3) float32.
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
    """The figures of `Motion` from answers along a sweep; both are clamped at 0 first."""
    relit, reference = np.maximum(relit, 0), np.maximum(reference, 0)
    relit_steps, reference_steps = np.diff(relit, axis=1), np.diff(reference, axis=1)  # (C, S, n, 3)
    relit_change, reference_change = _norm(relit_steps), _norm(reference_steps)
    brightness, true_brightness = relit.mean(axis=(2, 3), dtype=np.float64), reference.mean(axis=(2, 3), dtype=np.float64)
    mean, brightest = float(true_brightness.mean()), float(true_brightness.max())
    rms = float(np.sqrt((reference_change**2).mean()))
    if mean <= 0 or rms <= 0:
        raise InputError("expected a reference that shines and changes along the sweep, found one that does not; is the capture black?")
    ripple = _without_affine(directions, brightness - true_brightness) / mean
    bright = true_brightness >= DIM * brightest
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
        ripple=ripple,
        ghost=ghost,
        edge=edge,
        change_ratio=float(np.sqrt((relit_change**2).mean())) / rms,
        largest_step=float((relit_change / np.maximum(reference_change, rms)).max()),
        brightness_error=float(np.abs(brightness[bright] / true_brightness[bright] - 1).max()),
        largest_ripple=float(np.abs(ripple).max()),
        ghosting=float(ghost.sum() / edge.sum()) if edge_texels.any() else 0.0,
        edge_kept=float(np.einsum("csnk,csnk->", due, relit_steps, dtype=np.float64)) / power if power > 0 else 1.0,
        edge_texels=float(edge_texels.mean()),
    )


def lambert_sweep(encode: Callable[[Capture], Asset], directions: Float64[ndarray, "L 3"]) -> Motion:
    """What a method makes of an unshadowed Lambert plane facing up, T = max(0, z), captured under lights at unit `directions`.

    An asset does not say what it would make of another surface: its basis may come from its own images. So the method encodes a
    capture of the plane, a few texels under the very lights of the capture in question, and is held to the cosine itself.
    """
    with tempfile.TemporaryDirectory(prefix="srbf-") as name:
        capture = lambert_capture(Path(name) / "capture", directions)
        asset = encode(capture)
        texels = sampled_texels(capture.coverage() >= COVERED)
        return sweep(asset, lambda path: _cosines(path, len(texels)), texels)


def lambert_capture(folder: Path, directions: Float64[ndarray, "L 3"], side: int = 4) -> Capture:
    """Write the capture of an unshadowed Lambert plane facing up: every light a train light, images of side x side texels."""
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
    """The pictures of the sweep in order, for a clip: clamped, with ambient; a few are in memory at a time."""
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
    """`values` along each circle less their least-squares fit by 1, x, y, z: a gain, an offset or a tilt of the light is no pulse."""
    left = np.empty_like(values)
    for row, path, curve in zip(left, directions, values, strict=True):
        affine = np.column_stack([np.ones(len(path)), path])
        row[:] = curve - affine @ np.linalg.lstsq(affine, curve, rcond=None)[0]
    return left


def _passing(directions: np.ndarray, reference: Float[ndarray, "C F n 3"], steps: np.ndarray) -> Bool[ndarray, "C S n"]:
    """Where a shadow edge passes: the step is steeper than STEEP times the texel's peak times the angle moved; widened by a step."""
    chord = np.linalg.norm(np.diff(directions, axis=1), axis=-1)  # (C, S), the angle for small steps
    peak = reference.sum(axis=-1).max(axis=(0, 1))  # (n,)
    steep = np.abs(steps.sum(axis=-1)) > STEEP * peak * chord[:, :, None]
    passing = steep.copy()
    passing[:, 1:] |= steep[:, :-1]
    passing[:, :-1] |= steep[:, 1:]
    return passing
