"""What the demos ask of a bake, and the demo of lights inside at a tiny size."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from srbf import demo
from srbf.asset import Asset
from srbf.cli import app
from srbf.demo import SCENES, Steps, inside
from srbf.demo.inside import INSIDE, Amount
from srbf.demo.pictures import bilinear
from srbf.methods.surface_changes import Surfaces
from srbf.methods.transfer import Transfer
from srbf.visibility import transfer_basis


@pytest.mark.parametrize("name", SCENES)
def test_what_is_published_is_finer(name: str) -> None:
    scene = SCENES[name]
    draft, fine = (scene.settings(400, quality) for quality in ("draft", "publish"))
    assert draft.sun_angle == 0
    assert fine.width * fine.height >= 4 * draft.width * draft.height
    assert fine.width * draft.height == draft.width * fine.height, "of the same shape"
    assert (draft.samples, fine.samples) == (2, 4)
    assert fine.lights == draft.lights == 400
    assert (fine.sun_angle > 0) == (scene.receiver.kind == "lightmap"), "as wide as the light spacing"


@pytest.mark.parametrize("name", INSIDE)
def test_lights_inside_are_held_out_alone(name: str) -> None:
    scene = INSIDE[name]
    draft, fine = (scene.settings(["Floor", "Walls"], quality) for quality in ("draft", "publish"))
    assert draft.receiver.also == ("Walls",) and draft.receiver.uv_layer == scene.uv_layer
    assert draft.transport == "indirect" and draft.light_set is not None and draft.light_set.kind == "surfels"
    assert draft.validation == 0 and 0 < draft.holdout <= fine.holdout
    assert fine.width > draft.width and fine.holdout_samples > draft.holdout_samples
    view = scene.view("draft")
    assert view.quantity == "radiance" and view.holdout == 0, "a view has what the picture is made of, without lights to test"


def test_a_texel_s_middle_has_its_own_light() -> None:
    image = np.random.default_rng(1).random((3, 5, 3)).astype(np.float32)
    columns, rows = np.meshgrid((np.arange(5) + 0.5) / 5, (np.arange(3) + 0.5) / 3)
    there = np.stack([columns, rows], axis=-1).astype(np.float32)
    np.testing.assert_allclose(bilinear(image, there), image, atol=1e-6)
    there[1, 2] = np.nan
    assert (bilinear(image, there)[1, 2] == 0).all()
    between = np.array([[[0.2, 0.5 / 3]]], np.float32)  # of the first two texels of the first row
    np.testing.assert_allclose(bilinear(image, between)[0, 0], image[0, :2].mean(axis=0), atol=1e-6)


def test_directions_mean_nothing_inside(tmp_path: Path) -> None:
    done = CliRunner().invoke(app, ["demo", "--scene", "loft", "-o", str(tmp_path / "out"), "--lights", "5"])
    assert done.exit_code == 2 and "expected --lights with a scene under directional lights, found it with loft" in done.output
    assert not (tmp_path / "out").exists()


@pytest.mark.blender
def test_a_loft_from_script_to_picture(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("embreex")
    loft = INSIDE["loft"]
    few = replace(Transfer(), clusters=4, surfels=800, rank=48, editable=True)
    small = replace(loft, places=loft.places[:1], draft=Amount(48, 600, 0.8, few, 1, 4, (40, 30)))
    monkeypatch.setattr(inside, "INSIDE", {"loft": small})
    monkeypatch.setattr(demo, "write_report", lambda *_args, **_named: tmp_path / "index.html")  # has tests of its own
    for name in ("PLACED", "MOST_PLACED", "NEAR", "SPOTS"):
        monkeypatch.setattr(transfer_basis, name, 40)
    seen: list[list[Path]] = []
    steps = inside.inside_steps

    def watched(*arguments: Any) -> Steps:
        made = steps(*arguments)
        shown = next(made)
        seen.append([*(tmp_path / "capture" / "lights").iterdir(), shown.asset])
        yield shown
        return (yield from made)

    with monkeypatch.context() as patch:
        patch.setattr(inside, "inside_steps", watched)
        done = CliRunner().invoke(app, ["demo", "--scene", "loft", "-o", str(tmp_path)])
    assert done.exit_code == 0, done.output
    assert seen == [[tmp_path / "asset"]], "it can be looked at before Cycles renders a light"
    assert f"srbf view {tmp_path / 'asset'} {tmp_path / 'capture'} --mesh {tmp_path / 'scene.glb'}" in done.output
    asset = Asset.open(tmp_path / "asset")
    assert {"Picture", "Walls", "Floor", "Partition"} <= set(Surfaces.of(asset).names)
    error = json.loads((tmp_path / "asset" / "asset.json").read_text())["error"]["holdout"]
    assert 0 < error["relative_rmse"] < 1, "nearer than darkness, though the reference has four samples"
    assert (tmp_path / "beside_cycles.png").stat().st_size > 10_000
