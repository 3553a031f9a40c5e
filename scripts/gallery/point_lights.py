"""The relit lantern against true Cycles point lights on its path: errors, and a strip of both."""

from __future__ import annotations

import numpy as np
from numpy import ndarray

from scripts.gallery import drawing, strip
from scripts.gallery.paths import ScenePaths
from scripts.gallery.scenes import Fit
from srbf.asset import Asset
from srbf.capture import COVERED, Capture
from srbf.evaluation.errors_by_role import evaluate
from srbf.io import files
from srbf.lights import PointLight
from srbf.methods import linear_response
from srbf.relighting.direct_light import Added

SHOWN_LIGHTS = 3  # evenly along the path
WORST_FRACTION = 0.01  # of the pixels of an image, by error; `rest` leaves them out


def evaluate_point_lights(paths: ScenePaths, fit: Fit) -> None:
    """Write the errors of the relit point lights: those of `srbf evaluate`, and, for the lights `relit` and their direct light `alone`,
    the relative RMSE of all pixels, that of the `rest` without the worst of every image, and the mean brightness over the true one."""
    asset, capture = Asset.open(paths.asset(fit)), Capture.open(paths.true_point_lights)
    errors = evaluate(asset, capture, direct=fit.direct, roles=("train",))
    covered = capture.coverage() >= COVERED
    true, relit, alone = [], [], []
    with Added(asset, fit.direct) as added:
        for index, position in enumerate(capture.positions()):
            point_light = _point_light(position)
            direct = added.response([point_light])
            assert direct is not None
            true.append(np.maximum(capture.image(index), 0)[covered])
            relit.append(np.maximum(linear_response(asset, [point_light]) + direct, 0)[covered])
            alone.append(direct[covered])
    compared = {"relit": _compared(relit, true), "alone": _compared(alone, true)}
    files.write_json(paths.point_light_errors(fit), {**errors, **compared})


def _compared(pictures: list[ndarray], true: list[ndarray]) -> dict[str, float]:
    """Errors over all images together, each (P, 3)."""
    squares = np.stack([((a - b).astype(np.float64) ** 2).sum(axis=1) for a, b in zip(pictures, true, strict=True)])
    powers = np.stack([(b.astype(np.float64) ** 2).sum(axis=1) for b in true])
    kept = squares <= np.quantile(squares, 1 - WORST_FRACTION, axis=1, keepdims=True)
    return {
        "relative_rmse": float(np.sqrt(squares.sum() / powers.sum())),
        "rest": float(np.sqrt(squares[kept].sum() / powers[kept].sum())),
        "brightness": float(sum(a.mean(dtype=np.float64) for a in pictures) / sum(b.mean(dtype=np.float64) for b in true)),
    }


def draw(paths: ScenePaths, fit: Fit) -> None:
    """Write the strip of some point lights: Cycles, relit, and the direct light alone."""
    asset, capture = Asset.open(paths.asset(fit)), Capture.open(paths.true_point_lights)
    errors = files.read_json(paths.point_light_errors(fit))
    count = len(capture.lights)
    rows = []
    with Added(asset, fit.direct) as added:
        for index in sorted({round(i * count / SHOWN_LIGHTS) % count for i in range(SHOWN_LIGHTS)}):
            point_light = _point_light(capture.positions([index])[0])
            direct = added.response([point_light])
            assert direct is not None
            relit = np.maximum(linear_response(asset, [point_light]) + direct, 0)
            true = np.maximum(capture.image(index), 0)
            x, y, z = point_light.position
            strength = float(np.sqrt((true.astype(np.float64) ** 2).mean()))
            relative = errors["lights"][index]["rmse"] / strength
            rows.append(
                strip.Row(
                    None,
                    (f"x {x:.1f}", f"y {y:.1f}", f"z {z:.1f} m"),
                    (true, relit, direct),
                    ("a true point light", f"relative RMSE {relative:.2f}", ""),
                    drawing.gain_of(true, 0.98),
                )
            )
    drawing.save(strip.sheet(["rendered by Cycles", fit.label, "rays alone"], rows), paths.point_light_strip)


def _point_light(position: np.ndarray) -> PointLight:
    x, y, z = (float(value) for value in position)
    return PointLight((x, y, z), falloff="inverse-square")
