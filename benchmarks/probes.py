"""`python benchmarks/probes.py SCENE.blend CAPTURE ASSET…`: the light of probes on white spheres against Cycles, by kind of light.

Irradiance on 42 vertices of each of 50 spheres of 10 cm radius at random free places that no bake saw, which nothing else sees; lights,
references and columns as of lights_inside.py.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from lights_inside import PLACES, fresh_places, placed, row
from references import rendered

from srbf.asset import Asset
from srbf.bake.job import base_job
from srbf.bake.scene_query import ask_scene
from srbf.bake.settings import BakeSettings, Receiver
from srbf.bake.worker import Worker
from srbf.capture import Capture
from srbf.methods import linear_response
from srbf.relighting.probe_light import harmonics, light_at

SPHERES = Path(__file__).parent.parent / "data" / "scenes" / "white_spheres.py"
NAME, RADIUS, CLEARANCE = "White spheres", 0.1, 0.05  # m


def geometry(scene: Path, settings: BakeSettings) -> tuple[np.ndarray, np.ndarray]:
    """Positions (n, 3) and unit normals (n, 3) of all vertices."""
    images = {}
    with tempfile.TemporaryDirectory(prefix="srbf-") as name:
        scratch = Path(name)
        job = {**base_job(scene, settings, scratch), "channels": ["position", "normal", "coverage"]}
        with Worker(job, scratch, scratch / "bake.log", None) as worker:
            for event in worker.events(print):
                if event["event"] == "image":
                    images[event["name"]] = np.load(scratch / event["file"]).reshape(settings.width * settings.height, -1)
    real = images["coverage"][:, 0] > 0
    return images["position"][real], images["normal"][real]


def main() -> None:
    """Print a row per kind of light."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene", type=Path)
    parser.add_argument("capture", type=Path)
    parser.add_argument("assets", type=Path, nargs="+")
    parser.add_argument("--spheres", type=int, default=50)
    parser.add_argument("--lights", type=int, default=12)
    parser.add_argument("--samples", type=int, default=64)
    parser.add_argument("--kinds", default="point,spot,area")
    asked = parser.parse_args()
    capture = Capture.open(asked.capture)
    question = {"box": None, "count": 0, "random": asked.spheres, "places": 1, "seed": 4242, "random_clearance": RADIUS + CLEARANCE}
    centers = np.array(ask_scene(asked.scene, {"places": question}, print)["places"]["random"])
    print(f"{'asset':>24}{'light':>8}{'pooled':>8}{'mean':>8}{'worst':>8}{'without 1 %':>14}{'energy':>9}{'noise':>8}")
    with tempfile.TemporaryDirectory(prefix="srbf-") as name:
        scene, listed = Path(name) / "spheres.blend", Path(name) / "places.json"
        listed.write_text(json.dumps(centers.tolist()))
        subprocess.run([sys.executable, SPHERES, asked.scene, scene, listed, str(RADIUS)], check=True, stdout=subprocess.DEVNULL)
        receiver = Receiver("vertices", NAME)
        found = ask_scene(scene, {"vertices": receiver.job()})
        settings = BakeSettings(receiver, found["width"], found["height"])
        points, normals = geometry(scene, settings)
        fresh = fresh_places(asked.scene, PLACES)
        for kind in asked.kinds.split(","):
            lights = placed(capture, kind, asked.lights, np.random.default_rng([3, len(kind)]), fresh)
            references = rendered(scene, settings, lights, asked.samples)["indirect"]
            first, second = references.reshape(2, len(lights), -1, 3)[:, :, : len(points)]
            for path in asked.assets:
                asset = Asset.open(path)
                relit = [light_at(asset, harmonics(asset, linear_response(asset, [light])), points, normals) for light in lights]
                print(f"{path.name:>24}{kind:>8}{row(np.stack(relit), first, second)}", flush=True)


if __name__ == "__main__":
    main()
