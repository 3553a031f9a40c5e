"""Layers as BC7 or BC1 blocks: each by itself, or with error feedback between layers where only their sums are seen."""

from __future__ import annotations

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64
from srbf.compute.threads import each
from srbf.encode.quantization import metric, round_alone
from srbf.io.containers.blocks import BLOCK_BYTES, SIDE, BlockFormat, decode, encode

TEXEL_BATCH = 1 << 15
PASSES = 1  # over all blocks after the first; a second gains 0.1 dB


def blocks_alone(
    values: Float32[ndarray, "N H W C"], scale: Float32[ndarray, "N C"], bias: Float32[ndarray, "N C"], form: BlockFormat
) -> ndarray:
    """(N, bytes) uint8 of every layer, in given ranges."""
    stored = round_alone(values, scale, bias)
    found: list[ndarray] = [np.empty(0, np.uint8)] * len(stored)

    def work(i: int) -> None:
        found[i] = encode(stored[i], form)

    each(work, len(stored))
    return np.stack(found)


def blocks_together(
    values: Float32[ndarray, "K H W C"],
    functions: Float64[ndarray, "M K"],
    scale: Float32[ndarray, "K C"],
    bias: Float32[ndarray, "K C"],
    form: BlockFormat,
) -> ndarray:
    """(K, bytes) uint8 of layers that are only seen in sums weighted by overlapping `functions`.

    As `quantization.round_together` [Babai1986], a block's loss in the place of a byte's: what the blocks of one layer lose, the layers
    still to be compressed make up for. Then once more over all: each layer is compressed again for what all others lack, and a block
    kept where the functions' metric G = R^T R says that less is lost: with errors e, change d of layer i counts 2 d (G e)_i + G_ii d^2.
    """
    height, width = values.shape[1:3]
    high, wide = -(-height // SIDE), -(-width // SIDE)  # blocks
    padded = np.pad(values, ((0, 0), (0, high * SIDE - height), (0, wide * SIDE - width), (0, 0)), "edge")
    found = np.empty((len(values), high, wide * BLOCK_BYTES[form]), np.uint8)
    upper, at_a_time = metric(functions), max(1, TEXEL_BATCH // (SIDE * SIDE * wide))

    def work(task: int) -> None:
        rows = slice(task * at_a_time, (task + 1) * at_a_time)
        band = padded[:, rows.start * SIDE : rows.stop * SIDE]
        found[:, rows] = _band(band, upper, scale, bias, form).reshape(len(values), -1, found.shape[2])

    each(work, -(-high // at_a_time))
    return found.reshape(len(values), -1)


def _band(
    values: Float32[ndarray, "K h w C"],
    upper: Float64[ndarray, "K K"],
    scale: Float32[ndarray, "K C"],
    bias: Float32[ndarray, "K C"],
    form: BlockFormat,
) -> ndarray:
    k, height, width, channels = values.shape
    passed_on = np.triu(upper / np.diag(upper)[:, None], 1).astype(np.float32)
    gram = (upper.T @ upper).astype(np.float32)
    blocks = np.empty((k, height * width // SIDE**2, BLOCK_BYTES[form]), np.uint8)
    errors = np.zeros_like(values)

    def compressed(i: int, wanted: ndarray) -> tuple[ndarray, ndarray]:
        """(blocks, their residual) of layer i."""
        found = encode(round_alone(wanted[None], scale[i : i + 1], bias[i : i + 1])[0], form)
        decoded = decode(found[None], form, width, height)[0, ..., :channels]
        return found.reshape(blocks.shape[1:]), values[i] - (decoded / np.float32(255) * scale[i] + bias[i])

    for i in reversed(range(k)):
        blocks[i], errors[i] = compressed(i, values[i] + np.tensordot(passed_on[i, i + 1 :], errors[i + 1 :], 1))
    for _ in range(PASSES):
        for i in range(k):
            seen = np.tensordot(gram[i], errors, 1)
            found, lacking = compressed(i, values[i] + seen / gram[i, i] - errors[i])
            change = lacking - errors[i]
            lost = (2 * change * seen + gram[i, i] * change**2).reshape(height // SIDE, SIDE, width // SIDE, SIDE, channels).sum((1, 3, 4))
            better = lost < 0
            blocks[i][better.ravel()] = found[better.ravel()]
            texels = better.repeat(SIDE, 0).repeat(SIDE, 1)
            errors[i][texels] = lacking[texels]
    return blocks
