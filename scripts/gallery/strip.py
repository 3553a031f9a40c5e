"""The strip of a scene: rendered and relit images side by side under held-out lights."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy import ndarray
from PIL import Image, ImageDraw

from scripts.gallery import drawing
from scripts.gallery.drawing import INK, SOFT, font
from scripts.gallery.paths import ScenePaths
from srbf.asset import Asset
from srbf.capture import Capture
from srbf.evaluation.errors_by_role import psnr
from srbf.io import files
from srbf.methods import responses as asset_responses
from srbf.relighting.direct_light import Added
from srbf.sphere import normalize

MIN_WIDTH, MAX_WIDTH = 160, 384  # pixels of one image
GAP, HEADING, UNDER, SIDE = 8, 30, 24, 74


@dataclass(frozen=True)
class Row:
    """One light: the glyph and text beside its images, the images with a line under each, and their common exposure."""

    glyph: Image.Image | None
    beside: tuple[str, ...]
    pictures: tuple[ndarray, ...]
    under: tuple[str, ...]
    gain: float


def draw(paths: ScenePaths) -> None:
    """Write the strip: one row per light, the rendered image first, then each fit's with its PSNR."""
    scene = paths.scene
    capture = Capture.open(paths.capture).combined()
    chosen = tested_lights(capture, scene.tested)
    responses = [relit(paths, fit_index, capture, chosen) for fit_index in range(len(scene.fits))]
    errors = [files.read_json(paths.errors(fit)) for fit in scene.fits]
    rows = []
    for n, index in enumerate(chosen):
        direction, file = capture.directions([index])[0], capture.lights[index].file
        reference = np.maximum(capture.image(index), 0)
        under = ["held out"]
        for error in errors:
            (rmse,) = [light["rmse"] for light in error["lights"] if light["file"] == file]
            under.append(f"{psnr(error['holdout']['peak'], rmse):.1f} dB")
        elevation = np.degrees(np.arcsin(direction[2]))
        rows.append(
            Row(
                drawing.sun(direction, SIDE - 14),
                (f"{elevation:.0f}° high",),
                (reference, *(response[n] for response in responses)),
                tuple(under),
                drawing.gain_of(reference),
            )
        )
    headings = ["photographed" if scene.dome else "rendered by Cycles", *(fit.label for fit in scene.fits)]
    drawing.save(sheet(headings, rows), paths.strip)


def tested_lights(capture: Capture, wanted: Sequence[tuple[float, float]]) -> list[int]:
    """Index of the held-out light nearest to each (azimuth, elevation) in degrees, none twice."""
    indices = capture.indices("holdout")
    directions = capture.directions(indices)
    chosen: list[int] = []
    for azimuth, elevation in np.radians(wanted):
        aim = normalize(np.array([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]))
        order = np.argsort(-(directions @ aim))
        chosen.append(next(indices[i] for i in order if indices[i] not in chosen))
    return chosen


def relit(paths: ScenePaths, fit_index: int, capture: Capture, chosen: Sequence[int]) -> list[ndarray]:
    """A fit's images under some of the capture's lights, with direct light where the fit leaves it out."""
    fit = paths.scene.fits[fit_index]
    asset = Asset.open(paths.asset(fit))
    directions = capture.directions(chosen)
    with Added(asset, fit.direct) as added:
        direct = added.directional(directions)
        return list(np.maximum(asset_responses(asset, directions) + direct, 0))


def sheet(headings: Sequence[str], rows: Sequence[Row]) -> Image.Image:
    """Rows of images under headings on white."""
    height, width = rows[0].pictures[0].shape[:2]
    w = min(MAX_WIDTH, max(MIN_WIDTH, width))
    h = round(w * height / width)
    paper = Image.new("RGB", (SIDE + len(headings) * (w + GAP), HEADING + len(rows) * (h + UNDER)), "white")
    pen = ImageDraw.Draw(paper)
    for column, heading in enumerate(headings):
        x = SIDE + column * (w + GAP)
        pen.text((x, HEADING - 8), heading, font=font(15), fill=INK, anchor="ls")
    for n, row in enumerate(rows):
        y = HEADING + n * (h + UNDER)
        if row.glyph is not None:
            drawing.paste(paper, row.glyph, 4, y)
        for line, text in enumerate(row.beside):
            pen.text((4, y + SIDE + 4 + 16 * line), text, font=font(12), fill=SOFT, anchor="ls")
        for column, (linear, under) in enumerate(zip(row.pictures, row.under, strict=True)):
            x = SIDE + column * (w + GAP)
            paper.paste(drawing.picture(linear, row.gain, (w, h)), (x, y))
            pen.text((x, y + h + 17), under, font=font(13), fill=INK if column else SOFT, anchor="ls")
    return paper
