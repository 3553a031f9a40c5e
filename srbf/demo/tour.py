"""The demo without a scene: three scenes one after the other, each with a page of one file, and an index that grows as they are made."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import srbf
from srbf.bake.run import Reporter
from srbf.demo import Demo, Progress, Quality, Ready, Shown, run_demo, scene_script
from srbf.demo.dome import run_demo_dome
from srbf.demo.index_page import Card, data_uri, index_page
from srbf.demo.inside import run_demo_inside
from srbf.errors import SrbfError
from srbf.io import files
from srbf.viewer.built_page import page_files
from srbf.viewer.contents import contents_of
from srbf.viewer.single_file import single_file

INDEX = "index.html"
KEPT = "card.json"  # of a finished scene


@dataclass(frozen=True)
class Stop:
    """A scene of the tour: its name is that of its folder and of its page, `opens` the state that the page opens with."""

    name: str
    title: str
    sentence: str
    opens: dict[str, Any]
    make: Callable[[str, Path, Reporter, Progress, Quality, Ready], Demo]

    def card(self) -> Card:
        """What the index says before anything is made."""
        return Card(self.title, self.sentence, self.opens)


def _split(name: str, folder: Path, reporter: Reporter, progress: Progress, quality: Quality, ready: Ready) -> Demo:
    return run_demo(name, folder, None, reporter, progress, quality, "indirect", ready)


def _sun(x: float, y: float, z: float, intensity: float) -> dict[str, Any]:
    return {"kind": "directional", "on": True, "color": "#fff0dc", "intensity": intensity, "direction": [x, y, z]}


def _point(x: float, y: float, z: float, intensity: float) -> dict[str, Any]:
    own = {"position": [x, y, z], "a0": 1, "falloff": "inverse-square", "radius": 0.001}
    return {"kind": "point", "on": True, "color": "#ffe2bd", "intensity": intensity, **own}


STOPS = (
    Stop(
        "loft",
        "Carry a light through a loft",
        "Drag the light through the door: its shadows stay crisp, and its bounces follow.",
        {"lights": [_point(5.0, 2.55, 1.3, 4)], "tone": "agx"},
        run_demo_inside,
    ),
    Stop(
        "caustics",
        "Move the sun over colored glass",
        "Drag the sun on the disc: light falls through the glass in color, and the pawn's shadow stays sharp.",
        {"lights": [_sun(-0.45, -0.5, 0.74, 1.1)], "tone": "agx"},
        _split,
    ),
    Stop(
        "coin",
        "Rake light over a coin",
        "Drag the light toward the rim of the disc: every letter and scratch of the photographed coin throws its shadow.",
        {"lights": [_sun(-0.62, 0.55, 0.56, 1.0)]},
        run_demo_dome,
    ),
)


def run_tour(folder: Path, reporter: Reporter, progress: Progress, quality: Quality = "draft") -> list[str]:
    """Make the scenes of STOPS, each in a folder of its own; returns a line for each that failed, and goes on with the next.

    The index is there, and its path is said, as soon as the first scene can be opened. Finished scenes are kept, others resumed.
    MissingLibraryError where the scenes or the built page are not installed.
    """
    page_files()
    for stop in STOPS:
        scene_script(stop.name)
    files.make_folder(folder)
    cards = [stop.card() for stop in STOPS]
    failures = []
    said = False

    def write(grows: bool = True) -> None:
        nonlocal said
        files.write_text(folder / INDEX, index_page(cards, grows))
        if not said and any(card.page for card in cards):
            said = True
            reporter.say(f"open {folder / INDEX}: one scene can be relit now, the others follow on the same page")

    for number, stop in enumerate(STOPS):
        card = cards[number]
        kept = _kept(folder, stop, quality)
        if kept is not None:
            cards[number] = kept
            write()
            continue
        card.note = "Being made now."
        write()

        def ready(shown: Shown, stop: Stop = stop, card: Card = card) -> None:
            files.write_text(folder / f"{stop.name}.html", single_file(contents_of([shown.asset], None, shown.mesh)))
            card.page, card.note = f"{stop.name}.html", "Cycles renders what it is compared with."
            write()
            card.picture = data_uri(shown.picture())
            write()

        def say(line: str, stop: Stop = stop) -> None:
            reporter.say(f"{stop.name}: {line}")

        try:
            made = stop.make(stop.name, folder / stop.name, Reporter(reporter.progress, say), progress, quality, ready)
        except (SrbfError, OSError, MemoryError) as error:
            failures.append(f"{stop.name} failed: {' '.join(str(error).split()) or type(error).__name__}")
            card.note, card.failed = failures[-1], True
            reporter.say(failures[-1])
        else:
            card.note = f"{made.error[0].upper()}{made.error[1:]}."
            files.write_json(folder / stop.name / KEPT, _record(quality, card))
        write()
    write(grows=False)
    return failures


def _record(quality: Quality, card: Card) -> dict[str, Any]:
    return {"srbf": srbf.__version__, "quality": quality, "card": asdict(card)}


def _kept(folder: Path, stop: Stop, quality: Quality) -> Card | None:
    """The card of a scene that is finished and whose page is there."""
    path = folder / stop.name / KEPT
    if not path.is_file() or not (folder / f"{stop.name}.html").is_file():
        return None
    found = files.read_json(path)
    card = Card(**found["card"])
    return card if found == _record(quality, card) and (card.title, card.opens) == (stop.title, stop.opens) else None
