"""Trains a small network that decodes a code and coordinates, together with the network that makes the codes. Needs jax."""

from __future__ import annotations

import functools
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32
from srbf.basis.neural_decoder import NeuralDecoder, elu
from srbf.errors import MissingLibraryError

RANGE = 8.0  # of a code's numbers, whose standard deviation starts as 1
BYTE_STEP = 2 * RANGE / 255
ENCODER_WIDTH = 64
RATE = 0.02  # of Adam's steps at first; it falls as a cosine to 0
WARM_UP = 100  # steps until the full rate
MOMENTUM, SECOND_MOMENTUM, SMALLEST = 0.9, 0.99, 1e-8  # [Kingma2015]
ROWS, COLUMNS = 512, 16  # of a step: receivers, and coordinates that all of them are asked at
CHUNK = 50  # steps between two looks at the clock
KEPT = 0.98  # of the running mean of the networks, per step: what an interrupted training returns


@dataclass(frozen=True, eq=False)
class Encoder:
    """Codes of rows x: RANGE tanh(y / RANGE), y = x S + s(s(x A + a) B + b) C + c, s the ELU."""

    straight: Float32[ndarray, "J C"]
    layers: tuple[tuple[ndarray, ndarray], ...]

    def codes(self, rows: Float32[ndarray, "n J"]) -> Float32[ndarray, "n C"]:
        """Within -RANGE to RANGE."""
        units = rows
        for weights, bias in self.layers[:-1]:
            units = elu(units @ weights + bias)
        weights, bias = self.layers[-1]
        return np.float32(RANGE) * np.tanh((rows @ self.straight + units @ weights + bias) / np.float32(RANGE))


@dataclass(frozen=True, eq=False)
class Trained:
    """Both networks, the mean squared error of the last steps, how many steps there were, and whether the user ended them."""

    encoder: Encoder
    decoder: NeuralDecoder
    error: float
    steps: int
    interrupted: bool


def require_jax() -> Any:
    """jax; MissingLibraryError without."""
    try:
        import jax
    except ImportError as error:
        raise MissingLibraryError("a neural map is trained by jax: pip install srbf[neural]") from error
    return jax


