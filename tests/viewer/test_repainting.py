"""Objects of an editable asset emit and are repainted on the page, by the panel and by the address."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from cloud_assets import room, with_table, with_transfer
from surface_assets import with_surfaces
from test_cloud import EXPOSURE, opened
from test_page import STEP, ZOOM, shown_as
from test_web_cloud import POINT
from test_web_surfaces import expected_of

HALVES = 0.1  # of 255: the tables are half floats


def linear(color: str) -> tuple[float, ...]:
    stored = np.array([int(color[i : i + 2], 16) / 255 for i in (1, 3, 5)])
    return tuple(np.where(stored <= 0.04045, stored / 12.92, ((stored + 0.055) / 1.055) ** 2.4))


def test_objects_emit_and_are_repainted(chromium: Any, serve: Callable[..., str], tmp_path: Path) -> None:
    made, surfaces = with_surfaces(with_table(with_transfer(room()))[0], None)
    made.write(tmp_path / "asset")
    url = serve(tmp_path / "asset")

    def shows(changes: list[tuple]) -> bool:
        light = {**POINT, **chromium.state()["lights"][0], "color": (1.0, 1.0, 1.0)}
        expected = shown_as(expected_of(made, surfaces, [light], changes), EXPOSURE)
        assert np.ptp(expected) > 60
        return bool((np.abs(chromium.texels(14, 9, ZOOM) - expected) <= STEP + HALVES).all())

    opened(chromium, url)
    chromium("choose", selector='.lil-gui .controller:has(.name:text-is("Object")) select', value="Screen")
    chromium("number", name="Emits", value=2.5)
    assert shows([("emission", "Screen", (2.5, 2.5, 2.5))])
    saved = json.loads(chromium.file("Lights (FRAMES.json)"))["frames"][0]["lights"]
    assert saved[1:] == [{"kind": "named", "name": "Screen", "color": [2.5, 2.5, 2.5]}]
    assert chromium.state()["surfaces"] == [{"name": "Screen", "strength": 2.5, "emission": "#ffffff"}]
    painted = {"name": "Wall", "strength": 1.5, "emission": "#40ff80", "albedo": "#ff8000"}
    opened(chromium, url, surfaces=[painted])
    shining = tuple(1.5 * x for x in linear("#40ff80"))
    assert shows([("albedo", "Wall", linear("#ff8000")), ("emission", "Wall", shining)])
    chromium("run", script="[...document.querySelectorAll('.lil-gui button')].find((b) => b.textContent === 'All as baked').click()")
    chromium("press", keys=["Shift"])
    assert shows([])
    assert chromium.state()["surfaces"] == []
