"""`srbf evaluate`: an asset against its capture's images, or against true point lights inside its scene."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from srbf.asset import Asset
from srbf.bake.point_reference import compare_with_point_lights
from srbf.capture import Capture
from srbf.captured_light import ROLES
from srbf.cli.method_flags import FitCommand, with_method_flags
from srbf.cli.parameters import AssetFolder, Blender, Json
from srbf.cli.terminal import note, print_json, progress_bar
from srbf.cli.values import COUNT, COUNT_OR_NONE
from srbf.evaluation.environment_errors import environment_errors
from srbf.evaluation.errors_by_role import evaluate as evaluate_capture
from srbf.evaluation.glossy_errors import glossy_errors
from srbf.evaluation.leave_one_out import leave_one_out as errors_left_out
from srbf.evaluation.random_mixes import mix_errors
from srbf.evaluation.viewer_errors import viewer_errors, viewer_line
from srbf.fitting.options import method_for
from srbf.light_domain import domain_of_capture
from srbf.methods.environment_table import has_environment_table
from srbf.methods.glossy_eigen_map import GlossyEigenMap
from srbf.relighting.direct_light import Added, chosen

COMMAND = FitCommand


@with_method_flags
def evaluate(
    asset: AssetFolder,
    method: str | None,
    settings: dict[str, Any],
    reference: Annotated[
        Path | None,
        typer.Argument(metavar="REFERENCE", help="A capture's folder; with --point-reference the .blend it came from.", show_default=False),
    ] = None,
    leave_one_out: Annotated[
        bool, typer.Option("--leave-one-out", help="ASSET is a CAPTURE: fit it to all lights but one, for each, by the flags of srbf fit.")
    ] = False,
    point_reference: Annotated[
        int | None,
        typer.Option(
            metavar="COUNT", parser=COUNT, help="Compare with so many true point lights of Cycles inside the scene.", show_default=False
        ),
    ] = None,
    direct: Annotated[
        Literal["none", "ray", "shadow-map", "pca"] | None,
        typer.Option(
            help="Direct light added to an indirect asset, to compare with the combined response; default none, with point lights ray.",
            show_default=False,
        ),
    ] = None,
    samples: Annotated[int, typer.Option(metavar="COUNT", parser=COUNT, help="Samples per texel of --point-reference.")] = 64,
    seed: Annotated[int, typer.Option(metavar="NUMBER", parser=COUNT_OR_NONE, help="Random seed of the point lights' positions.")] = 0,
    blender: Blender = None,
    json: Json = False,
) -> None:
    """Print the error by role, by distance from true point lights, or at lights left out of a fit."""
    if leave_one_out:
        if reference is not None or point_reference is not None or direct is not None:
            raise typer.BadParameter(
                "expected --leave-one-out CAPTURE and flags of srbf fit, found a second path, --point-reference or --direct"
            )
        with progress_bar("leave one out") as update:
            _print_errors(errors_left_out(Capture.open(asset), lambda c: method_for(c, method, settings).encode(c), update), json)
        return
    if reference is None:
        raise typer.BadParameter("expected an asset and a capture, found one path; or add --leave-one-out to fit a capture")
    if method is not None or settings:
        raise typer.BadParameter("expected flags of srbf fit with --leave-one-out alone, found them with an asset that is fitted already")
    opened = Asset.open(asset)
    if point_reference is not None:
        with Added(opened, chosen(opened, direct)) as added, progress_bar("point lights") as update:
            point_lights = compare_with_point_lights(
                opened, reference, point_reference, samples, seed, update, note, blender, added.response
            )
        if json:
            print_json(point_lights | {"lamps": point_lights["point_lights"]})  # its former key, for one version; words: ok
            return
        typer.echo(f"{point_reference} true point lights against the point relighter, relative RMSE (at the best scale of each falloff)")
        typer.echo(f"{'distance, m':>16} {'inverse-square':>18} {'linear':>18} {'texels':>10}")
        for row in point_lights["by_distance"]:
            cells = [f"{row[name]['relative_rmse']:.3f} ({row[name]['scaled']:.3f})" for name in ("inverse-square", "linear")]
            typer.echo(f"{row['from']:7.2f} – {row['to']:6.2f} {cells[0]:>18} {cells[1]:>18} {row['texels']:>10}")
        return
    images = Capture.open(reference)
    with progress_bar("evaluate") as update:
        result = evaluate_capture(opened, images, update, direct or "none")
    if domain_of_capture(images).is_inside:
        _add_means(result)
    if domain_of_capture(images).kind == "named" and direct in (None, "none"):
        result["mixes"] = mix_errors(opened, images).as_dict()
    if "harmonics" in opened.manifest and images.gloss is not None:
        result["viewers"] = viewer_errors(opened, images)
    if opened.method == GlossyEigenMap.name and images.gloss_terms is not None:
        result["viewers"] = glossy_errors(opened, images)
    if has_environment_table(opened) and "surfels" in images.manifest:
        result["environments"] = environment_errors(opened, images)
    _print_errors(result, json)


def _add_means(result: dict[str, Any]) -> None:
    """The mean relative RMSE over the lights of each role, beside the pooled one; not of lights that do not say theirs."""
    for role in ROLES:
        values = [light["relative_rmse"] for light in result["lights"] if light["role"] == role and "relative_rmse" in light]
        if role in result and values:
            result[role]["relative_rmse_mean"] = sum(values) / len(values)


def _print_errors(result: dict[str, Any], json: bool) -> None:
    if json:
        print_json(result)
        return
    with_mean = any("relative_rmse_mean" in error for error in result.values() if isinstance(error, dict))
    mean = f"{'mean':>8}" if with_mean else ""
    typer.echo(f"{'role':<14}{'lights':>7}{'rmse':>12}{'relative':>10}{mean}{'PSNR, dB':>10}{'pooled':>8}{'peak':>8}")
    for role, error in result.items():
        if role not in ("lights", "mixes", "viewers", "environments"):
            count = sum(light["role"] == role for light in result["lights"])
            mean = f"{error['relative_rmse_mean']:>8.4f}" if with_mean else ""
            typer.echo(
                f"{role:<14}{count:>7}{error['rmse']:>12.5g}{error['relative_rmse']:>10.4f}{mean}{error['psnr']:>10.2f}"
                f"{error['psnr_pooled']:>8.2f}{error['peak']:>8.3g}"
            )
    for role, error in result.items():
        if role in ("validation", "holdout") and "noise" in error:
            typer.echo(f"{role}: the references have noise of about {error['noise']:.4f}, relative, which the error includes")
    for role, error in result.get("viewers", {}).items():
        typer.echo(f"{role} lights toward random viewers: {viewer_line(error)}")
    if "environments" in result:
        found = result["environments"]
        by_rays = f", against rays {found['rays']:.4f}" if "rays" in found else ""
        typer.echo(
            f"bounces of {found['count']} half bright environments: relative {found['relative_rmse']:.4f} against the capture's form "
            f"factors, {found['worst']:.4f} at worst{by_rays}"
        )
    if "mixes" in result:
        mixes = result["mixes"]
        typer.echo(
            f"{mixes['count']} random mixes: PSNR {mixes['psnr']:.2f} dB in the mean, {mixes['worst']:.2f} dB at worst, "
            f"relative {mixes['relative_rmse']:.4f}, peak {mixes['peak']:.3g}"
        )
