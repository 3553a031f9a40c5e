"""`python benchmarks/lights_inside.py SCENE.blend CAPTURE ASSET`: bounces of lights inside against Cycles, by kind of light.

Lights at random free places that no bake saw: points, points 5 to 20 cm off a surface (near) and 5 cm off one (wall), spots of 25 to 35
degrees, areas of 0.6 x 0.3 m; and four of the points in random colors at a time (four).
Every reference is rendered twice, so that its noise drops out: relative RMSE = sqrt(sum (a - r1)(a - r2) / sum r1 r2). The median and the
90th percentile over lights, pooled, their mean and worst, the mean without the worst 1 % of texels, the ratio of energies, and the noise of
one reference.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from references import rendered, settings_of

from srbf.asset import Asset
from srbf.bake.scene_query import ask_scene
from srbf.capture import COVERED, Capture
from srbf.lights import AreaLight, Light, PointLight, SpotLight
from srbf.methods import linear_response
from srbf.visibility.cloud_lights import CloudLights

CLEARANCE = 0.1  # m
OFF_SURFACE = {"near": (0.05, 0.2), "wall": (0.05, 0.05)}  # m
LIGHTS_AT_A_TIME = 4
SIDES = (0.6, 0.3)
PLACES, FRESH = 512, 0x5EED  # of which lights are drawn; the seed of these


def fresh_places(scene: Path, count: int) -> np.ndarray:
    """(n, 3) random free places that no capture of a usual seed has, m: at those of a capture are the lights that a fit is made for."""
    where = {"box": None, "count": 0, "spacing": None, "random": 0, "places": count, "seed": FRESH}
    return np.array(ask_scene(scene, {"places": where})["places"]["places"])


def placed(capture: Capture, kind: str, count: int, rng: np.random.Generator, places: np.ndarray | None = None) -> list[Light]:
    """`count` random lights of a kind, at some of the free `places` (n, 3), by default the capture's."""
    inside = CloudLights.of(capture)
    cells, free = inside.cells, inside.free if places is None else places
    lights: list[Light] = []
    while len(lights) < count:
        place = free[rng.integers(len(free))]
        off = np.linalg.norm(cells.places - place, axis=1).min()
        direction = rng.normal(size=3)
        direction /= np.linalg.norm(direction)
        if kind in OFF_SURFACE:
            cell = rng.choice(len(cells.places), p=cells.areas / cells.areas.sum())
            place = cells.places[cell] + rng.uniform(*OFF_SURFACE[kind]) * cells.normals[cell]
            clear = inside.visible(np.repeat(place[None], 32, axis=0), place + 0.04 * rng.normal(size=(32, 3)))
            if not clear.all():
                continue
        elif off < CLEARANCE + (0.4 if kind == "area" else 0.0):
            continue
        x, y, z = (float(value) for value in place)
        if kind == "spot":
            outer = float(rng.uniform(np.radians(25), np.radians(35)))
            lights.append(SpotLight((x, y, z), falloff="inverse-square", direction=tuple(direction), inner=outer, outer=outer))
        elif kind == "area":
            u = np.cross(direction, [0.3, 0.5, 0.8])
            u /= np.linalg.norm(u)
            lights.append(AreaLight((x, y, z), u=tuple(SIDES[0] * u), v=tuple(SIDES[1] * np.cross(direction, u))))
        else:
            lights.append(PointLight((x, y, z), falloff="inverse-square"))
    return lights


def row(relit: np.ndarray, first: np.ndarray, second: np.ndarray) -> str:
    """One line of the table; arrays (N, n, 3)."""
    products, power = (relit - first) * (relit - second), first * second
    lit = power.sum(axis=(1, 2)) > 0  # a light that reaches no receiver has no relative error
    products, power = products[lit], power[lit]
    by_light = np.sqrt(np.maximum(products.sum(axis=(1, 2)) / power.sum(axis=(1, 2)), 0))
    pooled = np.sqrt(max(products.sum() / power.sum(), 0))
    trimmed = []
    for own, whole in zip(products.sum(axis=2), power.sum(axis=2), strict=True):
        kept = np.argsort(np.abs(own))[: int(0.99 * len(own))]
        trimmed.append(np.sqrt(max(own[kept].sum() / whole[kept].sum(), 0)))
    noise = np.sqrt(((first - second)[lit] ** 2).sum() / 2 / power.sum())
    energy = relit.sum() / ((first.sum() + second.sum()) / 2)
    spread = f"{np.median(by_light):8.3f}{np.quantile(by_light, 0.9):8.3f}"
    return f"{spread}{pooled:8.3f}{by_light.mean():8.3f}{by_light.max():8.3f}{np.mean(trimmed):14.3f}{energy:9.3f}{noise:8.3f}"


def mixtures(count: int) -> np.ndarray:
    """(count, count, 3): colors of four of the lights at a time, random for each row."""
    rng = np.random.default_rng(4)
    found = np.zeros((count, count, 3))
    for row in found:
        row[rng.choice(count, min(LIGHTS_AT_A_TIME, count), replace=False)] = rng.uniform(0.1, 1, (min(LIGHTS_AT_A_TIME, count), 3))
    return found


def main() -> None:
    """Print a row per kind of light."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene", type=Path)
    parser.add_argument("capture", type=Path)
    parser.add_argument("assets", type=Path, nargs="+")
    parser.add_argument("--lights", type=int, default=12)
    parser.add_argument("--samples", type=int, default=128)
    parser.add_argument("--kinds", default="point,near,wall,spot,area", help="point gives four as well")
    asked = parser.parse_args()
    capture = Capture.open(asked.capture)
    covered = capture.coverage() >= COVERED
    print(
        f"{'asset':>24}{'light':>8}{'median':>8}{'90 %':>8}{'pooled':>8}{'mean':>8}{'worst':>8}{'without 1 %':>14}{'energy':>9}{'noise':>8}"
    )
    fresh = fresh_places(asked.scene, PLACES)
    for kind in asked.kinds.split(","):
        lights = placed(capture, kind, asked.lights, np.random.default_rng([3, len(kind)]), fresh)
        first, second = rendered(asked.scene, settings_of(capture), lights, asked.samples)["indirect"][:, :, covered]
        for path in asked.assets:
            asset = Asset.open(path)
            relit = np.stack([linear_response(asset, [light])[covered] for light in lights])
            print(f"{path.name:>24}{kind:>8}{row(relit, first, second)}", flush=True)
            if kind == "point":
                mixed = (np.einsum("mlc,lnc->mnc", mixtures(len(lights)), images) for images in (relit, first, second))
                print(f"{path.name:>24}{'four':>8}{row(*mixed)}", flush=True)


if __name__ == "__main__":
    main()
