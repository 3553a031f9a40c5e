"""Programs run as a user runs them: an environment of its own, no Node.js on PATH, nothing of this checkout on Python's path."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
BIN = "Scripts" if sys.platform == "win32" else "bin"


def run(words: Sequence[object], path: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    """A program with `path` as PATH, and nothing of this checkout on Python's path."""
    environment = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "VIRTUAL_ENV")}
    environment |= {"PATH": path, "PIP_DISABLE_PIP_VERSION_CHECK": "1", "PYTHONUTF8": "1"}
    return subprocess.run(
        list(map(str, words)), cwd=cwd, env=environment, capture_output=True, text=True, encoding="utf-8", timeout=900, check=False
    )


def succeed(done: subprocess.CompletedProcess[str]) -> subprocess.CompletedProcess[str]:
    """The same, and the test fails with what was printed where the program did."""
    if done.returncode:
        pytest.fail(f"{done.args} ended with {done.returncode}:\n{done.stdout[-3000:]}{done.stderr[-3000:]}")
    return done


@dataclass(frozen=True)
class Distribution:
    """One distribution, built; the wheel was built from the sdist, where no Node.js is."""

    sdist: Path
    wheel: Path


@dataclass(frozen=True)
class Environment:
    """A virtual environment, and the empty folder that is its PATH and where its programs run."""

    root: Path
    nowhere: Path

    def python(self, *words: object) -> subprocess.CompletedProcess[str]:
        """Its Python."""
        return run([self.root / BIN / "python", *words], str(self.nowhere), self.nowhere)

    def srbf(self, *words: object) -> subprocess.CompletedProcess[str]:
        """The command line that is installed in it."""
        return run([self.root / BIN / "srbf", *words], str(self.nowhere), self.nowhere)
