"""Steps that are done once: each knows what it was made from, what it left and how long it took, over any number of runs."""

from __future__ import annotations

import hashlib
import json
import os
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from srbf.io import files

TIMES = "times.json"
BEAT = 5.0  # seconds between two notes of how long the step at hand has taken so far


@dataclass(frozen=True)
class Made:
    """A finished step: the digest of all that it was made from, its wall seconds, those of interrupted runs included, and CPU seconds.

    `cpu` lacks what a killed run had used by then; `interrupted` counts such runs.
    """

    digest: str
    seconds: float
    cpu: float
    interrupted: int


@dataclass
class Steps:
    """The steps of one gallery, noted in times.json of its folder."""

    folder: Path
    say: Callable[[str], None]
    redone: list[str] = field(default_factory=list)
    _noted: dict[str, dict[str, Any]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        files.make_folder(self.folder)
        if (self.folder / TIMES).is_file():
            self._noted = files.read_json(self.folder / TIMES)["steps"]

    def run(self, name: str, made_from: Any, outputs: Sequence[Path], make: Callable[[], object]) -> str:
        """Do the step unless its outputs are there and were made from the same; returns the digest for steps that follow."""
        digest = hashlib.sha256(json.dumps(made_from, sort_keys=True, default=str).encode()).hexdigest()[:16]
        before = self._noted.get(name)
        same = before is not None and before["digest"] == digest
        if same and before is not None and before["done"] and all(path.exists() for path in outputs):
            return digest
        for path in outputs:
            files.make_folder(path.parent)
        self.redone.append(name)
        self.say(f"{name} …")
        goes_on = same and before is not None and not before["done"]
        note: dict[str, Any] = {"digest": digest, "done": False, "seconds": 0.0, "cpu": 0.0, "interrupted": 0}
        if goes_on and before is not None:
            note |= {"seconds": before["seconds"], "interrupted": before["interrupted"] + 1}
        self._noted[name] = note
        used = _cpu_seconds()
        with self._beating(note):
            make()
        missing = [path.name for path in outputs if not path.exists()]
        assert not missing, f"{name} left no {missing}"
        note |= {"done": True, "cpu": round(_cpu_seconds() - used, 2)}
        self._write()
        self.say(f"{name}: {note['seconds']:.1f} s")
        return digest

    def made(self, name: str) -> Made:
        """What is noted of a finished step."""
        note = self._noted[name]
        return Made(note["digest"], note["seconds"], note["cpu"], note["interrupted"])

    def has(self, name: str) -> bool:
        """Whether a step was finished once."""
        return bool(self._noted.get(name, {}).get("done"))

    def spent(self, scene: str, kinds: Sequence[str]) -> float:
        """Seconds of a scene's finished steps whose names are, or begin with, one of some words."""
        names = [f"{scene}/{kind}" for kind in kinds]
        return sum(
            note["seconds"]
            for step, note in self._noted.items()
            if note["done"] and any(step == name or step.startswith(f"{name} ") for name in names)
        )

    def total(self, scenes: Sequence[str]) -> Made:
        """The sums over all finished steps of some scenes."""
        notes = [note for name, note in self._noted.items() if note["done"] and name.split("/")[0] in scenes]
        return Made("", sum(n["seconds"] for n in notes), sum(n["cpu"] for n in notes), sum(n["interrupted"] for n in notes))

    @contextmanager
    def _beating(self, note: dict[str, Any]) -> Iterator[None]:
        """Note every few seconds how long it has taken, so that a kill loses little of the time."""
        earlier, started, over = note["seconds"], time.perf_counter(), threading.Event()

        def beat() -> None:
            while not over.wait(BEAT):
                note["seconds"] = round(earlier + time.perf_counter() - started, 2)
                self._write()

        self._write()
        thread = threading.Thread(target=beat, daemon=True)
        thread.start()
        try:
            yield
        finally:
            over.set()
            thread.join()
            note["seconds"] = round(earlier + time.perf_counter() - started, 2)
            self._write()

    def _write(self) -> None:
        files.write_json(self.folder / TIMES, {"steps": self._noted})


def _cpu_seconds() -> float:
    """Of this process and of all children that have ended."""
    spent = os.times()
    return spent.user + spent.system + spent.children_user + spent.children_system
