"""`python -m scripts.live_pages SCENE...`: scenes of `srbf demo` as single files that open from disk, for `make site`.

Scenes are made in --demos where they are missing; pages and a list of them go to -o. A page above 10 MiB is refused: phones read it whole.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from srbf.demo.tour import STOPS
from srbf.io import files

LARGEST = 10 << 20  # bytes
OPTIONS = {"caustics": ("--transport", "indirect")}  # as `srbf demo` without a scene makes it
LIST = "live.md"
BESIDE = {
    "loft": "Carry a light through the door of a furnished room: shadows are crisp, bounces follow.",
    "caustics": "A table under two glass rings, a ball and an angel of tinted glass. Move the sun: direct light is drawn by shadow maps.",
    "coin": "A struck coin, from 48 photographs under a light dome. Rake the light over it.",
    "house": "A room by daylight, seen by one camera. Move the sun around the house.",
}


@dataclass(frozen=True)
class LivePage:
    """A scene's page, and its size in bytes."""

    scene: str
    path: Path
    size: int

    @property
    def line(self) -> str:
        """Its entry in the list."""
        return f"- [{self.scene.capitalize()}](live/{self.path.name}), {self.size / (1 << 20):.1f} MiB. {BESIDE[self.scene]}"


def text_of(pages: list[LivePage]) -> str:
    """The list of pages, Markdown."""
    lines = "\n".join(page.line for page in pages)
    return f"""# Live scenes
Each page is one file: open it here, or save it and open it from disk. It needs no server and asks no other host.

{lines}

`make site` made them from `srbf demo` on two cores; [how to use the page](viewer.md).
"""


def demo_of(scene: str, demos: Path) -> Path:
    """The folder of a scene's demo: in that of the demo of all scenes, if it is one of these."""
    return demos / "demo" / scene if scene in {stop.name for stop in STOPS} else demos / scene


def page_of(scene: str, demo: Path, folder: Path) -> LivePage:
    """Save the page of a demo; CalledProcessError where srbf says why it cannot."""
    path, mesh = folder / f"{scene}.html", demo / "scene.glb"
    srbf("view", str(demo / "asset"), *(["--mesh", str(mesh)] if mesh.is_file() else []), "--save", str(path), "--force")
    return LivePage(scene, path, path.stat().st_size)


def srbf(*command: str) -> None:
    """Run a command of srbf."""
    subprocess.run([sys.executable, "-m", "srbf", *command], check=True)


def main() -> int:
    """Make the pages; returns 0 when all are small enough."""
    parser = argparse.ArgumentParser(prog="python -m scripts.live_pages", description=__doc__.splitlines()[0])
    parser.add_argument("scenes", nargs="+", choices=sorted(BESIDE))
    parser.add_argument("--demos", type=Path, default=Path("out"), help="folder of the demos, one for each scene")
    parser.add_argument("-o", "--output", type=Path, default=Path("build/live"))
    given = parser.parse_args()
    folder = given.output / "live"
    files.make_folder(folder)
    pages = []
    for scene in given.scenes:
        demo = demo_of(scene, given.demos)
        if not (demo / "asset" / "asset.json").is_file():
            srbf("demo", "--scene", scene, *OPTIONS.get(scene, ()), "-o", str(demo))
        pages.append(page_of(scene, demo, folder))
    files.write_text(given.output / LIST, text_of(pages))
    too_large = [f"{page.path} of {page.size / (1 << 20):.1f} MiB" for page in pages if page.size > LARGEST]
    if too_large:
        sys.stderr.write(f"expected pages of at most 10 MiB, found {', '.join(too_large)}; fit the scene with a smaller --budget\n")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
