"""`png`: one linear PNG per layer, value = byte / 255 * scale + bias."""

from __future__ import annotations

from pathlib import Path

from srbf.asset import Asset
from srbf.errors import InputError
from srbf.export.layers import in_encoding
from srbf.export.manifest import stem, with_layers
from srbf.export.settings import PLAIN, Settings, Written, no_levels
from srbf.stored_layers import layer_entries


def write(asset: Asset, folder: Path, settings: Settings = PLAIN) -> Written:
    """Fill `folder` with the asset as PNGs of bytes; overlapping Gaussians are rounded together, stored bytes stay unchanged."""
    if settings.encoding not in (None, "uint8"):
        raise InputError(f"expected `encoding` uint8 for PNG files, found {settings.encoding}")
    no_levels(settings, "PNG files")
    stored, scale, bias = in_encoding(asset, "uint8")
    with_layers(asset, "uint8", stored, scale, bias, layer_entries(stem(asset), "uint8", scale, bias)).write(folder)
    return Written()
