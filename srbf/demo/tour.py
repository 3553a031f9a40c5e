"""The demo without a scene: three scenes, each with a page of one file, and an index that grows; their errors are measured last."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import srbf
from srbf.bake.run import Reporter
from srbf.demo import Progress, Quality, Shown, Steps, demo_steps, finished, scene_script
from srbf.demo.dome import dome_steps
from srbf.demo.index_page import Card, data_uri, index_page
from srbf.demo.inside import inside_steps
from srbf.errors import InputError, SrbfError
from srbf.io import files
from srbf.viewer.built_page import page_files
from srbf.viewer.contents import contents_of
from srbf.viewer.single_file import single_file

INDEX = "index.html"
KEPT = "card.json"  # of a scene that is begun
UNFINISHED = "Not finished: the same command resumes it."


@dataclass(frozen=True)
class Stop:
    """A scene of the tour: its name is that of its folder and of its page, `opens` the state that the page opens with."""

    name: str
    title: str
    sentence: str
    opens: dict[str, Any]
    steps: Callable[[str, Path, Reporter, Progress, Quality], Steps]

    def card(self) -> Card:
        """What the index says before anything is made."""
        return Card(self.title, self.sentence, self.opens)


def _split(name: str, folder: Path, reporter: Reporter, progress: Progress, quality: Quality) -> Steps:
    return demo_steps(name, folder, None, reporter, progress, quality, "indirect")


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
        {"lights": [_point(3.3, 2.9, 1.5, 2)], "tone": "agx"},
        inside_steps,
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
        dome_steps,
    ),
)


def run_tour(folder: Path, reporter: Reporter, progress: Progress, quality: Quality = "draft") -> list[str]:
    """Make the scenes of STOPS, each in a folder of its own, then measure them; those after one that fails, too.

    Returns a line for each failure. The index is there, and its path is said, as soon as the first scene can be opened. Finished scenes are
    kept, others resumed.
    MissingLibraryError where the scenes or the built page are not installed; InputError where `folder` has scenes of another quality.
    """
    page_files()
    for stop in STOPS:
        scene_script(stop.name)
    files.make_folder(folder)
    tour = _Tour(folder, reporter, progress, quality)
    tour.check_quality()
    try:
        for step in (tour.make, tour.draw, tour.measure):
            for number in range(len(STOPS)):
                step(number)
            if step == tour.make:
                reporter.say("all scenes that were made can be opened; next their errors are measured")
        return [card.note for card in tour.cards if card.failed]
    finally:
        tour.end()


class _Tour:
    """One run: the cards of its scenes, and the index that shows them."""

    def __init__(self, folder: Path, reporter: Reporter, progress: Progress, quality: Quality) -> None:
        self._folder, self._reporter, self._progress, self._quality = folder, reporter, progress, quality
        self.cards = [stop.card() for stop in STOPS]
        self._opened: dict[int, tuple[Shown, Steps]] = {}
        self._is_said = False

    def check_quality(self) -> None:
        """InputError where a scene was begun with another quality."""
        for stop in STOPS:
            found = self._found(stop) or {}
            quality = found.get("quality", self._quality)
            if quality != self._quality and found.get("srbf") == srbf.__version__:
                raise InputError(
                    f"expected quality {quality}, that of the scenes in {self._folder}, found {self._quality}; "
                    "choose another folder, or delete it"
                )

    def end(self) -> None:
        """The index as it stays; scenes that an interrupt left say so."""
        for card in self.cards:
            if not card.is_done:
                card.note = UNFINISHED
        self.write(grows=False)

    def write(self, grows: bool = True) -> None:
        """The index as it is now; says where it is once there is a link on it."""
        files.write_text(self._folder / INDEX, index_page(self.cards, grows))
        if not self._is_said and any(card.page for card in self.cards):
            self._is_said = True
            self._reporter.say(f"open {self._folder / INDEX}: one scene can be relit now, the others follow on the same page")

    def make(self, number: int) -> None:
        """Make a scene until it can be opened, or keep it where it is finished."""
        stop, card = STOPS[number], self.cards[number]
        kept = self._kept(stop)
        if kept is not None:
            self.cards[number] = kept
            self.write()
            return
        card.note = "Being made now."
        self.write()
        files.make_folder(self._folder / stop.name)
        files.write_json(self._folder / stop.name / KEPT, self._record(card))

        def say(told: str) -> None:
            self._reporter.say(f"{stop.name}: {told}")

        with self._failing(stop, card):
            steps = stop.steps(stop.name, self._folder / stop.name, Reporter(self._reporter.progress, say), self._progress, self._quality)
            shown = next(steps)
            page = single_file(contents_of([shown.asset], None, shown.mesh))
            files.write_text(self._folder / f"{stop.name}.html", page)
            card.page, card.note = f"{stop.name}.html", "Its errors are measured once all scenes can be opened."
            self._opened[number] = shown, steps
        self.write()

    def draw(self, number: int) -> None:
        """The picture of a scene that was made in this run."""
        if number in self._opened:
            with self._failing(STOPS[number], self.cards[number]):
                self.cards[number].picture = data_uri(self._opened[number][0].picture())
            self.write()

    def measure(self, number: int) -> None:
        """The errors of a scene that was made in this run."""
        stop, card = STOPS[number], self.cards[number]
        if number not in self._opened or card.failed:
            return
        _, steps = self._opened[number]
        card.note = "Its errors are being measured."
        self.write()
        with self._failing(stop, card):
            made = finished(steps)
            card.note, card.is_done = f"{made.error[0].upper()}{made.error[1:]}.", True
            files.write_json(self._folder / stop.name / KEPT, self._record(card))
        self.write()

    @contextmanager
    def _failing(self, stop: Stop, card: Card) -> Iterator[None]:
        """Whatever fails in here, the other scenes can still be made."""
        try:
            yield
        except Exception as error:  # noqa: BLE001  whatever it is, one line says so on the page
            card.note, card.failed, card.is_done = f"{stop.name} failed: {_in_one_line(error)}", True, True
            self._reporter.say(card.note)

    def _kept(self, stop: Stop) -> Card | None:
        """The card of a scene that is finished and whose page is there."""
        found = self._found(stop)
        if found is None or not (self._folder / f"{stop.name}.html").is_file():
            return None
        with suppress(KeyError, TypeError):
            card = Card(**found["card"])
            if card.is_done and found == self._record(card):
                return replace(card, title=stop.title, sentence=stop.sentence, opens=stop.opens)
        return None

    def _found(self, stop: Stop) -> dict[str, Any] | None:
        """What a scene recorded, when it was begun or once it was finished."""
        with suppress(SrbfError):
            return files.read_json(self._folder / stop.name / KEPT)
        return None

    def _record(self, card: Card) -> dict[str, Any]:
        return {"srbf": srbf.__version__, "quality": self._quality, "card": asdict(card)}


def _in_one_line(error: Exception) -> str:
    kind = "" if isinstance(error, SrbfError) else f"{type(error).__name__} "
    return kind + " ".join(str(error).split())
