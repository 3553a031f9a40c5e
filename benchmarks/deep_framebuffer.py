"""`python benchmarks/deep_framebuffer.py SCENE.blend CAPTURE ASSET...`: pictures of a view against Cycles, by kind of light.

Lights at random free places that no bake saw, each so that the view gets light of it: points, wide spots of 35 to 50 degrees, narrow ones
of 10 to 15, and points 5 cm off a surface in view (wall). References are rendered twice, so that their noise drops out: relative RMSE =
sqrt(sum (a - r1)(a - r2) / sum r1 r2), of the indirect light, of the direct light (`--direct ray` or `shadow-map`) and of the full picture,
median over lights; the ratio of energies of the indirect light, pooled and the one farthest from 1; megabytes of the asset's links, pool
and pixels or maps; CPU seconds for one light; the noise of one reference. `--references FILE.npz` keeps what Cycles rendered.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np
from references import rendered, settings_of

from srbf.asset import Asset
from srbf.capture import COVERED, Capture
from srbf.lights import Light, PointLight, SpotLight
from srbf.methods import linear_response
from srbf.relighting.direct_light import Added
from srbf.visibility.embree import EmbreeTriangles
from srbf.visibility.received import occluders_of

KINDS = ("point", "wide", "narrow", "wall")
CONES = {"wide": (35, 50), "narrow": (10, 15)}  # degrees, half-angles
OFF_WALL = 0.05  # m
LOOKS = 256  # pixels that a light must light, some of them


def placed(capture: Capture, kind: str, count: int, seed: int = 3) -> list[Light]:
    """`count` random lights of a kind; spots look at a pixel of the view, lights at a wall are in front of one."""
    rng = np.random.default_rng([seed, len(kind)])
    scene = capture.scene()
    assert scene is not None
    occluders = occluders_of(scene)
    free = np.array(capture.manifest["free_places"])
    covered = capture.coverage().ravel() >= COVERED
    images = capture.geometry("position"), capture.geometry("normal")
    position, normal = (image.reshape(-1, 3)[covered].astype(np.float64) for image in images if image is not None)
    lights: list[Light] = []
    while len(lights) < count:
        pixel = rng.integers(len(position), size=LOOKS)
        target = position[pixel[0]]
        place = target + OFF_WALL * normal[pixel[0]] if kind == "wall" else free[rng.integers(len(free))]
        if not _sees(occluders, place, position[pixel[:1]] + 1e-3 * normal[pixel[:1]]).all():
            continue
        if kind == "point" and _sees(occluders, place, position[pixel] + 1e-3 * normal[pixel]).mean() < 0.1:
            continue
        x, y, z = (float(value) for value in place)
        if kind in CONES:
            outer = float(np.radians(rng.uniform(*CONES[kind])))
            axis = (target - place) / np.linalg.norm(target - place)
            direction = (float(axis[0]), float(axis[1]), float(axis[2]))
            lights.append(SpotLight((x, y, z), falloff="inverse-square", direction=direction, inner=outer, outer=outer))
        else:
            lights.append(PointLight((x, y, z), falloff="inverse-square"))
    return lights


def _sees(occluders: EmbreeTriangles, place: np.ndarray, points: np.ndarray) -> np.ndarray:
    vector = points - place
    distance = np.linalg.norm(vector, axis=1)
    return ~occluders.occluded(
        np.broadcast_to(place, vector.shape).astype(np.float32), vector / np.maximum(distance, 1e-9)[:, None], distance - 1e-4
    )


def error(own: np.ndarray, first: np.ndarray, second: np.ndarray) -> float:
    """Relative RMSE without the references' noise."""
    return float(np.sqrt(max(((own - first) * (own - second)).sum(dtype=np.float64), 0) / (first * second).sum(dtype=np.float64)))


def main() -> None:
    """Print a row per asset and kind of light."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene", type=Path)
    parser.add_argument("capture", type=Path)
    parser.add_argument("assets", type=Path, nargs="+")
    parser.add_argument("--lights", type=int, default=8)
    parser.add_argument("--samples", type=int, default=64)
    parser.add_argument("--kinds", default=",".join(KINDS))
    parser.add_argument("--references", type=Path)
    parser.add_argument("--direct", choices=("ray", "shadow-map"), default="ray")
    asked = parser.parse_args()
    capture = Capture.open(asked.capture)
    covered = capture.coverage() >= COVERED
    kept = dict(np.load(asked.references)) if asked.references is not None and asked.references.is_file() else {}
    print(f"{'asset':>24}{'light':>8}{'indirect':>10}{'direct':>8}{'full':>8}{'energy':>8}{'worst':>8}{'MB':>8}{'CPU s':>8}{'noise':>9}")
    for kind in asked.kinds.split(","):
        lights = placed(capture, kind, asked.lights)
        if kind not in kept:
            images = rendered(asked.scene, settings_of(capture), lights, asked.samples, ("indirect", "direct"), gloss=True)
            kept[kind] = np.stack([images["indirect"], images["direct"]], axis=2)
            if asked.references is not None:
                np.savez(asked.references, **kept)
        references = kept[kind][:, :, :, covered]
        for path in asked.assets:
            asset = Asset.open(path)
            linear_response(asset, lights[:1])
            started = time.process_time()
            indirect = np.stack([linear_response(asset, [light])[covered] for light in lights])
            seconds = (time.process_time() - started) / len(lights)
            with Added(asset, asked.direct) as added:
                direct = np.stack([np.asarray(added.response([light]))[covered] for light in lights])
            bounced, near_errors, full, energies, noise = [], [], [], [], []
            for own, near, first, second in zip(indirect, direct, *references, strict=True):
                known = np.isfinite(first + second).all(axis=(0, 2))  # Cycles leaves a few pixels of spots with sharp edges as NaN
                own, near, first, second = own[known], near[known], first[:, known], second[:, known]
                bounced.append(error(own, first[0], second[0]))
                near_errors.append(error(near, first[1], second[1]))
                full.append(error(own + near, first.sum(axis=0), second.sum(axis=0)))
                energies.append((float(own.sum()), float((first[0] + second[0]).sum() / 2)))
                noise.append(np.sqrt(((first[0] - second[0]) ** 2).sum() / 2 / (first[0] * second[0]).sum()))
            energy = np.array([one / other for one, other in energies])
            whole = sum(one for one, _ in energies) / sum(other for _, other in energies)
            size = (asset.stored.nbytes + sum(table.nbytes for table in asset.tables.values())) / 1e6
            errors = f"{100 * np.median(bounced):>9.1f}%{100 * np.median(near_errors):>7.2f}%{100 * np.median(full):>7.2f}%"
            print(
                f"{path.name:>24}{kind:>8}{errors}{whole:>8.3f}"
                f"{energy[np.abs(energy - 1).argmax()]:>8.3f}{size:>8.1f}{seconds:>8.2f}{100 * np.median(noise):>8.0f}%",
                flush=True,
            )


if __name__ == "__main__":
    main()
