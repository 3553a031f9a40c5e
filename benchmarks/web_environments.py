"""`python benchmarks/web_environments.py ASSET MAP.exr`: an environment map that turns, in three.js, against numpy.

Seconds until the map is first shown, milliseconds of each turn and of a directional light that moves, with the lightmap drawn and read
back; relative RMSE and the largest difference, by the largest value, from numpy's exact sums over the texels.
The page is that of the browser's tests: `npm run build:pages -- --outDir ../../../build/web/pages` in web/.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np
from web_surfels import asked, images, open_page

from srbf.asset import Asset
from srbf.io.image import read_image
from srbf.lights import EnvironmentLight
from srbf.methods import linear_response

TURNS = 24
COMPARED = 4  # of them, with numpy


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("asset", type=Path)
    parser.add_argument("map", type=Path)
    arguments = parser.parse_args()
    asset, light = Asset.open(arguments.asset), EnvironmentLight(read_image(arguments.map, 3))
    height, width, _ = light.image.shape
    plain = {"kind": "environment", "color": [1, 1, 1]}
    around = {**plain, "width": width, "height": height, "pixels": light.image.ravel().tolist()}
    angles = np.linspace(0, 2 * np.pi, TURNS, endpoint=False)
    suns = [[{"kind": "directional", "direction": [np.cos(a), np.sin(a), 1.0], "color": [1, 1, 1]}] for a in angles]
    sets = [suns[0], *suns, [around], *([{**plain, "turn": angle}] for angle in angles[1:].tolist())]
    with tempfile.TemporaryDirectory() as folder, open_page(folder) as page:
        (Path(folder) / "asset").symlink_to(arguments.asset.resolve())
        said = asked(page, {"run": "three-lightmap", "asset": "/served/asset", "lights": [], "lightSets": sets})
    assert "error" not in said, said
    _, *moves = said["milliseconds"][: TURNS + 1]
    first, *turns = said["milliseconds"][TURNS + 1 :]
    relit = images(said)[TURNS + 1 :]
    errors = []
    for i in np.linspace(0, TURNS - 1, COMPARED).astype(int).tolist():
        expected = np.maximum(linear_response(asset, [light.turned(angles[i])]), 0)
        apart = relit[i] - expected
        errors.append((np.sqrt(np.square(apart).mean() / np.square(expected).mean()), np.abs(apart).max() / expected.max()))
    print(f"{width} x {height} texels: shown after {first / 1000:.2f} s, then each turn {np.median(turns):.1f} ms", end=", ")
    print(f"a directional light that moves {np.median(moves):.1f} ms (medians)")
    print(f"relative RMSE {max(e for e, _ in errors):.5f}, largest difference {max(e for _, e in errors):.5f}")


if __name__ == "__main__":
    main()
