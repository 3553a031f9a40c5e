"""A light that moves through a scene: its path through an opening, and how far the picture changes from frame to frame."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float32, Float64, Int
from srbf.asset import Asset
from srbf.capture import Capture
from srbf.encode.position_table import PositionTable
from srbf.errors import InputError
from srbf.light_domain import domain_of_asset
from srbf.methods import method_of, responses
from srbf.methods.component_maps import ComponentMaps
from srbf.visibility.cloud_lights import CloudLights, unseen_lights

FRAMES = 120
MOST_PLACES = 256  # free places among which a path is looked for
SHORTEST = 0.25  # of the diagonal of the free places' box: a shorter path is no travel
CLEARANCE = 0.1  # m: nothing stands so close to a path
TRIED = 96  # paths whose clearance is measured
LONG = 0.5  # of the diagonal: a path of this length counts in full
LENGTH_SHARE = 0.2  # of a path's score: length over the diagonal; the rest is what its ends do not both see

Visible = Callable[[ndarray, ndarray], ndarray]  # (n, 3), (n, 3) -> (n,) bool: nothing stands between two places


@dataclass(frozen=True, eq=False)
class MotionInside:
    """A light of unit irradiance at 1 m in F frames along a straight path, over n texels with responses a; a step joins two frames.

    places               of the frames, m
    relit_change         |a_{s+1} - a_s| over texels and colors of the asset, its weights by rays
    table_change         the same, its weights from the table of positions
    reference_change     the same of all captured images without compression
    *_brightness         mean of a over texels and colors
    largest_step         the largest of `relit_change` over the largest of `reference_change`: above 1 popping
    table_step           the same of `table_change`
    error, table_error   relative rmse against the reference, pooled over frames
    apart                share of the free places seen from an end of the path that the other end does not see: 0 in a convex room
    """

    places: Float64[ndarray, "F 3"]
    relit_change: Float64[ndarray, " S"]
    table_change: Float64[ndarray, " S"]
    reference_change: Float64[ndarray, " S"]
    relit_brightness: Float64[ndarray, " F"]
    table_brightness: Float64[ndarray, " F"]
    reference_brightness: Float64[ndarray, " F"]
    largest_step: float
    table_step: float
    error: float
    table_error: float
    apart: float

    @property
    def length(self) -> float:
        """Of the path, m."""
        return float(np.linalg.norm(self.places[-1] - self.places[0]))

    def as_dict(self) -> dict[str, Any]:
        """The measures as JSON values; curves are lists."""
        return {name: value.tolist() if isinstance(value, ndarray) else value for name, value in vars(self).items()}


def path_through_opening(places: Float64[ndarray, "n 3"], visible: Visible, frames: int = FRAMES) -> tuple[Float64[ndarray, "F 3"], float]:
    """(places of the frames, how far apart its ends are in what they see), on the way between two free places through an opening.

    Of two places that see each other, the free places that one alone sees are few in a convex room and many on two sides of a door. The
    path with most of them is taken, longer ones first among equals, whose surroundings of CLEARANCE are free too if there is one.
    InputError where no two places see each other.
    """
    if len(places) > MOST_PLACES:
        places = places[np.linspace(0, len(places) - 1, MOST_PLACES).astype(np.int64)]
    i, j = np.triu_indices(len(places), 1)
    seen = visible(places[i], places[j])
    i, j = i[seen], j[seen]
    if not len(i):
        raise InputError("expected two free places that see each other, found none")
    sees = np.eye(len(places), dtype=bool)
    sees[i, j] = sees[j, i] = True
    counts = sees.astype(np.int64)
    common = (counts @ counts)[i, j]
    either = counts.sum(axis=1)[i] + counts.sum(axis=1)[j] - common
    apart = 1 - common / np.maximum(either, 1)
    length = np.linalg.norm(places[j] - places[i], axis=1)
    diagonal = max(float(np.linalg.norm(np.ptp(places, axis=0))), 1e-9)
    share = length / diagonal
    score = apart * np.minimum(1, share / LONG) + LENGTH_SHARE * share - (share < SHORTEST)
    best = np.argsort(-score, kind="stable")[:TRIED]
    clear = _clear(places[i[best]], places[j[best]], visible)
    chosen = best[int(np.argmax(clear))]  # the first, where none is clear
    t = np.linspace(0, 1, frames)[:, None]
    return places[i[chosen]] * (1 - t) + places[j[chosen]] * t, float(apart[chosen])


def _clear(start: Float64[ndarray, "n 3"], end: Float64[ndarray, "n 3"], visible: Visible) -> Bool[ndarray, " n"]:
    """Whether four lines beside each path are free, and the ways to their ends."""
    along = (end - start) / np.maximum(np.linalg.norm(end - start, axis=1), 1e-12)[:, None]
    helper = np.eye(3)[np.abs(along).argmin(axis=1)]
    across = np.cross(along, helper)
    across /= np.maximum(np.linalg.norm(across, axis=1), 1e-12)[:, None]
    clear = np.ones(len(start), bool)
    for side in (across, np.cross(along, across)):
        for sign in (CLEARANCE, -CLEARANCE):
            a, b = start + sign * side, end + sign * side
            clear &= visible(start, a) & visible(a, b) & visible(end, b)
    return clear


def move_inside(asset: Asset, capture: Capture, texels: Int[ndarray, " n"], frames: int = FRAMES) -> MotionInside:
    """Move a light through an opening of the scene and compare the asset with all captured images, interpolated without compression.

    `asset` is whole or of `texels` alone; these are flat indices of the capture. The reference of a capture of patches is their weighted
    sum, that of one of point lights the ridge regression on their fingerprints. Memory: the responses of `texels` to all train lights,
    and three times (F, n, 3) float32.
    InputError on a capture of other lights, without free places or without its scene; MissingLibraryError without embreex.
    """
    if domain_of_asset(asset.manifest).kind != "cloud" or capture.kind not in ("point", "patch"):
        raise InputError(
            f"expected a capture of patches or of point lights, whose images tell what moving lights show, found {capture.kind} lights in "
            f"{capture.folder}"
        )
    inside = CloudLights.of(capture)
    places, apart = path_through_opening(inside.free, inside.visible, frames)
    picked = asset if asset.width * asset.height == len(texels) else asset.at(texels)
    relit = responses(picked, places).reshape(frames, -1, 3)
    table = _by_table(picked, places).reshape(frames, -1, 3)
    reference = _reference(capture, inside, texels, places)
    changes = [_changes(images) for images in (relit, table, reference)]
    largest = [float(change.max()) for change in changes]
    if largest[2] <= 0:
        raise InputError(f"expected images that change with the place of a light in {capture.folder}, found constant or black ones")
    power = max(float((reference.astype(np.float64) ** 2).sum()), 1e-30)
    errors = [float(np.sqrt(((images - reference).astype(np.float64) ** 2).sum() / power)) for images in (relit, table)]
    brightness = [images.mean(axis=(1, 2), dtype=np.float64) for images in (relit, table, reference)]
    return MotionInside(
        places,
        *(changes[0], changes[1], changes[2]),
        *(brightness[0], brightness[1], brightness[2]),
        largest_step=largest[0] / largest[2],
        table_step=largest[1] / largest[2],
        error=errors[0],
        table_error=errors[1],
        apart=apart,
    )


def _by_table(asset: Asset, places: Float64[ndarray, "F 3"]) -> Float32[ndarray, "F H W 3"]:
    """As of an engine without rays: weights from the table of positions."""
    if not issubclass(method_of(asset), ComponentMaps):
        raise InputError(f"expected components with a table of positions, found an asset of {asset.method}")
    table = PositionTable.of(asset.manifest, asset.tables)
    own = domain_of_asset(asset.manifest).moved(places, asset.asset_from_world)
    return ComponentMaps.weighted(asset, np.stack([table.evaluate(place) for place in own]))


def _reference(
    capture: Capture, inside: CloudLights, texels: Int[ndarray, " n"], places: Float64[ndarray, "F 3"]
) -> Float32[ndarray, "F n 3"]:
    train = capture.indices("train")
    values = capture.sample(train, texels)  # (n, L, 3)
    received = inside.received(places)  # (F, K)
    if capture.kind == "point":
        weights = unseen_lights(capture, inside).prints.weights(received)
    else:
        weights = received[:, [int(capture.lights[i].patch or 0) for i in train]]
    return np.einsum("fl,nlc->fnc", weights.astype(np.float32), values, optimize=True)


def _changes(images: Float32[ndarray, "F n 3"]) -> Float64[ndarray, " S"]:
    steps = np.diff(images, axis=0)
    return np.sqrt(np.einsum("snk,snk->s", steps, steps, dtype=np.float64))
