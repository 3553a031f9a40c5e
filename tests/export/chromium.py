"""Headless Chromium with WebGPU by SwiftShader: a page that draws its jobs and posts the pixels back."""

from __future__ import annotations

import base64
import json
import shutil
import subprocess
import tempfile
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import numpy as np
from npm_package import CHROMIUM

PAGE = Path(__file__).parent / "webgpu.html"
FLAGS = [
    "--headless", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--use-gl=angle", "--ignore-gpu-blocklist",
    "--disable-background-networking", "--disable-sync", "--no-first-run", "--enable-unsafe-webgpu", "--use-webgpu-adapter=swiftshader",
    "--enable-features=Vulkan",
]  # fmt: skip
SECONDS = 90


def browser() -> str | None:
    return next(filter(None, map(shutil.which, CHROMIUM)), None)


def encoded(values: np.ndarray) -> str:
    return base64.b64encode(np.ascontiguousarray(values, np.float32).tobytes()).decode()


def ask(cases: dict[str, Any]) -> dict[str, Any]:
    """What the page returns for `cases`: by name the pixels of `pictures`, the errors of `modules`."""
    responses: list[dict[str, Any]] = []
    returned = threading.Event()

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            body = json.dumps(cases).encode() if self.path.endswith("cases.json") else PAGE.read_bytes()
            self.send_response(200)
            self.send_header("Content-Type", "application/json" if self.path.endswith("cases.json") else "text/html")
            self.end_headers()
            self.wfile.write(body)

        def do_POST(self) -> None:
            responses.append(json.loads(self.rfile.read(int(self.headers["Content-Length"]))))
            self.send_response(204)
            self.end_headers()
            returned.set()

        def log_message(self, *_: object) -> None:
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)  # a secure context, which WebGPU asks for
    threading.Thread(target=server.serve_forever, daemon=True).start()
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        url = f"http://127.0.0.1:{server.server_port}/"
        process = subprocess.Popen(
            [str(browser()), *FLAGS, f"--user-data-dir={profile}", url], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        try:
            assert returned.wait(SECONDS), "Chromium did not respond"
        finally:
            process.terminate()
            process.wait(10)
            server.shutdown()
            server.server_close()
    assert "error" not in responses[0], responses[0]["error"]
    return responses[0]