def train(
    rows: Float32[ndarray, "n J"],
    values: Float32[ndarray, "n L 3"],
    coordinates: Float32[ndarray, "L 3"],
    codes: int,
    hidden: int,
    steps: int,
    time_limit: float,
    rng: np.random.Generator,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> Trained:
    """Networks that give `values` of every row at every coordinate, in the least squares, by Adam on random rows and coordinates.

    The numbers of a code are disturbed by half a byte's step either way, so that rounding costs nothing.

    Parameters
    ----------
    rows
        What the encoder sees of each receiver, principal components of its values, of about unit size or less; the first of them are what
        codes begin as.
    values
        Of about unit size.
    coordinates
        Of the columns of `values`.
    codes, hidden
        Numbers in a code, and units of each hidden layer.
    steps
        At most so many. Where fewer fit into `time_limit` s, compilation included, the rate falls to 0 by then.
    rng
        Of weights and of what each step sees. Equal seeds give equal networks if the time sufficed for all steps.
    progress
        Called with (steps done, steps planned).

    Returns
    -------
    Trained
        KeyboardInterrupt ends the training early with what there is.

    Raises
    ------
    MissingLibraryError
        Without jax.
    """
    started = time.monotonic()
    jax = require_jax()
    tree = functools.partial(jax.tree_util.tree_map, jax.numpy.asarray)
    run = functools.partial(_compiled(), tree(values.transpose(1, 0, 2)), tree(rows), tree(coordinates))
    mean = _start(rows, codes, hidden, rng)
    nothing = jax.tree_util.tree_map(np.zeros_like, mean)
    state = tuple(tree(part) for part in (mean, nothing, nothing, mean))
    key = jax.random.PRNGKey(int(rng.integers(1 << 31)))
    done, planned, error, interrupted = 0, steps, np.nan, False
    rate, compiled = 0.0, started  # seconds a step, and when the first chunk had ended
    try:
        while done < planned:
            count = min(CHUNK, planned - done)
            at = np.arange(done, done + CHUNK, dtype=np.float32)
            keys = jax.random.split(jax.random.fold_in(key, done), CHUNK)
            state, losses = run(state, keys, at, np.float32(planned), np.float32(count))
            error = float(losses[:count].mean())  # waits for the steps
            mean = jax.tree_util.tree_map(np.array, state[3])  # a copy: the next chunk takes the state's memory
            done += count
            now = time.monotonic()
            if done <= CHUNK:
                compiled = now
            else:
                rate = (now - compiled) / (done - CHUNK)
            left = started + time_limit - now
            planned = min(planned, done + (int(left / rate) // CHUNK * CHUNK if rate else planned if left > 0 else 0))
            progress(done, max(planned, done))
    except KeyboardInterrupt:
        interrupted = True
    decoder, encoder = mean
    return Trained(Encoder(encoder[0], tuple(encoder[1:])), NeuralDecoder(*decoder), error, done, interrupted)


def _start(rows: Float32[ndarray, "n J"], codes: int, hidden: int, rng: np.random.Generator) -> tuple[tuple, tuple]:
    """Weights before the first step: codes are leading columns of `rows`, layers have random weights that keep variances."""

    def layer(inputs: int, outputs: int, gain: float = 1.0) -> ndarray:
        return (rng.normal(size=(inputs, outputs)) * np.sqrt(gain / inputs)).astype(np.float32)

    def bias(outputs: int) -> ndarray:
        return np.zeros(outputs, np.float32)

    first = layer(codes + 3, hidden)
    decoder = (first[:codes], first[codes:], bias(hidden), layer(hidden, hidden), bias(hidden), layer(hidden, 3), bias(3))
    size = rows.shape[1]
    straight = np.zeros((size, codes), np.float32)
    spread = rows.std(axis=0)
    for j in range(min(size, codes)):
        straight[j, j] = 1 / spread[j] if spread[j] > 0 else 0
    widths = (size, ENCODER_WIDTH, ENCODER_WIDTH)
    layers = tuple((layer(a, b), bias(b)) for a, b in zip(widths, widths[1:], strict=False))
    return decoder, (straight, *layers, (layer(ENCODER_WIDTH, codes, 0.01), bias(codes)))


@functools.cache
def _compiled() -> Callable[..., Any]:
    """CHUNK steps of Adam as one program, of which the first `count` change anything."""
    jax = require_jax()
    np_, tree = jax.numpy, jax.tree_util.tree_map

    def squashed(x: Any) -> Any:
        return np_.where(x > 0, x, np_.expm1(np_.minimum(x, 0)))

    def loss(networks: Any, values: Any, rows: Any, coordinates: Any, key: Any) -> Any:
        (code, direction, first_bias, hidden, hidden_bias, output, output_bias), (straight, *layers) = networks
        units = rows
        for weights, bias in layers[:-1]:
            units = squashed(units @ weights + bias)
        weights, bias = layers[-1]
        found = RANGE * np_.tanh((rows @ straight + units @ weights + bias) / RANGE)
        found = found + BYTE_STEP * (jax.random.uniform(key, found.shape) - 0.5)
        units = squashed((found @ code + first_bias)[None] + (coordinates @ direction)[:, None])
        units = squashed(units @ hidden + hidden_bias)
        return np_.mean((units @ output + output_bias - values) ** 2)

    @functools.partial(jax.jit, donate_argnums=3)
    def run(values: Any, rows: Any, coordinates: Any, state: Any, keys: Any, at: Any, planned: Any, count: Any) -> Any:
        columns = len(coordinates)

        def step(state: Any, given: Any) -> Any:
            networks, first, second, mean = state
            key, number = given
            of_rows, of_columns, of_codes = jax.random.split(key, 3)
            some = jax.random.randint(of_rows, (min(ROWS, len(rows)),), 0, len(rows))
            among = jax.random.permutation(of_columns, columns)[:COLUMNS]
            error, slope = jax.value_and_grad(loss)(networks, values[among[:, None], some[None]], rows[some], coordinates[among], of_codes)
            first = tree(lambda m, g: MOMENTUM * m + (1 - MOMENTUM) * g, first, slope)
            second = tree(lambda v, g: SECOND_MOMENTUM * v + (1 - SECOND_MOMENTUM) * g * g, second, slope)
            rate = 0.5 * RATE * (1 + np_.cos(np_.pi * np_.minimum(number / planned, 1))) * np_.minimum(1, (number + 1) / WARM_UP)
            seen, seen_second = 1 - MOMENTUM ** (number + 1), 1 - SECOND_MOMENTUM ** (number + 1)
            networks = tree(lambda w, m, v: w - rate * (m / seen) / (np_.sqrt(v / seen_second) + SMALLEST), networks, first, second)
            kept = np_.minimum(KEPT, (number + 1) / (number + 10))  # the start is soon forgotten
            mean = tree(lambda a, b: kept * a + (1 - kept) * b, mean, networks)
            return (networks, first, second, mean), error

        def counted(state: Any, given: Any) -> Any:
            return jax.lax.cond(given[1] < at[0] + count, step, lambda same, _: (same, np_.float32(0)), state, given)

        return jax.lax.scan(counted, state, (keys, at))

    return run
