"""Patches that emit, against closed forms: a white-ish sphere, two plates, and what lies behind."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bpy_process import in_blender

pytestmark = pytest.mark.blender

REFLECTANCE = 0.5
ALBEDO = (0.8, 0.4, 0.2)  # of the patches: another than the sphere's, whose light is multiplied by it
PATCHES = 4


class Silent:
    """Drops warnings."""

    def warn(self, message: str) -> None:
        """Do nothing."""


def lambert(reflectance: float) -> Any:
    from blender_bake import materials

    return materials.lambert((reflectance,) * 3)


def empty_scene(bounces: int) -> Any:
    import bpy

    from blender_bake import scene as scenes

    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scenes.configure(scene)
    scene.cycles.max_bounces = scene.cycles.diffuse_bounces = bounces
    return scene


def add(scene: Any, name: str, points: Any, faces: Any, reflectance: float) -> Any:
    import bpy

    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([tuple(map(float, point)) for point in points], [], [tuple(map(int, face)) for face in faces])
    mesh.materials.append(lambert(reflectance))
    obj = bpy.data.objects.new(name, mesh)
    scene.collection.objects.link(obj)
    return obj


def vertices_of(scene: Any, name: str) -> Any:
    import bpy

    from blender_bake.vertices import VertexReceiver, image_size

    width, height = image_size(len(bpy.data.objects[name].data.vertices))
    job = {"quantity": "irradiance", "width": width, "height": height, "receiver": {"object": name}}
    return VertexReceiver(scene, job, Silent())  # type: ignore[arg-type]


def sphere(folder: str) -> dict[str, Any]:
    """Irradiance of the texels of a closed sphere of radius 1 m, seen from inside, under its quarters."""
    import bpy

    from blender_bake.emissive_patches import EmissivePatches
    from blender_bake.lightmap import LightmapReceiver

    scene = empty_scene(24)
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=3, radius=1)
    bpy.context.object.name = "Sphere"
    mesh = bpy.context.object.data
    mesh.flip_normals()
    mesh.materials.append(lambert(REFLECTANCE))
    points = np.array([vertex.co for vertex in mesh.vertices])
    corners = points[np.array([face.vertices for face in mesh.polygons])].astype(np.float32)
    middle = corners.mean(axis=1)
    patch = (middle[:, 0] > 0.3).astype(int) + 2 * (middle[:, 1] > -0.2)
    np.savez(Path(folder) / "patches.npz", corners=corners, albedo=np.tile(np.array(ALBEDO, np.float32), (len(corners), 1)), patch=patch)
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    job = {"quantity": "irradiance", "width": 48, "height": 48, "receiver": {"object": "Sphere", "uv_layer": "UVMap"}}
    receiver = LightmapReceiver(scene, job, Silent())  # type: ignore[arg-type]
    inside = receiver.channels(["coverage"])["coverage"][:, :, 0] > 0
    patches = EmissivePatches(scene, str(Path(folder) / "patches.npz"))
    before = len(bpy.data.meshes)
    images = []
    for k in range(patches.count):
        patches.aim(k)
        images.append(receiver.response(48, k)[inside])
    patches.aim(None)
    return {
        "images": np.array(images),
        "dark": receiver.response(1, 0),
        "share": np.bincount(patch, area) / area.sum(),
        "meshes_left": len(bpy.data.meshes) - before,
    }


def test_a_sphere_spreads_the_light_of_any_patch_evenly(tmp_path: Path) -> None:
    """E = (A_k / A) albedo / (1 - reflectance) everywhere, on the patch itself too, whose surface reflects beneath it."""
    found = in_blender(sphere, str(tmp_path))
    assert (found["dark"] == 0).all() and found["meshes_left"] == 0
    assert len(found["images"]) == PATCHES
    for image, share in zip(found["images"], found["share"], strict=True):
        expected = share * np.array(ALBEDO) / (1 - REFLECTANCE)
        np.testing.assert_allclose(image.mean(axis=0), expected, rtol=0.01)
        assert np.median(np.abs(image / expected - 1)) < 0.1  # noise of 48 samples


def plates(folder: str) -> dict[str, Any]:
    """Irradiance of a lower plate's vertices under patches of the faces of an upper one, and of a third plate above both."""
    from blender_bake.emissive_patches import EmissivePatches

    scene = empty_scene(0)
    side = np.linspace(-0.5, 0.5, 5)
    flat = np.stack([*np.meshgrid(side, side, indexing="ij"), np.zeros((5, 5))], axis=-1).reshape(-1, 3)
    faces = [(5 * i + j, 5 * i + j + 5, 5 * i + j + 6, 5 * i + j + 1) for i in range(4) for j in range(4)]
    add(scene, "Lower", flat, faces, 0.5)
    add(scene, "Upper", flat + [0, 0, 1], [face[::-1] for face in faces], 0.5)
    add(scene, "Above", flat + [0, 0, 2], [face[::-1] for face in faces], 0.5)
    square = np.array([(-0.5, -0.5, 1), (0.5, -0.5, 1), (0.5, 0.5, 1), (-0.5, 0.5, 1)], np.float32)
    down, up = square[[[0, 2, 1], [0, 3, 2]]], square[[[0, 1, 2], [0, 2, 3]]]
    albedo, patch = np.ones((4, 3), np.float32), np.array([0, 0, 1, 1])
    np.savez(Path(folder) / "patches.npz", corners=np.concatenate([down, up]), albedo=albedo, patch=patch)
    receivers = {name: vertices_of(scene, name) for name in ("Lower", "Upper", "Above")}
    patches = EmissivePatches(scene, str(Path(folder) / "patches.npz"))
    found: dict[str, Any] = {}
    for k, way in enumerate(("down", "up")):
        patches.aim(k)
        for name in receivers:
            receiver = vertices_of(scene, name)
            found[f"{name} {way}"] = receiver.response(1024, k)[0, :25, 0]
    return found


