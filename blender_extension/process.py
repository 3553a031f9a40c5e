# SPDX-License-Identifier: GPL-3.0-or-later
"""Run `srbf` in a separate process: start it, read its output from a file, and stop it. Nothing here blocks."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
from importlib.util import find_spec
from pathlib import Path

from .progress import Reader

HOST = Path(__file__).parent / "host.py"


class MissingHostError(Exception):
    """This Python cannot import the library `srbf`."""


class Job:
    """A running `srbf` command. It writes to the file `log`, which survives the end of Blender, unlike a pipe."""

    def __init__(self, what: str, command: list[str], log: Path) -> None:
        self.what = what
        self.reader = Reader()
        self.status: int | None = None  # the exit status, once it has ended
        self.stopping = False
        log.parent.mkdir(parents=True, exist_ok=True)
        self._extensions = no_extensions()
        with open(log, "wb") as words:
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=words,
                stderr=subprocess.STDOUT,
                env=environment(self._extensions.name),
                # out of reach of Ctrl-C in Blender's own terminal; on Windows CTRL_BREAK needs a group to go to
                start_new_session=os.name != "nt",
                creationflags=getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0),
            )
        self._log = open(log, "rb")  # noqa: SIM115 - closed when the process has ended

    @property
    def running(self) -> bool:
        return self.status is None

    def poll(self) -> bool:
        """Read new output; True while the process runs."""
        if self.status is not None:
            return False
        status = self._process.poll()  # before reading: the output of an ended process is complete
        self.reader.feed(self._log.read())
        if status is not None:
            self.reader.close()
            self._log.close()
            self._extensions.cleanup()
            self.status = status
        return self.running

    def stop(self) -> None:
        """Interrupt it like Ctrl-C: a bake keeps its finished lights, and the same command resumes it."""
        if self._process.poll() is None:
            self.stopping = True
            self._process.send_signal(getattr(signal, "CTRL_BREAK_EVENT", signal.SIGINT))

    def outcome(self) -> str:
        """One line on its result."""
        if self.status == 0:
            return f"{self.what}: done"
        if self.stopping:
            return f"{self.what}: stopped"
        last = self.reader.words[-1] if self.reader.words else f"ended with status {self.status}"
        return f"{self.what}: {last.removeprefix('srbf: ')}"


def host_command(arguments: list[str]) -> list[str]:
    """The command that runs `srbf` with these arguments in Blender's own Python."""
    return [sys.executable, "-P", str(HOST), *arguments]


def no_extensions() -> tempfile.TemporaryDirectory[str]:
    """An empty folder for BLENDER_USER_EXTENSIONS.

    The bake's Blender starts with factory settings, where no extension is enabled: in the user's own folder it would remove the
    installed wheels of all extensions, including the library's during the bake.
    """
    return tempfile.TemporaryDirectory(prefix="srbf-no-extensions-", ignore_cleanup_errors=True)


def environment(extensions: str) -> dict[str, str]:
    """This process's environment with `srbf` on the Python path, and `extensions` for its Blenders; MissingHostError without `srbf`."""
    spec = find_spec("srbf")
    if spec is None or spec.origin is None:
        raise MissingHostError("expected the library srbf beside this extension, found none; install the extension's zip again")
    paths = [str(Path(spec.origin).parent.parent), *filter(None, [os.environ.get("PYTHONPATH")])]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(paths), "PYTHONUNBUFFERED": "1", "BLENDER_USER_EXTENSIONS": extensions}
