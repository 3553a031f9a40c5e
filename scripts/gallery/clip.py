"""The clip of a scene: its assets under moving lights, as a looping WebP."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy import ndarray
from PIL import Image
from scipy.interpolate import CubicSpline

from scripts.gallery import drawing
from scripts.gallery.paths import ScenePaths
from scripts.gallery.scenes import Fit, Lantern, Sun
from srbf.arrays import Float64
from srbf.asset import Asset
from srbf.lights import DirectionalLight, Light, PointLight, triple
from srbf.methods import linear_response
from srbf.relighting.direct_light import Added

MILLISECONDS_PER_FRAME = 80
MAX_BYTES = 1_200_000
GLYPH_SIZE = 44  # pixels
FLAME_RADIUS = 0.035  # m, of the lantern's painted flame
HALO_RADIUS = 4.0  # in flame radii, a hundredth as bright


def draw(paths: ScenePaths) -> None:
    """Write the clip, one panel per moving fit."""
    scene = paths.scene
    fits = scene.moved
    lit = [frames_of(paths, fit) for fit in fits]
    gain = drawing.gain_of(np.stack([image for images in lit for image in images[:: max(1, len(images) // 12)]]), 0.99)
    height, width = lit[0][0].shape[:2]
    w = scene.clip_width // len(fits)
    h = round(w * height / width)
    pictures = []
    for number in range(scene.frames):
        picture = Image.new("RGB", (w * len(fits), h))
        for column, (fit, images) in enumerate(zip(fits, lit, strict=True)):
            picture.paste(drawing.picture(images[number], gain, (w, h)), (column * w, 0))
            if len(fits) > 1:
                drawing.label(picture, column * w, h, fit.label)
        if isinstance(scene.clip, Sun):
            glyph = drawing.sun(sun_directions(scene.clip, scene.frames)[number], GLYPH_SIZE)
            drawing.paste(picture, glyph, picture.width - GLYPH_SIZE - 4, 4)
        pictures.append(picture)
    drawing.save_moving(pictures, paths.clip, MILLISECONDS_PER_FRAME, MAX_BYTES)


def frames_of(paths: ScenePaths, fit: Fit) -> list[ndarray]:
    """Every frame, linear: the sum over its lights, clamped at 0; direct light is added where the fit leaves it out."""
    scene, asset = paths.scene, Asset.open(paths.asset(fit))
    with Added(asset, fit.direct) as added:

        def response(light: Light) -> ndarray:
            direct = added.response([light])
            response = linear_response(asset, [light])
            return response if direct is None else response + direct

        if isinstance(scene.clip, Lantern):
            moon = response(DirectionalLight(scene.clip.moon, scene.clip.moon_color))  # fixed, and relighting is linear
            point_lights = lantern_lights(scene.clip, scene.frames)
            return [with_flame(np.maximum(moon + response(point_light), 0), asset, point_light) for point_light in point_lights]
        suns = sun_lights(scene.clip, scene.frames)
        return [np.maximum(sum(response(light) for light in lights), 0) for lights in suns]


def sun_directions(sun: Sun, frames: int) -> Float64[ndarray, "F 3"]:
    """Unit directions of one orbit, counter-clockwise seen from above, with the elevation between `low` and `high`."""
    turn = np.arange(frames) * (2 * np.pi / frames)
    middle, swing = np.radians((sun.high + sun.low) / 2), np.radians((sun.high - sun.low) / 2)
    elevation = middle - swing * np.cos(sun.swings * turn)
    return np.column_stack([np.cos(elevation) * np.cos(turn), np.cos(elevation) * np.sin(turn), np.sin(elevation)])


def sun_lights(sun: Sun, frames: int) -> list[list[Light]]:
    """The lights of every frame: the sun, and, if `second` is set, a light that orbits in the opposite direction."""
    lights: list[list[Light]] = []
    for x, y, z in sun_directions(sun, frames):
        both: list[Light] = [DirectionalLight((x, y, z), sun.color)]
        if sun.second is not None:
            both.append(DirectionalLight((x, -y, z), sun.second))
        lights.append(both)
    return lights


def lantern_lights(lantern: Lantern, frames: int) -> list[PointLight]:
    """One point light per frame, along a smooth closed curve through the corners."""
    corners = np.array([*lantern.path, lantern.path[0]])
    lengths = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    curve = CubicSpline(np.concatenate([[0], np.cumsum(lengths)]), corners, bc_type="periodic")
    positions = curve(np.arange(frames) * (lengths.sum() / frames))
    color = np.array(lantern.color)
    return [PointLight(triple(position), triple(color), falloff="inverse-square", radius=lantern.radius) for position in positions]


def with_flame(linear: ndarray, asset: Asset, point_light: PointLight) -> ndarray:
    """The image with the light's flame painted where a perspective camera sees it, unless occluded; unchanged without such a camera."""
    camera = asset.manifest.get("direct", {}).get("camera")
    if camera is None or camera["type"] != "PERSP":
        return linear
    height, width = linear.shape[:2]
    x, y, depth = seen_at(camera, point_light.position, width, height)
    radius = FLAME_RADIUS / (depth * pixel_angle(camera, width))
    rows, columns = np.mgrid[:height, :width]
    away = np.hypot(columns + 0.5 - x, rows + 0.5 - y) / radius
    eye = np.array(camera["matrix_world"])[:3, 3]
    beyond = np.linalg.norm(asset.images["position"] - eye, axis=2) > np.linalg.norm(np.array(point_light.position) - eye)
    flame = np.exp(-(away**2)) + 0.01 * np.exp(-((away / HALO_RADIUS) ** 2))
    strength = (flame * beyond)[..., None] * np.array(point_light.color) * 4
    return (linear + strength).astype(np.float32)


def seen_at(camera: dict, position: Sequence[float], width: int, height: int) -> tuple[float, float, float]:
    """(column, row, depth) at which a pinhole camera sees a world position."""
    matrix, frame = np.array(camera["matrix_world"]), np.array(camera["frame"])
    top_right, _, bottom_left, top_left = frame
    local = np.linalg.inv(matrix) @ np.array([*position, 1.0])
    depth = -float(local[2])
    on_frame = local[:3] * (top_left[2] / local[2])
    u = (on_frame[0] - top_left[0]) / (top_right[0] - top_left[0])
    v = (on_frame[1] - top_left[1]) / (bottom_left[1] - top_left[1])
    return float(u * width), float(v * height), depth


def pixel_angle(camera: dict, width: int) -> float:
    """Width of a pixel at depth 1, m."""
    top_right, _, _, top_left = np.array(camera["frame"])
    return float((top_right[0] - top_left[0]) / -top_left[2] / width)
