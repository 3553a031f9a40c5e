"""A small network of a code and a direction: what a neural map evaluates for every receiver and light."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float32

AXES = 3  # of a direction
COLORS = 3


@dataclass(frozen=True, eq=False)
class NeuralDecoder:
    """T(p, L) ~ W_2 s(W_1 s(W_a a(p) + W_L L + b_0) + b_1) + b_2, s(x) = x above 0, e^x - 1 below: ELU     [Dulecha2020; ours is smaller]

    Parameters
    ----------
    code
        (C, W) float32: W_a, from a code of C numbers to W hidden units.
    direction
        (3, W): W_L.
    first_bias
        (W,): b_0.
    hidden, hidden_bias
        (W, W) and (W,): W_1, b_1.
    output, output_bias
        (W, 3) and (3,): W_2, b_2.
    """

    code: Float32[ndarray, "C W"]
    direction: Float32[ndarray, "3 W"]
    first_bias: Float32[ndarray, " W"]
    hidden: Float32[ndarray, "W W"]
    hidden_bias: Float32[ndarray, " W"]
    output: Float32[ndarray, "W 3"]
    output_bias: Float32[ndarray, " 3"]

    @property
    def numbers(self) -> int:
        """How many numbers the network has."""
        return sum(part.size for part in self._parts())

    @property
    def products(self) -> int:
        """Multiplications for one receiver and one light."""
        return self.code.size + self.direction.size + self.hidden.size + self.output.size

    def of_codes(self, codes: Float[ndarray, "n C"]) -> Float32[ndarray, "n W"]:
        """W_a a + b_0: the same for all lights."""
        return np.asarray(codes, np.float32) @ self.code + self.first_bias

    def toward(self, first: Float32[ndarray, "n W"], directions: Float[ndarray, "m 3"]) -> Float32[ndarray, "n 3"]:
        """Responses to a white light per unit of strength, signed; `first` of `of_codes`, and a unit direction for each or one for all."""
        units = elu(first + np.asarray(directions, np.float32) @ self.direction)
        return elu(units @ self.hidden + self.hidden_bias) @ self.output + self.output_bias

    def table(self) -> Float32[ndarray, "R W"]:
        """All numbers as rows of W: C + 3 + 1 of the first layer, W + 1 of the second, then the weights of each color and the three biases.

        A shader adds up rows: a row times a number, and for a color one product of two rows.
        """
        last = np.zeros((1, self.code.shape[1]), np.float32)
        last[0, :COLORS] = self.output_bias
        rows = (self.code, self.direction, self.first_bias[None], self.hidden, self.hidden_bias[None], self.output.T, last)
        return np.concatenate(rows).astype(np.float32)

    @classmethod
    def of_table(cls, table: Float32[ndarray, "R W"]) -> NeuralDecoder:
        """The network whose `table` it is; `rows_of` tells how many rows that has."""
        width = table.shape[1]
        codes = len(table) - rows_of(0, width)
        ends = np.cumsum([codes, AXES, 1, width, 1, COLORS])
        code, direction, first_bias, hidden, hidden_bias, output, last = np.split(table, ends)
        return cls(code, direction, first_bias[0], hidden, hidden_bias[0], np.ascontiguousarray(output.T), last[0, :COLORS])

    def _parts(self) -> tuple[ndarray, ...]:
        return self.code, self.direction, self.first_bias, self.hidden, self.hidden_bias, self.output, self.output_bias


def rows_of(codes: int, width: int) -> int:
    """How many rows the table of a network has."""
    return codes + AXES + 1 + width + 1 + COLORS + 1


def elu(x: Float32[ndarray, "n W"]) -> Float32[ndarray, "n W"]:
    """x above 0, e^x - 1 below."""
    return np.maximum(x, 0) + np.expm1(np.minimum(x, 0))
