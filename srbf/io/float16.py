"""Half floats to float32 by their bits: several times faster than numpy's conversion."""

from __future__ import annotations

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float32

INFINITE = 0x7C00  # smallest magnitude of a half's bits that is Inf or NaN
MAGNITUDE = np.uint16(0x7FFF)
SIGN_AND_VALUE = np.int32(~0x70000000)  # removes the copies of the sign from widening
REBIAS = np.float32(2.0**112)  # 127 - 15, between the exponents' biases; also correct for subnormals


def finite_to_float32(half: Float[ndarray, "*shape"], out: Float32[ndarray, "*shape"]) -> Float32[ndarray, "*shape"]:
    """`half` converted to `out`, bit-identical to numpy for finite values. Inf and NaN become wrong finite values: check `all_finite`.

    Shift the 15 bits of exponent and mantissa to their float32 places, keep the sign, multiply by 2^112. Four passes over `out`:
    use pieces that fit the cache.
    """
    bits = out.view(np.int32)
    np.copyto(bits, half.view(np.int16))  # sign-extended
    np.left_shift(bits, 13, out=bits)
    np.bitwise_and(bits, SIGN_AND_VALUE, out=bits)
    np.multiply(out, REBIAS, out=out)
    return out


def all_finite(half: Float[ndarray, "*shape"]) -> bool:
    """Whether no half float is Inf or NaN."""
    return half.size == 0 or int((half.view(np.uint16) & MAGNITUDE).max()) < INFINITE
