# SPDX-License-Identifier: GPL-3.0-or-later
"""`srbf` in a process of its own: started, listened to through a file, and asked to stop. Nothing here waits."""

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
    """The library `srbf` is not where this Python looks."""


class Job:
    """A running `srbf` command. Its words go through the file `log`, which no end of Blender can break as it would a pipe."""

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
        """Read what has been said since; True as long as it runs."""
        if self.status is not None:
            return False
        status = self._process.poll()  # before reading: what an ended process said is in the file
        self.reader.feed(self._log.read())
        if status is not None:
            self.reader.close()
            self._log.close()
            self._extensions.cleanup()
            self.status = status
        return self.running

    def stop(self) -> None:
        """Ask it to end, as Ctrl-C does: a bake keeps its finished lights, and the same command goes on with it."""
        if self._process.poll() is None:
            self.stopping = True
            self._process.send_signal(getattr(signal, "CTRL_BREAK_EVENT", signal.SIGINT))

    def outcome(self) -> str:
        """One line on how it ended."""
        if self.status == 0:
            return f"{self.what}: done"
        if self.stopping:
            return f"{self.what}: stopped"
        last = self.reader.words[-1] if self.reader.words else f"ended with status {self.status}"
        return f"{self.what}: {last.removeprefix('srbf: ')}"


def host_command(arguments: list[str]) -> list[str]:
    """`srbf` with these arguments, run by Blender's own Python."""
    return [sys.executable, "-P", str(HOST), *arguments]


def no_extensions() -> tempfile.TemporaryDirectory[str]:
    """A folder to name in BLENDER_USER_EXTENSIONS.

    The bake's Blender starts with factory settings, where no extension is switched on: in the user's own folder it would remove the
    installed wheels of all of them, and the library's under the running bake.
    """
    return tempfile.TemporaryDirectory(prefix="srbf-no-extensions-", ignore_cleanup_errors=True)


def environment(extensions: str) -> dict[str, str]:
    """This process's, `srbf` where Python looks, and `extensions` for the Blenders to come; MissingHostError where there is no `srbf`."""
    spec = find_spec("srbf")
    if spec is None or spec.origin is None:
        raise MissingHostError("expected the library srbf beside this extension, found none; install the extension's zip again")
    paths = [str(Path(spec.origin).parent.parent), *filter(None, [os.environ.get("PYTHONPATH")])]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(paths), "PYTHONUNBUFFERED": "1", "BLENDER_USER_EXTENSIONS": extensions}
