"""`ktx2`: a texture array for the web and for Vulkan."""

from __future__ import annotations

from pathlib import Path

from srbf.asset import Asset
from srbf.export import texture_array
from srbf.export.settings import PLAIN, Settings, Written


def write(asset: Asset, folder: Path, settings: Settings = PLAIN) -> Written:
    """Fill `folder` with the asset, its layers in one .ktx2 file."""
    return texture_array.write(".ktx2", asset, folder, settings)
