"""What an engine's shader calls for one asset: the pack's functions with the asset's own numbers, in any dialect.

`srbfAssetDirectional`, `srbfAssetPoint` and `srbfAssetLights` are written once, in the pack's GLSL, and translated with it. Counts,
centers, scale and bias are constants of the shader, floats that need no decoding are not decoded, and an engine passes weights and
point lights alone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from srbf.asset import Asset
from srbf.export.translation import PackFile, pack_files, parse
from srbf.methods import method_of


@dataclass(frozen=True, eq=False)
class AssetShader:
    """Parts of an asset's shader: `defines` are counts, `arrays` name -> (a define, (n, 4) values), `files` the pack's and its own last."""

    defines: dict[str, int]
    arrays: dict[str, tuple[str, ndarray]]
    files: list[PackFile]

    @property
    def pack(self) -> list[PackFile]:
        return self.files[:-1]

    @property
    def own(self) -> PackFile:
        return self.files[-1]


def counts(asset: Asset, pairs: bool = False) -> dict[str, int]:
    """What the pack asks for by `#define`, of one asset; InputError on one that no shader relights.

    `pairs`: relighting maps find the R table as values and differences, one fetch in place of two.
    """
    return method_of(asset).shader_parts(asset, pairs).defines


def asset_shader(asset: Asset, defines: dict[str, int], prepare: Callable[[str, str], str]) -> AssetShader:
    """The shader of one asset with its `counts`, its files by `pack_files`."""
    method = method_of(asset)
    parts = method.shader_parts(asset)
    needed = [f"methods/{method.stem()}.glsl", f"methods/{method.stem()}_lights.glsl", "combine/mip_level.glsl"]
    return AssetShader(defines, parts.arrays, [*pack_files(needed, None, prepare), parse(parts.functions, "asset")])


def rows_of(values: ndarray, row: Callable[[str], str]) -> str:
    """The rows of an array, each of the shortest decimals that give back the same float32."""
    return ",\n".join("    " + row(", ".join(_decimal(value) for value in vector)) for vector in np.asarray(values, np.float32))


def _decimal(value: np.float32) -> str:
    text = np.format_float_positional(value, unique=True, trim="0") if value == 0 or abs(value) > 1e-6 else repr(float(value))
    return text + "0" if text.endswith(".") else text
