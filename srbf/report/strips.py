"""Strips of one point or spot light at several positions, and a short animation."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy import ndarray

from srbf.errors import MissingLibraryError
from srbf.io.files import atomic_path
from srbf.lights import DirectionalLight, Light, PointLight
from srbf.methods import relight
from srbf.report.canvas import MARGIN, SOFT, Sheet, box_for, gain_text, place_text, shown
from srbf.report.point_lights import moving_point
from srbf.report.subject import Picture, Subject

POINTS, SPOTS, ANIMATION = "point_strip.png", "spot_strip.png", "animation.webp"
ORBIT_FRAMES, TRAVEL_FRAMES = 14, 10  # of the directional and of the point light
ELEVATION = np.radians(38)
MAX_SIDE = 440  # pixels of a frame
MAX_BYTES = 2 << 20


def point_strip(subject: Subject, folder: Path) -> Picture:
    """Write point_strip.png: the asset under one point light at several positions."""
    return _strip(subject, folder / POINTS, subject.points, "A moving point light", "Point lights")


def spot_strip(subject: Subject, folder: Path) -> Picture:
    """Write spot_strip.png: the asset under a moving spot light."""
    return _strip(subject, folder / SPOTS, subject.spots, "A moving spot light", "Spot lights")


def _strip(subject: Subject, path: Path, point_lights: Sequence[PointLight], heading: str, title: str) -> Picture:
    asset, gain = subject.asset, subject.gain
    columns = min(3, len(point_lights))
    rows = -(-len(point_lights) // columns)
    w, h = box_for(asset.width, asset.height, area=330 * 220, widest=430, tallest=340)
    top, legend, gap = 84, 62, 16
    first = point_lights[0]
    fall = "a0/|L|" if first.falloff == "linear" else "(a0/|L|)²"
    sheet = Sheet(
        2 * MARGIN + columns * (w + gap) - gap,
        top + rows * (h + legend) + 6,
        heading,
        f"White, attenuation {fall}; {gain_text(gain)}. Plan: the receivers from above, x right, y up, the light in yellow.",
    )
    for n, point_light in enumerate(point_lights):
        x, y = MARGIN + n % columns * (w + gap), top + n // columns * (h + legend)
        sheet.image(x, y, w, h, shown(relight(asset, [point_light]), gain, subject.covered))
        _plan(sheet, subject, point_light, x, y + h + 6, min(64, 0.3 * w), 44)
        sheet.text(
            x + min(64, 0.3 * w) + 10,
            y + h + 28,
            f"{place_text(point_light.position)} m\n$a_0$ {point_light.a0:.2f} m",
            size=8,
            color=SOFT,
            va="center",
        )
    sheet.save(path)
    caption = f"{title} relit from the maps; none was captured. {len(point_lights)} positions, all at the contact sheet's exposure."
    return Picture(path.name, title, caption)


def _plan(sheet: Sheet, subject: Subject, point_light: PointLight, x: float, y: float, width: float, height: float) -> None:
    """A plan of the receivers (subsampled) and the light, seen from above, in world meters."""
    positions = subject.asset.images["position"][subject.covered]
    positions = positions[:: max(1, len(positions) // 600)].astype(np.float64)
    inverse = np.linalg.inv(subject.asset.asset_from_world)
    positions = positions @ inverse[:3, :3].T + inverse[:3, 3]
    low, high = np.minimum(positions.min(axis=0), point_light.position)[:2], np.maximum(positions.max(axis=0), point_light.position)[:2]
    scale = (
        0.86 * min(width, height) / max(float((high - low).max()), 1e-3) * np.array([1, -1])
    )  # sheet units per meter; y points down there
    corner = np.array([x, y]) + [0.07 * width, 0.5 * height]
    middle = np.array([low[0], (low[1] + high[1]) / 2])
    sheet.dots(corner + (positions[:, :2] - middle) * scale)
    at = corner + (np.array(point_light.position[:2]) - middle) * scale
    sheet.point_light(at[0], at[1], size=4.5)


def animation(subject: Subject, folder: Path) -> Picture:
    """Write animation.webp (animation.gif where Pillow has no WebP): a directional light orbits, then a point light passes.

    MissingLibraryError without Pillow. At most 24 frames and MAX_BYTES.
    """
    lights = _path(subject)
    path = write_animation([frame(subject, light) for light in lights], folder)
    second = f", then {len(lights) - ORBIT_FRAMES} of a point light passing by" if len(lights) > ORBIT_FRAMES else ""
    return Picture(
        path.name,
        "In motion",
        f"{ORBIT_FRAMES} frames of a directional light orbiting at {np.degrees(ELEVATION):.0f}° of elevation{second}.",
    )


def write_animation(pictures: Sequence[ndarray], folder: Path) -> Path:
    """Write frames (H, W, 3) uint8 as animation.webp, or animation.gif where Pillow has no WebP; at most MAX_BYTES.

    MissingLibraryError without Pillow.
    """
    try:
        from PIL import Image, features
    except ImportError as error:
        raise MissingLibraryError("the animation of a report needs Pillow: pip install Pillow") from error
    frames = [Image.fromarray(picture) for picture in pictures]
    webp = bool(features.check("webp"))
    path = folder / (ANIMATION if webp else "animation.gif")
    factor = MAX_SIDE / max(frames[0].size)
    for quality in (82, 60, 40):
        size = (max(1, round(frames[0].width * factor)), max(1, round(frames[0].height * factor)))
        kernel = Image.Resampling.LANCZOS if factor < 1 else Image.Resampling.BICUBIC
        scaled = [frame.resize(size, kernel) for frame in frames]
        options: dict[str, Any] = {"quality": quality, "method": 4} if webp else {}
        with atomic_path(path) as temporary:
            scaled[0].save(temporary, save_all=True, append_images=scaled[1:], duration=120, loop=0, **options)
        if path.stat().st_size <= MAX_BYTES:
            break
        factor *= 0.7
    return path


def _path(subject: Subject) -> list[Light]:
    lights: list[Light] = []
    for turn in np.arange(ORBIT_FRAMES) * (2 * np.pi / ORBIT_FRAMES):
        lights.append(DirectionalLight((np.cos(ELEVATION) * np.cos(turn), np.cos(ELEVATION) * np.sin(turn), np.sin(ELEVATION))))
    if subject.points:
        there_and_back = 0.5 - 0.5 * np.cos(np.arange(TRAVEL_FRAMES) * (2 * np.pi / TRAVEL_FRAMES))
        lights += [moving_point(subject.asset, subject.covered, float(t)) for t in there_and_back]
    return lights


def frame(subject: Subject, light: Light) -> ndarray:
    """The asset under one light, (H, W, 3) uint8, at the page's exposure."""
    image = relight(subject.asset, [light])
    return np.round(shown(image, subject.gain, subject.covered) * 255).astype(np.uint8)
