"""Files as people leave them: saved in other modes, with vertices that are no numbers, far away, of several scenes, in unusual frames."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from bpy_process import run as run_script
from conftest import SCENES, Baked, built
from typer.testing import CliRunner

from srbf.bake.settings import BakeSettings, Receiver
from srbf.cli import app
from srbf.errors import BakeError

pytestmark = pytest.mark.blender

SMALL = ["--lights", "4", "--samples", "1", "--validation", "0", "--holdout", "0"]
OF_EITHER = ["EDIT", "PARTICLE_EDIT", "WEIGHT_PAINT"]
OF_ONE = ["EDIT_BOTH", "SCULPT", "VERTEX_PAINT", "TEXTURE_PAINT"]
OF_OTHERS = ["EDIT_CURVE", "POSE", "SCULPT_CURVES", "PAINT_GREASE_PENCIL"]


@pytest.fixture(scope="session")
def odd(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    return built("odd_files.py", tmp_path_factory)


def bake(scene: Path, folder: Path, receiver: str, width: int = 16, height: int = 16, **settings: object) -> Baked:
    listed = folder.with_suffix(".lp")
    listed.write_text("1\nnoon.png 0 0 1\n")
    small = {"samples": 2, "validation": 0, "holdout": 0, "light_list": listed}
    kind = {"quantity": "radiance"} if receiver.startswith("view") else {}
    return Baked(scene, folder, BakeSettings(Receiver.parse(receiver), width, height, **{**small, **kind, **settings}))


def run(*words: object) -> tuple[int, str]:
    """Exit status and what was said of `srbf bake`, in this process."""
    done = CliRunner().invoke(app, ["bake", *map(str, words)])
    return done.exit_code, done.stderr


@pytest.mark.parametrize(
    ("mode", "whose"),
    [
        *((m, w) for m in OF_EITHER for w in ("receiver", "occluder")),
        *((m, "receiver") for m in OF_ONE),
        *((m, "other") for m in OF_OTHERS),
    ],
)
def test_any_mode_is_left_and_its_edits_kept(tmp_path: Path, mode: str, whose: str) -> None:
    """The lid's shadow is a square half as wide as the plane, beneath it: where the edit, or the pose, has moved it."""
    scene = tmp_path / "scene.blend"
    run_script(SCENES / "odd_files.py", "mode", mode, whose, scene).check_returncode()
    capture = bake(scene, tmp_path / "capture", "lightmap:Plane").capture
    position, image = capture.geometry("position"), capture.image(0)[..., 0]
    plane_moved = mode == "EDIT_BOTH" or (mode == "EDIT" and whose == "receiver")
    lid_moved = mode in ("EDIT_BOTH", "POSE") or (mode == "EDIT" and whose == "occluder")
    assert position[..., 0].mean() == pytest.approx(0.5 * plane_moved, abs=1e-3)
    shaded = (np.abs(position[..., 0] - 0.5 * lid_moved) < 0.5) & (np.abs(position[..., 1]) < 0.5)
    assert 0.1 < shaded.mean() < 0.3
    np.testing.assert_allclose(image[shaded].mean(), 0, atol=0.02)
    np.testing.assert_allclose(image[~shaded].mean(), 1, atol=0.02)


@pytest.mark.parametrize(
    ("name", "receiver", "layer", "words"),
    [
        ("nan receiver", "lightmap:Plane", None, r"vertices of 'Plane', found \(1, nan, 0\) at vertex 2"),
        ("nan receiver", "vertices:Plane", None, "'Plane'.*at vertex 2"),
        ("infinite receiver", "lightmap:Plane", None, r"'Plane', found \(1, inf, 0\) at vertex 2"),
        ("nan by modifier", "lightmap:Plane", None, r"'Plane' after its modifiers.*at vertex 0 and 3 more"),
        ("nan layer", "lightmap:Plane", "UV", "UV layer 'UV' of 'Plane'.*at vertex 1"),
        ("scaled away", "lightmap:Plane", None, r"area on 'Plane', found none at a scale of \(1, 0, 0\)"),
        ("nowhere", "lightmap:Plane", None, "place in the world for 'Plane'"),
        ("two scenes", "lightmap:Plane", None, "'Plane' is in scene 'Night shot': add --scene \"Night shot\""),
        ("two scenes", "view:Camera", None, "'Camera' is in scene 'Night shot'"),
    ],
)
def test_what_cannot_be_baked_is_named_in_a_line(odd, tmp_path: Path, name: str, receiver: str, layer: str | None, words: str) -> None:
    parsed = Receiver.parse(receiver, layer)
    size = {"width": 4, "height": 1} if parsed.kind == "vertices" else {"width": 16, "height": 16}
    quantity = "radiance" if parsed.kind == "view" else "irradiance"
    with pytest.raises(BakeError, match=words) as caught:
        Baked(odd(name), tmp_path / "capture", BakeSettings(parsed, lights=1, holdout=0, validation=0, quantity=quantity, **size))
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "capture" / "capture.json").exists()


