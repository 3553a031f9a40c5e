"""Captures under point lights: which places are free, irradiance of point lights, and assets measured against them."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from srbf.bake.point_lights import PointGrid
from srbf.bake.run import Bake
from srbf.bake.scene_query import with_free_point_lights
from srbf.bake.settings import BakeSettings, Receiver, plan_lights
from srbf.capture import Capture
from srbf.errors import BakeError, InputError
from srbf.evaluation.errors_by_role import evaluate
from srbf.methods.relighting_map import RelightingMap

HALF = 2.0**-11  # relative rounding of a stored half float
BOX = (-2.0, -2.0, 0.0, 2.0, 2.0, 2.0)


def settings_with(points: PointGrid | None, **changes: object) -> BakeSettings:
    small = {"width": 16, "height": 16, "samples": 1, "validation": 2, "holdout": 3, "holdout_samples": 1}
    return BakeSettings(Receiver("lightmap", "Plane"), points=points, **{**small, **changes})


def test_words_of_a_light_set() -> None:
    assert PointGrid.parse("point:0.5", None) == PointGrid(0.5)
    assert PointGrid.parse("point:2", "0,1,2,3,4,5").box == (0, 1, 2, 3, 4, 5)
    for light_set, box, words in [
        ("sphere:3", None, "point:SPACING"),
        ("point", None, "point:SPACING"),
        ("point:near", None, "point:SPACING"),
        ("point:0", None, "spacing"),
        ("point:nan", None, "spacing"),
        ("point:1", "0,0,0,1,1", "x0,y0,z0,x1,y1,z1"),
        ("point:1", "0,0,1,1,1,0", "the smaller"),
    ]:
        with pytest.raises(InputError, match=words):
            PointGrid.parse(light_set, box)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"sun_angle": 0.1}, "`sun_angle`"),
        ({"light_list": Path("l.lp")}, "`light_list`"),
        ({"transport": "indirect"}, "combined"),
        ({"samples": "auto"}, "auto"),
    ],
)
def test_settings_that_point_lights_cannot_have(changes: dict, words: str) -> None:
    with pytest.raises(InputError, match=words):
        settings_with(PointGrid(1.0), **changes)


def test_planned_point_lights_have_their_roles_and_places() -> None:
    points = PointGrid(1.0, BOX, ((0, 0, 1), (1, 0, 1)), ((0.1, 0, 1), (0.2, 0, 1), (0.3, 0, 1), (0.4, 0, 1), (0.5, 0, 1)))
    settings = settings_with(points)
    lights = plan_lights(settings)
    assert [light.role for light in lights] == ["train"] * 2 + ["validation"] * 2 + ["holdout"] * 3
    assert [light.place[0] for light in lights] == [0, 1, 0.1, 0.2, 0.3, 0.4, 0.5]
    assert lights[2].placed.json() == {"kind": "point", "position": [0.1, 0, 1]}
    record = json.loads(json.dumps(settings.record()))
    assert "lights" not in record and record["points"]["spacing"] == 1 and record["points"]["box"] == list(BOX)
    moved = settings_with(PointGrid(1.0, BOX, ((0, 0, 1.5), (1, 0, 1)), points.random))
    assert moved.record()["points"]["positions"] != record["points"]["positions"]
    with pytest.raises(InputError, match="with_free_point_lights"):
        plan_lights(settings_with(PointGrid(1.0)))
    with pytest.raises(InputError, match="point lights"):
        settings.with_matched_sun()
    assert "points" not in settings_with(None).record()  # captures of before there were any stay what they were


@pytest.mark.blender
def test_places_inside_blocks_are_left_out(blend, tmp_path: Path) -> None:
    """The block's inside is not free, the open crate's is, the room's air is, and nothing is nearer than a tenth of the spacing."""
    settings = settings_with(PointGrid(0.25, (-2.0, -2.0, 0.0, 2.0, 2.0, 3.0)), validation=20, holdout=30)
    said: list[str] = []
    found = with_free_point_lights(Bake(blend("blocks"), tmp_path, settings), said.append).settings
    assert found.points is not None
    train, validation, holdout = found.points.places(20, 30)
    axes = [np.arange(n) * 0.25 + low for n, low in ((16, -1.875), (16, -1.875), (12, 0.125))]
    every = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    inside = (np.abs(every - [-1, 0, 1]) < 0.5).all(axis=1)
    assert inside.sum() == 4 * 4 * 4
    expected = {tuple(point) for point in every[~inside]}
    assert {tuple(point) for point in train.round(9)} == expected and len(train) == len(expected)
    assert "64 places in or near geometry" in said[-1]
    for point in np.concatenate([validation, holdout]):
        outside = np.abs(point - [-1, 0, 1]).max() - 0.5  # the block's distance, in its own norm
        assert outside > 0.025 / np.sqrt(3) and point[2] > 0.025 and (np.abs(point[:2]) <= 2).all()
    again = with_free_point_lights(Bake(blend("blocks"), tmp_path, settings)).settings
    assert again == found


