"""A sphere alone before a camera: what is relit over black is Cycles' own picture on a transparent film, edges included."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from srbf.bake.run import Bake, Reporter
from srbf.bake.settings import BakeSettings, Receiver
from srbf.capture import Capture
from srbf.cli import app
from srbf.io.image import decode_srgb, read_image

pytestmark = pytest.mark.blender

SIZE = 32
TOWARDS = (0.35, -0.75, 0.55)
ALBEDO = (0.8, 0.5, 0.3)
BUILD = """
import sys
import bpy
from mathutils import Vector
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24, radius=1)
bpy.ops.object.shade_smooth()
material = bpy.data.materials.new("matte")
material.use_nodes = True
nodes = material.node_tree.nodes
nodes.clear()
diffuse, out = nodes.new("ShaderNodeBsdfDiffuse"), nodes.new("ShaderNodeOutputMaterial")
diffuse.inputs["Color"].default_value = (*COLOR, 1)
material.node_tree.links.new(diffuse.outputs[0], out.inputs["Surface"])
bpy.context.object.data.materials.append(material)
camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
camera.location = (0.1, -5, 0.2)
camera.rotation_euler = (-camera.location).to_track_quat("-Z", "Y").to_euler()
scene = bpy.context.scene
scene.collection.objects.link(camera)
scene.camera = camera
bpy.ops.wm.save_as_mainfile(filepath=sys.argv[1])
sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
sun.data.energy, sun.data.angle = 1, 0
sun.rotation_euler = Vector(TOWARDS).to_track_quat("Z", "Y").to_euler()
scene.collection.objects.link(sun)
scene.render.engine = "CYCLES"
scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.use_adaptive_sampling = 256, False, False
scene.render.film_transparent = True
scene.render.resolution_x = scene.render.resolution_y = SIZE
scene.render.image_settings.file_format = "OPEN_EXR"
scene.render.image_settings.color_mode = "RGBA"
scene.render.image_settings.color_depth = "32"
scene.render.filepath = sys.argv[2]
bpy.ops.render.render(write_still=True)
"""


@pytest.fixture(scope="module")
def sphere(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, np.ndarray]:
    """The .blend, and Cycles' own picture under the sun: premultiplied RGBA."""
    folder = tmp_path_factory.mktemp("sphere")
    script = BUILD.replace("COLOR", str(ALBEDO)).replace("TOWARDS", str(TOWARDS)).replace("SIZE", str(SIZE))
    arguments = [sys.executable, "-c", script, str(folder / "sphere.blend"), str(folder / "own.exr")]
    subprocess.run(arguments, check=True, capture_output=True, timeout=120)
    return folder / "sphere.blend", read_image(folder / "own.exr")


def baked(blend: Path, folder: Path, **settings: object) -> Capture:
    wanted = {"width": SIZE, "height": SIZE, "lights": 40, "samples": 64, "validation": 0, "holdout": 0, "quantity": "radiance", **settings}
    Bake(blend, folder, BakeSettings(Receiver.parse("view", None), **wanted)).run(Reporter())  # type: ignore[arg-type]
    return Capture.open(folder)


def relit(asset: Path, out: Path, *flags: str) -> np.ndarray:
    done = CliRunner().invoke(app, ["relight", str(asset), "-o", str(out), "--directional", ",".join(map(str, TOWARDS)), *flags])
    assert done.exit_code == 0, done.stderr
    return read_image(out)


def test_over_black_it_is_cycles_own_picture(sphere: tuple[Path, np.ndarray], tmp_path: Path) -> None:
    blend, own = sphere
    capture = baked(blend, tmp_path / "capture", domain="sphere")
    share = capture.coverage()
    edge = (share > 0) & (share < 1)
    assert (share == 0).mean() > 0.4 and edge.sum() > 30
    np.testing.assert_allclose(share, own[..., 3], atol=0.06)
    done = CliRunner().invoke(app, ["fit", str(tmp_path / "capture"), "-o", str(tmp_path / "asset"), "-k", "24"])
    assert done.exit_code == 0, done.stderr
    over_black = relit(tmp_path / "asset", tmp_path / "p.exr", "--alpha", "premultiplied")
    straight = relit(tmp_path / "asset", tmp_path / "s.exr")
    picture = relit(tmp_path / "asset", tmp_path / "s.png")
    white = own[..., :3].max()
    for image in (over_black[..., :3], straight[..., :3] * straight[..., 3:], decode_srgb(picture[..., :3]) * picture[..., 3:]):
        assert not image[share == 0].any()
        difference = image - own[..., :3]
        assert np.sqrt((difference**2).mean()) < 0.025 * white
        assert abs(difference[edge].mean()) < 0.02 * own[edge, :3].mean() + 0.002 * white  # neither darker nor brighter
        assert np.abs(difference[edge]).max() < 0.12 * white, np.abs(difference[edge]).max() / white


def test_irradiance_of_edges_is_the_radiance_without_albedo(sphere: tuple[Path, np.ndarray], tmp_path: Path) -> None:
    """At two samples, of which many pixels of the edge are missed by one or both: E = pi L / albedo of the same samples, pixel by pixel."""
    blend, _ = sphere
    few = {"lights": 6, "samples": 2}
    irradiance = baked(blend, tmp_path / "irradiance", quantity="irradiance", **few)
    radiance = baked(blend, tmp_path / "radiance", **few)
    share = irradiance.coverage()
    edge = (share > 0) & (share < 1)
    for index in range(6):
        expected = radiance.image(index)[edge] * np.pi / np.float32(ALBEDO)
        np.testing.assert_allclose(irradiance.image(index)[edge], expected, rtol=4e-3, atol=1e-4)  # half floats of both