def test_a_patch_emits_to_its_own_side_alone(tmp_path: Path) -> None:
    """Above its middle, a square of 1 m at 1 m gives E = 4 / pi * X / sqrt(1 + X^2) atan(X / sqrt(1 + X^2)), X = 1/2, and radiosity 1."""
    found = in_blender(plates, str(tmp_path))
    x = 0.5
    expected = 4 / np.pi * x / np.hypot(1, x) * np.arctan(x / np.hypot(1, x))
    middle = 12  # of the 5 x 5 vertices
    np.testing.assert_allclose(found["Lower down"][middle], expected, rtol=0.03)
    assert (found["Above down"] == 0).all()
    assert (found["Upper down"] == 0).all() and (found["Lower up"] == 0).all()
    np.testing.assert_allclose(found["Lower down"], found["Lower down"].reshape(5, 5).T.ravel(), rtol=0.1)


def many_patches(folder: str) -> dict[str, Any]:
    from blender_bake.emissive_patches import EmissivePatches

    scene = empty_scene(0)
    fragments = np.random.default_rng(0).uniform(-1, 1, (400_000, 3, 3)).astype(np.float32)
    patch = np.random.default_rng(1).integers(0, 512, len(fragments))
    path = Path(folder) / "patches.npz"
    np.savez(path, corners=fragments, albedo=np.ones((len(fragments), 3), np.float32), patch=patch)
    started = time.perf_counter()
    patches = EmissivePatches(scene, str(path))
    read = time.perf_counter() - started
    started = time.perf_counter()
    for k in range(50):
        patches.aim(k)
    return {"read": read, "aim": (time.perf_counter() - started) / 50}


def test_aiming_takes_milliseconds(tmp_path: Path) -> None:
    found = in_blender(many_patches, str(tmp_path))
    assert found["read"] < 5 and found["aim"] < 0.05, found  # 0.1 s and 1 ms on two idle cores
