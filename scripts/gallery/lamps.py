"""True lamps of Cycles where the lantern is carried, against the relit ones: the error, and both side by side."""

from __future__ import annotations

import numpy as np

from scripts.gallery import drawing, strip
from scripts.gallery.places import Places
from scripts.gallery.scenes import Fit
from srbf import files
from srbf.asset import Asset
from srbf.capture import COVERED, Capture
from srbf.direct.choice import Added
from srbf.evaluation import evaluate
from srbf.lights import PointLight
from srbf.methods import linear_response

SHOWN = 3  # lamps, evenly along the path
ALONE = "rays_alone"


def evaluate_lamps(places: Places, fit: Fit) -> None:
    """The relit lamps' error as `srbf evaluate` has it on a capture of lamps, and beside it that of their direct light alone."""
    asset, capture = Asset.open(places.asset(fit)), Capture.open(places.true_lamps)
    errors = evaluate(asset, capture, direct=fit.direct, roles=("train",))
    covered = capture.coverage() >= COVERED
    squares, powers = [], []
    with Added(asset, fit.direct) as added:
        for index, position in enumerate(capture.positions()):
            true = np.maximum(capture.image(index), 0)[covered].astype(np.float64)
            direct = added.answer([_lamp(position)])
            assert direct is not None
            squares.append(((direct[covered] - true) ** 2).mean())
            powers.append((true**2).mean())
    files.write_json(places.lamp_errors(fit), {**errors, ALONE: {"relative_rmse": float(np.sqrt(sum(squares) / sum(powers)))}})


def draw(places: Places, fit: Fit) -> None:
    """Write the strip of some lamps: Cycles, relit, and the direct light alone."""
    asset, capture = Asset.open(places.asset(fit)), Capture.open(places.true_lamps)
    errors = files.read_json(places.lamp_errors(fit))
    count = len(capture.lights)
    rows = []
    with Added(asset, fit.direct) as added:
        for index in sorted({round(i * count / SHOWN) % count for i in range(SHOWN)}):
            lamp = _lamp(capture.positions([index])[0])
            direct = added.answer([lamp])
            assert direct is not None
            relit = np.maximum(linear_response(asset, [lamp]) + direct, 0)
            true = np.maximum(capture.image(index), 0)
            x, y, z = lamp.position
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
    drawing.save(strip.sheet(["rendered by Cycles", fit.label, "rays alone"], rows), places.lamp_strip)


def _lamp(position: np.ndarray) -> PointLight:
    x, y, z = (float(value) for value in position)
    return PointLight((x, y, z), falloff="inverse-square")
