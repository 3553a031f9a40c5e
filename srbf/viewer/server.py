"""A server on 127.0.0.1 for the page and its assets; it serves the names of one table only."""

from __future__ import annotations

import re
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from urllib.parse import unquote, urlsplit

from srbf.errors import InputError, SrbfError
from srbf.viewer.contents import Content, read

HOST = "127.0.0.1"
TYPES = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".json": "application/json",
    ".glb": "model/gltf-binary",
    ".png": "image/png",
    ".txt": "text/plain; charset=utf-8",
}
HEADERS = {
    "Content-Security-Policy": (
        "default-src 'self'; img-src 'self' blob: data:; connect-src 'self' blob: data:; style-src 'self' 'unsafe-inline'; font-src data:; "
        "frame-ancestors 'none'; base-uri 'none'; form-action 'none'"
    ),
    "Cross-Origin-Resource-Policy": "same-origin",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
}


class ViewerServer(ThreadingHTTPServer):
    """Serves `contents`: name to bytes, a file, or a function that makes the bytes. Requests for other hosts are refused."""

    daemon_threads = True

    def __init__(self, contents: dict[str, Content], port: int = 0) -> None:
        """InputError if the port is not available."""
        try:
            super().__init__((HOST, port), _Handler)
        except (OSError, OverflowError) as error:
            raise InputError(f"expected a free port, found {port} unavailable ({error}); choose another `port`, or 0") from error
        self.contents = contents

    @property
    def url(self) -> str:
        return f"http://{HOST}:{self.server_port}/"

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Ignore pages that were closed while loading."""


class _Handler(BaseHTTPRequestHandler):
    server: ViewerServer
    protocol_version = "HTTP/1.1"
    server_version = "srbf"
    sys_version = ""

    def do_GET(self) -> None:
        self._response(body=True)

    def do_HEAD(self) -> None:
        self._response(body=False)

    def _response(self, body: bool) -> None:
        if self.headers.get("Host") not in (f"{HOST}:{self.server.server_port}", f"localhost:{self.server.server_port}"):
            return self._send(HTTPStatus.FORBIDDEN, b"expected this machine's own address\n", ".txt", body)
        name = unquote(urlsplit(self.path).path, errors="replace").removeprefix("/")
        content = self.server.contents.get(name)
        if content is None:
            return self._send(HTTPStatus.NOT_FOUND, b"expected a file of the page or of its asset\n", ".txt", body)
        try:
            data = read(content)
        except (OSError, SrbfError) as error:
            line = " ".join(str(error).split())
            return self._send(HTTPStatus.INTERNAL_SERVER_ERROR, f"{line}\n".encode(), ".txt", body)
        found = re.search(r"\.[a-z0-9]+$", name)
        return self._send(HTTPStatus.OK, data, found[0] if found else ".html", body)

    def _send(self, status: HTTPStatus, data: bytes, suffix: str, body: bool) -> None:
        self.send_response(status)
        self.send_header("Content-Type", TYPES.get(suffix, "application/octet-stream"))
        self.send_header("Content-Length", str(len(data)))
        for name, value in HEADERS.items():
            self.send_header(name, value)
        self.end_headers()
        if body:
            self.wfile.write(data)

    def log_message(self, format: str, *args: Any) -> None:
        """No log: the page reports errors."""
