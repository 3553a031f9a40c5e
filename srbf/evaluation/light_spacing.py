"""Light spacing against shadows: a penumbra narrower than the spacing of the lights falls between two of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64, Int
from srbf.capture import COVERED, Capture
from srbf.errors import InputError
from srbf.sphere import mean_spacing

NEIGHBORS = 4  # nearest lights of each light
TEXELS = 4096
MIN_PEAK = (
    0.5  # of the 90 % quantile of the texels' peaks; dimmer texels get light at grazing angles only, where it always falls off steeply
)
MIN_BRIGHTER = float(np.sqrt(0.5))  # of a texel's peak, the brighter response of a pair
HALF_CELL = 0.7  # light spacings, the largest distance of a texel's normal to the nearest light
EDGE_LOSS = 0.15  # of the brighter response, lost beyond the loss of an unshadowed surface: an edge is between the two lights
JUMP_LOSS = 0.75  # of the response, or of its change in the neighborhood: the whole edge is between the two lights
NEIGHBORHOOD = 8  # nearest lights of either light of a pair
MAX_JUMPED = 0.5  # of the edges; more is too coarse
RESOLVED_SUN = 0.7  # light spacings: about half of the edges of a sun of this size are jumped
MIN_EDGES = 1e-3  # of the pairs; a capture with fewer has no significant shadows


@dataclass(frozen=True)
class ShadowSampling:
    """Shadow edges of a capture against the spacing of its N train lights.

    `spacing` is the lights' mean distance (rad), `edges` the share of (texel, pair of neighboring lights) with a shadow edge or
    the end of a highlight between the two lights, `jumped` the share of those whose whole edge is between the two lights.
    """

    lights: int
    spacing: float
    edges: float
    jumped: float
    sun_angle: float | None = None  # rad, if the capture records it

    @property
    def too_coarse(self) -> bool:
        """Whether most shadow edges fall between two lights, so that interpolation can only cross-fade them."""
        if self.edges < MIN_EDGES:
            return False
        return self.jumped > MAX_JUMPED if self.sun_angle is None else self.sun_angle < RESOLVED_SUN * self.spacing

    def sentence(self) -> str:
        """The result as one sentence with its numbers."""
        spacing = f"the {self.lights} lights are {np.degrees(self.spacing):.1f} degrees apart"
        if self.edges < MIN_EDGES:
            return f"{spacing}, and the capture has hardly a shadow edge between neighboring lights."
        sun = "" if self.sun_angle is None else f"the sun is {np.degrees(self.sun_angle):.1f} degrees wide and "
        crossed = f"{sun}{self.jumped:.0%} of the shadow edges between neighbors lie wholly between two lights"
        if self.too_coarse:
            return f"{spacing}, {crossed}: too coarse for these shadows; bake more lights, or a softer sun (--sun-angle auto)."
        return f"{spacing}, {crossed}: close enough for these shadows."


def shadow_sampling(capture: Capture, texels: Int[ndarray, " n"] | None = None) -> ShadowSampling:
    """Search every pair of neighboring train lights for texels that lose their light between the two.

    For a pair at an angle t whose brighter response is at least cos a of the texel's peak, an unshadowed Lambert surface loses at most
    1 - cos t + tan a sin t of it (a is 45 degrees, or more where few lights may all miss the peak). If a texel loses EDGE_LOSS more, an
    edge is between the lights. The edge is jumped if JUMP_LOSS of the response is lost, or of its whole change around the pair. Full
    shadows of a hard sun are jumped at any N; with a sun as large as the spacing, a third to a half of the edges are. Partial
    shadows, as of tinted glass, are jumped less often, so for them the share is a lower bound. The measure is ours.

    Pairs more than about 30 degrees apart are inconclusive and left out: forty lights on the sphere show no edges at all.

    In the space of directions, a texel's penumbra is as wide as the sun at any distance of the occluder. If the capture records the
    size of its sun, `too_coarse` depends on that size alone.

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
    """(edges, jumped edges, all candidates) over texels and pairs of each light with its NEIGHBORS nearest."""
    cosines = directions @ directions.T
    np.fill_diagonal(cosines, -np.inf)
    nearest = np.argsort(-cosines, axis=1)[:, : min(NEIGHBORHOOD, len(directions) - 1)]
    pairs = {(min(i, int(j)), max(i, int(j))) for i, row in enumerate(nearest) for j in row[:NEIGHBORS]}
    peak = responses.max(axis=0)  # (n,)
    lit = peak >= MIN_PEAK * np.quantile(peak, 0.9)
    responses, floor = responses[:, lit], MIN_BRIGHTER * peak[lit]
    cos_a = MIN_BRIGHTER * np.cos(HALF_CELL * min(mean_spacing(directions), 1.0))
    tan_a = np.sqrt(1 - cos_a**2) / cos_a
    edges = jumped = looked = 0
    for i, j in sorted(pairs):
        angle = float(np.arccos(np.clip(cosines[i, j], -1, 1)))
        unshadowed = 1 - np.cos(angle) + tan_a * np.sin(angle)
        if unshadowed + EDGE_LOSS >= JUMP_LOSS:
            continue
        brighter, dimmer = np.maximum(responses[i], responses[j]), np.minimum(responses[i], responses[j])
        bright = (brighter >= floor) & (brighter > 0)
        lost = 1 - dimmer[bright] / brighter[bright]
        looked += len(lost)
        between = np.flatnonzero(bright)[lost > unshadowed + EDGE_LOSS]
        around = responses[np.union1d(nearest[i], nearest[j])][:, between]
        change = brighter[between] - dimmer[between]
        whole = (change >= JUMP_LOSS * np.ptp(around, axis=0)) | (change >= JUMP_LOSS * brighter[between])
        edges += len(between)
        jumped += int(whole.sum())
    return edges, jumped, looked
