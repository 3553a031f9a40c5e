"""The page and one asset on 127.0.0.1: a table of names, and nothing but what stands in it."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

from srbf import files
from srbf.asset import MANIFEST, Asset
from srbf.capture import Capture
from srbf.errors import InputError, SrbfError
from srbf.export.web import shown_mesh
from srbf.viewer import facts
from srbf.viewer.built_page import page_files
from srbf.viewer.references import References

HOST = "127.0.0.1"
ASSET, CAPTURE = "asset/", "capture/"
TYPES = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".json": "application/json",
    ".glb": "model/gltf-binary",
    ".png": "image/png",
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

Content = bytes | Path | Callable[[], bytes]


class ViewerServer(ThreadingHTTPServer):
    """Serves `contents`, name to bytes, a file, or what makes the bytes; hosts other than its own address are refused."""

    daemon_threads = True

    def __init__(self, contents: dict[str, Content], port: int = 0) -> None:
        """InputError where the port is taken, or may not be had."""
        try:
            super().__init__((HOST, port), _Handler)
        except (OSError, OverflowError) as error:
            raise InputError(f"expected a free port, found that {port} cannot be had ({error}); choose another --port, or none") from error
        self.contents = contents

    @property
    def url(self) -> str:
        return f"http://{HOST}:{self.server_port}/"

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A page that was closed while it loaded is no event."""


def contents_of(folder: Path, capture: Path | None = None, mesh: Path | None = None) -> dict[str, Content]:
    """Everything the page may ask for of the asset in `folder`; what `Asset.open`, `Capture.open` and `page_files` raise."""
    page = page_files()
    asset = Asset.open(folder)
    references = None
    if capture is not None:
        references = References(Capture.open(capture))
        references.check(asset)
    notes: list[str] = []
    shown = shown_mesh(asset, mesh, notes)
    told = facts.facts(asset, ASSET, shown is not None, facts.title(folder), CAPTURE if references else None, tuple(notes))
    contents: dict[str, Content] = {"": page["index.html"], **page, facts.NAME: json.dumps(told).encode()}
    manifest = folder / MANIFEST
    for name in (MANIFEST, *asset.manifest.get("sha256", {}), *_named(asset)):
        path = files.inside(folder, name, manifest)
        if path.is_file():
            contents[ASSET + name] = path
    if shown is not None:
        contents[facts.MESH] = shown
    if references is not None:
        contents[f"{CAPTURE}lights.json"] = json.dumps(references.lights()).encode()
        for index in range(len(references.capture.lights)):
            contents[f"{CAPTURE}{index}.exr"] = _image(references, index)
    return contents


def _image(references: References, index: int) -> Callable[[], bytes]:
    return lambda: references.image(index)


def _named(asset: Asset) -> list[str]:
    """Files that asset.json names; an asset need not have checksums."""
    entries = [entry["file"] for entry in asset.layers]
    tables = [asset.manifest[name]["file"] for name in asset.tables]
    return [*entries, *tables, *(asset.manifest[name] for name in asset.images)]


class _Handler(BaseHTTPRequestHandler):
    server: ViewerServer
    protocol_version = "HTTP/1.1"
    server_version = "srbf"
    sys_version = ""

    def do_GET(self) -> None:
        self._answer(body=True)

    def do_HEAD(self) -> None:
        self._answer(body=False)

    def _answer(self, body: bool) -> None:
        if self.headers.get("Host") not in (f"{HOST}:{self.server.server_port}", f"localhost:{self.server.server_port}"):
            return self._send(HTTPStatus.FORBIDDEN, b"expected this machine's own address\n", ".txt", body)
        name = unquote(urlsplit(self.path).path, errors="replace").removeprefix("/")
        content = self.server.contents.get(name)
        if content is None:
            return self._send(HTTPStatus.NOT_FOUND, b"expected a file of the page or of its asset\n", ".txt", body)
        try:
            data = content.read_bytes() if isinstance(content, Path) else content if isinstance(content, bytes) else content()
        except (OSError, SrbfError) as error:
            line = " ".join(str(error).split())
            return self._send(HTTPStatus.INTERNAL_SERVER_ERROR, f"{line}\n".encode(), ".txt", body)
        found = re.search(r"\.[a-z0-9]+$", name)
        return self._send(HTTPStatus.OK, data, found[0] if found else ".html", body)

    def _send(self, status: HTTPStatus, data: bytes, suffix: str, body: bool) -> None:
        self.send_response(status)
        self.send_header("Content-Type", TYPES.get(suffix, "text/plain; charset=utf-8" if suffix == ".txt" else "application/octet-stream"))
        self.send_header("Content-Length", str(len(data)))
        for name, value in HEADERS.items():
            self.send_header(name, value)
        self.end_headers()
        if body:
            self.wfile.write(data)

    def log_message(self, format: str, *args: Any) -> None:
        """Nothing: the page says itself what fails."""
