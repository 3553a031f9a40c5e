"""The report on an asset against its capture: figures, and one page that holds them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from srbf.asset import Asset
from srbf.capture import Capture
from srbf.errors import InputError, MissingLibraryError
from srbf.evaluation.rate_distortion import compared_methods
from srbf.io import files
from srbf.lights import Light
from srbf.methods import Method
from srbf.report.abrdf_mosaic import abrdf_tiles
from srbf.report.contact_sheet import contact_sheet
from srbf.report.findings import measure
from srbf.report.maps import sum_of_maps
from srbf.report.page import write_page
from srbf.report.point_light import point_light
from srbf.report.sphere import centers, r_curve
from srbf.report.strips import animation, point_strip, spot_strip
from srbf.report.subject import Picture, Subject, gather

MAPS, POSITION = "maps", "position"  # requirements of a figure on the asset
Draw = Callable[[Subject, Path], Picture]
REASONS = {
    MAPS: "Not drawn: this picture shows the terms of a relighting map of Gaussians, and the asset holds other functions.",
    POSITION: "Not drawn: the asset has no position map (photographs never have one), which a point light needs.",
}
FIGURES: tuple[tuple[str, str, Draw, tuple[str, ...]], ...] = (  # file, title, function, requirements
    ("contact_sheet.png", "Reference against relit", contact_sheet, ()),
    ("animation.webp", "In motion", animation, ()),
    ("sum_of_maps.png", "A sum of maps", sum_of_maps, (MAPS,)),
    ("point_light.png", "A point light", point_light, (MAPS, POSITION)),
    ("point_strip.png", "Point lights", point_strip, (POSITION,)),
    ("spot_strip.png", "Spot lights", spot_strip, (POSITION,)),
    ("abrdf_tiles.png", "ABRDF tiles", abrdf_tiles, ()),
    ("centers.png", "Centers and lights", centers, (MAPS,)),
    ("r_curve.png", "The curve R", r_curve, (MAPS,)),
)
REPORT_FILES = (
    *(file for file, *_ in FIGURES),
    "error_by_light.png",
    "animation.gif",
    "report.md",
    "index.html",
)  # of any version of the report


def write_report(
    asset: Asset,
    capture: Capture,
    folder: Path | str,
    *,
    evaluation: dict[str, Any],
    timings: Mapping[str, float] | None = None,
    demo_lights: Sequence[Light] | None = None,
    asset_folder: Path | None = None,
    methods: Sequence[Method] | None = None,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> Path:
    """Write the figures, report.md and index.html into `folder`; returns the path of index.html, which contains all figures.

    `evaluation` is the result of `srbf.evaluation.errors_by_role.evaluate` for this asset and capture. `timings` are seconds by step.
    `demo_lights` are point and spot lights to show instead of derived ones; other kinds are ignored. `asset_folder` is the saved asset,
    for its size on disk. `methods` are fitted to a sample of the capture and compared. Replaces the files of an earlier report.
    If the asset lacks the data of a figure, the page gives the reason. InputError if sizes or lights do not match, MissingLibraryError
    without matplotlib.
    """
    folder = Path(folder)
    if (asset.width, asset.height) != (capture.width, capture.height):
        found = f"{capture.width}x{capture.height}"
        raise InputError(f"expected a capture of the asset's {asset.width}x{asset.height} texels, found {found}")
    if {entry["file"] for entry in evaluation.get("lights", [])} != {light.file for light in capture.lights}:
        raise InputError(f"expected an evaluation of the {len(capture.lights)} lights of {capture.folder}, found others; evaluate again")
    files.make_folder(folder)
    for name in REPORT_FILES:
        (folder / name).unlink(missing_ok=True)
    subject = gather(asset, capture, evaluation, demo_lights)
    steps = 4 + len(FIGURES)
    findings = measure(subject, compared_methods() if methods is None else methods, lambda done, total: progress(done, steps))
    pictures = []
    for entry in FIGURES:
        pictures.append(_draw(subject, folder, *entry))
        progress(4 + len(pictures), steps)
    return write_page(subject, findings, folder, pictures, timings, asset_folder)


def _draw(subject: Subject, folder: Path, file: str, title: str, draw: Draw, needs: tuple[str, ...]) -> Picture:
    has = {MAPS: subject.asset.manifest.get("basis", {}).get("kind") == "gaussian", POSITION: bool(subject.points)}
    for need in needs:
        if not has[need]:
            return Picture(file, title, REASONS[need], omitted=True)
    if draw is animation:
        try:
            return draw(subject, folder)
        except MissingLibraryError as error:
            return Picture(file, title, f"Not drawn: {error}.", omitted=True)
    return draw(subject, folder)
