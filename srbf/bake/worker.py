"""Blender's process, controlled from the host: start it, send requests, read events, notice its end, terminate it on exit."""

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

from srbf.bake.request import RenderRequest
from srbf.errors import BakeError, MissingLibraryError


def command(blender: Path | None, job: Path) -> list[str]:
    """The worker's command line: an installed Blender, or this Python's bpy; sandboxed, it can write only beside `job`.

    MissingLibraryError or BakeError where there is no Blender.
    """
    package = importlib.util.find_spec("blender_bake")
    if package is None or package.origin is None:
        raise MissingLibraryError("baking needs srbf-blender, found it missing; pip install srbf[blender]")
    sandboxed = [sys.executable, str(Path(package.origin).parent / "sandbox.py"), str(job.parent)] if sys.platform != "win32" else []
    if blender is not None:
        if shutil.which(blender) is None:
            raise BakeError(f"cannot start Blender at {blender}: expected a program, found none; correct `blender`")
        script = str(Path(package.origin).parent / "__main__.py")
        return [*sandboxed, str(blender), "--background", "--factory-startup", "--disable-autoexec", "--python", script, "--", str(job)]
    if importlib.util.find_spec("bpy") is None:
        version = f"{sys.version_info.major}.{sys.version_info.minor}"
        raise MissingLibraryError(
            f"expected Blender, found that this Python {version} has no bpy (which needs 3.11 or 3.13); "
            "add `blender=/path/to/blender`, or install srbf[blender] with such a Python"
        )
    return [*sandboxed, sys.executable, "-m", "blender_bake", str(job)]


class WorkerDiedError(BakeError):
    """The process ended without an error event (a crash, a kill), or sent nothing for too long and was killed."""


class Worker:
    """A running worker: send requests, read events. As a context manager it is always terminated on exit."""

    def __init__(self, job: dict[str, Any], scratch: Path, log: Path, blender: Path | None = None) -> None:
        path = scratch / "job.json"
        path.write_text(json.dumps(job), encoding="utf-8")
        self._log_path = log
        self._log = open(log, "ab")  # noqa: SIM115 - closed in close
        self._events: SimpleQueue[dict[str, Any] | None] = SimpleQueue()
        try:
            # A session of its own: Ctrl-C reaches only the host. The worker ends when its stdin closes.
            self._process = subprocess.Popen(
                command(blender, path),
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=self._log,
                text=True,
                encoding="utf-8",
                errors="replace",
                start_new_session=True,
                # Started with factory settings, Blender would remove the wheels of the user's extensions.
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
        """Kill the process if it still runs."""
        if self._process.poll() is None:
            self._process.kill()
        self._process.wait()
        self._reader.join()
        for stream in (self._process.stdin, self._process.stdout):
            if stream is not None:
                with suppress(OSError):  # requests that a dead worker did not read
                    stream.close()
        self._log.close()

    def kill(self) -> None:
        """End the process now, from any thread: whoever awaits an event gets WorkerDiedError."""
        self._process.kill()

    def ask(self, request: RenderRequest) -> None:
        """Send one more request to a job that serves; replies come in order, as events `rendered`."""
        self._send(request.message())

    def end(self) -> None:
        """Let it finish the request begun, drop the others, and end."""
        self._send({"end": True})

    def event(self, patience: float | None = None) -> dict[str, Any] | None:
        """The next event; None once it is done. BakeError on an error event, WorkerDiedError after `patience` seconds of silence."""
        try:
            event = self._events.get(timeout=patience)
        except Empty as error:
            self._process.kill()
            raise WorkerDiedError(f"Blender's process sent nothing for {patience:.0f} s and was stopped") from error
        if event is None:
            status = self._process.wait()
            cause = f"signal {-status}" if status < 0 else f"status {status}"
            raise WorkerDiedError(f"Blender's process ended unexpectedly ({cause}), last output: {self._last_output()}")
        if event["event"] == "error":
            raise BakeError(event["message"])
        return None if event["event"] == "done" else event

    def events(self, say: Callable[[str], None]) -> Iterator[dict[str, Any]]:
        """Every event until it is done; warnings go to `say` instead."""
        while (event := self.event()) is not None:
            if event["event"] == "warning":
                say(event["message"])
            else:
                yield event

    def _send(self, request: dict[str, Any]) -> None:
        assert self._process.stdin is not None
        with suppress(OSError):  # a dead worker is noticed when its reply is awaited
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

    def _last_output(self) -> str:
        self._log.flush()
        with open(self._log_path, "rb") as log:
            lines = log.read()[-2000:].decode(errors="replace").strip().splitlines()
        return repr(lines[-1]) if lines else "(nothing)"
