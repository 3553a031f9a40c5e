"""`srbf report`: pictures and figures of an asset and its capture."""

from __future__ import annotations

from srbf.asset import Asset
from srbf.capture import Capture
from srbf.cli.parameters import AssetFolder, CaptureFolder, Force, Output
from srbf.cli.terminal import note, progress_bar
from srbf.evaluation import evaluate
from srbf.files import atomic_folder, check_replaceable
from srbf.report import write_report


def report(asset: AssetFolder, capture: CaptureFolder, output: Output, force: Force = False) -> None:
    """Write a folder to look at: contact sheet, the article's figures, errors, and a page (index.html)."""
    check_replaceable(output, force, "index.html")
    opened, images = Asset.open(asset), Capture.open(capture)
    with progress_bar("evaluate") as update:
        errors = evaluate(opened, images, update)
    with atomic_folder(output, force, "index.html") as folder:
        write_report(opened, images, folder, evaluation=errors, asset_folder=asset)
    note(f"wrote {output / 'index.html'}")
