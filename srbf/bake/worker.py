"""Blender's process as seen from outside: start it, ask it, read its events, notice its death, and never leave it behind."""

from __future__ import annotations

import importlib.util
import json
import os
import shutil
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from queue import Empty, SimpleQueue
from types import TracebackType
from typing import Any

from srbf.errors import BakeError, MissingLibraryError


def command(blender: Path | None, job: Path) -> list[str]:
    """The worker's command line: an installed Blender, else the bpy module of this Python, able to write beside `job` alone (`confine`)."""
    package = importlib.util.find_spec("blender_bake")
    if package is None or package.origin is None:
        raise MissingLibraryError("baking needs srbf-blender, found it missing; pip install srbf[blender]")
    confined = [sys.executable, str(Path(package.origin).parent / "confine.py"), str(job.parent)] if sys.platform != "win32" else []
    if blender is not None:
        if shutil.which(blender) is None:
            raise BakeError(f"cannot start Blender at {blender}: expected a program, found none; correct --blender")
        script = str(Path(package.origin).parent / "__main__.py")
        return [*confined, str(blender), "--background", "--factory-startup", "--disable-autoexec", "--python", script, "--", str(job)]
    if importlib.util.find_spec("bpy") is None:
        version = f"{sys.version_info.major}.{sys.version_info.minor}"
        raise MissingLibraryError(
            f"baking needs Blender: this Python {version} has no bpy (there is one for 3.11 and 3.13); "
            "add --blender /path/to/blender, or install srbf[blender] under such a Python"
        )
    return [*confined, sys.executable, "-m", "blender_bake", str(job)]


class WorkerDiedError(BakeError):
    """The process ended without an error event (a crash, a kill), or said nothing for too long and was killed."""


class Worker:
    """A running worker; ask it for lights, take its events. As a context manager it is dead at the end, whatever happened."""

    def __init__(self, job: dict[str, Any], scratch: Path, log: Path, blender: Path | None = None) -> None:
        path = scratch / "job.json"
        path.write_text(json.dumps(job), encoding="utf-8")
        self._log_path = log
        self._log = open(log, "ab")  # noqa: SIM115 - closed in close
        self._events: SimpleQueue[dict[str, Any] | None] = SimpleQueue()
        try:
            # A session of its own: Ctrl-C reaches the host alone, which decides. Its stdin is also our life line.
            self._process = subprocess.Popen(
                command(blender, path),
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=self._log,
                text=True,
                encoding="utf-8",
                errors="replace",
                start_new_session=True,
                # Begun with factory settings, Blender removes the wheels of all extensions that the user has.
                env={**os.environ, "BLENDER_USER_EXTENSIONS": str(scratch / "extensions")},
            )
        except OSError as error:
            self._log.close()
            raise BakeError(f"cannot start Blender at {blender or sys.executable}: {error.strerror}") from error
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def __enter__(self) -> Worker:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Kill it where it still runs."""
        if self._process.poll() is None:
            self._process.kill()
        self._process.wait()
        self._reader.join()
        for stream in (self._process.stdin, self._process.stdout):
            if stream is not None:
                with suppress(OSError):  # words that a dead worker never took
                    stream.close()
        self._log.close()

    def ask(self, light: dict[str, Any]) -> None:
        """Ask for one more light of a job that serves; what is asked for is answered in order."""
        self._tell(light)

    def end(self) -> None:
        """Let it finish the light at hand, forget the others, and end."""
        self._tell({"end": True})

    def event(self, patience: float | None = None) -> dict[str, Any] | None:
        """The next event; None once it is done. BakeError on an error event, WorkerDiedError after `patience` seconds of silence."""
        try:
            event = self._events.get(timeout=patience)
        except Empty as error:
            self._process.kill()
            raise WorkerDiedError(f"Blender's process gave no answer for {patience:.0f} s and was stopped") from error
        if event is None:
            status = self._process.wait()
            cause = f"signal {-status}" if status < 0 else f"status {status}"
            raise WorkerDiedError(f"Blender's process ended unexpectedly ({cause}), its last words being {self._last_words()}")
        if event["event"] == "error":
            raise BakeError(event["message"])
        return None if event["event"] == "done" else event

    def events(self, say: Callable[[str], None]) -> Iterator[dict[str, Any]]:
        """Every event until it is done, but warnings, which are said."""
        while (event := self.event()) is not None:
            if event["event"] == "warning":
                say(event["message"])
            else:
                yield event

    def _tell(self, request: dict[str, Any]) -> None:
        assert self._process.stdin is not None
        with suppress(OSError):  # a dead one is noticed when its answer is awaited
            self._process.stdin.write(json.dumps(request) + "\n")
            self._process.stdin.flush()

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            event = self._parse(line)
            if event is not None:
                self._events.put(event)
        self._events.put(None)

    def _parse(self, line: str) -> dict[str, Any] | None:
        try:
            event = json.loads(line)
        except ValueError:
            event = None
        if isinstance(event, dict) and "event" in event:
            return event
        self._log.write(line.encode())
        return None

    def _last_words(self) -> str:
        self._log.flush()
        with open(self._log_path, "rb") as log:
            lines = log.read()[-2000:].decode(errors="replace").strip().splitlines()
        return repr(lines[-1]) if lines else "(nothing)"
