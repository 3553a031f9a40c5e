"""An asset in the form that an engine loads: one target per file, each a function write(asset, folder, settings)."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

from srbf.asset import MANIFEST, Asset
from srbf.errors import InputError
from srbf.export.loss import relit_psnr
from srbf.export.settings import PLAIN, Settings, Target, Written
from srbf.info import folder_bytes
from srbf.io.files import atomic_folder, check_replaceable, checksums, write_json
from srbf.methods import method_of

__all__ = ["TARGETS", "Report", "Settings", "Target", "Written", "check_target", "export"]

TARGETS: dict[str, str] = {  # by name: the module whose `write` fills a folder, imported when it is asked for
    **{name: f"srbf.export.{name}" for name in ("exr", "png", "dds", "ktx2", "gltf")},
    **{name: f"srbf.export.{name}" for name in ("godot", "unity", "unreal", "hlsl", "metal", "wgsl")},
    "web": "srbf.viewer.site",
}


@dataclass(frozen=True)
class Report:
    """Quality and cost of an export.

    `psnr` (dB) compares its relit pictures with the asset's (`loss.relit_psnr`). `bytes_per_texel` is what a shader reads of a
    texel's own layers, `bytes_per_texel_resident` the layers' GPU memory per texel, mip levels included; `layer_bytes` that
    of all texels, `resident_bytes` everything, tables and geometry included.
    """

    target: str
    encoding: str
    levels: int
    psnr: float
    bytes_per_texel: int | float
    bytes_per_texel_resident: float
    layer_bytes: int
    resident_bytes: int
    disk_bytes: int
    notes: tuple[str, ...]


def check_target(target: str) -> None:
    """InputError on an unknown target."""
    if target not in TARGETS:
        raise InputError(f"expected a target of {', '.join(TARGETS)}, found {target!r}")


def export(
    asset: Asset, target: str, folder: Path, settings: Settings = PLAIN, force: bool = False, min_psnr: float | None = None
) -> Report:
    """Write an asset in the form that an engine loads; the loss is measured on the files as read back, and recorded in `source.export`.

    Parameters
    ----------
    asset
        What `srbf.fit` made, or `Asset.open` read.
    target
        One of `TARGETS`: `exr`, `png`, `dds`, `ktx2`, `gltf`, `godot`, `unity`, `unreal`, `hlsl`, `metal`, `wgsl` or `web`.
    folder
        Written atomically; `Asset.open` reads it.
    settings
        Encoding of the layers, mip levels, and a mesh for targets that write one.
    force
        Replace an asset that is there.
    min_psnr
        The least PSNR (dB) of the exported asset against `asset` that is accepted.

    Returns
    -------
    Report
        PSNR (dB), bytes per texel, bytes in memory and on disk, and the target's notes.

    Raises
    ------
    InputError
        On an unknown target, an asset that no engine can read, settings that the target cannot have, and where the PSNR is below
        `min_psnr`; nothing is written then.
    OutputExistsError
        Where the folder exists and `force` is not set, or it holds something else than an asset.

    Examples
    --------
    >>> from srbf.export import export
    >>> report = export(asset, "dds", folder / "dds")
    >>> report.target, report.encoding, report.bytes_per_texel
    ('dds', 'bc7', 9)
    >>> Asset.open(folder / "dds").k
    9
    """
    check_target(target)
    if not method_of(asset).exportable:
        raise InputError(
            f"expected an asset that engines can read, found a {asset.method} one; relight it by `srbf relight`, or fit another method"
        )
    check_replaceable(folder, force, MANIFEST)
    with atomic_folder(folder, force, MANIFEST) as temporary:
        write: Target = import_module(TARGETS[target]).write
        written = write(asset, temporary, settings)
        exported = Asset.open(temporary)
        psnr = relit_psnr(asset, exported)
        if min_psnr is not None and not psnr >= min_psnr:
            raise InputError(
                f"expected at least {min_psnr:g} dB of {target} as {exported.encoding}, found {psnr:.2f}; "
                "nothing was written: take a larger `encoding`, or lower `min_psnr`"
            )
        source = exported.manifest.setdefault("source", {})
        source["export"] = {**source.get("export", {}), "target": target, "psnr": round(psnr, 3), "notes": list(written.notes)}
        exported.manifest["sha256"] = checksums(temporary, MANIFEST)  # including files that the target has added
        write_json(temporary / MANIFEST, exported.manifest)
        disk = folder_bytes(temporary)
    return Report(
        target=target,
        encoding=exported.encoding,
        levels=exported.levels,
        psnr=psnr,
        bytes_per_texel=exported.bytes_per_texel()["directional"],
        bytes_per_texel_resident=exported.layer_bytes() / (exported.width * exported.height),
        layer_bytes=exported.layer_bytes(),
        resident_bytes=exported.resident_bytes(),
        disk_bytes=disk,
        notes=written.notes,
    )
