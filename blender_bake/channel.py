# SPDX-License-Identifier: GPL-3.0-or-later
"""How the worker speaks to its host: JSON lines on the real stdout, arrays as files in the scratch folder, death on end of stdin."""

from __future__ import annotations

import json
import os
import sys
import threading
from pathlib import Path
from typing import Any, NoReturn

import numpy as np


class WorkerError(Exception):
    """A failure told to the host in one line: expected, found, what to do."""


class Channel:
    """Events out. Blender's own chatter, from C as from Python, goes to stderr once this is made."""

    def __init__(self) -> None:
        sys.stdout.flush()
        self._out = os.fdopen(os.dup(1), "w", encoding="utf-8")
        os.dup2(2, 1)

    def emit(self, event: str, **fields: Any) -> None:
        """One JSON line, flushed."""
        self._out.write(json.dumps({"event": event, **fields}) + "\n")
        self._out.flush()

    def warn(self, message: str) -> None:
        """A line for the user that does not stop the bake."""
        self.emit("warning", message=message)


def hand_over(scratch: Path, name: str, array: np.ndarray) -> str:
    """Write a float32 array for the host to take; returns the file's name."""
    file = f"{name}.npy"
    try:
        np.save(scratch / file, np.ascontiguousarray(array, np.float32))
    except OSError as error:
        raise WorkerError(f"cannot write into {scratch.parent}: {error}; is the disk full? Free some and run again") from error
    return file


def die_with_host() -> None:
    """End this process as soon as stdin closes: the host holds the other end, so its death, even by kill -9, closes it."""

    def watch() -> None:
        while os.read(0, 4096):
            pass
        leave(3)

    threading.Thread(target=watch, daemon=True).start()


def leave(status: int) -> NoReturn:
    """Exit at once: after a failed driver Blender can hang for ever in its own shutdown."""
    sys.stderr.flush()
    os._exit(status)
