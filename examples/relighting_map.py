"""A capture to a relit image in a dozen lines: `python examples/relighting_map.py CAPTURE OUT.png`."""

import sys
from pathlib import Path

from srbf.capture import Capture
from srbf.evaluation.errors_by_role import evaluate
from srbf.io.image import write_picture
from srbf.lights import DirectionalLight, PointLight
from srbf.methods import relight
from srbf.methods.relighting_map import RelightingMap


def main(capture_folder: str, picture: str) -> None:
    """Fit 25 maps, print the held-out error, relight by a blue directional light and, where there are positions, a warm point light."""
    capture = Capture.open(capture_folder)
    asset = RelightingMap(k=25).encode(capture)
    errors = evaluate(asset, capture)
    sys.stdout.write("".join(f"{role}: {error['psnr']:.1f} dB\n" for role, error in errors.items() if role != "lights"))
    lights = [DirectionalLight((0.3, 0.2, 0.9), color=(0.3, 0.4, 0.6))]
    if "position" in asset.images:
        x, y, z = asset.images["position"][asset.covered].mean(axis=0)
        lights.append(PointLight((x, y, z + 0.6), color=(1.0, 0.7, 0.4), a0=0.6))
    write_picture(Path(picture), relight(asset, lights))


if __name__ == "__main__":
    main(*sys.argv[1:])
