"""The page beside Cycles: a render of the present lights, its error, one at a time, stopped, and asked for by this page alone."""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Callable, Iterator
from http.client import HTTPConnection
from pathlib import Path
from threading import Thread
from typing import Any
from urllib.parse import quote
from urllib.request import urlopen

import numpy as np
import pytest
from test_page import HEIGHT, STEP, WIDTH, shown_as

from srbf.asset import Asset
from srbf.bake.given_reference import render_given
from srbf.errors import InputError
from srbf.io.image import read_image
from srbf.viewer.contents import contents_of
from srbf.viewer.cycles import CyclesRenders
from srbf.viewer.server import ViewerServer

sys.path.append(str(Path(__file__).parents[1] / "bake"))
from light_set_commands import done, scenes_in

pytest.importorskip("embreex")
pytestmark = [pytest.mark.blender, pytest.mark.slow]

SIZE, ZOOM = (64, 48), 6
EXPOSURE = 2.0
ROUNDED = 0.25  # the page's numbers are rounded, so that the noise of some pixels differs
ERROR = 0.15  # of 64 samples, most of it noise


@pytest.fixture(scope="module")
def shot(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """The asset's folder and the .blend."""
    folder = tmp_path_factory.mktemp("shot")
    scene = scenes_in(tmp_path_factory)("designed")
    size = "x".join(map(str, SIZE))
    done(
        "bake",
        scene,
        "-o",
        folder / "capture",
        "--receiver",
        "view",
        "--size",
        size,
        "--light-set",
        "gather",
        "--pool",
        4000,
        "--holdout",
        0,
    )
    done("fit", folder / "capture", "-o", folder / "asset")
    return folder / "asset", scene


@pytest.fixture
def start(built: Path) -> Iterator[Callable[[Path, Path], ViewerServer]]:
    servers: list[ViewerServer] = []

    def serve(folder: Path, scene: Path) -> ViewerServer:
        renders = CyclesRenders(Asset.open(folder), scene)
        servers.append(ViewerServer(contents_of([folder], renders=renders), renders=renders))
        Thread(target=servers[-1].serve_forever, kwargs={"poll_interval": 0.02}, daemon=True).start()
        return servers[-1]

    yield serve
    for server in servers:
        server.shutdown()
        server.server_close()


def pressed(chromium: Any, name: str) -> None:
    chromium("run", script=f"[...document.querySelectorAll('.lil-gui button')].find((b) => b.textContent === {json.dumps(name)}).click()")


def texels(chromium: Any) -> tuple[np.ndarray, np.ndarray]:
    """(H, W, 3) bytes of the picture, and which texels no handle of a light covers."""
    canvas, (width, height) = chromium.canvas(), SIZE
    top, left = round(canvas.shape[0] / 2 - height * ZOOM / 2), round(canvas.shape[1] / 2 - width * ZOOM / 2)
    blocks = canvas[top : top + height * ZOOM, left : left + width * ZOOM].reshape(height, ZOOM, width, ZOOM, 3)
    return blocks[:, 0, :, 0], (blocks == blocks[:, :1, :, :1]).all(axis=(1, 3, 4))


def status(chromium: Any) -> str:
    return str(chromium("run", script="document.getElementById('status').textContent"))


def asked(server: ViewerServer, method: str, body: Any = None, **headers: str) -> tuple[int, dict[str, Any]]:
    connection = HTTPConnection("127.0.0.1", server.server_port, timeout=60)
    own = {"Origin": f"http://127.0.0.1:{server.server_port}", "Content-Type": "application/json"}
    connection.request(method, "/cycles", None if body is None else json.dumps(body), own | headers)
    response = connection.getresponse()
    text = response.read().decode()
    return response.status, json.loads(text) if text.startswith("{") else {"error": text}


def test_the_page_shows_a_render_beside_the_relit_picture(
    chromium: Any, shot: tuple[Path, Path], start: Callable[[Path, Path], ViewerServer], tmp_path: Path
) -> None:
    folder, scene = shot
    server = start(folder, scene)
    state = {"zoom": ZOOM, "middle": [SIZE[0] / 2, SIZE[1] / 2], "exposure": EXPOSURE}
    chromium("open", url=f"{server.url}#{quote(json.dumps(state))}", width=WIDTH, height=HEIGHT)
    relit, plain = texels(chromium)
    chromium("number", name="Samples", value=64)
    pressed(chromium, "Render with Cycles")
    chromium("press", keys=[])  # it waits until the page is no longer busy
    assert chromium.state()["compare"] == "slider"
    line = status(chromium)
    assert "Cycles: 64 samples in" in line and "relative rmse" in line and "psnr" in line and "page" in line
    error = float(line.split("relative rmse ")[1].split(" %")[0]) / 100
    chromium("choose", selector=".lil-gui .controller:has(.name:text-is('With the render')) select", value="Reference")
    asset = Asset.open(folder)
    (tmp_path / "image.exr").write_bytes(urlopen(f"{server.url}cycles/image.exr").read())
    reference = read_image(tmp_path / "image.exr")
    own = render_given(asset, scene, [one["light"] for one in asset.manifest["scene_lights"]], 64).image
    assert np.sqrt(((reference - own) ** 2).mean() / (own**2).mean()) < ROUNDED
    found, still = texels(chromium)
    covered = (asset.images["coverage"] > 0.99) & plain & still
    assert covered.mean() > 0.5
    assert np.quantile(np.abs(found - shown_as(reference, EXPOSURE))[covered], 0.97) <= STEP  # whole texels are under handles
    least = (reference[covered] ** 2).mean()
    linear = np.where(relit <= 10, relit / 12.92 / 255, ((relit / 255 + 0.055) / 1.055) ** 2.4) / 2**EXPOSURE
    shown = (relit < 254).all(axis=2) & covered
    estimate = np.sqrt(((linear - reference)[shown] ** 2).mean() / least)
    assert error < ERROR and abs(error - estimate) < 0.4 * error, (error, estimate)
    chromium("choose", selector=".lil-gui .controller:has(.name:text-is('With the render')) select", value="Slider: reference | relit")
    chromium("number", name="Intensity", value=2)
    assert "lights have changed since: render again" in status(chromium)
    if "SRBF_SHOT" in os.environ:
        chromium("open", url=chromium("address"), width=1200, height=800)
        pressed(chromium, "Render with Cycles")
        chromium("press", keys=[])
        chromium("shot", path=os.environ["SRBF_SHOT"])


def test_a_render_is_stopped_by_the_page(chromium: Any, shot: tuple[Path, Path], start: Callable[[Path, Path], ViewerServer]) -> None:
    chromium("open", url=start(*shot).url, width=WIDTH, height=HEIGHT)
    chromium("number", name="Samples", value=4096)
    pressed(chromium, "Render with Cycles")
    chromium("run", script="new Promise((done) => setTimeout(done, 1500))")
    assert "Cycles:" in status(chromium)
    began = time.monotonic()
    pressed(chromium, "Stop the render")
    chromium("press", keys=[])
    assert time.monotonic() - began < 10 and "Cycles" not in status(chromium)
    assert "stopped" in chromium("run", script="document.getElementById('hint').textContent")
    assert chromium("run", script="[...document.querySelectorAll('.lil-gui button')].some((b) => b.textContent === 'Render with Cycles')")


def test_one_at_a_time_and_of_this_page_alone(shot: tuple[Path, Path], start: Callable[[Path, Path], ViewerServer]) -> None:
    folder, scene = shot
    server = start(folder, scene)
    lights = [one["light"] for one in Asset.open(folder).manifest["scene_lights"]]
    job = {"lights": lights, "samples": 4096}
    for wrong in ({"Origin": "http://example.org"}, {"Origin": "null"}, {"Host": "example.org"}):
        assert asked(server, "POST", job, **wrong)[0] == 403
        assert asked(server, "DELETE", **wrong)[0] == 403
    assert asked(server, "POST", job, **{"Content-Type": "text/plain"})[0] == 400
    for bad in (
        {},
        {"lights": "x", "samples": 1},
        {"lights": [{"kind": "point"}], "samples": 1},
        {"lights": [{"kind": "environment", "file": "/etc/passwd"}], "samples": 1},
    ):
        assert asked(server, "POST", bad)[0] == 400, bad
    assert asked(server, "POST", job)[0] == 202
    code, told = asked(server, "POST", job)
    assert code == 409 and "running" in told["error"]
    assert asked(server, "DELETE")[1]["state"] == "stopped"
    assert asked(server, "POST", {"lights": lights, "samples": 0})[0] == 202  # and fails
    for _ in range(100):
        found = json.loads(server.renders.status()) if server.renders else {}
        if found["state"] != "rendering":
            break
        time.sleep(0.1)
    assert found["state"] == "failed" and "samples" in found["error"]


def test_a_scene_that_has_changed_is_said(shot: tuple[Path, Path], tmp_path: Path) -> None:
    folder, scene = shot
    other = tmp_path / "other.blend"
    other.write_bytes(scene.read_bytes() + b" ")
    renders = CyclesRenders(Asset.open(folder), other)
    notes = json.loads(bytes(contents_of([folder], renders=renders)["viewer.json"]))["notes"]  # type: ignore[arg-type]
    assert any("other.blend has changed" in note for note in notes)
    with pytest.raises(InputError, match="no such file"):
        CyclesRenders(Asset.open(folder), tmp_path / "none.blend")
