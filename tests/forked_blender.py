"""Blender's worker, and scripts for its Python, forked from a process that has loaded Blender: to load it is most of a small bake.

What is forked is as Blender is when it has just started. A worker has the sandbox, folders and pipes that it has in a process of its
own, which bakes by `python -m srbf` still start.
"""

from __future__ import annotations

import atexit
import json
import os
import runpy
import select
import signal
import socket
import subprocess
import sys
import traceback
from contextlib import suppress
from functools import cache
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory, TemporaryFile, mkdtemp
from threading import Lock
from typing import IO, Any

ROOT = Path(__file__).parents[1]
LONGEST = 1 << 16  # bytes of a request
PATIENCE = 120  # s, for a script


class Forked:
    """What `srbf.bake.worker` asks of a process, of one that the loaded Blender has forked."""

    def __init__(self, control: socket.socket, stdin: IO[str], stdout: IO[str]) -> None:
        self._control, self.stdin, self.stdout = control, stdin, stdout
        self.pid = int(control.recv(32))
        self.returncode: int | None = None

    def poll(self) -> int | None:
        if self.returncode is None and select.select([self._control], [], [], 0)[0]:
            self.wait()
        return self.returncode

    def wait(self) -> int:
        if self.returncode is None:
            self.returncode = int(self._control.recv(32))
            self._control.close()
        return self.returncode

    def kill(self) -> None:
        if self.poll() is None:
            with suppress(ProcessLookupError):  # it ended, and its status is on the way
                os.kill(self.pid, signal.SIGKILL)


class LoadedBlender:
    """A process that loads Blender, and modules, when it is first asked; in place of `subprocess` in `srbf.bake.worker`."""

    PIPE = subprocess.PIPE

    def __init__(self, *modules: str) -> None:
        self._lock = Lock()
        self._modules = modules
        self._process: subprocess.Popen[bytes] | None = None
        self._asking: socket.socket
        self._folder = TemporaryDirectory(prefix="blender-")
        atexit.register(self._close)

    def Popen(self, command: list[str], **given: Any) -> Any:
        """A worker: forked, where it is that of this Python's bpy in a sandbox and writes no EXR, whose threads no fork has."""
        ours = command[-3:-1] == ["-m", "blender_bake"] and command[1].endswith("sandbox.py")
        if not ours or not writes_no_exr(json.loads(Path(command[-1]).read_text())):
            return subprocess.Popen(command, **given)
        (stdin, to_worker), (from_worker, stdout) = os.pipe(), os.pipe()
        control = self._ask({"arguments": command[2:], "environment": given["env"]}, [stdin, stdout, given["stderr"].fileno()])
        for descriptor in (stdin, stdout):
            os.close(descriptor)
        text = {"encoding": given["encoding"], "errors": given["errors"]}
        return Forked(control, os.fdopen(to_worker, "w", **text), os.fdopen(from_worker, "r", **text))

    def run(self, script: Path, *arguments: object, **environment: str) -> subprocess.CompletedProcess[str]:
        """A script, as by `python SCRIPT ARGUMENTS`, to its end."""
        line = [str(script), *map(str, arguments)]
        with TemporaryFile("w+") as stdout, TemporaryFile("w+") as stderr, open(os.devnull) as nothing:
            request = {"script": line, "environment": {**os.environ, **environment}}
            control = self._ask(request, [nothing.fileno(), stdout.fileno(), stderr.fileno()])
            with control:
                control.settimeout(PATIENCE)
                control.recv(32)
                status = int(control.recv(32))
            for file in (stdout, stderr):
                file.seek(0)
            return subprocess.CompletedProcess(line, status, stdout.read(), stderr.read())

    def _ask(self, request: dict[str, Any], descriptors: list[int]) -> socket.socket:
        with self._lock:
            if self._process is None:
                self._load()
        ours, its = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with its:
            text = json.dumps({**request, "folder": str(Path.cwd()), "scratch": self._folder.name})
            socket.send_fds(self._asking, [text.encode()], [*descriptors, its.fileno()])
        return ours

    def _load(self) -> None:
        self._asking, its = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        folders = dict.fromkeys(("TMPDIR", "BLENDER_USER_RESOURCES", "BLENDER_USER_EXTENSIONS"), self._folder.name)
        environment = {**os.environ, **folders, "PYTHONPATH": os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])}
        command = [sys.executable, __file__, str(its.fileno()), *self._modules]
        with its:
            self._process = subprocess.Popen(command, env=environment, pass_fds=[its.fileno()], start_new_session=True)

    def _close(self) -> None:
        """End the process; its workers end with the pipes of their hosts."""
        if self._process is not None:
            self._asking.close()
            self._process.wait()
        self._folder.cleanup()


