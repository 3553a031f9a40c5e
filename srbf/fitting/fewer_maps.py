"""An asset of fewer maps, or components, after the fit and without its capture."""

from __future__ import annotations

from srbf.asset import Asset
from srbf.errors import InputError
from srbf.io.image import Encoding
from srbf.methods import method_of


def keep(asset: Asset, count: int, encoding: Encoding | None = None) -> Asset:
    """The asset with `count` maps, or components, as near as they come over the captured domain; in its own encoding unless given.

    InputError where the method cannot (clustered eigen maps, baselines), and on a count above the asset's. The error by role was measured
    for more: it is left out.
    """
    method = method_of(asset)
    have = method.reducible_from(asset)
    if have is None:
        raise InputError(f"expected relighting maps or an eigen map to keep fewer of, found {asset.method}; fit again with fewer")
    if not 1 <= count <= have:
        raise InputError(f"expected `count` of 1 to {have}, as many as the asset has, found {count}")
    manifest = {key: value for key, value in asset.manifest.items() if key not in ("error", "sha256")}
    manifest["source"] = {**manifest.get("source", {}), "kept": {"of": have}}
    return method.reduced(asset, manifest, count, encoding or asset.held)
