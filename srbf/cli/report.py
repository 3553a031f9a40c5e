"""`srbf report`: pictures and figures of an asset and its capture."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path
from typing import Annotated, Any

import typer

from srbf.asset import Asset
from srbf.capture import Capture
from srbf.captured_light import ROLES
from srbf.cli.parameters import AssetFolder, CaptureFolder, Force
from srbf.cli.relight import check_image_output
from srbf.cli.terminal import note, progress_bar
from srbf.errors import SrbfError
from srbf.evaluation.errors_by_role import evaluate
from srbf.io.files import atomic_folder, check_replaceable, write_text
from srbf.relighting.direct_light import Direct

PAGE = "index.html"
WITH_DIRECT: dict[str, Direct] = {"direct_ray": "ray", "direct_shadow_map": "shadow-map"}


def report(
    asset: AssetFolder,
    capture: CaptureFolder,
    output: Annotated[
        Path,
        typer.Option(
            "-o", "--output", metavar="PATH", help="OUT.html, or a folder that gets the pictures as files too.", show_default=False
        ),
    ],
    force: Force = False,
) -> None:
    """Write one page to look at: errors at held-out lights, in motion, by bytes, on mixes or over places, and figures, all inside it."""
    from srbf.report import check_domains, write_report

    single = output.suffix.lower() in (".html", ".htm")
    if single:
        check_image_output(output, force)
    else:
        check_replaceable(output, force, PAGE)
    opened, images = Asset.open(asset), Capture.open(capture)
    check_domains(opened, images)
    started = time.perf_counter()
    with progress_bar("evaluate") as update:
        errors = evaluate(opened, images, update)
    errors |= _with_direct(opened, images)
    timings = {"evaluate, all lights": time.perf_counter() - started}
    with progress_bar("report") as update:
        if single:
            with tempfile.TemporaryDirectory(prefix="srbf-") as name:
                page = write_report(opened, images, Path(name), evaluation=errors, timings=timings, asset_folder=asset, progress=update)
                write_text(output, page.read_text(encoding="utf-8"))
        else:
            with atomic_folder(output, force, PAGE) as folder:
                write_report(opened, images, folder, evaluation=errors, timings=timings, asset_folder=asset, progress=update)
    note(f"wrote {output if single else output / PAGE}")


def _with_direct(asset: Asset, capture: Capture) -> dict[str, Any]:
    """Errors of an indirect asset on the least seen role once its direct light is added, exact and as an engine would; noted where not."""
    found: dict[str, Any] = {}
    if asset.transport != "indirect":
        return found
    role = next(role for role in ROLES[::-1] if capture.indices(role))
    if not capture.has_direct_of((role,)):
        note(f"no errors with direct light: {capture.folder} has no direct images of its {role} lights")
        return found
    tested, as_role = capture, role
    if not capture.has_direct:  # patches have no direct light: the peak is that of the tested lights
        tested, as_role = capture.with_roles(["train" if light.role == role else None for light in capture.lights]), "train"
    for key, direct in WITH_DIRECT.items():
        try:
            found[key] = {role: evaluate(asset, tested, direct=direct, roles=(as_role,))[as_role]}
        except SrbfError as error:
            note(f"no errors with --direct {direct}: {error}")
    return found
