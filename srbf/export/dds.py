"""`dds`: a texture array with the DX10 header, for engines on the desktop."""

from __future__ import annotations

from pathlib import Path

from srbf.asset import Asset
from srbf.export import texture_array
from srbf.export.settings import PLAIN, Settings, Written


def write(asset: Asset, folder: Path, settings: Settings = PLAIN) -> Written:
    """Fill `folder` with the asset, its layers in one .dds file."""
    return texture_array.write(".dds", asset, folder, settings)
