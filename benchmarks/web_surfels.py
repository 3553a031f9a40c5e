"""`python benchmarks/web_surfels.py ASSET…`: the lightmap that three.js draws of lights inside, against numpy's rays.

Weights by passes of the GPU (shadow maps of 128, 256, 512 and 1024 texels per side of a face), by those of WebGPU's nodes, by compute
shaders, by rays on the CPU, and by the table of places (rays for spots and areas): relative RMSE of the indirect light over all texels,
at random free places. Deep framebuffers have no table. The page is that of the browser's tests:
`npm run build:pages -- --outDir ../../../build/web/pages` in web/. Chromium is found on PATH, and runs SwiftShader.
"""

from __future__ import annotations

import argparse
import base64
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from srbf.asset import Asset
from srbf.lights import AreaLight, Light, PointLight, SpotLight
from srbf.methods import linear_response

ROOT = Path(__file__).resolve().parents[1]
KINDS = {PointLight: "point", SpotLight: "spot", AreaLight: "area"}
CASES: dict[str, dict[str, Any]] = {
    **{f"passes, {size}": {"weights": "gpu", "shadowSize": size} for size in (128, 256, 512, 1024)},
    "nodes, 512": {"run": "nodes-lightmap", "backend": "webgpu", "weights": "gpu", "shadowSize": 512},
    "nodes, 1024": {"run": "nodes-lightmap", "backend": "webgpu", "weights": "gpu", "shadowSize": 1024},
    "compute, 1024": {"run": "nodes-lightmap", "backend": "webgpu", "weights": "compute", "shadowSize": 1024},
    "rays on the CPU": {"weights": "cpu", "exact": True},
    "table of places": {"weights": "cpu", "exact": False},
}


def light_sets(asset: Asset, count: int, seed: int) -> dict[str, list[list[Light]]]:
    """Of every kind `count`, one light each; and four points together."""
    rng = np.random.default_rng(seed)
    free = np.array(asset.manifest["free_places"])
    sets: dict[str, list[list[Light]]] = {"point": [], "spot": [], "area": [], "four points": []}
    for _ in range(count):
        places = [(float(x), float(y), float(z)) for x, y, z in free[rng.choice(len(free), 4, replace=False)]]
        x, y, z = (float(value) for value in rng.normal(size=3))
        points: list[Light] = [PointLight(place, falloff="inverse-square") for place in places]
        sets["point"].append(points[:1])
        sets["spot"].append([SpotLight(places[0], falloff="inverse-square", direction=(x, y, z), inner=0.4, outer=0.6)])
        sets["area"].append([AreaLight(places[0], u=(0.6, 0.0, 0.0), v=(0.0, 0.3, 0.0))])
        sets["four points"].append(points)
    return sets


def drawn(page: subprocess.Popen[str], url: str, sets: list[list[Light]], options: dict[str, Any]) -> list[np.ndarray] | None:
    """The lightmaps, (H, W, 3) each; None where the asset cannot be relit so."""
    lights = [[{"kind": KINDS[type(light)], **asdict(light)} for light in one] for one in sets]
    said = asked(page, {"run": "three-lightmap", "asset": url, "lights": [], "lightSets": lights, **options})
    return None if "error" in said else images(said)


def asked(page: subprocess.Popen[str], job: dict[str, Any]) -> dict[str, Any]:
    """What the page says of a job."""
    assert page.stdin is not None
    assert page.stdout is not None
    page.stdin.write(json.dumps(job) + "\n")
    page.stdin.flush()
    said: dict[str, Any] = json.loads(page.stdout.readline())
    return said


def images(said: dict[str, Any]) -> list[np.ndarray]:
    """The lightmaps of a job, (H, W, 3) each."""
    shapes = [(one["height"], one["width"], 4) for one in said["pictures"]]
    flat = [np.frombuffer(base64.b64decode(one["pixels"]), np.float32) for one in said["pictures"]]
    return [pixels.reshape(shape)[..., :3] for pixels, shape in zip(flat, shapes, strict=True)]


@contextmanager
def open_page(folder: str) -> Iterator[subprocess.Popen[str]]:
    """The tests' page in Chromium, which serves what is in `folder` as /served/."""
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    node = shutil.which("node", path=path)
    chromium = next(filter(None, map(shutil.which, ("chromium-headless-shell", "chromium", "google-chrome"))), None)
    assert node, "expected node, found none; pip install 'srbf[test]'"
    assert chromium, "expected Chromium on PATH, found none"
    command = [node, str(ROOT / "web/test/driver.mjs"), chromium, str(ROOT / "build/web/pages"), folder]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as page:
        assert page.stdout is not None
        page.stdout.readline()
        yield page
        page.terminate()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("assets", type=Path, nargs="+")
    parser.add_argument("--lights", type=int, default=8)
    parser.add_argument("--seed", type=int, default=3)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder, open_page(folder) as page:
        for place in arguments.assets:
            asset = Asset.open(place)
            (Path(folder) / place.name).symlink_to(place.resolve())
            for kind, sets in light_sets(asset, arguments.lights, arguments.seed).items():
                expected = [np.maximum(linear_response(asset, lights), 0) for lights in sets]
                for name, options in CASES.items():
                    found = drawn(page, f"/served/{place.name}", sets, options)
                    if found is None:
                        continue
                    ambient = asset.images["ambient"] if "ambient" in asset.images else np.float32(0)
                    errors = [
                        float(np.sqrt(np.square(image - ambient - own).mean() / np.square(own).mean()))
                        for image, own in zip(found, expected, strict=True)
                    ]
                    print(f"{place.name}, {kind}, {name}: median {np.median(errors):.4f}, worst {max(errors):.4f}", flush=True)


if __name__ == "__main__":
    main()
