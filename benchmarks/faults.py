"""Faults injected into a bake from outside; after each, the same command must give the bits of the undisturbed bake."""

from __future__ import annotations

import errno
import multiprocessing
import os
import shlex
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
MAY_DIFFER = ("bake.log", ".lock", ".holder.json")  # wall times, and who holds the folder
MAKING = {"os.mkdir", "os.rename"}
REMOVING = {"os.remove", "os.rmdir"}
TIMEOUT = 60.0  # seconds a small bake may take before it counts as hung
SMALL = ["--size", "8", "--lights", "5", "--samples", "4", "--validation", "1", "--holdout", "1", "--holdout-samples", "8"]


class LostError(Exception):
    """Lost or different data: what, and how to reproduce it."""


def contents(folder: Path) -> dict[str, bytes]:
    """The files of a capture that every undisturbed bake has equal."""
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file() and p.name not in MAY_DIFFER}


def compare(found: dict[str, bytes], expected: dict[str, bytes]) -> None:
    """LostError unless both have the same files with the same bytes."""
    missing, added = sorted(set(expected) - set(found)), sorted(set(found) - set(expected))
    changed = sorted(name for name in set(found) & set(expected) if found[name] != expected[name])
    if missing or added or changed:
        raise LostError(f"missing {missing}, changed {changed}, left over {added}")


@dataclass(frozen=True)
class Ended:
    """The end of a command: its exit status (minus the signal that killed it) and its stderr."""

    status: int
    said: str


@dataclass(frozen=True)
class Strike:
    """A fault at the `count`-th file operation (from 1) of a process below `folder`: make, open for writing, rename or remove.
    `kill` the process before it, let the disk be `full` from then on, or only `count` the operations."""

    kind: str
    count: int
    folder: Path

    def arm(self) -> Callable[[], int]:
        """Activate in this process, permanently. Returns a function that gives the number of operations."""
        seen = 0
        root = str(self.folder)

        def watch(event: str, arguments: tuple[Any, ...]) -> None:
            nonlocal seen
            makes = event in MAKING or (event == "open" and bool(int(arguments[2] or 0) & (os.O_CREAT | os.O_TRUNC)))
            if not (makes or event in REMOVING or (event == "open" and int(arguments[2] or 0) & (os.O_WRONLY | os.O_RDWR))):
                return
            path = os.fsdecode(arguments[0]) if isinstance(arguments[0], str | bytes | os.PathLike) else ""
            if not path.startswith(root) and os.path.isabs(path):  # noqa: PTH117 - relative ones are those of a tree being removed
                return
            seen += 1
            if self.kind == "kill" and seen == self.count:
                os.kill(os.getpid(), signal.SIGKILL)
            if self.kind == "full" and seen >= self.count and makes and event != "os.rename":
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), path)

        sys.addaudithook(watch)
        return lambda: seen


