"""Light sets against closed forms and the scene's own light; input that means nothing, in one line."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bpy_process import in_blender
from light_set_commands import NAMES, done, refused, scenes_in

from srbf.capture import Capture
from srbf.io.image import read_image

pytestmark = pytest.mark.blender

ONE = ["--receiver", "lightmap:Floor", "--size", "8", "--samples", "1", "--validation", "0", "--holdout", "1", "--holdout-samples", "1"]
CLOUD = ["--light-set", "cloud", "--lights", "4"]
PATCHES = ["--light-set", "patches", "--patches", "4", "--transport", "indirect"]
NAMED = ["--light-set", "named"]
SUNLIT = ["--no-cast-shadow", "Walls"]  # a bake of directions ends where none of them gets in
SCREEN = NAMES[3]


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    return scenes_in(tmp_path_factory)


@pytest.mark.parametrize(
    ("name", "flags", "status", "words"),
    [
        ("unlit", NAMED, 1, "expected lights in .*unlit.blend, found none: no light object, no emission and a black world; add one"),
        ("room", [*NAMED, "--light-group", "Nope"], 1, "collection 'Nope' for --light-group, found none; there are 'Corner seat'"),
        ("room", [*NAMED, "--light-group", "Nothing lit"], 1, "a light in collection 'Nothing lit', found none that renders; name another"),
        ("block", CLOUD, 1, "expected room for 4 train lights in the box 0,0,0 to 2,2,2 m, found 0 .*; choose another --light-bounds"),
        ("room", [*CLOUD, "--light-bounds", "2.1,1.3,0.1,2.4,1.6,0.5"], 1, "in the box 2.1,1.3,0.1 to 2.4,1.6,0.5 m, found 0"),
        ("room", [*CLOUD, "--light-bounds", "1,1,1,0,2,2"], 2, "each first value the smaller, found '1,1,1,0,2,2'"),
        ("room", [*CLOUD, "--light-bounds", "0,0,1"], 2, "--light-bounds x0,y0,z0,x1,y1,z1 in meters, found '0,0,1'"),
        ("room", [*CLOUD, "--grid", "0.001"], 1, "at most 20000 point lights, found 12000000000 in the box; choose a larger"),
        ("room", [*CLOUD, "--lights", "1000000"], 2, "expected 1 to 20000 lights, found 1000000"),
        (
            "metal",
            PATCHES,
            1,
            "surfaces that reflect light around the free places, found none; choose another --light-bounds, or make them",
        ),
        ("black", PATCHES, 1, "surfaces that reflect light around the free places, found none"),
        ("room", [*CLOUD, "--patches", "4"], 2, "expected --patches with --light-set patches, found it with cloud"),
        ("room", [*PATCHES, "--grid", "0.5"], 2, "expected --grid with --light-set cloud, found it with patches"),
        ("room", [*PATCHES, "--transport", "combined"], 2, "--transport indirect with --light-set patches, found combined"),
        ("room", [*NAMED, "--keep-scene-lights"], 2, "--light-set named without --keep-scene-lights"),
        ("room", ["--patches", "4"], 2, "expected --light-set .* with --patches, found none"),
    ],
)
def test_what_means_nothing_is_refused_in_one_line(scene, tmp_path: Path, name: str, flags: list[str], status: int, words: str) -> None:
    folder = tmp_path / "capture"
    line = refused(["bake", scene(name), "-o", folder, *ONE, *flags], status)
    assert re.search(words, line), line
    assert not folder.exists()


def test_an_open_scene_says_what_the_lights_cover(scene, tmp_path: Path) -> None:
    said = done("bake", scene("open_air"), "-o", tmp_path / "capture", *ONE, *PATCHES, "--light-bounds", "0,0,0,3,3,2").stderr
    assert "in the box 0,0,0 to 3,3,2 m" in said and "the scene is open: " in said and "captured in that box alone" in said
    assert (np.array(Capture.open(tmp_path / "capture").manifest["free_places"])[:, 2] > 1.5).any()


def test_a_dry_run_writes_nothing(scene, tmp_path: Path) -> None:
    said = done("bake", scene("crowd"), "-o", tmp_path / "capture", "--dry-run", *ONE, *NAMED)
    assert "100 train at 1 samples, 0 validation and 0 holdout at 1, lights of the scene" in said.stdout
    assert "time       about" in said.stdout and not (tmp_path / "capture").exists()


def test_a_farm_bakes_groups_and_odd_names_by_the_flags_of_its_job(scene, tmp_path: Path) -> None:
    """The steps of the job, one after the other, give the bits of one bake; then the names pass `srbf fit` and `srbf relight`."""
    flags = [*ONE, *NAMED, "--light-group", "Corner seat"]
    done("bake", scene("room"), "-o", tmp_path / "bundle", *flags, "--farm", "openjd", "--farm-tasks", "2")
    job = json.loads((tmp_path / "bundle" / "template.json").read_text())
    for step, shards in (("Prepare", [0]), ("Bake", [2, 1]), ("Finish", [0])):
        (args,) = [entry["script"]["actions"]["onRun"]["args"] for entry in job["steps"] if entry["name"] == step]
        for shard in shards:
            values = {"Param.Scene": scene("room"), "Param.Capture": tmp_path / "farmed", "Task.Param.Shard": shard}
            for name, value in values.items():
                args = [arg.replace(f"{{{{{name}}}}}", str(value)) for arg in args]
            done(*args[2:])
    done("bake", scene("room"), "-o", tmp_path / "plain", *flags)
    plain, farmed = Capture.open(tmp_path / "plain"), Capture.open(tmp_path / "farmed")
    assert plain.manifest == farmed.manifest and len(plain.lights) == 3
    for index in range(3):
        np.testing.assert_array_equal(plain.image(index), farmed.image(index))
    done("fit", tmp_path / "plain", "-o", tmp_path / "asset", "--exact")
    for index, light in enumerate(plain.manifest["lights"]):
        lit = tmp_path / f"{index}.exr"
        done("relight", tmp_path / "asset", "-o", lit, "--light", f"{light['name']}=0.5")
        np.testing.assert_allclose(read_image(lit, 3), 0.5 * np.maximum(plain.image(index), 0), rtol=2e-3, atol=1e-5)


def test_a_hundred_lights_take_no_longer_each(scene, tmp_path: Path) -> None:
    done("bake", scene("crowd"), "-o", tmp_path / "capture", *ONE, *NAMED)
    capture = Capture.open(tmp_path / "capture")
    assert [light["name"] for light in capture.manifest["lights"]][:2] == ["Star", "Star.001"] and len(capture.lights) == 100
    lines = [line for line in (tmp_path / "capture" / "bake.log").read_text(errors="replace").splitlines() if "srbf: light" in line]
    assert np.median([float(line.split()[-2]) for line in lines]) < 0.5  # s; 0.01 on two idle cores


def test_a_receiver_that_the_first_lights_do_not_reach_is_baked(scene, tmp_path: Path) -> None:
    """Each light of a building may be of another room: that many are black says nothing of the others."""
    done("bake", scene("cellar"), "-o", tmp_path / "capture", *ONE, *NAMED)
    lit = {name: image.mean() for name, image in by_name(Capture.open(tmp_path / "capture")).items()}
    assert len(lit) == 31 and lit.pop("Upstairs") > 0.1 and set(lit.values()) == {0}


def by_name(capture: Capture) -> dict[str, np.ndarray]:
    return {light["name"]: capture.image(index) for index, light in enumerate(capture.manifest["lights"])}


def test_named_lights_sum_to_the_scene_and_groups_to_their_lights(scene, tmp_path: Path) -> None:
    counts = ["--receiver", "lightmap:Floor", "--size", "8", "--samples", "512", "--validation", "0", "--holdout", "0"]
    own = ["--lights", "1", "--samples", "1", "--holdout-samples", "1024", "--keep-scene-lights", *SUNLIT]
    for name, flags in (("single", NAMED), ("grouped", [*NAMED, "--light-group", "Corner seat"]), ("own", own)):
        done("bake", scene("room"), "-o", tmp_path / name, *counts, *flags)
    single, grouped = (by_name(Capture.open(tmp_path / name)) for name in ("single", "grouped"))
    scene_light = read_image(tmp_path / "own" / "ambient.exr", 3)
    assert set(grouped) == {"Corner seat", NAMES[1], "Panel"}
    for found, expected in (
        (np.sum(list(single.values()), axis=0), scene_light),
        (np.sum(list(grouped.values()), axis=0), scene_light),
        (grouped["Corner seat"], single[NAMES[0]] + single[SCREEN]),
    ):
        assert np.sqrt(((found - expected) ** 2).mean()) < 0.04 * expected.mean()
        assert found.mean() == pytest.approx(expected.mean(), rel=0.01)


def test_an_emissive_receiver_goes_on_to_shine(scene, tmp_path: Path) -> None:
    """Its own light comes back to it from the room, as texels and as vertices; in a bake of directions it is ambient light."""
    counts = ["--size", "8", "--samples", "256", "--validation", "0", "--holdout", "0"]
    named = {}
    for kind in ("lightmap", "vertices"):
        done("bake", scene("room"), "-o", tmp_path / kind, "--receiver", f"{kind}:{SCREEN}", *counts, *NAMED)
        named[kind] = {name: image.mean(axis=(0, 1)) for name, image in by_name(Capture.open(tmp_path / kind)).items()}
    for name in NAMES:
        np.testing.assert_allclose(named["vertices"][name], named["lightmap"][name], rtol=0.3)  # corners see a bit less
    assert named["lightmap"][SCREEN] == pytest.approx(np.array([0.2, 0.5, 1]) * named["lightmap"][SCREEN][2], rel=0.01)
    assert named["lightmap"][SCREEN][2] > 0.3
    sun = ["--lights", "1", "--samples", "1", "--holdout-samples", "512", *SUNLIT]
    done("bake", scene("room"), "-o", tmp_path / "sun", "--receiver", f"lightmap:{SCREEN}", *counts, *sun)
    ambient = read_image(tmp_path / "sun" / "ambient.exr", 3).mean(axis=(0, 1))
    np.testing.assert_allclose(ambient, named["lightmap"][SCREEN] + named["lightmap"]["Panel"], rtol=0.03)


def under_white(principled: bool) -> dict[str, Any]:
    """Light of an emissive receiver and of the panel on it: its material emission alone, or shiny metal that emits, in a node group."""
    import bpy
    import light_set_scenes

    from blender_bake import scene as scenes
    from blender_bake.named_lights import NamedLights
    from blender_bake.vertices import VertexReceiver

    bpy.ops.wm.read_factory_settings(use_empty=True)
    light_set_scenes.room()
    if principled:
        light_set_scenes.shining_metal(bpy.data.objects[SCREEN], (0.2, 0.5, 1), 6)
    scene = bpy.context.scene
    scenes.configure(scene)
    named = NamedLights(scene, [])
    job = {"transport": "combined", "quantity": "irradiance", "width": 4, "height": 1, "receiver": {"object": SCREEN}}
    receiver = VertexReceiver(scene, job, Silent())  # type: ignore[arg-type]
    found = {}
    for name in (SCREEN, "Panel", None):
        named.aim(name)
        found[str(name)] = receiver.response(64, 0)
    return found


class Silent:
    """Drops warnings."""

    def warn(self, message: str) -> None:
        """Do nothing."""


def test_white_in_place_of_metal_gives_back_no_more_than_falls_in() -> None:
    plain, metal = in_blender(under_white, False), in_blender(under_white, True)
    for name in (SCREEN, "Panel"):
        assert plain[name].mean() > 0.05
        np.testing.assert_allclose(metal[name], plain[name], rtol=1e-3)
    assert (metal["None"] == 0).all()


def test_light_in_a_sphere_is_even_wherever_it_comes_from(scene, tmp_path: Path) -> None:
    """Albedo 1/2: the indirect irradiance of a light of unit irradiance at 1 m is 1 everywhere in a sphere of 1 m; of all patches, too."""
    counts = ["--receiver", "lightmap:Sphere", "--size", "12", "--samples", "64", "--validation", "0", "--holdout", "2"]
    counts += ["--holdout-samples", "64", "--transport", "indirect"]
    for kind, flags in (("cloud", ["--lights", "10"]), ("patches", ["--patches", "10"])):
        done("bake", scene("sphere"), "-o", tmp_path / kind, *counts, "--light-set", kind, *flags)
        capture = Capture.open(tmp_path / kind)
        covered = capture.coverage() >= 0.5
        images = np.stack([capture.image(index)[covered] for index in range(len(capture.lights))])
        of_points, train = (images if kind == "cloud" else images[-2:]), images[:-2]
        np.testing.assert_allclose(of_points.mean(axis=(1, 2)), 1, atol=0.12)  # their noise
        assert (train.mean() if kind == "cloud" else train.sum(axis=0).mean()) == pytest.approx(1, abs=0.02)
        done("fit", tmp_path / kind, "-o", tmp_path / f"{kind} asset", "--budget", "13")
        for place in ("0,0,0", "0.5,0.3,-0.2"):
            lit = tmp_path / f"{kind} {place}.exr"
            done("relight", tmp_path / f"{kind} asset", "-o", lit, "--point", place, "--direct", "none")
            relit = read_image(lit, 3)[covered]
            assert relit.mean() == pytest.approx(1, abs=0.03) and relit.std() < 0.25, (kind, place)
