"""Bakes of glossy surfaces: viewers as Cycles takes them, harmonics against bakes toward new viewers, passes, resume, wrong usage."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bpy_process import in_blender
from faults import contents
from light_set_commands import scenes_in
from made_places import places_of
from typer.testing import CliRunner

from srbf.bake.light_sets import CloudSet, NamedSet
from srbf.bake.settings import BakeSettings, Receiver, plan_lights
from srbf.bake.viewers import project, viewer_directions
from srbf.basis.exitant_harmonics import LEAST_COSINE, harmonics, lifted, radiance
from srbf.capture import Capture
from srbf.cli import app
from srbf.errors import InputError
from srbf.sphere import fibonacci, random_directions

ORDER = 3
NEW = 12  # viewers that no fit knows
SINGLE = 2e-3  # of Cycles' directions: single precision, and corners just inside their faces
CLOUD = CloudSet("cloud", 3)
ROOM = ["--light-set", "cloud", "--lights", "3", "--validation", "0", "--holdout", "1", "--seed", "5", "--gloss", "1"]


def ball(scene: Any, shader: Any) -> Any:
    """A smooth ball of radius 1 m, its `shader` a function of the node tree that gives the surface's socket."""
    import bpy

    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=3, radius=1.0)
    obj = bpy.context.object
    obj.data.polygons.foreach_set("use_smooth", [True] * len(obj.data.polygons))
    made = bpy.data.materials.new("Ball")
    made.use_nodes = True
    tree = made.node_tree
    tree.nodes.clear()
    tree.links.new(shader(tree), tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    obj.data.materials.append(made)
    return obj


def receiver_of(scene: Any, name: str, viewers: Any) -> Any:
    import bpy

    from blender_bake.vertices import VertexReceiver, image_size

    width, height = image_size(len(bpy.data.objects[name].data.vertices))
    job = {"receiver": {"kind": "vertices", "object": name}, "width": width, "height": height}

    class Silent:
        def warn(self, message: str) -> None:
            """Do nothing."""

    events: Any = Silent()
    return VertexReceiver(scene, {**job, "quantity": "radiance", "transport": "combined", "viewers": viewers}, events)


def directions_that_a_bake_takes(viewers: list[list[float]]) -> dict[str, Any]:
    """Emission that shows the direction that a surface is seen from."""
    import bpy
    import numpy as np

    from blender_bake import scene as scenes

    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scenes.configure(scene)

    def shown(tree: Any) -> Any:
        scaled = tree.nodes.new("ShaderNodeVectorMath")
        scaled.operation = "MULTIPLY_ADD"
        scaled.inputs[1].default_value = scaled.inputs[2].default_value = (0.5, 0.5, 0.5)
        tree.links.new(tree.nodes.new("ShaderNodeNewGeometry").outputs["Incoming"], scaled.inputs[0])
        emission = tree.nodes.new("ShaderNodeEmission")
        tree.links.new(scaled.outputs[0], emission.inputs["Color"])
        return emission.outputs[0]

    ball(scene, shown)
    receiver = receiver_of(scene, "Icosphere", viewers)
    seen = receiver._viewers.images(lambda seed: receiver._image(receiver._of_vertices(receiver._bake("EMIT", 1, seed))), 0)
    normal = receiver.channels(["normal"])["normal"]
    return {"seen": np.asarray(seen) * 2 - 1, "normal": normal, "camera": scene.render.bake.view_from == "ABOVE_SURFACE"}


def glossy_ball(viewers: list[list[float]], new: list[list[float]], samples: int) -> dict[str, Any]:
    """Radiance of a half diffuse, half glossy ball under a point light, toward `viewers` and toward `new` ones."""
    import bpy

    from blender_bake import scene as scenes
    from blender_bake.light import SoleLight

    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scenes.configure(scene)

    def glossy(tree: Any) -> Any:
        mix = tree.nodes.new("ShaderNodeMixShader")
        diffuse, lobe = tree.nodes.new("ShaderNodeBsdfDiffuse"), tree.nodes.new("ShaderNodeBsdfAnisotropic")
        lobe.inputs["Roughness"].default_value = 0.75
        tree.links.new(diffuse.outputs[0], mix.inputs[1])
        tree.links.new(lobe.outputs[0], mix.inputs[2])
        return mix.outputs[0]

    ball(scene, glossy)
    light = SoleLight(scene, 0.0)
    light.aim({"kind": "point", "position": (1.5, -1.0, 1.8)})
    receiver = receiver_of(scene, "Icosphere", viewers)
    found = {"views": receiver.toward(samples, 3), "normal": receiver.channels(["normal"])["normal"], "above": receiver.response(4, 1)}
    return {**found, "new": receiver_of(scene, "Icosphere", new).toward(4 * samples, 8)}


@pytest.mark.blender
def test_a_bake_sees_a_surface_from_where_the_fit_says() -> None:
    viewers = viewer_directions(ORDER)
    found = in_blender(directions_that_a_bake_takes, viewers.tolist())
    normal = found["normal"].reshape(-1, 1, 3)
    shape = (len(normal), len(viewers), 3)
    seen = found["seen"].reshape(shape)
    expected = lifted(np.broadcast_to(viewers, shape), np.broadcast_to(normal, shape))
    clear = ((normal * viewers).sum(axis=2) > LEAST_COSINE + 0.1) & (found["normal"].reshape(-1, 3) ** 2).sum(axis=1, keepdims=True).astype(
        bool
    )
    assert np.abs(seen - expected)[clear].max() < SINGLE
    raised = ~clear & (np.linalg.norm(normal, axis=2) > 0.5)
    assert np.abs(seen - expected)[raised].max() < 0.1  # of corners whose faces lean another way than their vertex
    assert found["camera"]


@pytest.mark.blender
def test_harmonics_tell_bakes_toward_new_viewers() -> None:
    viewers, new = viewer_directions(ORDER), fibonacci(NEW)
    found = in_blender(glossy_ball, viewers.tolist(), new.tolist(), 4)
    terms = project(found["views"], found["normal"], ORDER).reshape(-1, (ORDER + 1) ** 2, 3)
    normal = found["normal"].reshape(-1, 3)
    truth = found["new"].reshape(len(terms), NEW, 3)
    told = np.stack([radiance(terms, lifted(np.broadcast_to(one, normal.shape), normal), ORDER) for one in new], axis=1)
    assert truth.max() > 0.05
    assert np.sqrt(((told - truth) ** 2).sum() / (truth**2).sum()) < 0.1
    above = found["above"].reshape(-1, 3)
    from_above = radiance(terms, normal, ORDER)
    assert np.sqrt(((from_above - above) ** 2).sum() / (above**2).sum()) < 0.1
    forgetful = np.sqrt(((above[:, None] - truth) ** 2).sum() / (truth**2).sum())
    assert forgetful > 0.15  # one image alone misses what changes with the viewer


def test_projection_reproduces_what_is_of_its_order() -> None:
    rng = np.random.default_rng(2)
    normals = random_directions(7, "sphere", rng).reshape(1, 7, 3).astype(np.float32)
    viewers = viewer_directions(2)
    shape = (7, len(viewers), 3)
    seen = harmonics(lifted(np.broadcast_to(viewers, shape), np.broadcast_to(normals.reshape(7, 1, 3), shape)), 2)
    given = rng.normal(size=(7, 9, 3))
    images = (seen @ given).reshape(1, 7, -1).astype(np.float32)
    found = project(images, normals, 2).reshape(7, 9, 3)
    above = np.array([lifted(one, normals[0]) for one in np.broadcast_to(random_directions(1, "sphere", rng), (1, 7, 3))])[0]
    np.testing.assert_allclose(radiance(found, above, 2), radiance(given, above, 2), atol=0.05 * np.abs(given).max())
    flat = project(np.full((1, 2, 3 * len(viewers)), 0.25, np.float32), np.zeros((1, 2, 3), np.float32), 2).reshape(2, 9, 3)
    np.testing.assert_allclose(radiance(flat, np.array([[0, 0, 1.0], [1, 0, 0]]), 2), 0.25, rtol=1e-5)


def test_settings_of_gloss() -> None:
    of_room = BakeSettings(Receiver("vertices", "Crate"), light_set=CLOUD, quantity="radiance", gloss=3, validation=0, holdout=0)
    for changes, message in (
        ({"gloss": 5}, "expected `gloss` of order 1 to 4, found 5"),
        ({"gloss": 0}, "expected `gloss` of order 1 to 4, found 0"),
        ({"light_set": None}, "expected `light_set=cloud` or cubemap:SIDE with `gloss`, found others"),
        ({"light_set": NamedSet()}, "expected `light_set=cloud` or cubemap:SIDE with `gloss`, found named"),
        ({"quantity": "irradiance"}, "found irradiance, which no viewer changes"),
        ({"receiver": Receiver("view")}, "found a view, which has one viewer"),
    ):
        with pytest.raises(InputError, match=message):
            replace(of_room, **changes)


def srbf(*words: object) -> str:
    done = CliRunner().invoke(app, [str(word) for word in words])
    assert done.exit_code == 0, done.output
    return done.output


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return scenes_in(tmp_path_factory)("room")


@pytest.mark.slow
@pytest.mark.blender
@pytest.mark.parametrize(
    "flags", [["--receiver", "vertices:Crate", "--transport", "indirect"], ["--receiver", "lightmap:Walls", "--size", "8"]]
)
def test_a_capture_holds_harmonics_and_more_samples_are_added(room: Path, tmp_path: Path, flags) -> None:
    """A light whose file is gone is written again; what grew from 2 samples to 6 equals what was baked at once."""
    grown, whole = tmp_path / "grown", tmp_path / "whole"
    common = ["bake", room, *flags, *ROOM, "--holdout-samples", "96", "--keep-accumulation"]
    srbf(*common, "-o", grown, "--samples", "2")
    (grown / "harmonics" / "0001_02.exr").unlink()
    srbf(*common, "-o", grown, "--samples", "6")
    srbf(*common, "-o", whole, "--samples", "6")
    one, other = contents(grown), contents(whole)
    assert {name for name in one if name.startswith("harmonics/")} == {f"harmonics/{i:04d}_{k:02d}.exr" for i in range(4) for k in range(4)}
    assert {name: data for name, data in one.items() if not name.endswith(".log")} == {
        name: data for name, data in other.items() if not name.endswith(".log")
    }
    capture = Capture.open(grown)
    assert capture.gloss == 1 and capture.quantity == "radiance"
    normals = capture.geometry("normal")
    assert normals is not None
    covered = capture.coverage() > 0.5
    terms = capture.harmonics(3)[:, covered].transpose(1, 0, 2)  # of the light held out, which has less noise
    assert radiance(terms, normals[covered], 1).mean() == pytest.approx(capture.image(3)[covered].mean(), rel=0.2)


@pytest.mark.blender
def test_a_dry_run_counts_harmonics(room: Path, tmp_path: Path) -> None:
    words = ["bake", room, "-o", tmp_path / "x", "--receiver", "vertices:Crate", *ROOM, "--dry-run"]
    assert "3 train" in srbf(*words)


def test_planned_lights_name_their_harmonics() -> None:
    known = CloudSet("cloud", 2, found=places_of(lights=2, tested=1))
    settings = BakeSettings(Receiver("vertices", "A"), light_set=known, quantity="radiance", gloss=1, validation=0, holdout=1)
    lights = plan_lights(settings)
    assert [light.parts for light in lights] == [("response", "toward")] * 3
    assert lights[2].harmonics_files == tuple(f"harmonics/0002_0{k}.exr" for k in range(4))
    apart = plan_lights(replace(settings, transport="indirect"))
    assert [light.parts for light in apart] == [("indirect", "toward")] * 2 + [("response", "direct", "toward")]
    assert plan_lights(replace(settings, gloss=None))[0].harmonics_files == ()
