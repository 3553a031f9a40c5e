"""The server behind the page: on this machine only, the asset's own files only."""

from __future__ import annotations

import http.client
import json
import signal
import socket
import subprocess
import sys
import urllib.request
from collections.abc import Callable
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np
import pytest
from web_assets import complete, on_a_plane

from srbf.asset import Asset
from srbf.capture import Capture
from srbf.errors import ImageError, InputError, ManifestError, MissingLibraryError
from srbf.io.image import read_image
from srbf.viewer import built_page
from srbf.viewer.contents import contents_of
from srbf.viewer.server import ViewerServer


def ask(url: str, path: str, method: str = "GET", host: str | None = None) -> tuple[int, bytes]:
    parts = urlsplit(url)
    connection = http.client.HTTPConnection(parts.hostname or "", parts.port, timeout=10)
    connection.putrequest(method, path, skip_host=True)
    connection.putheader("Host", host or parts.netloc)
    connection.endheaders()
    response = connection.getresponse()
    body = response.read()
    connection.close()
    return response.status, body


@pytest.fixture
def folder(make_asset: Callable[..., Asset], tmp_path: Path) -> Path:
    path = tmp_path / "asset"
    complete(on_a_plane(make_asset(k=3, encoding="uint8"))).save(path)
    (path / "secret.txt").write_text("not named by asset.json")
    (tmp_path / "beside.txt").write_text("outside")
    return path


def test_the_asset_and_the_page_are_served_byte_for_byte(folder: Path, serve: Callable[..., str], built: Path) -> None:
    url = serve(folder)
    assert ask(url, "/") == (200, (built / "index.html").read_bytes())
    for name in ("asset.json", "map_00.png", "r_table.exr", "position.exr", "coverage.exr"):
        assert ask(url, f"/asset/{name}") == (200, (folder / name).read_bytes())
    told = json.loads(ask(url, "/viewer.json")[1])
    assert (told["assets"][0]["folder"], told["kind"], told["mesh"], told["capture"]) == ("asset/", "view", None, None)
    status, body = ask(url, "/asset/asset.json", "HEAD")
    assert (status, body) == (200, b"")


@pytest.mark.parametrize(
    "path",
    [
        "/asset/secret.txt",
        "/asset/../beside.txt",
        "/asset/%2e%2e/beside.txt",
        "/asset/..%2fbeside.txt",
        "/../beside.txt",
        "/asset//etc/passwd",
        "//etc/passwd",
        "/etc/passwd",
        "/asset/",
        "/asset/.",
        "/asset/asset.json/",
        "/asset/map_00.png%00",
        "/asset\\secret.txt",
        "/capture/0.exr",
        "/mesh.glb",
    ],
)
def test_nothing_else_is_served(folder: Path, serve: Callable[..., str], path: str) -> None:
    assert ask(serve(folder), path)[0] == 404


def test_other_hosts_and_methods_are_refused(folder: Path, serve: Callable[..., str]) -> None:
    """A page elsewhere that points its name at 127.0.0.1 gets nothing."""
    url = serve(folder)
    port = urlsplit(url).port
    assert ask(url, "/asset/asset.json", host=f"localhost:{port}")[0] == 200
    for host in (f"evil.example:{port}", "evil.example", "127.0.0.1", f"127.0.0.1:{port}.evil.example", ""):
        assert ask(url, "/asset/asset.json", host=host or " ")[0] == 403, host
    assert ask(url, "/", "POST")[0] == 501
    assert ask(url, "/", "DELETE")[0] == 501


def test_the_server_listens_on_this_machine_alone(folder: Path, built: Path) -> None:
    server = ViewerServer(contents_of([folder]))
    try:
        assert server.server_address[0] == "127.0.0.1"
        with pytest.raises(InputError, match="free port"):
            ViewerServer({}, server.server_port)
    finally:
        server.server_close()


def test_links_that_leave_the_folder_are_refused(folder: Path, built: Path) -> None:
    (folder / "map_00.png").unlink()
    (folder / "map_00.png").symlink_to(folder.parent / "beside.txt")
    with pytest.raises((ManifestError, ImageError)):
        contents_of([folder])


def test_a_capture_s_images_are_served_as_they_are(
    make_capture: Callable[..., Capture], make_asset: Callable[..., Asset], tmp_path: Path, serve: Callable[..., str]
) -> None:
    capture = make_capture(lambda direction: np.full((9, 14, 3), 0.5 + direction[2], np.float32), lights=6, holdout=2)
    complete(make_asset(k=3)).save(tmp_path / "asset")
    url = serve(tmp_path / "asset", capture.folder)
    lights = json.loads(ask(url, "/capture/lights.json")[1])["lights"]
    assert [light["role"] for light in lights] == [light.role for light in capture.lights]
    assert np.allclose([light["direction"] for light in lights], capture.directions())
    status, data = ask(url, "/capture/4.exr")
    (tmp_path / "served.exr").write_bytes(data)
    assert status == 200
    assert (read_image(tmp_path / "served.exr", 3) == capture.image(4)).all()
    assert ask(url, f"/capture/{len(lights)}.exr")[0] == 404


def test_a_capture_of_something_else_is_refused(
    make_capture: Callable[..., Capture], make_asset: Callable[..., Asset], tmp_path: Path, built: Path
) -> None:
    capture = make_capture(lambda direction: np.ones((5, 4, 3), np.float32), lights=4, holdout=1)
    complete(make_asset(k=3)).save(tmp_path / "asset")
    with pytest.raises(InputError, match="expected the capture that the asset was fitted from"):
        contents_of([tmp_path / "asset"], capture.folder)


def test_without_the_built_page_it_says_what_to_run(tmp_path: Path) -> None:
    with pytest.raises(MissingLibraryError, match="make web"):
        built_page.page_files(tmp_path)


def test_the_command_serves_until_it_is_interrupted(folder: Path, built: Path) -> None:
    command = [sys.executable, "-m", "srbf", "view", str(folder), "--no-browser"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        assert process.stdout is not None
        url = process.stdout.readline().strip()
        assert url.startswith("http://127.0.0.1:")
        with urllib.request.urlopen(url + "asset/asset.json", timeout=10) as response:
            assert response.read() == (folder / "asset.json").read_bytes()
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=20)
    finally:
        process.kill()
    assert process.returncode == 0
    assert (out, err) == ("", "")


def test_the_command_says_what_is_wrong_with_an_asset(folder: Path, built: Path) -> None:
    (folder / "map_01.png").write_bytes(b"")
    command = [sys.executable, "-m", "srbf", "view", str(folder), "--no-browser"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert (done.returncode, done.stdout) == (1, "")
    assert "map_01.png" in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_a_port_that_is_taken_is_said(folder: Path, built: Path) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        command = [sys.executable, "-m", "srbf", "view", str(folder), "--no-browser", "--port", str(taken.getsockname()[1])]
        done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 1
    assert "free port" in done.stderr
