"""Steps that run once: each records its inputs, its outputs and its time, over any number of runs."""

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
RECORD_INTERVAL = 5.0  # seconds between two records of the time of the running step


@dataclass(frozen=True)
class Made:
    """A finished step: the digest of its inputs, its wall seconds (interrupted runs included), and its CPU seconds.

    `cpu` leaves out killed runs; `interrupted` counts them.
    """

    digest: str
    seconds: float
    cpu: float
    interrupted: int


@dataclass
class Steps:
    """The steps of one gallery, recorded in its folder's times.json."""

    folder: Path
    say: Callable[[str], None]
    redone: list[str] = field(default_factory=list)
    _noted: dict[str, dict[str, Any]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        files.make_folder(self.folder)
        if (self.folder / TIMES).is_file():
            self._noted = files.read_json(self.folder / TIMES)["steps"]

    def run(self, name: str, made_from: Any, outputs: Sequence[Path], make: Callable[[], object]) -> str:
        """Run `make` unless the outputs exist and were made from the same inputs; returns the digest of the inputs for later steps."""
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
        with self._recording(note):
            make()
        missing = [path.name for path in outputs if not path.exists()]
        assert not missing, f"{name} did not write {missing}"
        note |= {"done": True, "cpu": round(_cpu_seconds() - used, 2)}
        self._write()
        self.say(f"{name}: {note['seconds']:.1f} s")
        return digest

    def made(self, name: str) -> Made:
        """The record of a finished step."""
        note = self._noted[name]
        return Made(note["digest"], note["seconds"], note["cpu"], note["interrupted"])

    def has(self, name: str) -> bool:
        """Whether a step was ever finished."""
        return bool(self._noted.get(name, {}).get("done"))

    def spent(self, scene: str, kinds: Sequence[str]) -> float:
        """Seconds of a scene's finished steps whose names equal, or begin with, one of `kinds`."""
        names = [f"{scene}/{kind}" for kind in kinds]
        return sum(
            note["seconds"]
            for step, note in self._noted.items()
            if note["done"] and any(step == name or step.startswith(f"{name} ") for name in names)
        )

    def total(self, scenes: Sequence[str]) -> Made:
        """Sums over all finished steps of some scenes."""
        notes = [note for name, note in self._noted.items() if note["done"] and name.split("/")[0] in scenes]
        return Made("", sum(n["seconds"] for n in notes), sum(n["cpu"] for n in notes), sum(n["interrupted"] for n in notes))

    @contextmanager
    def _recording(self, note: dict[str, Any]) -> Iterator[None]:
        """Record the elapsed time every few seconds, so that a kill loses little of it."""
        earlier, started, over = note["seconds"], time.perf_counter(), threading.Event()

        def record() -> None:
            while not over.wait(RECORD_INTERVAL):
                note["seconds"] = round(earlier + time.perf_counter() - started, 2)
                self._write()

        self._write()
        thread = threading.Thread(target=record, daemon=True)
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
    """CPU seconds of this process and of all ended children."""
    spent = os.times()
    return spent.user + spent.system + spent.children_user + spent.children_system
