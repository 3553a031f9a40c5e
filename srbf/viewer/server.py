"""A server on 127.0.0.1 for the page and its assets; it serves the names of one table only."""

from __future__ import annotations

import json
import re
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from urllib.parse import unquote, urlsplit

from srbf.errors import InputError, SrbfError
from srbf.viewer.contents import Content, read
from srbf.viewer.cycles import MOST_BYTES, PLACE, CyclesRenders

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
    """Serves `contents`: name to bytes, a file, or a function that makes the bytes. Requests for other hosts are refused.

    POST and DELETE of `cycles` begin and end a render, if there are any: of this page's own origin alone.
    """

    daemon_threads = True

    def __init__(self, contents: dict[str, Content], port: int = 0, renders: CyclesRenders | None = None) -> None:
        """`renders`: what the page may start and stop. InputError if the port is not available."""
        try:
            self.renders = renders
            super().__init__((HOST, port), _Handler)
        except (OSError, OverflowError) as error:
            raise InputError(f"expected a free port, found {port} unavailable ({error}); choose another `port`, or 0") from error
        self.contents = contents

    def server_close(self) -> None:
        """No render outlives the server."""
        if self.renders is not None:
            self.renders.stop()
        super().server_close()

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

    def do_POST(self) -> None:
        self._action(start=True)

    def do_DELETE(self) -> None:
        self._action(start=False)

    def _action(self, start: bool) -> None:
        """Begin or end a render. The browser of a page elsewhere would ask first whether it may send JSON, and get no leave."""
        port, renders = self.server.server_port, self.server.renders
        self.close_connection = True  # the body may be unread
        hosts = (f"{HOST}:{port}", f"localhost:{port}")
        if renders is None:
            return self._send(HTTPStatus.NOT_IMPLEMENTED, b"expected srbf view with --scene\n", ".txt", True)
        if self.headers.get("Host") not in hosts or self.headers.get("Origin") not in [f"http://{host}" for host in hosts]:
            return self._send(HTTPStatus.FORBIDDEN, b"expected a request of this page's own\n", ".txt", True)
        if self.path != f"/{PLACE}":
            return self._send(HTTPStatus.NOT_FOUND, b"expected the place of renders\n", ".txt", True)
        if not start:
            status, told = renders.stop()
        else:
            length = self.headers.get("Content-Length", "")
            size = int(length) if length.isdecimal() else -1
            if self.headers.get("Content-Type") != "application/json" or not 0 < size <= MOST_BYTES:
                return self._send(HTTPStatus.BAD_REQUEST, b"expected JSON of a megabyte or less\n", ".txt", True)
            status, told = renders.start(self.rfile.read(size))
        return self._send(status, json.dumps(told).encode(), ".json", True)

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
