"""`srbf export`: an asset in another form."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Literal

import typer

from srbf.asset import MANIFEST, Asset
from srbf.cli.parameters import AssetFolder, Force, Json, Output, parse_levels
from srbf.cli.terminal import note, print_json
from srbf.errors import InputError
from srbf.evaluation.errors_by_role import MAX_PSNR
from srbf.export import TARGETS, Report, Settings, check_target
from srbf.export import export as export_asset
from srbf.fitting.fewer_maps import keep as keep_fewer
from srbf.io.files import check_replaceable

MIB = 1 << 20


def export(
    asset: AssetFolder,
    output: Output,
    target: Annotated[str | None, typer.Option(help=f"What to write: {', '.join(TARGETS)}.", show_default=False)] = None,
    keep: Annotated[
        int | None, typer.Option(help="How many maps, or scalars of an eigen map, to project the asset on before.", show_default=False)
    ] = None,
    encoding: Annotated[
        Literal["half", "float", "uint8", "bc7", "bc1"] | None,
        typer.Option(help="Of the layers: the target's own unless given, without a target the asset's.", show_default=False),
    ] = None,
    levels: Annotated[
        str, typer.Option(help="Mip levels of dds and ktx2, the full size included; 0 or 1: none below it; auto: as charts allow.")
    ] = "auto",
    min_psnr: Annotated[
        float | None, typer.Option(help="Least PSNR, in dB, of the export relit against the asset relit; below it nothing is written.")
    ] = None,
    mesh: Annotated[
        Path | None, typer.Option(help="A .glb whose lightmap UV set gltf takes, instead of the asset's texels.", show_default=False)
    ] = None,
    force: Force = False,
    json: Json = False,
) -> None:
    """Write an asset as an engine loads it, or one of fewer maps: quality for memory, without the capture."""
    if target is None and keep is None:
        raise typer.BadParameter("expected --target or --keep, found neither")
    if target is None and (levels != "auto" or min_psnr is not None or mesh is not None or json):
        raise typer.BadParameter("expected --target with --levels, --min-psnr, --mesh and --json, found none")
    if target is not None:
        check_target(target)
    check_replaceable(output, force, MANIFEST)
    opened = Asset.open(asset)
    if target is None:
        assert keep is not None
        if encoding == "bc7" or encoding == "bc1":
            raise InputError(f"expected --encoding {encoding} with --target dds or ktx2, found it without a target")
        kept = keep_fewer(opened, keep, encoding)
        kept.save(output, force)
        note(_kept(kept, keep))
        return
    if keep is not None:
        opened = keep_fewer(opened, keep, "float")
        note(_kept(opened, keep))
    report = export_asset(opened, target, output, Settings(encoding, parse_levels(levels), mesh), force, min_psnr)
    if json:
        print_json(asdict(report))
        return
    for line in (*report.notes, *_summary(report, opened)):
        note(line)


def _kept(kept: Asset, keep: int) -> str:
    lost = kept.manifest["source"]["kept"].get("relative_residual")
    change = "" if lost is None else f", relative change {lost:.3g} over the domain"
    return f"kept {keep} of {kept.manifest['source']['kept']['of']}: {kept.bytes_per_texel()['directional']} bytes a texel{change}"


def _summary(report: Report, asset: Asset) -> list[str]:
    mips = "no mip levels" if report.levels == 1 else f"{report.levels} levels"
    with_mips = "" if report.levels == 1 else f", {report.bytes_per_texel_resident:.4g} with its mip levels"
    return [
        f"{report.target}: {len(asset.stored)} layers of {report.encoding}, {mips}, {report.disk_bytes / MIB:.2f} MiB on disk",
        f"GPU: {report.bytes_per_texel:g} bytes a texel{with_mips}; layers {report.layer_bytes / MIB:.2f} MiB, "
        f"all {report.resident_bytes / MIB:.2f} MiB",
        "relit, nothing is lost of the asset as given"
        if report.psnr >= MAX_PSNR
        else f"relit PSNR {report.psnr:.2f} dB against the asset as given",
    ]
