"""Triangles read back from glTF made here by hand: frames, instances, materials, and what is refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from closed_forms import TURN
from closed_forms import glb as build

from srbf.errors import ManifestError
from srbf.io.scene_glb import KNOTS, read_triangles

CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 2, 3]], np.float32)


def glb(**changes: Any) -> bytes:
    return build(CORNERS[None], **changes)


def test_the_root_turns_back_into_the_capture_frame() -> None:
    found = read_triangles(glb())
    np.testing.assert_allclose(found.corners[0], CORNERS, atol=1e-6)
    np.testing.assert_allclose(found.normals[0], np.broadcast_to([0, -3, 2] / np.sqrt(13), (3, 3)), atol=1e-6)
    assert found.occluders.all() and not found.filters.any()


def test_a_scene_that_is_y_up_by_itself_is_turned() -> None:
    found = read_triangles(glb(nodes=[{"mesh": 0}, {"children": [0]}]))
    np.testing.assert_allclose(found.corners[0], CORNERS @ np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]]), atol=1e-6)


def test_nodes_move_and_scale_their_children() -> None:
    nodes = [{"mesh": 0, "translation": [1, 2, 3], "scale": [2, 2, 2]}, {"rotation": TURN, "children": [0]}]
    np.testing.assert_allclose(read_triangles(glb(nodes=nodes)).corners[0], CORNERS * 2 + [1, 2, 3], atol=1e-6)


def test_transmission_is_a_tint_and_extras_win() -> None:
    meshes = [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}]
    glass: dict[str, Any] = {
        "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.25, 1.0, 1.0]},
        "extensions": {"KHR_materials_transmission": {"transmissionFactor": 0.5}},
    }
    found = read_triangles(glb(meshes=meshes, materials=[glass]))
    np.testing.assert_allclose(found.transmittance[found.material[0]], np.tile([0.25, 0.125, 0.5], (KNOTS, 1)))
    assert found.filters.all() and not found.occluders.any()
    curve = np.linspace(0, 2, 3 * KNOTS).reshape(KNOTS, 3)
    found = read_triangles(glb(meshes=meshes, materials=[{**glass, "extras": {"tint_by_cosine": curve.tolist()}}]))
    np.testing.assert_allclose(found.transmittance[found.material[0]], curve, rtol=1e-6)


def test_what_casts_no_shadow_does_not_occlude() -> None:
    found = read_triangles(glb(nodes=[{"mesh": 0, "extras": {"casts_shadow": False}}, {"rotation": TURN, "children": [0]}]))
    assert len(found.corners) == 1 and not found.occluders.any()


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"solid scene",
        glb()[:-20],
        glb(body=b"\0" * 8),
        glb(nodes=[]),
        glb(nodes=[{}, {}]),
        glb(nodes=[{"mesh": 0}, {"children": [1]}]),
        glb(accessors=[{"bufferView": 0, "componentType": 5122, "count": 3, "type": "VEC3"}]),
        glb(body=np.full_like(CORNERS, np.nan).tobytes()),
    ],
    ids=["empty", "text", "cut", "short", "no-nodes", "nothing", "cycle", "shorts", "nan"],
)
def test_what_is_no_scene_is_refused_in_one_line(data: bytes) -> None:
    with pytest.raises(ManifestError, match="binary glTF") as caught:
        read_triangles(data)
    assert "\n" not in str(caught.value)


def test_lightmap_coordinates_come_back_for_receivers_alone() -> None:
    places = np.array([[0.25, 0.5], [1, 0], [0, 1]], np.float32)
    accessors = [
        {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
        {"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC2"},
    ]
    found = read_triangles(
        glb(
            body=CORNERS.tobytes() + places.tobytes(),
            accessors=accessors,
            bufferViews=[{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 24}],
            meshes=[{"primitives": [{"attributes": {"POSITION": 0, "_LIGHTMAP": 1}}, {"attributes": {"POSITION": 0}}]}],
        )
    )
    np.testing.assert_array_equal(found.lightmap[0], places)
    assert np.isnan(found.lightmap[1]).all()
    assert read_triangles(glb()).lightmap is None
