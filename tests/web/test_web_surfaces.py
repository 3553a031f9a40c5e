"""Objects that emit and are repainted on the web: the pictures of a room are those of `srbf.methods.surface_changes`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cloud_assets import Room, room, with_table, with_transfer
from surface_assets import with_surfaces
from test_web_cloud import LIGHTS, POINT, received

from srbf.export.surfel_textures import MOST_TERMS

CLOSE = 2e-3  # of the largest value, as for other lights
RED, DIM = (0.9, 0.1, 0.2), (0.05, 0.1, 0.15)
CHANGES: list[list[tuple[str, str, tuple[float, ...] | None]]] = [
    [("emission", "Screen", (2.0, 0.5, 1.0))],
    [("albedo", "Wall", RED)],
    [("albedo", "Wall", RED), ("albedo", "Screen", DIM), ("emission", "Wall", (1.0, 1.0, 3.0))],
    [("albedo", "Wall", None), ("albedo", "Screen", None)],
]


def expected_of(made: Room, surfaces: Any, lights: list[dict[str, Any]], changes: list[tuple]) -> np.ndarray:
    albedo = {name: color for kind, name, color in changes if kind == "albedo" and color}
    surfaces = surfaces.painted(albedo)
    shapes = np.einsum("rkc,kc->rc", surfaces.transfer(), np.sum([received(made, light) for light in lights], axis=0))
    shapes += sum(surfaces.emitted(name, np.array(color)) for kind, name, color in changes if kind == "emission")
    weights = np.einsum("fr,rc->fc", made.files["light_values.exr"][0][..., 0], shapes)
    return np.maximum(made.response(weights), 0)


@pytest.mark.parametrize("bounces", [None, 3])
def test_changed_surfaces_light_the_room(browser: Any, bounces: int | None) -> None:
    """On the CPU and the GPU, one change after the other; the asset's table of places is of before."""
    made, surfaces = with_surfaces(with_table(with_transfer(room()))[0], bounces)
    url = browser.place(made.write)
    sets = [LIGHTS["point"], LIGHTS["all"], LIGHTS["spot"], LIGHTS["spot"]]
    for weights in ("cpu", "gpu"):
        job = {"weights": weights, "changes": CHANGES, "exact": True}
        drawn = browser.lightmaps("three-lightmap", url, sets, **job)
        for picture, lights, changes in zip(drawn, sets, CHANGES, strict=True):
            expected = expected_of(made, surfaces, lights, changes)
            assert expected.max() > 0.1
            np.testing.assert_allclose(picture, expected, atol=CLOSE * expected.max(), err_msg=f"{weights} {changes}")


def test_as_many_bounces_are_summed_as_in_exports() -> None:
    """The web reads assets as they are fitted, so no export can tell it the count."""
    source = (Path(__file__).resolve().parents[2] / "web/src/surface_changes.ts").read_text()
    assert f"MOST_TERMS = {MOST_TERMS};" in source


@pytest.mark.parametrize("backend", ["webgl", "webgpu"])
def test_objects_emit_in_node_materials(browser: Any, backend: str) -> None:
    """By passes of nodes, which refuse to repaint."""
    made, surfaces = with_surfaces(with_transfer(room()), None)
    job = {"asset": browser.place(made.write), "weights": "gpu", "backend": backend}
    (picture,) = browser.lightmaps("nodes-lightmap", light_sets=[LIGHTS["spot"]], changes=CHANGES[:1], **job)
    expected = expected_of(made, surfaces, LIGHTS["spot"], CHANGES[0])
    np.testing.assert_allclose(picture, expected, atol=CLOSE * expected.max())
    said = browser.response("nodes-lightmap", lightSets=[LIGHTS["spot"]], changes=CHANGES[1:2], **job)["error"]
    assert "found objects that are repainted" in said


def test_what_cannot_change_is_named(browser: Any) -> None:
    made = with_transfer(room())
    plain = {"lightSets": [[POINT]], "changes": [[("emission", "Wall", (1, 1, 1))]]}
    said = browser.response("three-lightmap", asset=browser.place(made.write), **plain)["error"]
    assert "expected an asset whose surfaces can change" in said
    url = browser.place(with_surfaces(made, None)[0].write)
    for change, expected in {
        ("emission", "Door", (1, 1, 1)): 'expected an object of Wall, Screen, found "Door"',
        ("albedo", "Wall", (1, 2, 1)): "expected an albedo of three numbers from 0 to 1, found 1, 2, 1",
    }.items():
        assert expected in browser.response("three-lightmap", asset=url, lightSets=[[POINT]], changes=[[change]])["error"]
