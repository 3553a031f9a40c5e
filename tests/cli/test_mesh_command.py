"""`srbf mesh` where it ends before Blender begins: one line each, exit 1, nothing written."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from test_commands import refused

from srbf.capture import Capture


@pytest.fixture
def capture(make_capture) -> Capture:
    return make_capture(lambda d: np.full((4, 5, 3), max(0, d[2])), lights=4, holdout=1)


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    """A file at which no Blender is to look."""
    path = tmp_path / "scene.blend"
    path.write_bytes(b"not a scene")
    return path


def described(capture: Capture, **keys: object) -> Path:
    """The capture, saying of itself what `keys` say."""
    path = capture.folder / "capture.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), **keys}))
    return capture.folder


def test_scene_and_output(scene: Path, tmp_path: Path) -> None:
    assert f"expected a .blend at {tmp_path / 'none.blend'}, found no such file" in refused(
        "mesh", tmp_path / "none.blend", "-o", tmp_path / "scene.glb"
    )
    assert "found a folder" in refused("mesh", tmp_path, "-o", tmp_path / "scene.glb")
    assert "expected -o NAME.glb, found 'scene.blend'" in refused("mesh", scene, "-o", scene, "--force")
    (tmp_path / "scene.glb").write_bytes(b"kept")
    assert "found one; choose another, or --force" in refused("mesh", scene, "-o", tmp_path / "scene.glb")
    (tmp_path / "folder.glb").mkdir()
    assert "expected no" in refused("mesh", scene, "-o", tmp_path / "folder.glb", "--force")
    assert (tmp_path / "scene.glb").read_bytes() == b"kept"
    assert scene.read_bytes() == b"not a scene"


@pytest.mark.parametrize(
    ("receiver", "found"),
    [
        ({"kind": "view", "camera": "Camera"}, "view"),
        (None, "none"),  # photographs
    ],
)
def test_a_capture_of_another_kind(scene: Path, capture: Capture, tmp_path: Path, receiver: dict | None, found: str) -> None:
    folder = described(capture, **({"receiver": receiver} if receiver else {}))
    line = refused("mesh", scene, "-o", tmp_path / "scene.glb", "--capture", folder)
    assert f"expected a capture of a lightmap or vertices at {folder}, found one of kind {found}; leave --capture out" in line
    assert not (tmp_path / "scene.glb").exists()


@pytest.mark.parametrize("text", ['{"uv_layer": "made"}', '{"per_loop": [[0, "a"]]}', '{"objects": [[]]}', "[", "[]"])
def test_uv_coordinates_that_are_none(scene: Path, capture: Capture, tmp_path: Path, text: str) -> None:
    receiver = {"kind": "lightmap", "object": "Table", "uv_layer": "made"}
    folder = described(capture, receiver=receiver, source={"uv": "uv.json"})
    (folder / "uv.json").write_text(text)
    assert f"in {folder / 'uv.json'}" in refused("mesh", scene, "-o", tmp_path / "scene.glb", "--capture", folder)
    described(capture, source={"uv": "../uv.json"})
    assert "expected a relative path inside" in refused("mesh", scene, "-o", tmp_path / "scene.glb", "--capture", folder)


def test_no_capture_at_all(scene: Path, tmp_path: Path) -> None:
    assert "expected a capture" in refused("mesh", scene, "-o", tmp_path / "scene.glb", "--capture", tmp_path / "none")
