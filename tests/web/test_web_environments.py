"""Environments in rooms with windows, on the web: the pictures are those of `srbf.methods.environment_table`."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from cloud_assets import Room, room, with_transfer
from test_web_cloud import LIGHTS, POINT, received

from srbf.lights import EnvironmentLight
from srbf.methods.environment_table import FILES, KEY
from srbf.visibility.environment_cells import cell_radiance

CLOSE = 2e-3  # of the largest value, as for other lights
SIDE = 6
CELLS = [0, 3, 7, 14, 15, 20, 35]
MAP = np.random.default_rng(21).random((5, 9, 3)).astype(np.float32)
ENVIRONMENT = {"kind": "environment", "width": 9, "height": 5, "pixels": MAP.ravel().tolist(), "color": [0.5, 1.0, 2.0]}


def with_windows(made: Room) -> tuple[Room, np.ndarray]:
    """A room `with_transfer` whose surfels see some cells of the environment, and the weights of shapes by these, (r, K, 3)."""
    rank = made.manifest["surfel_transfer"]["rank"]
    table = np.random.default_rng(22).uniform(0, 0.5, (rank, len(CELLS), 3)).astype(np.float32)
    told = {"file": FILES[KEY], "rank": rank, "side": SIDE, "cells": CELLS, "scale": 2.0}
    files = {**made.files, FILES[KEY]: ((table / 2).astype(np.float16).astype(np.float32), "half")}
    return replace(made, manifest={**made.manifest, KEY: told}, files=files), (table / 2).astype(np.float16).astype(np.float32) * 2


def expected_of(made: Room, table: np.ndarray, lights: list[dict[str, Any]]) -> np.ndarray:
    inside = [received(made, light) for light in lights if light["kind"] != "environment"]
    shapes = np.einsum("rkc,kc->rc", 2 * made.files["transfer.exr"][0], np.sum(inside, axis=0)) if inside else 0
    for light in lights:
        if light["kind"] == "environment":
            radiance = cell_radiance(EnvironmentLight(MAP, tuple(light["color"])).turned(light.get("turn", 0)), SIDE)[CELLS]
            shapes = shapes + np.einsum("rkc,kc->rc", table, radiance)
    return np.maximum(made.response(np.einsum("fr,rc->fc", made.files["light_values.exr"][0][..., 0], shapes)), 0)


SETS = [[ENVIRONMENT], [*LIGHTS["point"], ENVIRONMENT, {**ENVIRONMENT, "color": [1, 0.2, 0.1], "turn": -2.2}], LIGHTS["spot"]]


@pytest.mark.parametrize(
    ("page", "job"),
    [
        ("three-lightmap", {"weights": "cpu"}),
        ("three-lightmap", {"weights": "gpu"}),
        ("nodes-lightmap", {"weights": "gpu", "backend": "webgl"}),
        ("nodes-lightmap", {"weights": "gpu", "backend": "webgpu"}),
        ("nodes-lightmap", {"weights": "compute", "backend": "webgpu"}),
    ],
)
def test_maps_shine_through_windows(browser: Any, page: str, job: dict[str, str]) -> None:
    """Alone, beside lights inside and another map, and gone again."""
    made, table = with_windows(with_transfer(room()))
    drawn = browser.lightmaps(page, browser.place(made.write), SETS, exact=True, **job)
    for picture, lights in zip(drawn, SETS, strict=True):
        expected = expected_of(made, table, lights)
        assert expected.max() > 0.1
        np.testing.assert_allclose(picture, expected, atol=CLOSE * expected.max(), err_msg=str([light["kind"] for light in lights]))


def test_a_closed_room_knows_none(browser: Any) -> None:
    said = browser.response("three-lightmap", asset=browser.place(with_transfer(room()).write), lightSets=[[ENVIRONMENT, POINT]])["error"]
    assert "expected an asset whose surfels see an environment" in said
