"""True lamps of Cycles where the lantern is carried, against the relit ones: the error, and both side by side."""

from __future__ import annotations

import numpy as np
from numpy import ndarray

from scripts.gallery import drawing, strip
from scripts.gallery.places import Places
from scripts.gallery.scenes import Fit
from srbf.asset import Asset
from srbf.capture import COVERED, Capture
from srbf.evaluation.errors_by_role import evaluate
from srbf.io import files
from srbf.lights import PointLight
from srbf.methods import linear_response
from srbf.relighting.direct_light import Added

SHOWN = 3  # lamps, evenly along the path
WORST = 100  # one pixel in so many, those that err most, is left out of `rest`


def evaluate_point_lights(places: Places, fit: Fit) -> None:
    """The relit lamps' error as `srbf evaluate` has it on a capture of lamps, and beside it, of them and of their direct light `alone`:
    relative RMSE of all pixels, of the `rest` but the worst in every picture, and the mean brightness over the true one."""
    asset, capture = Asset.open(places.asset(fit)), Capture.open(places.true_point_lights)
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
    files.write_json(places.point_light_errors(fit), {**errors, **compared})


def _compared(pictures: list[ndarray], true: list[ndarray]) -> dict[str, float]:
    """Of all pictures together, each (P, 3)."""
    squares = np.stack([((a - b).astype(np.float64) ** 2).sum(axis=1) for a, b in zip(pictures, true, strict=True)])
    powers = np.stack([(b.astype(np.float64) ** 2).sum(axis=1) for b in true])
    kept = squares <= np.quantile(squares, 1 - 1 / WORST, axis=1, keepdims=True)
    return {
        "relative_rmse": float(np.sqrt(squares.sum() / powers.sum())),
        "rest": float(np.sqrt(squares[kept].sum() / powers[kept].sum())),
        "brightness": float(sum(a.mean(dtype=np.float64) for a in pictures) / sum(b.mean(dtype=np.float64) for b in true)),
    }


def draw(places: Places, fit: Fit) -> None:
    """Write the strip of some lamps: Cycles, relit, and the direct light alone."""
    asset, capture = Asset.open(places.asset(fit)), Capture.open(places.true_point_lights)
    errors = files.read_json(places.point_light_errors(fit))
    count = len(capture.lights)
    rows = []
    with Added(asset, fit.direct) as added:
        for index in sorted({round(i * count / SHOWN) % count for i in range(SHOWN)}):
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
                    ("a true lamp", f"relative RMSE {relative:.2f}", ""),
                    drawing.gain_of(true, 0.98),
                )
            )
    drawing.save(strip.sheet(["rendered by Cycles", fit.label, "rays alone"], rows), places.point_light_strip)


def _point_light(position: np.ndarray) -> PointLight:
    x, y, z = (float(value) for value in position)
    return PointLight((x, y, z), falloff="inverse-square")
