"""The asset.json of an export: that of the asset, with layers in another encoding."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from numpy import ndarray

from srbf.arrays import Float32
from srbf.asset import SCENE_FILE, Asset
from srbf.methods import method_of
from srbf.probe_grid import NEARNESS_FILE, PLACES_FILE


def with_layers(
    asset: Asset,
    target: str,
    stored: ndarray,
    scale: Float32[ndarray, "N C"],
    bias: Float32[ndarray, "N C"],
    entries: list[dict[str, Any]],
) -> Asset:
    """`asset` with other layers and `entries`, and every key that a file needs, whether it was loaded or made in memory.

    Errors by role, which were measured on the original layers, are dropped; `source.export` records the export.
    """
    manifest: dict[str, Any] = {
        "format": "srbf-asset",
        "version": 1,
        "quantity": "irradiance",
        "row_origin": "top",
        "axes": "z-up-right-handed",
        **{key: value for key, value in asset.manifest.items() if key not in ("error", "sha256")},
        **{name: f"{name}.exr" for name in asset.images},
        **({"scene": SCENE_FILE} if asset.scene is not None else {}),
    }
    if asset.probes is not None:
        manifest["receiver"] = {**manifest["receiver"], "places": PLACES_FILE, "nearness": NEARNESS_FILE}
    for name, table in asset.tables.items():
        told = {"size": table.size} if name == "r_table" else {"mapping": "octahedral"} if name == "w_table" else {}
        known = {**told, **manifest.get(name, {})}
        manifest[name] = {**known, "file": f"{name}.png" if "packed" in known else method_of(asset).tables[name]}
    manifest[asset.layers_key] = entries
    manifest["source"] = {**manifest.get("source", {}), "export": {"target": target}}
    return replace(asset, manifest=manifest, stored=stored, scale=scale, bias=bias)


def stem(asset: Asset) -> str:
    """The stem of its layers' files: `map` or `plane`."""
    return asset.layers_key[:-1]
