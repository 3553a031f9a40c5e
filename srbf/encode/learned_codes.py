"""Codes of all texels and the network that decodes them, from a training on a sample of the texels."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32
from srbf.basis.neural_decoder import NeuralDecoder
from srbf.capture import Capture
from srbf.encode.model_selection import TexelSample
from srbf.encode.weighted_rows import LightSpace
from srbf.light_images import OnImage
from srbf.solve.autoencoder import train
from srbf.solve.pca import principal_axes
from srbf.solve.streamed_product import StreamedProduct

SAMPLE_BYTES, SAMPLE_TEXELS = 1 << 29, 1 << 17  # what training sees at most
AXES = 48  # principal components that the encoder sees, per texel
CODED = 1 << 14  # texels at a time


@dataclass(frozen=True, eq=False)
class LearnedCodes:
    """`codes` (C, P) float32 of all texels, the network that decodes them, and how its training went."""

    codes: Float32[ndarray, "C P"]
    decoder: NeuralDecoder
    steps: int
    error: float
    interrupted: bool


def learned_codes(
    capture: Capture,
    codes: int,
    hidden: int,
    steps: int,
    time_limit: float,
    rng: np.random.Generator,
    progress: Callable[[int, int], None] = lambda done, total: None,
    on_image: OnImage = lambda row, image: None,
) -> LearnedCodes:
    """Train on a sample, project every texel on the sample's principal axes while the images stream by, and encode that.

    Parameters
    ----------
    capture
        With train lights.
    codes, hidden, steps, time_limit, rng
        Of `srbf.solve.autoencoder.train`.
    progress
        Called with (done, total), in images; training counts as many as there are.
    on_image
        As of `Capture.stream`.

    Returns
    -------
    LearnedCodes
        `error` is the training's rms over the responses' rms.
    """
    lights = capture.indices("train")
    count = int(np.clip(SAMPLE_BYTES // (12 * len(lights)), 1, SAMPLE_TEXELS))
    sample = TexelSample.of(capture, count, share=1.0)
    space = LightSpace.of(sample, "plain")
    axes, values = principal_axes(space.centered, min(AXES, 3 * len(lights), len(sample.texels)))
    product = StreamedProduct(space.weights(axes))
    for first, block in capture.stream(lights, on_image):
        product.add(first, block)
        progress(first + len(block), 2 * len(lights))
    spreads = np.maximum(values / np.sqrt(len(sample.texels)) / space.scale, 1e-30)
    gain = (np.sqrt(spreads[0] / spreads) / spreads[0]).astype(np.float32)  # leaves sqrt(spread / first spread)
    gain[values <= 1e-6 * max(float(values[0]), 1e-30)] = 0
    offsets = space.offsets(axes)
    responses = sample.responses[:, : sample.train]
    size = float(np.sqrt(np.mean(responses**2, dtype=np.float64))) or 1.0
    rows = (product.result[:, sample.texels] - offsets[:, None]).T * gain
    trained = train(
        np.ascontiguousarray(rows),
        responses / np.float32(size),
        sample.coordinates[: sample.train].astype(np.float32),
        codes,
        hidden,
        steps,
        time_limit,
        rng,
        lambda done, planned: progress(len(lights) + len(lights) * done // planned, 2 * len(lights)),
    )
    found = np.empty((codes, product.result.shape[1]), np.float32)
    for start in range(0, found.shape[1], CODED):
        part = slice(start, start + CODED)
        found[:, part] = trained.encoder.codes((product.result[:, part] - offsets[:, None]).T * gain).T
    decoder = replace(
        trained.decoder, output=trained.decoder.output * np.float32(size), output_bias=trained.decoder.output_bias * np.float32(size)
    )
    return LearnedCodes(found, decoder, trained.steps, float(np.sqrt(trained.error)), trained.interrupted)
