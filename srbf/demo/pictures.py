"""A lightmap's asset in its scene's camera, under point lights at other places, beside Cycles.

As an engine draws it: direct light per pixel, by shadow maps or rays, and bounces from the lightmap where a pixel shows a receiver.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float, Float32, Float64
from srbf.asset import Asset
from srbf.capture import Capture
from srbf.errors import InputError, ShaderError
from srbf.gl.context import create_context
from srbf.io.scene_glb import read_triangles
from srbf.lights import PointLight, triple
from srbf.methods import linear_response
from srbf.relighting.direct_light import Added, Direct
from srbf.report.canvas import MARGIN, Sheet, place_text, shown
from srbf.visibility.embree import EmbreeTriangles

WIDTH = 460  # of a picture on the sheet, in 1/100 inch
GAP, HEADER, LABEL = 14, 84, 30
WHITE = 0.97  # quantile of Cycles' picture that is shown as LEVEL
LEVEL = 0.8
Place = tuple[float, float, float]


@dataclass(frozen=True)
class Compared:
    """Where a light is (m), and the relative RMSE of the picture over pixels that show receivers; the noise of Cycles counts as error."""

    place: Place
    relative_rmse: float


class InCamera:
    """An asset in the camera of `view`, a capture of the scene with its geometry, under points of unit irradiance at 1 m.

    InputError where the asset has no lightmap coordinates, or the view no pinhole camera or no albedo.
    """

    def __init__(self, asset: Asset, view: Capture, direct: Direct) -> None:
        albedo = view.geometry("albedo")
        if albedo is None:
            raise InputError(f"expected the albedo of the view in {view.folder}, found none; bake it with transport indirect")
        self._asset, self._view, self._direct, self._albedo = asset, view, direct, albedo
        self._texels = lightmap_coordinates(asset, view)
        self.receivers: Bool[ndarray, "H W"] = np.isfinite(self._texels[..., 0])

    def pictures(self, places: Sequence[Place]) -> list[Float32[ndarray, "H W 3"]]:
        """Radiance with the light at each place (m): direct light per pixel, and bounces from the lightmap."""
        found = []
        with Added(self._view, self._direct) as added:
            for place in places:
                light = PointLight(triple(np.array(place)), falloff="inverse-square")
                bounced = bilinear(linear_response(self._asset, [light]), self._texels) * self._albedo / np.float32(np.pi)
                own = added.response([light])
                picture = np.where(self.receivers[..., None], bounced, 0) + (0 if own is None else own)
                found.append(np.maximum(picture, 0).astype(np.float32))
        return found

    def beside(self, places: Sequence[Place], references: Sequence[ndarray], path: Path) -> list[Compared]:
        """Draw the pictures beside `references`, radiance in the view, to a PNG."""
        height = WIDTH * self._view.height / self._view.width
        sheet = Sheet(
            2 * MARGIN + 2 * WIDTH + GAP,
            HEADER + len(places) * (height + LABEL) + 10,
            "A light carried through the scene",
            "Left: direct light per pixel, and bounces from the asset. Right: Cycles. No light was captured; each row has one exposure.",
        )
        results = []
        for row, (place, picture, reference) in enumerate(zip(places, self.pictures(places), references, strict=True)):
            error = _relative(picture[self.receivers], reference[self.receivers])
            results.append(Compared(place, error))
            gain = gain_of(reference)
            y = HEADER + row * (height + LABEL)
            words = (f"point light at {place_text(place)} m", f"Cycles; relative RMSE {100 * error:.1f} %, its noise included")
            for column, (pixels, label) in enumerate(zip((picture, reference), words, strict=True)):
                sheet.image(MARGIN + column * (WIDTH + GAP), y, WIDTH, height, shown(pixels, gain), label)
        sheet.save(path)
        return results


def direct_light() -> Direct:
    """By shadow maps as in engines; by rays where there is no OpenGL."""
    try:
        create_context().release()
    except ShaderError:
        return "ray"
    return "shadow-map"


def gain_of(pixels: Float[ndarray, "H W 3"]) -> float:
    """The exposure that shows the bright parts of linear pixels as LEVEL."""
    return LEVEL / max(float(np.quantile(pixels, WHITE)), 1e-30)


def shown_bytes(pixels: Float[ndarray, "H W 3"]) -> ndarray:
    """Linear pixels as sRGB bytes (H, W, 3) at an exposure of their own."""
    return np.round(np.clip(shown(pixels, gain_of(pixels)), 0, 1) * 255).astype(np.uint8)


def lightmap_coordinates(asset: Asset, view: Capture) -> Float32[ndarray, "H W 2"]:
    """Of what each pixel of a pinhole view shows, (0, 0) at the top left; NaN where that is no receiver of the asset's."""
    camera = view.manifest.get("direct", {}).get("camera", {})
    position = view.geometry("position")
    lightmap = None if asset.scene is None else read_triangles(asset.scene)
    if lightmap is None or lightmap.lightmap is None:
        raise InputError("expected an asset of a lightmap with scene.glb, found one without lightmap coordinates; bake it indirect")
    if camera.get("type") != "PERSP" or position is None:
        raise InputError(f"expected a view of a pinhole camera in {view.folder}, found another; give the scene a perspective camera")
    origin = np.array(camera["matrix_world"], np.float64)[:3, 3]
    away = position.reshape(-1, 3) - origin
    direction = away / np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-30)
    hit, _, corners = EmbreeTriangles(lightmap.corners).first_hit(np.broadcast_to(origin, direction.shape), direction)
    found = np.einsum("nk,nkc->nc", corners, lightmap.lightmap[np.maximum(hit, 0)])
    found[(hit < 0) | ~_seen(view)] = np.nan
    return found.reshape(view.height, view.width, 2).astype(np.float32)


def bilinear(image: Float[ndarray, "h w 3"], coordinates: Float32[ndarray, "H W 2"]) -> Float64[ndarray, "H W 3"]:
    """`image` at coordinates from 0 to 1, clamped at its borders; (0, 0) is the outer corner of its first texel. 0 where they are NaN."""
    from scipy.ndimage import map_coordinates

    known = np.nan_to_num(coordinates.astype(np.float64))
    rows, columns = known[..., 1] * image.shape[0] - 0.5, known[..., 0] * image.shape[1] - 0.5
    found = [map_coordinates(image[..., c].astype(np.float64), [rows, columns], order=1, mode="nearest") for c in range(3)]
    return np.where(np.isfinite(coordinates[..., :1]), np.stack(found, axis=-1), 0)


def _seen(view: Capture) -> Bool[ndarray, " P"]:
    """Pixels that show a surface."""
    return view.coverage().ravel() > 0


def _relative(picture: ndarray, reference: ndarray) -> float:
    power = float((reference.astype(np.float64) ** 2).sum())
    return float(np.sqrt(((picture - reference).astype(np.float64) ** 2).sum() / power)) if power > 0 else 0.0
