"""Tables of a report: size, fit, errors by role, with direct light added and at cluster borders."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from srbf.asset import Asset
from srbf.captured_light import ROLES
from srbf.evaluation.cluster_borders import ClusterBorders
from srbf.evaluation.rate_distortion import family_of, name_of
from srbf.info import bytes_by_light, folder_bytes, light_facts
from srbf.methods import method_of
from srbf.report.canvas import place_text
from srbf.report.inline import Table
from srbf.report.subject import Subject

DIRECT_METHODS = {"direct_ray": "direct light by rays, exact", "direct_shadow_map": "direct light by a shadow map"}  # keys of an evaluation


def read_bytes(asset: Asset) -> int | float:
    """Bytes per texel that a shader reads under one light."""
    return max(bytes_by_light(asset).values())


def kept_words(subject: Subject) -> str:
    """The asset's data per texel, as text."""
    return f"{family_of(subject.asset)} of {name_of(subject.asset)}"


def sizes(subject: Subject, asset_folder: Path | None) -> Table:
    """Size of capture and asset."""
    asset, capture = subject.asset, subject.capture
    raw = asset.stored.nbytes
    rows = (
        ("capture on disk", f"{bytes_text(folder_bytes(capture.folder))}, {len(capture.lights)} lights"),
        *([("asset on disk", bytes_text(folder_bytes(asset_folder)))] if asset_folder else []),
        ("data of the texels, uncompressed", f"{bytes_text(raw)}, {name_of(asset)}, {asset.encoding}"),
        ("train responses per stored number", f"{3 * len(capture.indices('train')) / method_of(asset).numbers_per_texel(asset):.1f}"),
        ("read by a shader", f"{read_bytes(asset)} bytes per texel"),
        ("resident on a GPU, with tables", bytes_text(asset.resident_bytes())),
    )
    return Table("Size", ("what", "how much"), rows)


def fit_facts(subject: Subject) -> Table:
    """The fit as recorded in the manifest."""
    asset = subject.asset
    spreads = np.array(spreads_of(asset))
    source = asset.manifest.get("source", {})
    rows = [
        ("method", f"{family_of(asset)}, {name_of(asset)}"),
        *([("spread Δ", spread_words(spreads))] if len(spreads) else []),
        *((name.replace("_", " "), _fact(value)) for name, value in light_facts(asset).items()),
        ("quantity, transport", f"{asset.manifest['quantity']}, {asset.manifest.get('transport', 'combined')}"),
    ]
    rows += [(name.replace("_", " "), _number(value)) for name, value in source.get("fit", {}).items()]
    rows += [
        (name.replace("_", " "), _number(value))
        for name, value in source.get("settings", {}).items()
        if name in ("centers", "ridge", "weighting")
    ]
    return Table("Fit", ("what", "value"), tuple(rows))


def spreads_of(asset: Asset) -> list[float]:
    """Spreads (rad) of the Gaussians in an asset's functions of direction; empty for other functions."""
    if "light_basis" in asset.manifest:
        return asset.manifest["light_basis"]["spreads"]
    return [asset.basis.spread] if asset.manifest.get("basis", {}).get("kind") == "gaussian" else []


def spread_words(spreads: np.ndarray) -> str:
    """One spread, or the range of several."""
    low, high = float(spreads.min()), float(spreads.max())
    if low == high:
        return f"{low:.4f} rad ({np.degrees(low):.1f}°)"
    return f"{low:.4f} to {high:.4f} rad ({np.degrees(low):.1f}° to {np.degrees(high):.1f}°)"


def errors(subject: Subject) -> Table:
    """Errors by role."""
    rows = []
    for role in ROLES:
        if role in subject.evaluation:
            e = subject.evaluation[role]
            count = len(subject.capture.indices(role))
            row = (
                role,
                str(count),
                f"{e['rmse']:.4g}",
                f"{100 * e['relative_rmse']:.2f} %",
                f"{e['psnr']:.2f} dB",
                f"{e['psnr_pooled']:.2f} dB",
            )
            rows.append(row)
    peak = subject.evaluation[subject.role]["peak"]
    return Table(f"Errors (peak {peak:.4g})", ("role", "lights", "rmse", "relative rmse", "psnr", "psnr pooled"), tuple(rows), numbers=True)


def split_errors(subject: Subject) -> list[Table]:
    """Errors with direct light added, if the evaluation has them: {`direct_ray`, `direct_shadow_map`: {role: RoleError}}."""
    rows = []
    for key, words in DIRECT_METHODS.items():
        for role in ROLES:
            if role in (found := subject.evaluation.get(key, {})):
                e = found[role]
                rows.append((words, role, f"{e['rmse']:.4g}", f"{100 * e['relative_rmse']:.2f} %", f"{e['psnr']:.2f} dB"))
    columns = ("indirect maps and", "role", "rmse", "relative rmse", "PSNR")
    return [Table("With the direct light added", columns, tuple(rows))] if rows else []


def border_figures(borders: ClusterBorders) -> Table:
    """Errors across cluster borders beside errors next to them."""
    rows = (
        ("error, rms", f"{borders.error_at_border:.4g}", f"{borders.error_beside:.4g}", f"{borders.error_ratio:.2f}"),
        ("jump of the error, rms", f"{borders.jump_at_border:.4g}", f"{borders.jump_beside:.4g}", f"{borders.jump_ratio:.2f}"),
    )
    title = f"Cluster borders ({borders.border:.1%} of neighboring texels; a ratio of 1 is invisible)"
    return Table(title, ("measure", "at borders", "beside them", "ratio"), rows, numbers=True)


def bytes_text(count: int) -> str:
    """A size in binary units."""
    for unit, power in (("GiB", 30), ("MiB", 20), ("KiB", 10)):
        if count >= 1 << power:
            return f"{count / (1 << power):.1f} {unit}"
    return f"{count} bytes"


def _fact(value: object) -> str:
    """A fact of lights: a box of places, a table of them, or a word."""
    if isinstance(value, dict) and "low" in value:
        return f"{place_text(value['low'])} to {place_text(value['high'])} m"
    if isinstance(value, dict) and "nodes" in value:
        nodes = " × ".join(str(count) for count in value["nodes"])
        return f"{nodes} nodes, {value['spacing']:.2f} m apart, rank {value['rank']}, {bytes_text(value['bytes'])}"
    return str(value)


def _number(value: object) -> str:
    if value is None:
        return "infinite"
    if isinstance(value, dict):
        return ", ".join(f"{name} {_number(part)}" for name, part in value.items())
    return f"{value:.4g}" if isinstance(value, float) else str(value)