def writes_no_exr(job: dict[str, Any]) -> bool:
    """Views and probes are rendered into files, lightmaps and vertices baked in memory."""
    return "query" in job or "mesh" in job or job["receiver"]["kind"] in ("lightmap", "vertices")


@cache
def loaded(*modules: str) -> LoadedBlender:
    """One a process."""
    return LoadedBlender(*modules)


def serve(asking: socket.socket, modules: list[str]) -> None:
    """Fork for every request: one process that waits, and the worker, whose number and status that one sends."""
    for module in ("bpy", "blender_bake.__main__", *modules):
        import_module(module)
    while True:
        text, descriptors, *_ = socket.recv_fds(asking, LONGEST, 4)
        if not text:
            return
        if not os.fork():
            asking.close()
            supervise(json.loads(text), descriptors)
        for descriptor in descriptors:
            os.close(descriptor)
        while os.waitpid(-1, os.WNOHANG)[0]:
            pass


def supervise(request: dict[str, Any], descriptors: list[int]) -> None:
    control = socket.socket(fileno=descriptors.pop())
    worker = os.fork()
    if not worker:
        control.close()
        work(request, descriptors)
    for descriptor in descriptors:
        os.close(descriptor)
    control.send(str(worker).encode())
    control.send(str(os.waitstatus_to_exitcode(os.waitpid(worker, 0)[1])).encode())
    os._exit(0)


def work(request: dict[str, Any], descriptors: list[int]) -> None:
    """As `sandbox.py` and `python -m blender_bake` do, or a script."""
    import bpy

    from blender_bake import sandbox
    from blender_bake.__main__ import main
    from blender_bake.ipc import leave

    for number, descriptor in enumerate(descriptors):
        os.dup2(descriptor, number)
        os.close(descriptor)
    os.setsid()
    os.environ.clear()
    os.environ.update(request["environment"])
    os.chdir(request["folder"])
    preferences = bpy.context.preferences.filepaths
    if "script" in request:
        preferences.temporary_directory = mkdtemp(dir=request["scratch"])
        script, *_ = sys.argv = request["script"]
        sys.path[:0] = [str(Path(script).parent), *filter(None, os.environ.get("PYTHONPATH", "").split(os.pathsep))]
        leave(status_of(script))
    scratch = Path(request["arguments"][0]).resolve()
    os.environ.update(sandbox.environment(scratch))
    preferences.temporary_directory = str(scratch)
    if not os.environ.get(sandbox.UNSANDBOXED) and sandbox.restrict_writes(scratch):
        os.environ[sandbox.SANDBOXED] = "1"
    sys.argv = request["arguments"][1:]
    main()


def status_of(script: str) -> int:
    """Of a script run to its end; what it raised goes to stderr."""
    try:
        runpy.run_path(script, run_name="__main__")
    except SystemExit as ended:
        if isinstance(ended.code, str):
            sys.stderr.write(f"{ended.code}\n")
        return ended.code if isinstance(ended.code, int) else int(ended.code is not None)
    except Exception:  # noqa: BLE001 - as Python ends a script
        traceback.print_exc()
        return 1
    finally:
        sys.stdout.flush()
    return 0


if __name__ == "__main__":
    serve(socket.socket(fileno=int(sys.argv[1])), sys.argv[2:])
