"""`python -m scripts.film_viewer ASSET --mesh SCENE.glb -o FILM.webp`: a looping film of the viewer while light and camera orbit.

With `--carry X,Y,Z/X,Y,Z…` the camera stays at `--eye`, and a point light goes along these places (m) and back. Needs what the viewer's
tests need: `make setup-test`.
"""

from __future__ import annotations

import argparse
import base64
import io
import json
import sys
import tempfile
from collections.abc import Iterable, Iterator
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
    parser.add_argument("--carry", help="places of a point light, m")
    parser.add_argument("--eye", type=float, nargs=3, help="where the camera stays then, m; by default where the scene has it")
    parser.add_argument("--intensity", type=float, default=4.0, help="of the point light")
    given = parser.parse_args()
    target = np.array(given.target)
    path = None if given.carry is None else np.array([[float(x) for x in place.split(",")] for place in given.carry.split("/")])
    with browser(given.asset, given.mesh) as (ask, url):
        pictures = []
        for i in range(given.frames):
            turn = i / given.frames
            shown = (
                orbiting(turn, target, given.distance)
                if path is None
                else carried(turn, path, given.intensity, given.eye and [rounded(given.eye), rounded(target)])
            )
            address = url + "#" + json.dumps(shown, separators=(",", ":")).replace("#", "%23").replace('"', "'")
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


def orbiting(turn: float, target: np.ndarray, distance: float) -> dict[str, Any]:
    """The page's state at the fraction `turn` of an orbit: the camera orbits the target, the sun in the opposite direction."""
    angle = 2 * np.pi * turn
    eye = target + distance * np.array([np.sin(0.46 + angle) * 0.83, -np.cos(0.46 + angle) * 0.83, 0.56])
    elevation = np.radians(48 + 12 * np.sin(2 * angle))
    azimuth = np.radians(215) - angle
    direction = [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
    light = {"kind": "directional", "on": True, "color": "#fff0dc", "intensity": 1.1, "direction": rounded(direction)}
    return {"lights": [light], "selected": -1, "eye": [rounded(eye), rounded(target)]}


def carried(turn: float, path: np.ndarray, intensity: float, eye: list[list[float]] | None) -> dict[str, Any]:
    """The same for a point light on its way along `path` (n, 3) and back, slower at both ends."""
    lengths = np.r_[0, np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))]
    along = (1 - np.cos(2 * np.pi * turn)) / 2 * lengths[-1]
    place = [np.interp(along, lengths, path[:, axis]) for axis in range(3)]
    light = {
        "kind": "point",
        "on": True,
        "color": "#fff0dc",
        "intensity": intensity,
        "position": rounded(place),
        "falloff": "inverse-square",
        "a0": 1.0,
        "radius": 0.001,
    }
    return {"lights": [light], "selected": -1, "tone": "agx", **({"eye": eye} if eye else {})}


def rounded(vector: Iterable[float]) -> list[float]:
    """To digits that an address may have."""
    return [round(float(x), 5) for x in vector]


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
