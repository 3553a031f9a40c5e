"""`python -m scripts.gallery`: make the gallery, or resume it.

Bakes and assets go to -o, pictures to --docs, the page beside that folder. Outputs made from the same scene, settings and version
are kept. --small runs every step at a tiny size, for the test.
"""

from __future__ import annotations

import argparse
import sys
import time
import warnings
from collections.abc import Callable
from pathlib import Path

from scripts.gallery import figure, page
from scripts.gallery.making import is_done, make
from scripts.gallery.paths import ScenePaths
from scripts.gallery.scenes import SCENES
from scripts.gallery.steps import Steps
from srbf.bake.folder import locked
from srbf.bake.run import Reporter
from srbf.errors import SrbfError
from srbf.io import files

LOCK = ".gallery.lock"
PROGRESS_INTERVAL = 20.0  # seconds between two lines about a bake's progress


def main() -> int:
    """Make the requested scenes; returns 0 when all are done."""
    parser = argparse.ArgumentParser(prog="python -m scripts.gallery", description=__doc__.splitlines()[0])
    parser.add_argument("--only", action="append", choices=[scene.name for scene in SCENES], help="make only this scene; may be repeated")
    parser.add_argument("-o", "--output", type=Path, default=Path("out/gallery"), help="folder of bakes and assets")
    parser.add_argument("--docs", type=Path, default=Path("docs/gallery"), help="folder of pictures; the page is beside it")
    parser.add_argument("--small", action="store_true", help="tiny, takes seconds")
    given = parser.parse_args()
    warnings.showwarning = lambda message, *_rest, **_named: say(f"  {message}")
    try:
        files.make_folder(given.output)
    except SrbfError as error:
        say(f"gallery: {error}")
        return 1
    held = locked(given.output, LOCK)  # until this process ends
    if held is None:
        say(f"gallery: another process is making {given.output}; wait for it, or choose another -o")
        return 1
    steps = Steps(given.output, say)
    scenes = [scene.small() if given.small else scene for scene in SCENES]
    everything = [ScenePaths(scene, given.output / scene.name, given.docs) for scene in scenes]
    started = time.perf_counter()
    try:
        for paths in everything:
            if not given.only or paths.scene.name in given.only:
                make(paths, steps, Reporter(progress_lines(), say))
        made = [paths for paths in everything if is_done(paths, steps)]
        finish(made, steps, given.docs)
    except SrbfError as error:
        say(f"gallery: {error}")
        return 1
    for paths in made:
        say(f"{paths.scene.name:14} {page.duration(steps.total([paths.scene.name]).seconds)}")
    whole = page.duration(steps.total([paths.scene.name for paths in made]).seconds)
    say(f"{'all':14} {whole}; this run {page.duration(time.perf_counter() - started)}, {len(steps.redone)} steps")
    return 0


def finish(made: list[ScenePaths], steps: Steps, docs: Path) -> None:
    """Draw the figure of all finished scenes and write the page if its text changed."""
    steps.run("figure", figure.made_from(made, steps), [docs / page.FIGURE], lambda: figure.draw(made, docs / page.FIGURE))
    path = docs.with_suffix(".md")
    written = page.text(made, steps, docs.name)
    if not path.is_file() or path.read_text(encoding="utf-8") != written:
        files.write_text(path, written)
        say(f"wrote {path}")


def progress_lines() -> Callable[[float, float, str], None]:
    """A callback that prints a line about a bake at intervals."""
    last = time.monotonic()

    def show(done: float, total: float, what: str) -> None:
        nonlocal last
        if time.monotonic() - last > PROGRESS_INTERVAL:
            last = time.monotonic()
            say(f"  {what}, {done:.0f} of {total:.0f} samples")

    return show


def say(line: str) -> None:
    """Print a line and flush stdout."""
    print(line, flush=True)


if __name__ == "__main__":
    sys.exit(main())
