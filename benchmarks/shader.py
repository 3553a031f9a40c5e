"""A frame by every method's shaders, side by side in one run: `python benchmarks/shader.py [--sides 256 1024]`.

Assets of random numbers in half floats, since a shader's time does not depend on what the numbers are: 25 relighting maps, eigen maps of 28
and 16 scalars, and 64 clusters of 8 scalars. Milliseconds are medians, the methods taking turns; `host` is what the processor spends on
weights.
"""

from __future__ import annotations

import argparse
import time
from typing import Any

import numpy as np

from srbf.asset import Asset
from srbf.basis.gaussian import r_table, spread_of
from srbf.basis.light_functions import LightFunctions
from srbf.basis.octahedral_table import octahedral_table
from srbf.gl.context import create_context
from srbf.gl.relighter import Relighter
from srbf.lights import DirectionalLight, Light, PointLight
from srbf.methods import folded_weights
from srbf.model_selection import dense_centers
from srbf.sphere import point_set

LIGHTS = 400  # of the capture that the light functions are as dense as
SPREADS = (0.2, 0.4)  # rad
METHODS: dict[str, dict[str, int]] = {
    "relighting map, k = 25": {"k": 25},
    "eigen map, 28 scalars": {"scalars": 28},
    "eigen map, 16 scalars": {"scalars": 16},
    "clustered, 64 x 8 scalars": {"clusters": 64, "scalars": 8},
}
KINDS: dict[str, list[Light]] = {"directional": [DirectionalLight((0.3, 0.2, 0.9))], "point": [PointLight((0.2, 0.1, 0.7))]}
PATCH = 16  # texels a side of a patch that is all one cluster


def make_asset(side: int, k: int = 0, scalars: int = 0, clusters: int = 0) -> Asset:
    """Random layers over a plane, in half floats."""
    rng = np.random.default_rng(0)
    layers, channels = (k, 3) if k else (-(-scalars // 4), 4)
    stored = rng.normal(size=(layers, side, side, channels)).astype(np.float16)
    scale, bias = np.ones((layers, channels), np.float32), np.zeros((layers, channels), np.float32)
    x = np.linspace(-1, 1, side, dtype=np.float32)
    images = {"position": np.stack([*np.meshgrid(x, -x), np.zeros((side, side), np.float32)], axis=-1)}
    manifest: dict[str, Any] = {"width": side, "height": side, "domain": "hemisphere"}
    entries = [{"encoding": "half"} for _ in range(layers)]
    if k:
        centers = point_set("fibonacci", k, "hemisphere")
        spread = spread_of(centers, "mean")
        manifest |= {"method": "relighting-map", "maps": entries}
        manifest["basis"] = {"kind": "gaussian", "centers": centers.tolist(), "spread": spread}
        return Asset(manifest, stored, scale, bias, {"r_table": r_table(spread)}, images)
    centers = dense_centers(point_set("fibonacci", LIGHTS, "hemisphere"), "hemisphere")
    count = max(clusters, 1) * (scalars + 1)
    coefficients = rng.normal(size=(count, len(centers), 3)).astype(np.float32)
    functions = LightFunctions(centers, rng.choice(SPREADS, count), coefficients)
    table = octahedral_table(functions, "hemisphere")
    manifest |= {"method": "clustered-eigen-map" if clusters else "eigen-map", "scalars": scalars, "planes": entries}
    manifest["light_basis"] = {"kind": "gaussian", "centers": centers.tolist(), "spreads": functions.spreads.tolist()}
    manifest["w_table"] = {"size": table.size, "columns": table.columns}
    tables = {"light_coefficients": coefficients, "w_table": table.atlas}
    if clusters:
        manifest["clusters"] = clusters
        patches = rng.integers(0, clusters, (-(-side // PATCH), -(-side // PATCH))).astype(np.uint8)
        tables["cluster_index"] = np.ascontiguousarray(patches.repeat(PATCH, axis=0).repeat(PATCH, axis=1)[:side, :side])
    return Asset(manifest, stored, scale, bias, tables, images)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sides", type=int, nargs="+", default=[256, 1024])
    parser.add_argument("--runs", type=int, default=15)
    arguments = parser.parse_args()
    context = create_context()
    print(f"{context.info['GL_RENDERER']}; ms, medians of {arguments.runs}\n")
    print(f"{'side':<6}{'method':<28}{'B / texel':>10}{'table':>7}{'host':>8}" + "".join(f"{kind:>14}" for kind in KINDS))
    for side in arguments.sides:
        assets = {name: make_asset(side, **shape) for name, shape in METHODS.items()}
        relighters = {name: Relighter(asset, context=context) for name, asset in assets.items()}
        times: dict[tuple[str, str], list[float]] = {}
        for run in range(-1, arguments.runs):  # the first compiles and uploads
            for name, relighter in relighters.items():
                for kind, lights in KINDS.items():
                    started = time.perf_counter()
                    relighter.draw(lights)
                    context.finish()
                    if run >= 0:
                        times.setdefault((name, kind), []).append(time.perf_counter() - started)
                started = time.perf_counter()
                folded_weights(assets[name], KINDS["directional"])
                if run >= 0:
                    times.setdefault((name, "host"), []).append(time.perf_counter() - started)
        for name, asset in assets.items():
            table = asset.manifest["w_table"]["size"] if "w_table" in asset.manifest else len(asset.table)
            took = {kind: 1e3 * float(np.median(times[name, kind])) for kind in ("host", *KINDS)}
            row = f"{side:<6}{name:<28}{asset.bytes_per_texel()['directional']:>10}{table:>7}{took['host']:>8.2f}"
            print(row + "".join(f"{took[kind]:>14.1f}" for kind in KINDS))
        for relighter in relighters.values():
            relighter.close()
    context.release()


if __name__ == "__main__":
    main()
