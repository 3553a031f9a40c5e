"""The sphere that probes light on the page: its picture is that of numpy, and it goes where one drags it."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
import pytest
from cloud_assets import PLACES, Room, room, with_table, with_transfer
from probe_assets import probes_of_room, write_probes
from test_page import HEIGHT, PANEL, WIDTH, shown_as
from test_web_cloud import POINT, received
from typer.testing import CliRunner

from srbf.asset import Asset
from srbf.cli import app
from srbf.errors import InputError
from srbf.probe_grid import ProbeGrid
from srbf.relighting.probe_light import harmonics, light_at
from srbf.viewer.contents import contents_of

EXPOSURE = -4.0
CLOSE = 2.5  # bytes: the middle of the sphere lies between its texels
AT, SIZE = [-1.3, -0.6, 1.0], 0.2  # m
EYE = np.array([0.2, -3.0, 2.2])
LIGHT = {**{key: POINT[key] for key in ("kind", "position", "a0", "falloff", "radius")}, "on": True, "color": "#ffffff", "intensity": 1.0}
MIDDLE = [(WIDTH - PANEL) / 2, HEIGHT / 2]


@pytest.fixture
def probes() -> tuple[Room, ProbeGrid]:
    return probes_of_room()


@pytest.fixture
def folders(probes: tuple[Room, ProbeGrid], tmp_path: Path) -> tuple[Path, Path]:
    with_table(with_transfer(room()))[0].write(tmp_path / "asset")
    write_probes(*probes, tmp_path / "probes")
    return tmp_path / "asset", tmp_path / "probes"


def shown(chromium: Any, **state: Any) -> None:
    """Have the page show a state, without loading it again."""
    ball = {"on": True, "position": AT, "size": SIZE}
    hashed = {"exposure": EXPOSURE, "lights": [LIGHT], "selected": -1, "eye": [EYE.tolist(), AT], "ball": ball, **state}
    chromium("run", script=f"location.hash = {quote(json.dumps(hashed))!r}")
    chromium("press", keys=["Shift"])


def middle(chromium: Any) -> np.ndarray:
    """The picture's middle pixel, which sees the sphere where it faces the eye."""
    canvas = chromium.canvas()
    return canvas[canvas.shape[0] // 2, canvas.shape[1] // 2].astype(float)


def test_a_sphere_is_lit_dragged_and_hidden(
    chromium: Any, probes: tuple[Room, ProbeGrid], folders: tuple[Path, Path], serve: Callable[..., str]
) -> None:
    made, asset = probes[0], Asset.open(folders[1])
    relit = np.maximum(made.response(made.weights(received(made, {**POINT, "color": (1.0, 1.0, 1.0)}))), 0).astype(np.float32)

    def indirect(at: list[float]) -> np.ndarray:
        facing = (EYE - at) / np.linalg.norm(EYE - at)
        return light_at(asset, harmonics(asset, relit), (at + SIZE * facing)[None], facing[None])[0]

    url = serve(folders[0], probes=folders[1])
    chromium("open", url=f"{url}#{quote(json.dumps({'terms': 'indirect'}))}", width=WIDTH, height=HEIGHT)
    ball, light = chromium.state()["ball"], chromium.state()["lights"][0]["position"]
    assert tuple(light) in {tuple(place) for place in PLACES}
    assert np.linalg.norm(np.subtract(ball["position"], light)) > 2 * ball["size"], "it does not start in the light"
    shown(chromium, terms="indirect")
    expected = shown_as(indirect(AT), EXPOSURE)
    assert 40 < expected.max() < 250
    assert np.abs(middle(chromium) - expected).max() < CLOSE

    chromium("drag", path=[MIDDLE, [MIDDLE[0] + 40, MIDDLE[1] - 30]])
    state = chromium.state()
    moved = np.array(state["ball"]["position"])
    assert np.linalg.norm(moved - AT) > 0.1 and abs((moved - AT) @ (EYE - AT)) < 1e-3, "it stays in the plane that faces the eye"
    assert state["eye"] == [EYE.tolist(), AT], "nothing else was dragged"

    toward = np.array(POINT["position"]) - AT
    shown(chromium, terms="direct", exposure=-1.0)
    facing = (EYE - AT) / np.linalg.norm(EYE - AT)
    toward -= SIZE * facing
    direct = toward @ facing / np.linalg.norm(toward) ** 3 * POINT["a0"] ** 2
    assert np.abs(middle(chromium) - shown_as(np.full(3, direct), -1.0)).max() < CLOSE
    shown(chromium, terms="direct", exposure=-1.0, ball={"on": False, "position": AT, "size": SIZE})
    assert np.abs(middle(chromium) - shown_as(np.full(3, direct), -1.0)).max() > 10, "it is hidden"


def test_the_command_takes_probes_with_it(folders: tuple[Path, Path], built: Path, tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    done = CliRunner().invoke(app, ["view", str(folders[0]), "--probes", str(folders[1]), "--save", str(page)])
    assert done.exit_code == 0, done.output
    held = json.loads(re.search(r'id="held">(.+?)</script>', page.read_text())[1])  # type: ignore[index]
    told = json.loads(base64.b64decode(held["viewer.json"]))
    assert told["probes"] == "probes/" and {"probes/asset.json", "probes/probes.exr", "probes/probe_nearness.exr"} < set(held)


def test_what_are_no_probes_of_the_lightmap_is_named(folders: tuple[Path, Path], built: Path, tmp_path: Path) -> None:
    asset, probes = folders
    with pytest.raises(InputError, match="expected an asset of probes in .* for `probes`, found one of a lightmap"):
        contents_of([asset], probes=asset)
    with pytest.raises(InputError, match="found 14 x 9 lightmap .* probes .*; name the one of probes by `probes`"):
        contents_of([asset, probes])
    told = json.loads((asset / "asset.json").read_text())
    named = {**told, "receiver": {"kind": "view"}}
    (asset / "asset.json").write_text(json.dumps(named))
    with pytest.raises(InputError, match="expected a lightmap or vertices for `probes`"):
        contents_of([asset], probes=probes)