@dataclass
class Lab:
    """A scene, a Blender (`blender`, or the bpy module where it is None), the flags of one bake, and its undisturbed result."""

    folder: Path
    scene: Path
    receiver: str = "lightmap:Plane"
    flags: Sequence[str] = tuple(SMALL)
    blender: Path | None = None
    whole: dict[str, bytes] = field(default_factory=dict)
    seconds: float = 0.0
    operations: int = 0  # of an undisturbed bake, see Strike
    _used: int = 0

    def fresh(self) -> Path:
        """A new capture folder; removes earlier ones."""
        shutil.rmtree(self.folder / f"capture{self._used}", ignore_errors=True)
        self._used += 1
        return self.folder / f"capture{self._used}"

    def arguments(self, folder: Path, *more: str) -> list[str]:
        blender = [] if self.blender is None else ["--blender", str(self.blender)]
        return ["bake", str(self.scene), "-o", str(folder), "--receiver", self.receiver, *self.flags, *blender, *more]

    def measure(self) -> None:
        """Bake undisturbed, twice: files that already differ then are not compared."""
        for _ in range(2):
            folder = self.fresh()
            started = time.monotonic()
            self.succeed(self.run(folder))
            self.seconds = time.monotonic() - started
            self.whole = self.whole or contents(folder)
            compare(contents(folder), self.whole)

    def start(self, folder: Path, *more: str, **environment: str) -> subprocess.Popen[str]:
        """The command as a user runs it."""
        line = [sys.executable, "-m", "srbf", *self.arguments(folder, *more)]
        return subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env={**os.environ, **environment})

    def run(self, folder: Path, *more: str, strike: Strike | None = None, **environment: str) -> Ended:
        """The same in a process forked from one with the libraries loaded."""
        said = self.folder / "said"
        child = FORKS.Process(target=_command, args=(self.arguments(folder, *more), said, strike, environment))
        child.start()
        child.join(TIMEOUT)
        if child.is_alive():
            child.kill()
            child.join()
            raise LostError(f"hung for {TIMEOUT:.0f} s")
        assert child.exitcode is not None
        return Ended(child.exitcode, said.read_text(errors="replace"))

    def succeed(self, ended: Ended) -> Ended:
        """LostError unless it succeeded."""
        if ended.status != 0:
            raise LostError(f"ended as {ended.status}: {ended.said.strip()[-400:]!r}")
        return ended

    def refuse(self, ended: Ended, *words: str) -> Ended:
        """LostError unless it exited with 1, without a traceback, with `words` in its last line."""
        last = (ended.said.strip().splitlines() or [""])[-1]
        if ended.status != 1 or "Traceback" in ended.said or not all(word in last for word in words):
            raise LostError(f"expected a line with {words}, found status {ended.status}: {ended.said.strip()[-400:]!r}")
        return ended

    def go_on(self, folder: Path, *more: str) -> None:
        """Resume by the same command, then repeat it: LostError unless the bits are those of the undisturbed bake."""
        wait_for_orphans(folder)
        self.succeed(self.run(folder, *more))
        compare(contents(folder), self.whole)

    def kill(
        self, folder: Path, process: subprocess.Popen[str], after: float, victims: Callable[[int, list[int]], list[int]], how: int
    ) -> Ended:
        """Send the signal `how` to the processes that `victims` selects, after `after` seconds; then wait for the end."""
        try:
            process.wait(after)
        except subprocess.TimeoutExpired:
            for victim in victims(process.pid, workers_of(folder)):
                try:
                    os.kill(victim, how)
                except ProcessLookupError:
                    continue
        try:
            said = process.communicate(timeout=TIMEOUT)[1]
        except subprocess.TimeoutExpired as error:
            process.kill()
            process.communicate()
            raise LostError(f"hung for {TIMEOUT:.0f} s") from error
        return Ended(process.returncode, said)


def fake_lab(folder: Path, *flags: str) -> Lab:
    """A lab with the fake Blender, measured."""
    folder.mkdir(parents=True)
    blender = folder / "blender"
    blender.write_text(f'#!/bin/sh\nexec {shlex.quote(sys.executable)} {shlex.quote(str(HERE / "fake_blender.py"))} "$@"\n')
    blender.chmod(0o755)
    scene = folder / "scene.blend"
    scene.write_bytes(b"BLENDER that only the fake one reads")
    lab = Lab(folder, scene, flags=(*SMALL, *flags), blender=blender)
    lab.measure()
    folder = lab.fresh()
    lab.operations = int(lab.succeed(lab.run(folder, strike=Strike("count", 0, folder))).said)
    return lab


def workers_of(folder: Path) -> list[int]:
    """Processes whose command line names a job of this capture."""
    found = []
    for entry in Path("/proc").glob("[0-9]*"):
        try:
            line = (entry / "cmdline").read_bytes()
        except OSError:
            continue
        if b"job.json" in line and str(folder.resolve()).encode() + b"/" in line:
            found.append(int(entry.name))
    return found


def wait_for_orphans(folder: Path) -> None:
    """LostError if a worker outlives its host by more than twenty seconds; stopped workers are ignored."""
    deadline = time.monotonic() + 20
    while workers := workers_of(folder):
        if time.monotonic() > deadline:
            for worker in workers:
                os.kill(worker, signal.SIGKILL)
            raise LostError("a worker outlived its host")
        time.sleep(0.02)


def _command(arguments: list[str], said: Path, strike: Strike | None, environment: dict[str, str]) -> None:
    """In a forked process: become the command."""
    from srbf.__main__ import main

    out = os.open(said, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    os.dup2(out, 1)
    os.dup2(out, 2)
    os.environ.update(environment)
    sys.argv = ["srbf", *arguments]
    counted = strike.arm() if strike is not None else None
    try:
        main()
    finally:
        if strike is not None and counted is not None and strike.kind == "count":
            said.write_text(str(counted()))


FORKS = multiprocessing.get_context("forkserver")
FORKS.set_forkserver_preload(["srbf.cli.bake", "filelock", "faults"])
