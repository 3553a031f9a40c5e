"""Named lights on the page: a mixing desk whose picture is the sum of the lights, its address, and FRAMES.json that plays."""

from __future__ import annotations

import base64
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
import pytest
from named_assets import NAMES, Colors, Mixed, light_mix, named_maps
from test_page import HEIGHT, PICTURE, STEP, WIDTH, ZOOM, shown_as

from srbf.asset import Asset
from srbf.export import export
from srbf.lights import NamedLight
from srbf.methods import relight

MADE = {"clusters": lambda: light_mix(clusters=5), "one cluster": lambda: light_mix(clusters=None), "maps": named_maps}
EXPOSURE = -3.0


def shows(chromium: Any, asset: Mixed, colors: Colors) -> bool:
    height, width = asset.ambient.shape[:2]
    expected = shown_as(asset.picture(colors), EXPOSURE)
    assert np.ptp(expected) > 60
    return bool((np.abs(chromium.texels(width, height, ZOOM) - expected) <= STEP).all())


def field(chromium: Any, label: str, value: str | bool) -> None:
    """Set a control of the desk as a user does."""
    what = "checked" if isinstance(value, bool) else "value"
    find = f"document.querySelector('#mixer [aria-label={json.dumps(label)}]')"
    chromium(
        "run", script=f"(at => {{ at.{what} = {json.dumps(value)}; at.dispatchEvent(new Event('input', {{bubbles: true}})); }})({find})"
    )
    chromium("press", keys=[])


def press_button(chromium: Any, text: str) -> None:
    chromium(
        "run", script=f"[...document.querySelectorAll('#mixer .all button')].find(at => at.textContent === {json.dumps(text)}).click()"
    )
    chromium("press", keys=[])


@pytest.fixture(params=MADE)
def asset(request: pytest.FixtureRequest) -> Mixed:
    return MADE[request.param]()


@pytest.fixture
def url(asset: Mixed, tmp_path: Path, serve: Callable[..., str]) -> str:
    asset.write(tmp_path / "asset")
    return serve(tmp_path / "asset")


def opened(chromium: Any, url: str, more: str = "") -> None:
    chromium("open", url=f"{url}{PICTURE},'view':'texels','exposure':{EXPOSURE}{more}}}", width=WIDTH, height=HEIGHT)


def test_the_desk_mixes_and_the_address_keeps_it(chromium: Any, asset: Mixed, url: str) -> None:
    """As designed, then dimmed, tinted and switched; the address names the lights that were changed, and brings them back."""
    opened(chromium, url)
    assert shows(chromium, asset, {})
    assert chromium.state()["lights"] == []
    field(chromium, "Desk lamp: intensity", "50")  # a quarter: the dial is finer near zero # words: ok
    field(chromium, "Window: intensity, a number", "2.5")
    field(chromium, "Window: color", "#00ff00")
    field(chromium, "TV: on", False)
    mixed = {"Desk lamp": (0.25, 0.25, 0.25), "Window": (0.0, 2.5, 0.0), "TV": (0.0, 0.0, 0.0)}
    assert shows(chromium, asset, mixed)
    there = chromium("address")
    assert [light["name"] for light in chromium.state()["lights"]] == ["Desk lamp", "Window", "TV"]
    chromium("open", url=there, width=WIDTH, height=HEIGHT)
    assert shows(chromium, asset, mixed)
    press_button(chromium, "All off")
    dark = shown_as(asset.ambient, EXPOSURE)
    assert (np.abs(chromium.texels(*asset.ambient.shape[1::-1], ZOOM) - dark) <= STEP).all()
    press_button(chromium, "All on")
    assert shows(chromium, asset, {**mixed, "TV": (1.0, 1.0, 1.0)})
    press_button(chromium, "As designed")
    assert shows(chromium, asset, {})


def test_an_exported_site_shows_numpy_s_picture(
    chromium: Any, asset: Mixed, built: Path, tmp_path: Path, serve_static: Callable[[Path], str]
) -> None:
    """As `srbf relight` has the mix, from any static host."""
    asset.write(tmp_path / "asset")
    mixed = Asset.open(tmp_path / "asset")
    lights = [NamedLight("Window", (2.0, 1.5, 0.5)), NamedLight("L0")]
    export(mixed, "web", tmp_path / "site")
    others = {name: (0.0, 0.0, 0.0) for name in NAMES if name not in ("Window", "L0")}
    colors = {**others, "Window": (2.0, 1.5, 0.5)}
    np.testing.assert_allclose(relight(mixed, lights), asset.picture(colors), atol=1e-5)
    off = {"kind": "named", "on": False, "color": "#ffffff", "intensity": 1}
    states = [{**off, "name": name} for name in others] + [{**off, "name": "Window", "on": True, "intensity": 2.0}]
    opened(chromium, serve_static(tmp_path / "site"), f",'lights':{quote(json.dumps(states))}")
    assert shows(chromium, asset, {**others, "Window": (2.0, 2.0, 2.0)})


