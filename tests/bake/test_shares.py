"""Bakes whose lights have a share of the texels: the same light at the same texels, resumed to the same bits, and what is refused."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from faults import contents

from srbf.bake.openjd import arguments
from srbf.bake.run import Bake, Reporter
from srbf.bake.settings import BakeSettings, Receiver, plan_lights
from srbf.capture import Capture
from srbf.errors import BakeError, InputError
from srbf.io.image import read_image
from srbf.receiver_images import Transport

FAKE = Path(__file__).resolve().parents[2] / "benchmarks" / "fake_blender.py"
FLAT = 0.05  # of the brightest, how far neighbors may differ: not at edges of shadows, where a share has a wider footprint
NOISE = 0.1  # relative RMSE of a picture of 64 samples and of another footprint, edges of shadows left out


def test_lights_in_turn_have_a_share_and_tested_ones_none() -> None:
    settings = BakeSettings(Receiver.parse("lightmap:Plane"), 32, 24, lights=10, validation=2, holdout=3, step=2)
    planned = plan_lights(settings)
    assert [light.role for light in planned if light.share is None] == ["validation"] * 2 + ["holdout"] * 3
    assert len({light.share for light in planned[:4]}) == 4
    assert settings.record()["step"] == 2 and "step" not in replace(settings, step=1).record()
    assert "--share=1/4" in arguments(settings)
    assert all(light.share is None for light in plan_lights(replace(settings, step=1)))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"step": 9}, "expected a share of every 1st to 8th texel"),
        ({"receiver": Receiver.parse("vertices:A")}, "expected a lightmap or a view with `share=1/4`, found vertices"),
        ({"samples": "auto"}, "found `samples=auto`"),
        ({"receiver": Receiver.parse("view"), "quantity": "radiance", "denoise": True}, "found `denoise`"),
        ({"receiver": Receiver.parse("view"), "height": 31}, "found 32x31; `size=32x32` is the next"),
        ({"width": 1}, "expected 2 texels or more each way"),
    ],
)
def test_settings_that_a_share_excludes(changes: dict, words: str) -> None:
    with pytest.raises(InputError, match=words) as caught:
        BakeSettings(**{"receiver": Receiver.parse("lightmap:Plane"), "width": 32, "height": 32, "step": 2, **changes})
    assert "\n" not in str(caught.value)


class StopError(Exception):
    pass


@pytest.mark.lengthy
@pytest.mark.parametrize("transport", ["combined", "indirect"])
@pytest.mark.skipif(sys.platform == "win32", reason="runs a script as Blender")
def test_a_stopped_bake_goes_on_to_the_same_bits(tmp_path: Path, transport: Transport) -> None:
    scene, blender = tmp_path / "scene.blend", tmp_path / "blender"
    scene.write_bytes(b"no scene")
    blender.write_text(f'#!/bin/sh\nexec {sys.executable} {FAKE} "$@"\n')
    blender.chmod(0o755)
    settings = BakeSettings(
        Receiver.parse("lightmap:Plane"), 9, 7, 30, samples=4, validation=1, holdout=1, transport=transport, step=2, holdout_samples=4
    )
    Bake(scene, tmp_path / "whole", settings, blender).run(Reporter())
    for after in (3, 20) if transport == "combined" else (40,):
        calls = 0

        def progress(done: float, total: float, what: str, after: int = after) -> None:
            nonlocal calls
            calls += 1
            if calls == after:
                raise StopError

        folder = tmp_path / f"stopped{after}"
        with pytest.raises(StopError):
            Bake(scene, folder, settings, blender).run(Reporter(progress))
        assert (folder / "bake.json").is_file()
        assert Bake(scene, folder, settings, blender).run(Reporter())
        assert contents(folder) == contents(tmp_path / "whole")
    capture = Capture.open(tmp_path / "whole")
    assert {read_image(capture.folder / light.file, 3).shape for light in capture.lights if light.share is None} == {(7, 9, 3)}
    assert {light.share.size(9, 7) for light in capture.lights if light.share} == {(5, 4), (4, 4), (5, 3), (4, 3)}
    assert capture.image(0).shape == capture.combined().image(0).shape == (7, 9, 3)


@pytest.mark.blender
@pytest.mark.parametrize(
    ("scene", "receiver", "size"),
    [
        ("torus", "lightmap:Torus", (48, 47)),
        ("occluder", "lightmap:Plane", (31, 32)),
        ("view", "view", (40, 30)),
        ("sharp ortho", "view", (30, 40)),
    ],
)
def test_a_share_is_those_texels_of_the_whole_image(bake, scene: str, receiver: str, size: tuple[int, int]) -> None:
    """Where neighbors have about the same light: edges of shadows have a wider footprint. No other texels are as close."""
    settings = {"width": size[0], "height": size[1], "lights": 6, "samples": 64, "holdout": 0}
    whole, parted = (bake(scene, receiver, f"step{step}", step=step, **settings).capture for step in (1, 2))
    errors, by_place = [], []
    for i, light in enumerate(parted.lights):
        assert light.share is not None
        part, expected = read_image(parted.folder / light.file, 3), whole.image(i)
        assert part.shape[1::-1] == light.share.size(*size)
        rolled = [np.roll(expected, by, axis) for axis in (0, 1) for by in (-1, 1)]
        change = np.max([np.abs(one - expected).max(axis=2) for one in rolled], axis=0)
        covered = (whole.coverage() == 1)[light.share.indices]
        even = covered & (change < FLAT * expected.max())[light.share.indices]
        power = (expected**2).mean()
        errors.append(float(((part - expected[light.share.indices])[even] ** 2).mean() / power))
        by_place.append([float(((part - one[light.share.indices])[covered] ** 2).mean()) for one in (expected, *rolled)])
    assert np.sqrt(np.mean(errors)) < NOISE
    if scene != "view":  # a plane of one color
        own, *others = np.mean(by_place, axis=0)
        assert own < 0.7 * min(others)


@pytest.mark.blender
@pytest.mark.parametrize(("scene", "receiver"), [("torus", "lightmap:Torus"), ("projected", "lightmap:Strip")])
def test_no_texel_of_a_share_is_lit_from_outside_of_its_chart(bake, scene: str, receiver: str) -> None:
    """One sample per light and pass: every covered texel that faces a high sun has light, at borders of charts too."""
    suns = 24
    capture = bake(scene, receiver, width=48, height=48, lights=suns, step=2, transport="indirect").capture
    lit = seen = 0
    for i in [i for i in capture.indices("train") if capture.lights[i].direction[2] > 0.8]:
        share, direct = capture.lights[i].share, capture.lights[i].direct
        assert share is not None and direct is not None
        cosine = (capture.geometry("normal") @ np.array(capture.lights[i].direction))[share.indices]
        facing = (capture.coverage()[share.indices] == 1) & (cosine > 0.5)
        image = read_image(capture.folder / direct, 3)[..., 1]
        seen, lit = seen + int(facing.sum()), lit + int((image[facing] > 0.3).sum())
    assert seen > 100 and lit > 0.97 * seen


@pytest.mark.blender
def test_indirect_shares_add_up(bake) -> None:
    capture = bake("emissive", "lightmap:Plane", width=24, height=24, lights=4, step=2, transport="indirect").capture
    for i in capture.indices("train"):
        both = [read_image(capture.folder / name, 3) for name in (capture.lights[i].file, capture.lights[i].direct)]
        assert both[0].shape == both[1].shape == (12, 12, 3)
    assert np.isfinite(capture.combined().image(0)).all()


@pytest.mark.blender
def test_a_mesh_without_a_free_uv_layer_is_refused(bake, blend, tmp_path: Path) -> None:
    with pytest.raises(BakeError, match="expected at most 7 UV layers of 'Plane' for a share of its texels, found 8") as caught:
        bake("full", "lightmap:Plane", step=2)
    assert "\n" not in str(caught.value)


@pytest.mark.blender
def test_a_panorama_has_no_shares(bake) -> None:
    with pytest.raises(BakeError, match="expected a perspective or orthographic camera for a share of a view, found PANO"):
        bake("pano", "view", step=2)
