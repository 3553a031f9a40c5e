"""`srbf export`: an asset in another form."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from srbf.asset import MANIFEST, Asset
from srbf.cli.parameters import AssetFolder, Force, Json, Output
from srbf.cli.terminal import note, print_json
from srbf.cli.values import AUTO_OR_LEVELS, COUNT, Number, Parsed
from srbf.evaluation.errors_by_role import MAX_PSNR
from srbf.export import TARGETS, Report, Settings, check_target
from srbf.export import export as export_asset
from srbf.fitting.fewer_maps import keep as keep_fewer
from srbf.io.files import check_replaceable

MIB = 1 << 20
FORMER_TARGETS = {"uint8": "png"}  # accepted for one version


def _target(name: str) -> str:
    name = FORMER_TARGETS.get(name, name)
    check_target(name)
    return name


def export(
    asset: AssetFolder,
    output: Output,
    target: Annotated[
        str | None, typer.Option(metavar="TARGET", parser=Parsed(_target), help=f"What to write: {', '.join(TARGETS)}.", show_default=False)
    ] = None,
    reduce_to: Annotated[
        int | None,
        typer.Option(
            metavar="COUNT",
            parser=COUNT,
            help="Project the asset first on so many maps, or components of an eigen map.",
            show_default=False,
        ),
    ] = None,
    encoding: Annotated[
        Literal["half", "float", "uint8", "bc7", "bc1"] | None,
        typer.Option(help="Of the layers: the target's own unless given, without a target the asset's.", show_default=False),
    ] = None,
    mip_levels: Annotated[
        Any,
        typer.Option(
            metavar="COUNT",
            parser=AUTO_OR_LEVELS,
            help="Mip levels of dds and ktx2, the full size included; 0 or 1: none below it; auto: as charts allow.",
        ),
    ] = "auto",
    min_psnr: Annotated[
        float | None,
        typer.Option(
            metavar="DECIBELS",
            parser=Number(),
            help="Least PSNR, in dB, of the export relit against the asset relit; below it nothing is written.",
            show_default=False,
        ),
    ] = None,
    mesh: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="A .glb whose lightmap UV set gltf takes, instead of the asset's texels.", show_default=False),
    ] = None,
    force: Force = False,
    json: Json = False,
) -> None:
    """Write an asset as an engine loads it, or one of fewer maps: quality for memory, without the capture."""
    if target is None and reduce_to is None:
        raise typer.BadParameter("expected --target or --reduce-to, found neither")
    if target is None and (mip_levels != "auto" or min_psnr is not None or mesh is not None or json):
        raise typer.BadParameter("expected --target with --mip-levels, --min-psnr, --mesh and --json, found none")
    if target is None and encoding in ("bc7", "bc1"):
        raise typer.BadParameter(f"expected --encoding {encoding} with --target dds or ktx2, found it without a target")
    check_replaceable(output, force, MANIFEST)
    opened = Asset.open(asset)
    if target is None:
        assert reduce_to is not None and encoding != "bc7" and encoding != "bc1"
        kept = keep_fewer(opened, reduce_to, encoding)
        kept.save(output, force)
        note(_kept(kept, reduce_to))
        return
    if reduce_to is not None:
        opened = keep_fewer(opened, reduce_to, "float")
        note(_kept(opened, reduce_to))
    report = export_asset(opened, target, output, Settings(encoding, mip_levels, mesh), force, min_psnr)
    if json:
        print_json(asdict(report))
        return
    for line in (*report.notes, *_summary(report, opened)):
        note(line)


def _kept(kept: Asset, count: int) -> str:
    lost = kept.manifest["source"]["kept"].get("relative_residual")
    change = "" if lost is None else f", relative change {lost:.3g} over the domain"
    return f"kept {count} of {kept.manifest['source']['kept']['of']}: {kept.bytes_per_texel()['directional']} bytes per texel{change}"


def _summary(report: Report, asset: Asset) -> list[str]:
    mips = "no mip levels" if report.levels == 1 else f"{report.levels} levels"
    with_mips = "" if report.levels == 1 else f", {report.bytes_per_texel_resident:.4g} with its mip levels"
    return [
        f"{report.target}: {len(asset.stored)} layers of {report.encoding}, {mips}, {report.disk_bytes / MIB:.2f} MiB on disk",
        f"GPU: {report.bytes_per_texel:g} bytes per texel{with_mips}; layers {report.layer_bytes / MIB:.2f} MiB, "
        f"all {report.resident_bytes / MIB:.2f} MiB",
        "relit, nothing is lost of the asset as given"
        if report.psnr >= MAX_PSNR
        else f"relit PSNR {report.psnr:.2f} dB against the asset as given",
    ]
