"""An asset's layers in another encoding, and the functions that weight them."""

from __future__ import annotations

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64
from srbf.asset import Asset
from srbf.encode.quantization import quantize, quantize_together, ranges_together
from srbf.errors import InputError
from srbf.io.image import Encoding
from srbf.methods import method_of


def finite_layers(asset: Asset) -> Float32[ndarray, "N H W C"]:
    """The decoded layers; InputError where one holds NaN or Inf."""
    layers = asset.coefficients()
    for i, layer in enumerate(layers):
        if not np.isfinite(layer).all():
            raise InputError(f"expected finite values in layer {i}, found NaN or Inf; fit again")
    return layers


def functions_of(asset: Asset) -> Float64[ndarray, "M K"] | None:
    """Functions over the domain through whose sums alone the layers are seen; None where each layer is rounded alone."""
    return method_of(asset).rounding_functions(asset)


def in_encoding(asset: Asset, encoding: Encoding) -> tuple[ndarray, Float32[ndarray, "N C"], Float32[ndarray, "N C"]]:
    """(stored, scale, bias), unchanged where they have that encoding already."""
    if asset.held == encoding:
        finite_layers(asset)
        return asset.stored, asset.scale, asset.bias
    functions = functions_of(asset)
    if encoding == "uint8" and functions is not None:
        return quantize_together(finite_layers(asset), functions)
    return _unused_kept(asset, *quantize(finite_layers(asset), encoding))


def byte_ranges(asset: Asset, layers: Float32[ndarray, "N H W C"]) -> tuple[Float32[ndarray, "N C"], Float32[ndarray, "N C"]]:
    """(scale, bias) of the byte encoding with the least loss for `layers` of the asset."""
    functions = functions_of(asset)
    if asset.held == "uint8":
        return asset.scale, asset.bias
    if functions is not None:
        return ranges_together(layers, functions)
    _, scale, bias = _unused_kept(asset, *quantize(layers, "uint8"))
    return scale, bias


def _unused_kept(
    asset: Asset, stored: ndarray, scale: Float32[ndarray, "N C"], bias: Float32[ndarray, "N C"]
) -> tuple[ndarray, Float32[ndarray, "N C"], Float32[ndarray, "N C"]]:
    """Unused channels of the last image keep scale and bias 0."""
    unused = asset.scale == 0
    scale[unused], bias[unused] = 0, 0
    return stored, scale, bias