def test_an_occluder_that_is_no_number_is_named(odd, tmp_path: Path) -> None:
    said = bake(odd("nan occluder"), tmp_path / "capture", "lightmap:Plane").said
    assert any("NaN" in line and "'Lid' at vertex 2" in line for line in said)


def test_a_layer_that_was_not_asked_for_is_made_again(odd, tmp_path: Path) -> None:
    baked = bake(odd("nan layer"), tmp_path / "capture", "lightmap:Plane")
    assert any("made a lightmap UV layer" in line and "NaN" in line for line in baked.said)
    assert (baked.capture.coverage() > 0).mean() > 0.5


@pytest.mark.parametrize("receiver", ["lightmap:Plane", "vertices:Plane", "view"])
def test_far_from_the_origin_single_precision_is_named(odd, tmp_path: Path, receiver: str) -> None:
    words = ["--receiver", receiver, "--size", "16", *SMALL]
    _, said = run(odd("far"), "-o", tmp_path / "far", *words)
    assert "5,000 km from the origin" in said and "steps by 500 mm" in said
    status, said = run(odd("near"), "-o", tmp_path / "near", *words)
    assert status == 0 and "single precision" not in said


def test_another_scene_is_baked_and_gone_on_with(odd, tmp_path: Path) -> None:
    folder = tmp_path / "capture"
    words = [odd("two scenes"), "-o", folder, "--receiver", "lightmap:Plane", "--size", "8", *SMALL]
    status, said = run(*words)
    assert status == 1 and '--scene "Night shot"' in said and not folder.exists()
    assert run(*words, "--scene", "Night shot")[0] == 0
    manifest = json.loads((folder / "capture.json").read_text())
    assert manifest["source"]["settings"]["scene"] == "Night shot"
    assert "complete already" in run(*words, "--scene", "Night shot")[1]
    status, said = run(*words)
    assert status == 1 and "another scene" in said
    status, said = run(odd("two scenes"), "-o", tmp_path / "none", "--receiver", "lightmap:Plane", "--scene", "Day", *SMALL)
    assert status == 1 and "expected a scene 'Day'" in said and "'Night shot'" in said
    assert run(odd("two scenes"), "-o", tmp_path / "props", "--collection", "Props", "--scene", "Night shot", "--size", "8", *SMALL)[0] == 0
    glb = tmp_path / "scene.glb"
    made = CliRunner().invoke(app, ["mesh", str(odd("two scenes")), "-o", str(glb), "--capture", str(folder)])
    assert made.exit_code == 0 and b'"Lid"' in glb.read_bytes()


def test_a_view_takes_the_shape_of_its_cameras_frame(odd, tmp_path: Path) -> None:
    """Without --size: 256 texels on the longer side, pixels square. What is begun keeps its size."""
    for name, shape in (("wide", (256, 144)), ("tall pixels", (128, 256))):
        folder = tmp_path / name
        status, said = run(odd(name), "-o", folder, "--receiver", "view", *SMALL)
        manifest = json.loads((folder / "capture.json").read_text())
        assert status == 0 and (manifest["width"], manifest["height"]) == shape
        assert f"{shape[0]}x{shape[1]} texels: the shape of the camera's frame" in said and "has its shape" not in said
        corners = np.array(manifest["source"]["camera"]["frame"])
        width, height = np.ptp(corners[:, 0]), np.ptp(corners[:, 1])
        assert width / height == pytest.approx(shape[0] / shape[1], rel=1e-5)
    square = tmp_path / "square"
    _, said = run(odd("wide"), "-o", square, "--receiver", "view", "--size", "16", *SMALL)
    assert re.search(r"the camera's frame 1.78 times \(1920x1080\); .*size.16x9`? has its shape", said)
    assert "complete already" in run(odd("wide"), "-o", square, "--receiver", "view", *SMALL)[1]


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("region", "render region (25-50 % across, 0-100 % up)"),
        ("blurred", "motion blur is left out"),
        ("stereo", "stereoscopy is left out"),
        ("foggy", "the volume of world 'Mist' is left out"),
        ("caught", "'Plane' is a shadow catcher"),
        ("caught", "'Lid' is a holdout"),
        ("wide", None),
    ],
)
def test_what_a_view_leaves_out_is_named(odd, tmp_path: Path, name: str, words: str | None) -> None:
    said = bake(odd(name), tmp_path / "capture", "view", 32, 18).said
    assert any(words in line for line in said) if words else not said