@pytest.mark.blender
def test_no_room_is_said(blend, tmp_path: Path) -> None:
    settings = settings_with(PointGrid(0.2, (-1.2, -0.2, 0.8, -0.8, 0.2, 1.2)))
    with pytest.raises(BakeError, match="`light_bounds`"):
        with_free_point_lights(Bake(blend("blocks"), tmp_path, settings))
    settings = settings_with(PointGrid(0.001))
    with pytest.raises(BakeError, match="larger spacing"):
        with_free_point_lights(Bake(blend("blocks"), tmp_path, settings))


@pytest.mark.blender
def test_a_white_plane_under_point_lights(blend, tmp_path: Path) -> None:
    """cos / d^2 of irradiance, through the command; and a directional asset of the plane predicts it, since nothing casts a shadow."""
    flags = ["--receiver", "lightmap:Plane", "--size", 16, "--samples", 64, "--holdout-samples", 64]
    points = ["--light-set", "point:0.8", "--light-bounds", "9,4,0.4,11,6,2", "--validation", 2, "--holdout", 3]
    done = subprocess.run(
        [sys.executable, "-m", "srbf", "bake", blend("plane"), "-o", tmp_path / "point_lights", *map(str, flags + points)],
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0 and "8 point lights" in done.stderr, done.stderr
    capture = Capture.open(tmp_path / "point_lights")
    assert capture.kind == "point" and [len(capture.indices(role)) for role in ("train", "validation", "holdout")] == [8, 2, 3]
    position = capture.geometry("position")
    for index, point_light in enumerate(capture.positions()):
        vectors = point_light - position
        distance = np.linalg.norm(vectors, axis=2)
        expected = vectors[..., 2] / distance**3
        apart = np.abs(capture.image(index)[..., 0] / expected - 1)
        # The mean of 64 points about the texel's center; closest to the light it is another than the center's.
        assert np.quantile(apart, 0.9) < 0.02 and apart.max() < 0.2
    with pytest.raises(InputError, match="centers of functions"):
        RelightingMap(k=4).encode(capture)


@pytest.mark.blender
def test_a_directional_asset_against_point_lights(bake) -> None:
    asset = RelightingMap(k=30).encode(bake("plane", "lightmap:Plane", name="suns", lights=50).capture)
    grid = ((9.5, 4.5, 0.8), (10.5, 5.5, 1.6))
    random = ((10.0, 5.2, 1.0), (9.2, 5.9, 2.0))
    points = PointGrid(1.0, (9, 4, 0, 11, 6, 2), grid, random)
    point_lights = bake("plane", "lightmap:Plane", name="point_lights", points=points, validation=1, holdout=1).capture
    errors = evaluate(asset, point_lights)
    assert [light["role"] for light in errors["lights"]] == ["train", "train", "validation", "holdout"]
    for role in ("train", "validation", "holdout"):
        assert errors[role]["relative_rmse"] < 0.05, errors[role]  # the fit's own error
