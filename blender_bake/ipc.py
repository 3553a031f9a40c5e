# SPDX-License-Identifier: GPL-3.0-or-later
"""Messages between the worker and its host: JSON lines to stdout and from stdin, arrays as files in the scratch folder."""

from __future__ import annotations

import json
import os
import shutil
import sys
import threading
from collections import deque
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

SESSION = "blender_"  # begins the name of the temporary folder that Blender makes when it starts


class WorkerError(Exception):
    """A failure, sent to the host in one line: expected, found, what to do."""


class Events:
    """Events to the host. Once this is made, Blender's own output, of C and of Python, goes to stderr."""

    def __init__(self) -> None:
        sys.stdout.flush()
        self._out = os.fdopen(os.dup(1), "w", encoding="utf-8")
        os.dup2(2, 1)

    def emit(self, event: str, **fields: Any) -> None:
        """Send one JSON line, flushed."""
        self._out.write(json.dumps({"event": event, **fields}) + "\n")
        self._out.flush()

    def warn(self, message: str) -> None:
        """Send a warning for the user."""
        self.emit("warning", message=message)


def hand_over(scratch: Path, name: str, array: np.ndarray) -> str:
    """Write an array as float32 for the host; returns the file's name. WorkerError where it cannot be written."""
    file = f"{name}.npy"
    try:
        np.save(scratch / file, np.ascontiguousarray(array, np.float32))
    except OSError as error:
        raise WorkerError(f"cannot write into {scratch.parent}: {error}; is the disk full? Free some and run again") from error
    return file


class Requests:
    """The host's requests on stdin, a JSON line each. The worker exits when stdin ends, that is when the host does, even by kill -9.

    Iterates over the requests as they come, until `{"end": true}`, which drops those not begun.
    """

    def __init__(self) -> None:
        self._waiting: deque[dict[str, Any] | None] = deque()
        self._changed = threading.Condition()
        threading.Thread(target=self._watch, daemon=True).start()

    def __iter__(self) -> Iterator[dict[str, Any]]:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._waiting)
                request = self._waiting.popleft()
            if request is None:
                return
            yield request

    def _watch(self) -> None:
        rest = b""
        while block := os.read(0, 65536):
            *lines, rest = (rest + block).split(b"\n")
            with self._changed:
                for line in lines:
                    request = json.loads(line)
                    if request.get("end"):
                        self._waiting.clear()
                        self._waiting.append(None)
                    else:
                        self._waiting.append(request)
                self._changed.notify()
        leave(3)


def leave(status: int) -> NoReturn:
    """Exit at once: after a failed driver Blender can hang in its shutdown. Its temporary folder, which that would remove, goes first."""
    sys.stderr.flush()
    blender = sys.modules.get("bpy")
    folder = Path(getattr(getattr(blender, "app", None), "tempdir", ""))
    if folder.name.startswith(SESSION):  # else it is the system's
        shutil.rmtree(folder, ignore_errors=True)
    os._exit(status)
