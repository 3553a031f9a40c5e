"""Bakes of glossy receivers under a cubemap: lobes of lightmaps and vertices beside Cycles, stages kept after a kill, wrong usage."""

from __future__ import annotations

import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bpy_process import in_blender
from light_set_commands import done, of_a_process, refused

from srbf.capture import COVERED, Capture
from srbf.cubemap import Cubemap
from srbf.cubemap_capture import CubemapCapture
from srbf.cubemap_transport import BOUNCES_FILE, TESTED_FILE, VISIBILITY_FILE

pytestmark = pytest.mark.blender

CUBEMAP = ["--light-set", "cubemap:4", "--gloss", "4", "--validation", "0", "--holdout", "2", "--seed", "77", "--size", "8"]
FEW = {"bake.light_sets.SURFEL_PLACES": 512, "bake.cubemap_set.SURFELS": 200, "visibility.distant_bounces.SURFEL_RAYS": 256}
CLOSE = 0.005  # relative RMSE to Cycles, straight up
CHOSEN = (66, 69, 70, 77)  # directions from above


def floor(path: str) -> dict[str, Any]:
    """A square of half metal whose roughness goes from 0.4 to 0.9 along x."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=5, y_subdivisions=5, size=2)
    obj = bpy.context.object
    obj.name = "Floor"
    made = bpy.data.materials.new("Half metal")
    made.use_nodes = True
    nodes, links = made.node_tree.nodes, made.node_tree.links
    surface = nodes["Principled BSDF"]
    surface.inputs["Base Color"].default_value = (0.7, 0.45, 0.3, 1)
    surface.inputs["Metallic"].default_value = 0.5
    split, slope = nodes.new("ShaderNodeSeparateXYZ"), nodes.new("ShaderNodeMath")
    links.new(nodes.new("ShaderNodeTexCoord").outputs["Generated"], split.inputs[0])
    slope.operation = "MULTIPLY_ADD"
    slope.inputs[1].default_value, slope.inputs[2].default_value = 0.5, 0.4
    links.new(split.outputs[0], slope.inputs[0])
    links.new(slope.outputs[0], surface.inputs["Roughness"])
    obj.data.materials.append(made)
    bpy.context.scene.render.engine = "CYCLES"
    bpy.ops.wm.save_as_mainfile(filepath=path, check_existing=False)
    return {}


@pytest.fixture(scope="module", autouse=True)
def few_places_and_rays() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        for name, few in FEW.items():
            patch.setattr(f"srbf.{name}", few)
        yield


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("glossy") / "floor.blend"
    in_blender(floor, str(path))
    return path


@pytest.mark.parametrize("receiver", ["vertices:Floor", "lightmap:Floor"])
def test_a_capture_is_that_of_cycles_from_above(scene: Path, tmp_path: Path, receiver: str) -> None:
    done("bake", scene, "-o", tmp_path / "capture", "--receiver", receiver, *CUBEMAP)
    capture = Capture.open(tmp_path / "capture")
    assert isinstance(capture, CubemapCapture) and capture.gloss_terms == 4 and capture.quantity == "radiance"
    gloss = capture.receiver_gloss
    place = capture.geometry("position")
    assert place is not None
    x = place.reshape(-1, 3)[capture.receivers, 0]
    np.testing.assert_allclose(gloss.roughness, 0.65 + 0.25 * x, atol=0.02)
    directions = Cubemap(4).directions[list(CHOSEN)]
    lines = [str(len(CHOSEN)), *(f"{i}.png {x:.9g} {y:.9g} {z:.9g}" for i, (x, y, z) in enumerate(directions.tolist()))]
    (tmp_path / "lights.lp").write_text("\n".join(lines) + "\n")
    words = ["--light-list", tmp_path / "lights.lp", "--samples", "64", "--validation", "0", "--holdout", "0", "--quantity", "radiance"]
    done("bake", scene, "-o", tmp_path / "cycles", "--receiver", receiver, "--size", "8", *words)
    rendered, covered = Capture.open(tmp_path / "cycles"), capture.coverage() >= COVERED
    for index, column in enumerate(CHOSEN):
        true, found = rendered.image(index)[covered], capture.image(column)[covered]
        assert np.linalg.norm(found - true) < (CLOSE if receiver.startswith("vertices") else 4 * CLOSE) * np.linalg.norm(true)
    up = np.broadcast_to(np.array([0.0, 0.0, 1.0]), (capture.height, capture.width, 3))
    for index in capture.indices("holdout"):
        np.testing.assert_allclose(capture.image(index)[covered], capture.toward(index, up)[covered], rtol=2e-3, atol=1e-4)


def test_a_bake_killed_once_lights_that_test_are_traced_resumes(scene: Path, tmp_path: Path) -> None:
    words = ["bake", scene, "--receiver", "vertices:Floor", *CUBEMAP]
    done(*words, "-o", tmp_path / "whole")
    folder = tmp_path / "killed"
    process = subprocess.Popen(of_a_process(*words, "-o", folder, few=FEW), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    deadline = time.monotonic() + 120
    while not (folder / TESTED_FILE).is_file() and process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.005)
    process.kill()
    process.wait()
    kept = [(folder / name).stat().st_mtime_ns for name in (VISIBILITY_FILE, BOUNCES_FILE, TESTED_FILE)]
    done(*words, "-o", folder)
    assert [(folder / name).stat().st_mtime_ns for name in (VISIBILITY_FILE, BOUNCES_FILE, TESTED_FILE)] == kept
    for name in ("capture.json", "lights/0000.exr", "lights/0001.exr"):
        assert (folder / name).read_bytes() == (tmp_path / "whole" / name).read_bytes()


@pytest.mark.parametrize(
    ("words", "status", "said"),
    [
        (["--gloss", "0"], 2, "1 or more"),
        (["--gloss", "65"], 2, "1 to 64 terms"),
        (["--gloss", "4", "--transport", "indirect"], 2, "--transport combined"),
        (["--gloss", "4", "--quantity", "irradiance"], 2, "radiance"),
    ],
)
def test_wrong_usage_has_one_line(scene: Path, tmp_path: Path, words: list[str], status: int, said: str) -> None:
    line = refused(["bake", scene, "-o", tmp_path / "no", "--receiver", "vertices:Floor", "--light-set", "cubemap:4", *words], status)
    assert said in line and not (tmp_path / "no").exists()
