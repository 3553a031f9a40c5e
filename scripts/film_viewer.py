"""`python -m scripts.film_viewer ASSET --mesh SCENE.glb -o FILM.webp`: a looping film of the viewer while light and camera orbit.

Needs what the viewer's tests need: `make setup-test`.
"""

from __future__ import annotations

import argparse
import base64
import io
import json
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Thread
from typing import Any

import numpy as np
from PIL import Image

from srbf.io.files import atomic_path
from srbf.viewer.contents import contents_of
from srbf.viewer.server import ViewerServer
from tests.npm_package import WEB, browser_program, driven

PANEL = 312  # pixels of the page beside the picture
QUALITY = 72
MILLISECONDS = 90  # a frame


def main() -> None:
    """Film what is asked for."""
    parser = argparse.ArgumentParser(prog="python -m scripts.film_viewer", description=__doc__.splitlines()[0])
    parser.add_argument("asset", type=Path)
    parser.add_argument("--mesh", type=Path, required=True)
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--frames", type=int, default=48)
    parser.add_argument("--width", type=int, default=640)
    parser.add_argument("--height", type=int, default=400)
    parser.add_argument("--target", type=float, nargs=3, default=(0.0, 0.0, 0.12), help="what the camera looks at, m")
    parser.add_argument("--distance", type=float, default=2.9, help="of the camera, m")
    given = parser.parse_args()
    with browser(given.asset, given.mesh) as (ask, url):
        pictures = []
        for i in range(given.frames):
            address = url + state(i / given.frames, np.array(given.target), given.distance)
            if i == 0:
                ask("open", url=address, width=given.width + PANEL, height=given.height)
            else:
                ask("run", script=f"location.hash = {json.dumps(address.split('#', 1)[1])}; new Promise(requestAnimationFrame)")
                ask("press", keys=["Shift"])  # no key of the page: comes back when it is at rest
            png = base64.b64decode(ask("download", text="Picture (PNG)")["bytes"])
            pictures.append(Image.open(io.BytesIO(png)).convert("RGB"))
            sys.stderr.write(f"{i + 1} of {given.frames}\n")
    with atomic_path(given.output) as temporary:  # whole frames: differences from the one before show as blocks
        film = {"save_all": True, "append_images": pictures[1:], "duration": MILLISECONDS, "loop": 0, "kmin": 0, "kmax": 1}
        pictures[0].save(temporary, "WEBP", **film, quality=QUALITY, method=4)


def state(turn: float, target: np.ndarray, distance: float) -> str:
    """The page's address at the fraction `turn` of an orbit: the camera orbits the target, the sun in the opposite direction."""
    angle = 2 * np.pi * turn
    eye = target + distance * np.array([np.sin(0.46 + angle) * 0.83, -np.cos(0.46 + angle) * 0.83, 0.56])
    elevation = np.radians(48 + 12 * np.sin(2 * angle))
    azimuth = np.radians(215) - angle
    direction = [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
    light = {"kind": "directional", "on": True, "color": "#fff0dc", "intensity": 1.1, "direction": [round(float(x), 5) for x in direction]}
    shown = {"lights": [light], "selected": -1, "eye": [[round(float(x), 5) for x in v] for v in (eye, target)]}
    return "#" + json.dumps(shown, separators=(",", ":")).replace("#", "%23").replace('"', "'")


@contextmanager
def browser(asset: Path, mesh: Path) -> Iterator[tuple[Any, str]]:
    """A function that sends commands to a Chromium, and the address of the page."""
    server = ViewerServer(contents_of([asset], None, mesh))
    Thread(target=server.serve_forever, daemon=True).start()
    with (
        tempfile.TemporaryDirectory() as folder,
        driven(WEB / "viewer" / "driver.mjs", browser_program(), log=Path(folder) / "log") as process,
    ):

        def ask(what: str, **job: Any) -> Any:
            process.stdin.write(json.dumps({"do": what, **job}) + "\n")
            process.stdin.flush()
            response = json.loads(process.stdout.readline())
            if "error" in response:
                raise RuntimeError(response["error"])
            return response.get("value")

        yield ask, server.url
    server.shutdown()


if __name__ == "__main__":
    main()
