"""The viewer's page as shipped, and one headless Chromium to drive it."""

from __future__ import annotations

import base64
import json
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from typing import Any
from urllib.parse import unquote

import numpy as np
import pytest
from npm_package import WEB, browser_program, driven, npm, viewer_page

from srbf.viewer.contents import contents_of
from srbf.viewer.server import ViewerServer

TESTS = Path(__file__).resolve().parents[1]
sys.path.append(str(TESTS / "web"))

__all__ = ["npm", "viewer_page"]  # fixtures


class Browser:
    """One page of a Chromium; every command waits until the page has drawn what it was asked to."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self._process = process
        self.may_fail = False

    def __call__(self, what: str, **job: Any) -> Any:
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(json.dumps({"do": what, **job}) + "\n")
        self._process.stdin.flush()
        line = self._process.stdout.readline()
        assert line, "expected a response of the browser, found it gone"
        response = json.loads(line)
        assert "error" not in response, response
        bad = [said for said in response["said"] if said.startswith("error")]
        assert self.may_fail or not bad, bad
        return response.get("value")

    def canvas(self) -> np.ndarray:
        """(H, W, 3) bytes of the canvas."""
        response = self("canvas")
        return np.frombuffer(base64.b64decode(response["bytes"]), np.uint8).reshape(response["height"], response["width"], 4)[..., :3]

    def texels(self, width: int, height: int, zoom: int) -> np.ndarray:
        """The picture on the canvas, of which each texel is `zoom` x `zoom` equal pixels: (H, W, 3) bytes."""
        canvas = self.canvas()
        top = round(canvas.shape[0] / 2 - height * zoom / 2)
        left = round(canvas.shape[1] / 2 - width * zoom / 2)
        blocks = canvas[top : top + height * zoom, left : left + width * zoom].reshape(height, zoom, width, zoom, 3)
        assert (blocks == blocks[:, :1, :, :1]).all(), "texels are not squares of one color"
        return blocks[:, 0, :, 0]

    def state(self) -> dict[str, Any]:
        """What the address says."""
        return json.loads(unquote(self("address").split("#", 1)[1].replace("'", "%22")))

    def file(self, text: str) -> bytes:
        """What the button of that name hands out."""
        return base64.b64decode(self("download", text=text)["bytes"])


@pytest.fixture(scope="session")
def chromium(built: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    log = tmp_path_factory.mktemp("viewer") / "browser.log"
    with driven(WEB / "viewer" / "driver.mjs", browser_program(), log=log) as process:
        yield Browser(process)


@pytest.fixture(autouse=True)
def every_error_counts(request: pytest.FixtureRequest) -> None:
    if "chromium" in request.fixturenames:
        request.getfixturevalue("chromium").may_fail = False


@pytest.fixture
def serve(built: Path) -> Iterator[Callable[..., str]]:
    """Serve an asset's folder as `srbf view` does; its URL."""
    servers: list[ViewerServer] = []

    def start(
        folder: Path | list[Path],
        capture: Path | None = None,
        mesh: Path | None = None,
        probes: Path | None = None,
        **given: Any,
    ) -> str:
        server = ViewerServer(contents_of(folder if isinstance(folder, list) else [folder], capture, mesh, probes, **given))
        Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True).start()
        servers.append(server)
        return server.url

    yield start
    for server in servers:
        server.shutdown()
        server.server_close()


@pytest.fixture
def serve_static() -> Iterator[Callable[[Path], str]]:
    """Serve a folder as any static host does; its URL."""
    with static_hosts() as start:
        yield start


@contextmanager
def static_hosts() -> Iterator[Callable[[Path], str]]:
    class Quiet(SimpleHTTPRequestHandler):
        def log_message(self, format: str, *args: Any) -> None:
            pass

    servers: list[ThreadingHTTPServer] = []

    def start(folder: Path) -> str:
        server = ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=str(folder)))
        Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True).start()
        servers.append(server)
        return f"http://127.0.0.1:{server.server_port}/"

    try:
        yield start
    finally:
        for server in servers:
            server.shutdown()
            server.server_close()