@pytest.fixture
def desk(chromium: Any, tmp_path: Path, serve: Callable[..., str]) -> Mixed:
    """One asset, open."""
    made = light_mix(clusters=5)
    made.write(tmp_path / "asset")
    opened(chromium, serve(tmp_path / "asset"))
    return made


def test_keys_reach_every_control(chromium: Any, desk: Mixed) -> None:
    """Tab goes through on, color, number and dial of each light; arrows move a dial; digits switch lights, and Delete removes none."""
    chromium("run", script="document.querySelector('#mixer .all button').focus()")
    chromium("press", keys=["Tab", "Tab", "Tab", "Space"])  # past the buttons: the first light's checkbox
    assert shows(chromium, desk, {"Desk lamp": (0.0, 0.0, 0.0)})
    chromium("press", keys=["Space", "Tab"])
    for _ in range(8):  # a color well may take several stops
        chromium("press", keys=["Tab"])
        if chromium("run", script="document.activeElement.type") == "range":
            break
    assert chromium("run", script="document.activeElement.getAttribute('aria-label')") == "Desk lamp: intensity"  # words: ok
    chromium("press", keys=["Home"])
    assert shows(chromium, desk, {"Desk lamp": (0.0, 0.0, 0.0)})
    chromium("press", keys=["End"])
    assert shows(chromium, desk, {"Desk lamp": (4.0, 4.0, 4.0)})
    assert chromium("run", script="document.activeElement.getAttribute('aria-valuetext')") == "4 times as designed"
    chromium("run", script="document.activeElement.blur()")
    chromium("press", keys=["3", "Delete"])
    assert shows(chromium, desk, {"Desk lamp": (4.0, 4.0, 4.0), "TV": (0.0, 0.0, 0.0)})
    assert chromium("run", script="document.querySelectorAll('#mixer .row').length") == len(NAMES)


def test_frames_play_frame_by_frame(chromium: Any, desk: Mixed, tmp_path: Path) -> None:
    """A flicker: each frame is numpy's; what a frame does not list is off; what is saved is what was dropped."""
    levels = [0.5, 2.0, 1.25]
    frames = [{"lights": [{"kind": "named", "name": "TV", "color": [x, x, x]}, {"kind": "named", "name": "L0"}]} for x in levels]
    text = json.dumps({"frames": frames})
    chromium("drop", name="FRAMES.json", bytes=base64.b64encode(text.encode()).decode(), moving=True)
    chromium("press", keys=["Space"])  # pause
    others = {name: (0.0, 0.0, 0.0) for name in NAMES if name not in ("TV", "L0")}
    assert any(shows(chromium, desk, {**others, "TV": (x, x, x)}) for x in levels)
    saved = json.loads(chromium.file("Path (FRAMES.json)"))
    assert [frame["lights"][0]["color"] for frame in saved["frames"]] == [[x, x, x] for x in levels]
    assert saved["frames"][0]["lights"][1] == {"kind": "named", "name": "L0", "color": [1, 1, 1]}


def test_wrong_frames_and_addresses_are_said_in_one_line(chromium: Any, desk: Mixed, tmp_path: Path) -> None:
    for text, expected in {
        "{": "expected JSON in FRAMES.json",
        '{"frames": []}': "expected a list of frames",
        '{"frames": [{"lights": [{"kind": "named", "name": "Lamp"}]}]}': 'expected a light of this asset, found "Lamp"',  # words: ok
        '{"frames": [{"lights": [{"kind": "point", "position": [0, 0, 1]}]}]}': "expected named lights for this asset, found a point one",
        '{"frames": [{"lights": [{"kind": "named", "name": "TV", "color": [1, 2]}]}]}': "expected three numbers of color in frame 0",
    }.items():
        chromium("drop", name="FRAMES.json", bytes=base64.b64encode(text.encode()).decode())
        assert expected in chromium("run", script="document.getElementById('toast').textContent")
    went = "addEventListener('hashchange', () => done(), {once: true})"
    other = "#{'lights':[{'kind':'named','name':'Lamp','on':true,'color':'@ffffff','intensity':1}]}".replace("@", "%23")  # words: ok
    chromium("run", script=f"new Promise((done) => {{ {went}; location.hash = {json.dumps(other)}; }})")
    assert 'found "Lamp"; the page uses its defaults' in chromium("run", script="document.getElementById('toast').textContent")  # words: ok
    assert shows(chromium, desk, {})
