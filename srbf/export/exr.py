"""`exr`: one image per layer, half floats or floats; every engine's loader reads it, and other exports start from it."""

from __future__ import annotations

from pathlib import Path

from srbf.asset import Asset
from srbf.errors import InputError
from srbf.export.layers import in_encoding
from srbf.export.manifest import stem, with_layers
from srbf.export.settings import PLAIN, Settings, Written, no_levels
from srbf.methods import method_of
from srbf.stored_layers import layer_entries


def write(asset: Asset, folder: Path, settings: Settings = PLAIN) -> Written:
    """Fill `folder` with the asset as EXRs, half floats by default; stored half floats stay unchanged."""
    encoding = settings.encoding or "half"
    if encoding != "half" and encoding != "float":
        raise InputError(f"expected `encoding` half or float for EXR files, found {encoding}")
    no_levels(settings, "EXR files")
    stored, scale, bias = in_encoding(asset, encoding)
    asset = method_of(asset).with_plain_tables(asset)
    with_layers(asset, "exr", stored, scale, bias, layer_entries(stem(asset), encoding, scale, bias)).write(folder)
    return Written()
