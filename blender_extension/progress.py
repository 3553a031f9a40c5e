# SPDX-License-Identifier: GPL-3.0-or-later
"""Output of a running `srbf bake --json-progress`: JSON lines of progress among lines for the user."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from typing import Any

WORDS_KEPT = 20  # lines


@dataclass(frozen=True)
class Progress:
    """One line {"done": x, "total": y, "what": "...", "seconds_left": s}; seconds_left is None while it is unknown."""

    done: float
    total: float
    what: str
    seconds_left: float | None

    @property
    def fraction(self) -> float:
        """0 to 1."""
        return min(max(self.done / self.total, 0.0), 1.0) if self.total > 0 else 0.0


class Reader:
    """Takes the stream in pieces of any length; `progress` is the latest one, `words` the last lines of other text."""

    def __init__(self) -> None:
        self.progress: Progress | None = None
        self.words: list[str] = []
        self._rest = b""

    def feed(self, piece: bytes) -> None:
        """Read the complete lines; the rest waits for its end of line."""
        *lines, self._rest = (self._rest + piece).split(b"\n")
        for line in lines:
            self._take(line.decode("utf-8", errors="replace").strip())

    def close(self) -> None:
        """Called at the end of the stream, so that a last line without a line break counts."""
        self.feed(b"\n")

    def _take(self, line: str) -> None:
        progress = parse(line)
        if progress is not None:
            self.progress = progress
        elif line:
            self.words = [*self.words, line][-WORDS_KEPT:]


def parse(line: str) -> Progress | None:
    """The progress of a line; None for other text, other JSON, or invalid numbers."""
    try:
        told = json.loads(line)
    except ValueError:
        return None
    if not isinstance(told, dict):
        return None
    done, total, left = (_number(told.get(key)) for key in ("done", "total", "seconds_left"))
    if done is None or total is None:
        return None
    return Progress(done, total, str(told.get("what", "")), None if left is None or left < 0 else left)


def duration(seconds: float) -> str:
    """`40 s`, `12 min`, `3 h 05 min`."""
    if seconds < 60:
        return f"{math.ceil(seconds)} s"
    minutes = math.ceil(seconds / 60)
    return f"{minutes} min" if minutes < 60 else f"{minutes // 60} h {minutes % 60:02d} min"


def _number(value: Any) -> float | None:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        return None
    return float(value)
