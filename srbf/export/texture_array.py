"""`dds` and `ktx2`: all layers in one texture array, BC7 by default, with their mip levels."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any, get_args

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64
from srbf.asset import Asset
from srbf.encode.quantization import round_alone, round_together
from srbf.errors import InputError
from srbf.export.layers import byte_ranges, finite_layers, functions_of, in_encoding
from srbf.export.manifest import stem, with_layers
from srbf.export.mips import coverage_of, levels_without_bleeding, smaller_levels
from srbf.export.rounding import blocks_alone, blocks_together
from srbf.export.settings import PLAIN, Settings, Written
from srbf.io.containers import write_texture_array
from srbf.io.containers.blocks import BlockFormat
from srbf.io.containers.dds_header import TexelFormat
from srbf.io.containers.texture_array import TextureArray
from srbf.methods import method_of

MOST_LAYERS = 2048  # of a texture array in Vulkan, Direct3D and WebGL; WebGPU guarantees 256
WEBGPU_LAYERS = 256


def write(suffix: str, asset: Asset, folder: Path, settings: Settings = PLAIN) -> Written:
    """Fill `folder` with the asset, its layers in one file `maps` or `planes` named .dds or .ktx2.

    InputError on BC1 for scalar coefficient maps, which are four per layer, and on impossible levels.
    """
    form = settings.encoding or "bc7"
    if form == "float":
        raise InputError(f"expected `encoding` {', '.join(get_args(TexelFormat))} for a texture array, found {form}")
    if form == "bc1" and asset.stored.shape[3] > 3:
        raise InputError(
            f"expected bc7 for scalar coefficient maps, four per layer, found bc1, which has three channels; export {asset.method} as bc7"
        )
    if len(asset.stored) > MOST_LAYERS:
        raise InputError(f"expected at most {MOST_LAYERS} layers of a texture array, found {len(asset.stored)}; fit with fewer maps")
    levels, notes = _levels(asset, settings)
    texture, scale, bias = texture_of(asset, form, levels)
    name = f"{stem(asset)}s{suffix}"
    write_texture_array(folder / name, texture)
    entries: list[dict[str, Any]] = [
        {
            "file": name,
            "layer": i,
            "encoding": form,
            "levels": levels,
            "scale": scale[i].astype(float).tolist(),
            "bias": bias[i].astype(float).tolist(),
        }
        for i in range(len(scale))
    ]
    stored = texture.pixels()[..., : scale.shape[1]]
    with_layers(asset, suffix[1:], stored, scale, bias, entries).write(folder, layers=False)
    if form.startswith("bc") and (asset.width % 4 or asset.height % 4):
        notes.append(f"{asset.width}x{asset.height} texels end within a block of 4 x 4: Direct3D and WebGPU require multiples of 4")
    if len(asset.stored) > WEBGPU_LAYERS:
        notes.append(f"{len(asset.stored)} layers exceed the {WEBGPU_LAYERS} that WebGPU guarantees")
    return Written(tuple(notes))


def texture_of(asset: Asset, form: TexelFormat, levels: int) -> tuple[TextureArray, Float32[ndarray, "N C"], Float32[ndarray, "N C"]]:
    """(texture array, scale, bias) of an asset; all levels are in the ranges of the first."""
    if levels == 1 and (form == "half" or form == "uint8"):
        stored, scale, bias = in_encoding(asset, form)
        return TextureArray.of(form, [stored]), scale, bias
    layers, functions = finite_layers(asset), functions_of(asset)
    if form == "half":
        stored, scale, bias = in_encoding(asset, form)
        below = smaller_levels(layers, coverage_of(asset), levels)[1:]
        return TextureArray.of(form, [stored, *(_halves(level, scale, bias) for level in below)]), scale, bias
    scale, bias = byte_ranges(asset, layers)
    every = smaller_levels(layers, coverage_of(asset), levels)
    if form == "uint8":
        stored, scale, bias = in_encoding(asset, form)
        return TextureArray.of(form, [stored, *(_bytes(level, functions, scale, bias) for level in every[1:])]), scale, bias
    compress = partial(blocks_alone) if functions is None else partial(_together, functions)
    found = tuple(compress(level, scale, bias, form) for level in every)
    return TextureArray(form, asset.width, asset.height, found), scale, bias


def _together(
    functions: Float64[ndarray, "M K"], values: Float32[ndarray, "K H W C"], scale: ndarray, bias: ndarray, form: BlockFormat
) -> ndarray:
    return blocks_together(values, functions, scale, bias, form)


def _bytes(values: Float32[ndarray, "N H W C"], functions: ndarray | None, scale: ndarray, bias: ndarray) -> ndarray:
    return round_alone(values, scale, bias) if functions is None else round_together(values, functions, scale, bias)


def _halves(values: Float32[ndarray, "N H W C"], scale: ndarray, bias: ndarray) -> ndarray:
    used = np.where(scale != 0, scale, 1)
    return ((values - bias[:, None, None]) / used[:, None, None]).astype(np.float16)


def _levels(asset: Asset, settings: Settings) -> tuple[int, list[str]]:
    """The number of levels, full size included, and notes on them."""
    clean = levels_without_bleeding(asset)
    most = max(asset.width, asset.height).bit_length()
    if settings.levels == "auto":
        clustered = "no mip levels: components of different clusters have no mean; relight to a texture and filter that"
        return clean, [] if method_of(asset).filterable else [clustered]
    if not 0 <= settings.levels <= most:
        raise InputError(f"expected 0 to {most} mip levels of {asset.width}x{asset.height} texels, found `levels={settings.levels}`")
    levels = max(1, settings.levels)
    if levels > 1 and not method_of(asset).filterable:
        raise InputError(
            "expected no mip levels of a clustered eigen map, whose components differ in meaning between clusters, found "
            f"`levels={levels}`; relight it to a texture and let the GPU filter that"
        )
    return levels, [f"from level {clean} on, charts share texels: {levels} levels where {clean} keep them apart"] if levels > clean else []
