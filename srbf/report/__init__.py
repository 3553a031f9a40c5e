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
from srbf.light_domain import domain_of_asset, domain_of_capture
from srbf.lights import Light
from srbf.methods import Method, method_of
from srbf.report.directions_report import DirectionsReport
from srbf.report.domain_report import DomainReport
from srbf.report.names_report import NamesReport
from srbf.report.page import write_page
from srbf.report.places_report import PlacesReport
from srbf.report.section import Figure
from srbf.report.subject import Picture, gather

REPORTS: dict[str, type[DomainReport]] = {kind: report for report in (DirectionsReport, NamesReport, PlacesReport) for kind in report.kinds}
REPORT_FILES = (
    "contact_sheet.png",
    "animation.webp",
    "animation.gif",
    "sum_of_maps.png",
    "point_light.png",
    "point_strip.png",
    "spot_strip.png",
    "abrdf_tiles.png",
    "centers.png",
    "r_curve.png",
    "error_by_light.png",
    "report.md",
    "index.html",
)  # of any version and kind of the report


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
    """Write the report on an asset against its capture: figures, report.md, and index.html, which contains them all.

    Parameters
    ----------
    asset
        Of the capture's size in texels.
    capture
        The references, under lights of the asset's light domain: directions, names, or places inside the scene.
    folder
        Made where it is missing. Files of an earlier report in it are replaced.
    evaluation
        The result of `srbf.evaluate` for this asset and capture, of all roles.
    timings
        Seconds by step.
    demo_lights
        Point and spot lights to show instead of derived ones; other kinds are ignored.
    asset_folder
        The saved asset, for its size on disk.
    methods
        Are fitted to a sample of the capture and compared. By default those of `compared_methods`.
    progress
        Called with (steps done, steps in all).

    Returns
    -------
    Path
        Of index.html. Where the asset lacks the data of a figure, the page gives the reason.

    Raises
    ------
    InputError
        On sizes that differ, on lights of another domain than the asset's, and on an evaluation of other lights than the capture's.
    MissingLibraryError
        Without matplotlib.

    Examples
    --------
    `write_report(asset, capture, folder / "report", evaluation=evaluate(asset, capture))` writes a whole report. The evaluation must be of
    all lights of the capture:

    >>> write_report(asset, capture, folder / "report", evaluation=evaluate(asset, capture, roles=["holdout"]))
    Traceback (most recent call last):
    srbf.errors.InputError: expected an evaluation of the 48 lights of ..., found others; evaluate again
    """
    folder = Path(folder)
    check_domains(asset, capture)
    if (asset.width, asset.height) != (capture.width, capture.height):
        found = f"{capture.width}x{capture.height}"
        raise InputError(f"expected a capture of the asset's {asset.width}x{asset.height} texels, found {found}")
    if {entry["file"] for entry in evaluation.get("lights", [])} != {light.file for light in capture.lights}:
        raise InputError(f"expected an evaluation of the {len(capture.lights)} lights of {capture.folder}, found others; evaluate again")
    files.make_folder(folder)
    for name in REPORT_FILES:
        (folder / name).unlink(missing_ok=True)
    subject = gather(asset, capture, evaluation, demo_lights)
    kind = REPORTS[subject.domain.kind]
    compared = [method for method in (compared_methods() if methods is None else methods) if subject.domain.kind in method.domains]
    steps = kind.steps + kind.drawings
    report = kind.measured(subject, compared, lambda done, total: progress(done, steps))
    pictures = []
    for figure in report.figures():
        pictures.append(_draw(figure, folder))
        progress(kind.steps + len(pictures), steps)
    return write_page(subject, report, folder, pictures, timings, asset_folder)


def check_domains(asset: Asset, capture: Capture) -> None:
    """InputError where the lights of a capture are not those that an asset is a function of, and for methods without a report."""
    if not method_of(asset).has_report:
        raise InputError(f"expected an asset that a report shows, found a {asset.method} one; `srbf evaluate` gives its errors")
    domain = domain_of_asset(asset.manifest)
    if domain_of_capture(capture).kind != domain.kind:
        wanted = " or ".join(domain.captured_kinds)
        raise InputError(f"expected a capture under {wanted} lights, as the asset's are, found {capture.kind} lights in {capture.folder}")


def _draw(figure: Figure, folder: Path) -> Picture:
    if figure.missing is not None:
        return Picture(figure.file, figure.title, figure.missing, omitted=True)
    try:
        return figure.draw(folder)
    except MissingLibraryError as error:
        if not figure.optional:
            raise
        return Picture(figure.file, figure.title, f"Not drawn: {error}.", omitted=True)
