"""`lights=auto`: how many directions, and which share of the texels for each, by a probe of the scene's costs and smoothness."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float64
from srbf.bake.folder import STATE
from srbf.bake.images import MASKS
from srbf.bake.job import base_job
from srbf.bake.light_sets import PlacedLight
from srbf.bake.planned_lights import PlannedLight, noise_seed
from srbf.bake.request import RenderRequest
from srbf.bake.run import Bake
from srbf.bake.schedule import FIRST_SAMPLES
from srbf.bake.settings import BakeSettings
from srbf.bake.worker import Worker
from srbf.encode.light_function_fit import choose_functions, dense_centers
from srbf.encode.model_selection import TexelSample
from srbf.errors import BakeError, InputError, ManifestError
from srbf.io import files
from srbf.light_domain.directions import Directions
from srbf.receiver_images import MANIFEST
from srbf.receiver_share import MOST_STEPS, Share, share_word
from srbf.solve.kernel_ridge import KernelPath
from srbf.sphere import farthest_points, point_set, random_directions
from srbf.texel_interpolation import interpolation

USUAL_LIGHTS = 400  # with all texels, where the probe tells nothing
COUNTS = (100, 140, 200, 280, 400, 560, 800, 1120, 1600, 2240, 3200)  # of lights to choose from
STEPS = (1, 2, 3)  # of shares to choose from
PROBE_LIGHTS, TESTED_LIGHTS = 160, 32  # of few texels: how smooth the response is over directions
VIEW_SAMPLES = 2  # of them; of a lightmap one, at the texels' centers: its others are spread over a footprint that few texels make wide
TIMED_LIGHTS = 4  # of all texels, in two passes of one sample, and of each share
PROBE_TEXELS = 1024  # about
SPENT = 0.7  # of the time that the first pass may take: the rest is for more samples, of tested lights most
GAIN = 0.97  # times the error of 400 whole lights, above which these are kept
LEAST = 1e-6  # squared error by directions
KNOWN_OF_OTHERS = 0.25  # of the squared error of interpolated texels: the rest is known of neighboring lights (measured: under 0.1)
STEEPEST = 1.0  # power of the number of lights that the error may fall with


@dataclass(frozen=True)
class Goal:
    """What a bake is chosen for: the least error within so many `seconds`, or the least time for a relative RMSE of `error`."""

    seconds: float | None = None
    error: float | None = None

    def __post_init__(self) -> None:
        if (self.seconds is None) == (self.error is None):
            found = "neither" if self.seconds is None else "both"
            raise InputError(f"expected `time_limit` or `error` with `lights=auto`, found {found}; give one of them")


@dataclass(frozen=True)
class Probe:
    """What a few renders tell of a scene.

    seconds: of a light of one sample, by step of its share; more: of one sample more of all texels. directions: relative RMSE, without
    noise, of the images of `counts` lights interpolated at unseen ones. averaged: by what the fit multiplies squared errors that differ
    from light to light. texel_errors: by step, squared relative error of an image of one sample, its missing texels interpolated.
    """

    seconds: dict[int, float]
    more: float
    counts: tuple[int, ...]
    directions: tuple[float, ...]
    averaged: float
    texel_errors: dict[int, float]

    @property
    def power(self) -> float:
        """p of an error by directions that falls with (number of lights)^-p, by least squares of logarithms."""
        found = -np.polyfit(np.log(self.counts), np.log(np.maximum(self.directions, 1e-6)), 1)[0]
        return float(np.clip(found, 0, STEEPEST))

    def error(self, lights: int, step: int, samples: int) -> float:
        """Predicted relative RMSE of all images interpolated at unseen lights."""
        of_directions = self.directions[-1] * (lights / self.counts[-1]) ** -self.power
        lost = KNOWN_OF_OTHERS * max(0.0, self.texel_errors[step] - self.texel_errors[1])
        return float(np.sqrt(of_directions**2 + self.averaged * (self.texel_errors[1] / samples + lost)))

    def time(self, lights: int, step: int, samples: int) -> float:
        """Predicted seconds of the train lights."""
        return lights * (self.seconds[step] + (samples - 1) * self.more / step**2)


@dataclass(frozen=True)
class LightChoice:
    """So many train lights, each with every `step`-th texel, and what the probe predicts: relative RMSE, and seconds of the whole bake."""

    lights: int
    step: int
    error: float
    seconds: float


def choose_lights(probe: Probe, goal: Goal, samples: int, tested: float, steps: Sequence[int] = STEPS) -> LightChoice:
    """The best of COUNTS × `steps` for a goal; 400 whole lights where they fit and are about as good.

    samples: of each train light; of a goal of seconds those of the first pass count instead. tested: seconds of all but train lights.
    """

    def of(count: int, step: int) -> LightChoice:
        own = samples if goal.seconds is None else 1 if step > 1 else FIRST_SAMPLES
        return LightChoice(count, step, probe.error(count, step, own), tested + probe.time(count, step, own))

    every = [of(count, step) for count in COUNTS for step in steps]
    usual = next(one for one in every if one.lights == USUAL_LIGHTS and one.step == 1)
    if goal.error is not None:
        good = [one for one in every if one.error <= goal.error]
        return min(good, key=lambda one: one.seconds) if good else min(every, key=lambda one: (round(one.error, 3), one.seconds))
    assert goal.seconds is not None
    within = [one for one in every if one.seconds <= SPENT * goal.seconds] or [min(every, key=lambda one: one.seconds)]
    best = min(within, key=lambda one: (one.error, one.seconds))
    return usual if usual in within and best.error > GAIN * usual.error else best


def with_chosen_lights(bake: Bake, goal: Goal, replacing: bool, say: Callable[[str], None] = lambda line: None) -> Bake:
    """The bake with a number of lights and a share for `goal`; a capture that its folder holds keeps its own, unless it is replaced.

    InputError where lights are not directions of a domain, or have no shares.
    """
    settings = bake.settings
    if settings.light_set is not None or settings.points is not None or settings.light_list is not None:
        raise InputError("expected directions of a domain with `lights=auto`, found others; give a number of `lights`, or leave it out")
    if settings.receiver.kind not in ("lightmap", "view") or settings.samples == "auto" or settings.denoise:
        raise InputError(
            "expected a lightmap or a view, without `samples=auto` and `denoise`, with `lights=auto`; give a number of `lights`"
        )
    before = None if replacing else _of_begun(bake.folder)
    if before is not None:
        return replace(bake, settings=replace(settings, lights=before[0], step=before[1]))
    steps = [step for step in STEPS if not (settings.receiver.kind == "view" and (settings.width % step or settings.height % step))]
    steps = [step for step in steps if min(settings.width, settings.height) >= step]
    probe = probed(bake, steps, say)
    if probe is None:
        say(f"the probe tells nothing of the scene: {USUAL_LIGHTS} lights, all texels of each")
        return replace(bake, settings=replace(settings, lights=USUAL_LIGHTS, step=1))
    each = FIRST_SAMPLES if goal.seconds is not None else settings.holdout_samples
    tested = (settings.validation + settings.holdout) * (probe.seconds[1] + (each - 1) * probe.more)
    choice = choose_lights(probe, goal, int(settings.samples), tested, steps)
    share = "all texels" if choice.step == 1 else f"{share_word(choice.step)} of the texels"
    goes_on = "the first pass takes" if goal.seconds is not None else "in"
    say(f"{choice.lights} lights with {share} of each: predicted error {choice.error:.3g}, {goes_on} about {choice.seconds:.0f} s")
    if goal.error is not None and choice.error > goal.error:
        say(f"no number of lights up to {COUNTS[-1]} promises an error of {goal.error:.3g}; this is the best of them")
    return replace(bake, settings=replace(settings, lights=choice.lights, step=choice.step))


def probed(bake: Bake, steps: Sequence[int], say: Callable[[str], None] = lambda line: None) -> Probe | None:
    """Renders of some lights, in a scratch folder; None where they are black."""
    settings = bake.settings
    bake.check_scene()
    width, height = settings.width, settings.height
    step = _probe_step(settings, steps)
    part = None if step == 1 else Share(step, (step // 2, step // 2), at_centers=settings.receiver.kind == "lightmap")
    samples = VIEW_SAMPLES if settings.receiver.kind == "view" else 1
    train = point_set("hammersley", PROBE_LIGHTS, settings.domain)
    tested = random_directions(TESTED_LIGHTS, settings.domain, np.random.default_rng(settings.seed + 1))
    timed = [int(i) for i in farthest_points(train, TIMED_LIGHTS)]
    requests: list[RenderRequest] = []

    def ask(direction: ndarray, samples: int, share: Share | None) -> None:
        index = len(requests)
        light = PlannedLight(
            index, PlacedLight("directional", tuple(direction.tolist())), "train", samples, noise_seed(settings.seed, index)
        )
        requests.append(RenderRequest(light, samples, light.seed, share, ("response",)))

    ask(train[timed[0]], 1, None)  # passes the scene to Cycles
    for i in (*timed, *timed):
        ask(train[i], 1, None)
    ask(train[timed[0]], 1 + 4, None)
    for one in steps:
        for i in timed:
            ask(train[i], 1, None if one == 1 else Share(one, (0, 0)))
    first = len(requests)
    for direction in (*train, *tested, *tested):
        ask(direction, samples, part)
    images, seconds, masks = _rendered(bake, requests, say)
    valid = masks["valid"][:, :, 0] > 0
    twice = np.array([images[1 : 1 + TIMED_LIGHTS], images[1 + TIMED_LIGHTS : 1 + 2 * TIMED_LIGHTS]])[:, :, valid]
    power = float((twice[0] * twice[1]).mean())  # of the response, without its noise
    own = valid if part is None else valid[part.indices]
    responses = np.stack([image[own] for image in images[first:]], axis=1)  # (n, M, 3)
    if power <= 0 or not own.any() or not responses.any():
        return None
    more = max(0.0, seconds[1 + 2 * TIMED_LIGHTS] - float(np.median(seconds[1 : 1 + 2 * TIMED_LIGHTS]))) / 4
    at = 2 + 2 * TIMED_LIGHTS
    costs = {one: float(np.median(seconds[at + k * TIMED_LIGHTS : at + (k + 1) * TIMED_LIGHTS])) for k, one in enumerate(steps)}
    counts, of_directions, averaged = _by_directions(responses, train, tested, settings)
    return Probe(costs, more, counts, of_directions, averaged, _by_texels(twice, valid, masks, steps, power, (height, width)))


def _probe_step(settings: BakeSettings, steps: Sequence[int]) -> int:
    """Of the share of texels by which smoothness over directions is measured."""
    most = int(np.sqrt(settings.width * settings.height / PROBE_TEXELS))
    sides = (settings.width, settings.height) if settings.receiver.kind == "view" else ()
    return max(step for step in range(1, MOST_STEPS + 1) if step == 1 or (step <= most and not any(side % step for side in sides)))


def _rendered(
    bake: Bake, requests: Sequence[RenderRequest], say: Callable[[str], None]
) -> tuple[list[ndarray], list[float], dict[str, ndarray]]:
    """(images, seconds of each, geometry and masks of the receiver)."""
    images: list[ndarray] = []
    seconds: list[float] = []
    masks: dict[str, ndarray] = {}
    with tempfile.TemporaryDirectory(prefix="srbf-") as name:
        scratch = Path(name)
        combined = replace(bake.settings, transport="combined", samples=1)
        job: dict[str, Any] = {**base_job(bake.scene, combined, scratch, requests), "channels": ["position", "normal", "coverage", *MASKS]}
        with Worker(job, scratch, scratch / "bake.log", bake.blender) as worker:
            for event in worker.events(say):
                if event["event"] == "image":
                    masks[event["name"]] = np.load(scratch / event["file"])
                elif event["event"] == "rendered":
                    path = scratch / event["files"]["response"]
                    images.append(np.load(path).astype(np.float32))
                    path.unlink()
                    seconds.append(event["seconds"])
    if len(images) < len(requests):
        raise BakeError(f"expected {len(requests)} images of a probe from Blender, found {len(images)}; run again")
    return images, seconds, masks


def _noise(twice: ndarray) -> float:
    """Variance of one pass, of two of the same lights."""
    return float(((twice[0] - twice[1]) ** 2).mean()) / 2


def _by_directions(
    responses: ndarray, train: Float64[ndarray, "L 3"], tested: Float64[ndarray, "V 3"], settings: BakeSettings
) -> tuple[tuple[int, ...], tuple[float, ...], float]:
    """(numbers of lights, relative RMSE of each at the tested lights without noise, sum of squares of a prediction's weights).

    responses (n, L + 2 V, 3): the tested lights after the train lights, twice. Of two renders of a light with noise of their own, the mean
    product has none.
    """
    once, twice = np.moveaxis(responses[:, len(train) :].reshape(len(responses), 2, len(tested), 3).astype(np.float64), 1, 0)
    power, noise = max(float((once * twice).mean()), 1e-30), float(((once - twice) ** 2).mean()) / 2
    order = farthest_points(train, len(train))
    counts = (len(train) // 4, len(train) // 2, len(train))
    errors, spread = [], 0.0
    for count in counts:
        chosen = np.array(sorted(order[:count]))
        lights = train[chosen]
        domain = Directions(settings.domain)
        both = np.concatenate([responses[:, chosen], responses[:, len(train) : len(train) + len(tested)]], axis=1)
        sample = TexelSample(np.arange(len(both)), both, np.concatenate([lights, tested]), count, domain)
        centers = dense_centers(lights, domain)
        model = choose_functions(sample, centers)
        path = KernelPath.of(model.kernel.between(lights, lights, centers))
        weights = path.solve(model.ridge, model.kernel.between(tested, lights, centers).T).T  # (V, L)
        predicted = np.einsum("vl,nlc->nvc", weights, responses[:, chosen].astype(np.float64))
        spread = float((weights**2).sum(axis=1).mean())
        square = float(((predicted - once) * (predicted - twice)).mean()) - spread * noise
        errors.append(float(np.sqrt(max(square / power, LEAST))))
    return counts, tuple(errors), spread


def _by_texels(
    twice: ndarray, valid: Bool[ndarray, "H W"], masks: dict[str, ndarray], steps: Sequence[int], power: float, size: tuple[int, int]
) -> dict[int, float]:
    """By step, the squared error of an image whose missing texels are interpolated, of one pass, relative to the image's squares."""
    noise = _noise(twice)
    errors = {1: noise / power}
    for step in [step for step in steps if step > 1]:
        known = np.zeros(size, bool)
        known[Share(step, (0, 0)).indices] = True
        whole = np.zeros((twice.shape[1], *size, 3), np.float32)
        whole[:, valid] = twice[0]
        operator = interpolation(known, valid.astype(np.float32), masks["position"], masks["normal"])
        filled = np.stack([(operator @ image[known]).reshape(*size, 3)[valid] for image in whole])
        # The filled image has noise of the first pass alone, so that its error at the second is its own and that pass's noise.
        errors[step] = max(float(((filled - twice[1]) ** 2).mean()) - noise, 0.0) / power
    return errors


def _of_begun(folder: Path) -> tuple[int, int] | None:
    """(lights, step) of the capture in `folder`, finished or not; None where there is none to read."""
    for name in (STATE, MANIFEST):
        if (folder / name).is_file():
            with suppress(ManifestError, KeyError, TypeError, ValueError):
                recorded = files.read_json(folder / name)
                settings = (recorded["source"] if name == MANIFEST else recorded)["settings"]
                return int(settings["lights"]), int(settings.get("step", 1))
    return None
