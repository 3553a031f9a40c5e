"""Whether a capture's lights stand close enough for its shadows: a penumbra narrower than their spacing falls between two lights."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64, Int
from srbf.capture import COVERED, Capture
from srbf.errors import InputError
from srbf.sphere import mean_spacing

NEIGHBORS = 4  # of each light, the nearest
TEXELS = 4096
LIT = 0.5  # of the 90 % quantile of texels' peaks: dimmer texels see light at grazing angles alone, where it falls off steeply anyhow
BRIGHT = float(np.sqrt(0.5))  # of a texel's peak: the brighter answer of a pair that is looked at
HALF_CELL = 0.7  # of the lights' spacing: how far the light nearest to a texel's normal may stand from it
MARGIN = 0.15  # of the brighter answer, lost beyond what an unshadowed surface can lose: an edge lies between the two lights
JUMP = 0.75  # of what the texel's answer changes in the neighborhood, or of the answer itself: the whole edge lies between them
AROUND = 8  # nearest lights of either one of a pair, its neighborhood
MOST = 0.5  # of the edges jumped: too coarse
RESOLVED = 0.7  # of the spacing: a sun of this size has about half of its edges jumped
RARE = 1e-3  # of the pairs: fewer edges than these are no shadows to speak of


@dataclass(frozen=True)
class ShadowSampling:
    """How the shadows of a capture meet the spacing of its N train lights.

    `spacing` is the lights' mean distance (rad), `edges` the share of (texel, pair of neighboring lights) between which a shadow edge or
    an end of a highlight lies, `jumped` the share of those that the texel crosses at once, wholly between the two lights.
    """

    lights: int
    spacing: float
    edges: float
    jumped: float
    sun_angle: float | None = None  # rad, where the capture says it

    @property
    def too_coarse(self) -> bool:
        """Whether most shadow edges fall between two lights, so that any interpolation can but cross-fade them."""
        if self.edges < RARE:
            return False
        return self.jumped > MOST if self.sun_angle is None else self.sun_angle < RESOLVED * self.spacing

    def sentence(self) -> str:
        """The finding in one sentence, with its figures."""
        stand = f"{self.lights} lights stand {np.degrees(self.spacing):.1f} degrees apart"
        if self.edges < RARE:
            return f"{stand}, and the capture has hardly a shadow edge between neighboring ones."
        sun = "" if self.sun_angle is None else f"the sun is {np.degrees(self.sun_angle):.1f} degrees wide and "
        crossed = f"{sun}{self.jumped:.0%} of the shadow edges between neighbors are crossed at once"
        if self.too_coarse:
            return f"{stand}, {crossed}: too coarse for these shadows; bake more lights, or a softer sun (--sun-angle auto)."
        return f"{stand}, {crossed}: close enough for these shadows."


def shadow_sampling(capture: Capture, texels: Int[ndarray, " n"] | None = None) -> ShadowSampling:
    """Look at every pair of neighboring train lights for texels that lose their light between the two.

    For a pair an angle t apart whose brighter answer is at least cos a of the texel's peak, an unshadowed Lambert surface loses at most
    1 - cos t + tan a sin t of it (a is 45 degrees, and more where few lights may all miss the peak); an edge lies between where MARGIN
    more is lost. It is jumped where JUMP of the answer is lost, or of all the change around the pair. Full shadows of a hard sun are
    jumped at any N, those of a sun as large as the spacing in a third to a half of the edges; shadows of many depths, as of tinted
    glass, are jumped more rarely, so that for them the share is a lower bound. The measure is ours.

    Pairs further apart than about 30 degrees cannot tell and are left out: forty lights on the sphere show no edges at all.

    A texel's penumbra in the space of directions is as wide as the sun, whatever the occluder's distance: where the capture says its
    sun's size, that decides and the share illustrates.

    `texels` are row-major indices, by default at most TEXELS covered ones. Memory: (N, n) float32. InputError without train lights
    or covered texels.
    """
    train = capture.indices("train")
    if len(train) < 2:
        raise InputError(f"expected at least 2 train lights in {capture.folder}, found {len(train)}")
    if texels is None:
        covered = np.flatnonzero(capture.coverage() >= COVERED)
        if not len(covered):
            raise InputError(f"expected covered texels in {capture.folder}, found none")
        texels = covered[np.linspace(0, len(covered) - 1, min(TEXELS, len(covered))).astype(int)]
    directions = capture.directions(train)
    responses = np.empty((len(train), len(texels)), np.float32)
    for first, block in capture.blocks(train):
        responses[first : first + len(block)] = np.maximum(block[:, texels], 0).sum(axis=-1)
    edges, jumped, looked = count_edges(directions, responses)
    sun_angle = capture.manifest.get("source", {}).get("settings", {}).get("sun_angle")
    return ShadowSampling(len(train), mean_spacing(directions), edges / max(looked, 1), jumped / max(edges, 1), sun_angle)


def count_edges(directions: Float64[ndarray, "L 3"], responses: Float32[ndarray, "L n"]) -> tuple[int, int, int]:
    """(edges, jumped ones, all that were looked at) over texels and pairs of each light with its NEIGHBORS nearest."""
    cosines = directions @ directions.T
    np.fill_diagonal(cosines, -np.inf)
    nearest = np.argsort(-cosines, axis=1)[:, : min(AROUND, len(directions) - 1)]
    pairs = {(min(i, int(j)), max(i, int(j))) for i, row in enumerate(nearest) for j in row[:NEIGHBORS]}
    peak = responses.max(axis=0)  # (n,)
    lit = peak >= LIT * np.quantile(peak, 0.9)
    responses, floor = responses[:, lit], BRIGHT * peak[lit]
    cos_a = BRIGHT * np.cos(HALF_CELL * min(mean_spacing(directions), 1.0))
    tan_a = np.sqrt(1 - cos_a**2) / cos_a
    edges = jumped = looked = 0
    for i, j in sorted(pairs):
        angle = float(np.arccos(np.clip(cosines[i, j], -1, 1)))
        unshadowed = 1 - np.cos(angle) + tan_a * np.sin(angle)
        if unshadowed + MARGIN >= JUMP:
            continue
        brighter, dimmer = np.maximum(responses[i], responses[j]), np.minimum(responses[i], responses[j])
        bright = (brighter >= floor) & (brighter > 0)
        lost = 1 - dimmer[bright] / brighter[bright]
        looked += len(lost)
        between = np.flatnonzero(bright)[lost > unshadowed + MARGIN]
        around = responses[np.union1d(nearest[i], nearest[j])][:, between]
        change = brighter[between] - dimmer[between]
        whole = (change >= JUMP * np.ptp(around, axis=0)) | (change >= JUMP * brighter[between])
        edges += len(between)
        jumped += int(whole.sum())
    return edges, jumped, looked
