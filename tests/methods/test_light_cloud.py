"""The light cloud on rooms solved by radiosity: errors at lights it never saw, linearity, leaks, other kinds of lights."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from made_rooms import Room, room_of_patches, room_of_points

from srbf.asset import Asset
from srbf.capture import Capture
from srbf.encode.position_table import PositionTable
from srbf.errors import InputError, ManifestError
from srbf.evaluation.errors_by_role import evaluate
from srbf.fitting.options import fit
from srbf.lights import AreaLight, DirectionalLight, PointLight, SphereLight, SpotLight
from srbf.methods import faded, linear_response, projected_weights
from srbf.methods.light_cloud import LightCloud

pytest.importorskip("embreex")
pytest.importorskip("sklearn")

BOX = Room.box((3, 2, 2), 0.25, 0.6)
DOOR = Room.box((4, 3, 2.5), 0.25, 0.6, (2.0, 1.0, 1.8))
APART = Room.box((4, 3, 2.5), 0.25, 0.6, (2.0, 3.0, 3.0))  # the wall without a door


@pytest.fixture(scope="module")
def patches(tmp_path_factory) -> Capture:
    return room_of_patches(tmp_path_factory.mktemp("patches") / "capture", BOX, 128)


@pytest.fixture(scope="module")
def asset(patches: Capture) -> Asset:
    return LightCloud(clusters=16, components=12).encode(patches)


@pytest.fixture(scope="module")
def points(tmp_path_factory) -> Capture:
    return room_of_points(tmp_path_factory.mktemp("points") / "capture", DOOR, 150)


def light(place, **changes) -> PointLight:
    return PointLight(tuple(place), falloff="inverse-square", **changes)


def of_cells(asset: Asset, room: Room, lights: list) -> np.ndarray:
    return linear_response(asset, lights).reshape(-1, 3)[: len(room.places)]


@pytest.mark.slow
def test_unseen_point_lights_are_relit(asset: Asset, patches: Capture) -> None:
    errors = evaluate(asset, patches)
    assert errors["holdout"]["relative_rmse"] < 0.08 and errors["validation"]["relative_rmse"] < 0.08
    assert asset.bytes_per_texel()["directional"] == 13


@pytest.mark.lengthy
def test_the_asset_on_disk_is_the_asset(asset: Asset, tmp_path: Path) -> None:
    asset.save(tmp_path / "asset")
    lights = [light((1.0, 1.0, 1.0)), SpotLight((2.0, 1.0, 1.5), falloff="inverse-square", direction=(0, 0, -1), inner=0.3, outer=0.5)]
    np.testing.assert_array_equal(linear_response(Asset.open(tmp_path / "asset"), lights), linear_response(asset, lights))


def test_lights_add_up_and_scale(asset: Asset) -> None:
    one, other = light((0.5, 0.6, 0.7), color=(2.0, 1.0, 0.5)), light((2.5, 1.5, 1.2))
    both = linear_response(asset, [one, other])
    np.testing.assert_allclose(both, linear_response(asset, [one]) + linear_response(asset, [other]), atol=1e-5 * both.max())
    np.testing.assert_allclose(linear_response(asset, [replace(one, a0=2.0)]), 4 * linear_response(asset, [one]), rtol=1e-4, atol=1e-5)
    assert not linear_response(asset, []).any()
    np.testing.assert_allclose(projected_weights(asset, [one, other]), projected_weights(asset, [other, one]), rtol=1e-12)


@pytest.mark.slow
def test_two_rooms_without_a_door_exchange_no_light(tmp_path: Path) -> None:
    apart = LightCloud(clusters=24, components=12).encode(room_of_patches(tmp_path / "capture", APART, 200))
    wall = np.abs(APART.places[:, 0] - 2) < 1e-6
    far = (APART.places[:, 0] > 2) | (wall & (APART.normals[:, 0] > 0))
    lit = of_cells(apart, APART, [light((1.0, 1.5, 1.2))])
    assert np.abs(lit[far]).mean() < 0.005 * lit[~far].mean()


@pytest.mark.parametrize(
    "near_point",
    [
        SphereLight((1.5, 1.0, 1.0), size=0.05),
        SpotLight((1.5, 1.0, 1.0), falloff="inverse-square", direction=(0, 0, 1), inner=np.pi, outer=np.pi),
    ],
    ids=["small sphere", "open spot"],
)
def test_lights_that_equal_a_point_light_are_one(asset: Asset, near_point: PointLight) -> None:
    np.testing.assert_allclose(linear_response(asset, [near_point]), linear_response(asset, [light((1.5, 1.0, 1.0))]), rtol=2e-3, atol=1e-4)


def test_spots_and_areas_are_relit_by_what_they_lay_on_the_walls(asset: Asset, patches: Capture) -> None:
    """Against the room's own transport, which knows the irradiance of every cell."""
    transport = BOX.transport()
    spot = SpotLight((1.5, 1.0, 1.7), falloff="inverse-square", direction=(0, 0, -1), inner=0.5, outer=0.6)
    direct = BOX.direct(np.array(spot.position))
    toward = BOX.places - spot.position
    cosine = toward @ [0, 0, -1] / np.linalg.norm(toward, axis=1)
    share = np.clip((cosine - np.cos(0.6)) / (np.cos(0.5) - np.cos(0.6)), 0, 1)
    truth = np.einsum("ijc,j->ic", transport, direct * share * share * (3 - 2 * share))
    error = np.sqrt(((of_cells(asset, BOX, [spot]) - truth) ** 2).sum() / (truth**2).sum())
    assert error < 0.2
    area = AreaLight((1.5, 1.0, 1.9), u=(0.4, 0, 0), v=(0, -0.4, 0))
    grid = (np.stack(np.meshgrid([-0.15, -0.05, 0.05, 0.15], [-0.15, -0.05, 0.05, 0.15]), -1)).reshape(-1, 2)
    truth = np.zeros_like(truth)
    for x, y in grid:
        place = np.array([1.5 + x, 1.0 + y, 1.9])
        unit = (place - BOX.places) / np.linalg.norm(place - BOX.places, axis=1)[:, None]
        truth += np.einsum("ijc,j->ic", transport, BOX.direct(place) * np.maximum(unit[:, 2], 0)) / len(grid)
    error = np.sqrt(((of_cells(asset, BOX, [area]) - truth) ** 2).sum() / (truth**2).sum())
    assert error < 0.1


def test_a_sun_through_no_window_lights_nothing(asset: Asset) -> None:
    assert not linear_response(asset, [DirectionalLight((0.2, 0.3, 1.0))]).any()


def test_the_table_of_places_stands_in_for_rays(asset: Asset, monkeypatch: pytest.MonkeyPatch) -> None:
    lights = [light(place) for place in BOX.free[-6:]]
    exact = np.stack([projected_weights(asset, [one]) for one in lights])
    monkeypatch.setattr("srbf.methods.lights_inside_maps.has_embree", lambda: False)
    looked_up = np.stack([projected_weights(asset, [one]) for one in lights])
    relit = LightCloud.weighted(asset, np.concatenate([exact, looked_up]))
    assert np.sqrt(((relit[:6] - relit[6:]) ** 2).sum() / (relit[:6] ** 2).sum()) < 0.05
    with pytest.raises(InputError, match="capture patches for any light, and install embreex"):
        projected_weights(asset, [DirectionalLight((0, 0, 1))])


def test_the_table_knows_what_is_outside(asset: Asset) -> None:
    table = PositionTable.of(asset.manifest, asset.tables)
    nodes, weight, inside = table.weights(BOX.free[0])
    assert inside and weight.sum() == pytest.approx(1) and (weight >= 0).all() and nodes.max() < np.prod(table.counts)
    assert table.weights(np.array([50.0, 50.0, 50.0]))[1].sum() == pytest.approx(1)


@pytest.mark.slow
@pytest.mark.parametrize("interpolation", ["fingerprint", "kernel"])
def test_captured_point_lights_are_interpolated(points: Capture, interpolation) -> None:
    cloud = LightCloud(clusters=24, components=12, interpolation=interpolation).encode(points)
    errors = evaluate(cloud, points)
    assert errors["holdout"]["relative_rmse"] < 0.2
    assert cloud.manifest["interpolation"]["kind"] == interpolation


@pytest.mark.slow
@pytest.mark.parametrize("merge", ["harmonic", "arithmetic"])
def test_merged_lights_of_zones_are_fewer_and_nearly_as_good(points: Capture, merge, tmp_path: Path) -> None:
    whole = evaluate(LightCloud(clusters=24, interpolation="kernel").encode(points), points)["holdout"]["relative_rmse"]
    few = LightCloud(clusters=24, interpolation="kernel", zones=4, merge=merge, merged=75).encode(points)
    assert few.manifest["source"]["fit"]["merged_lights"] == [75] * 4
    assert evaluate(few, points)["holdout"]["relative_rmse"] < 1.3 * whole
    few.save(tmp_path / "few")
    lights = [light(DOOR.free[3])]
    np.testing.assert_array_equal(linear_response(Asset.open(tmp_path / "few"), lights), linear_response(few, lights))


@pytest.mark.slow
def test_captured_lights_come_and_go_over_time(points: Capture) -> None:
    """A light that jumps into the other room: captured lights of this one take half a second to come, and no frame goes back."""
    cloud = LightCloud(clusters=8, interpolation="kernel", zones=2).encode(points)
    first, last = light((0.6, 2.5, 1.1)), light((3.4, 2.5, 1.1))
    before, after = linear_response(cloud, [first]), linear_response(cloud, [last])
    respond = faded(cloud, 0.5)
    np.testing.assert_allclose(respond([first], 0.1), before, rtol=1e-4, atol=1e-5)
    left = [np.linalg.norm(respond([last], 0.1) - after) / np.linalg.norm(before - after) for _ in range(6)]
    assert left[0] > 0.02 and left[-1] < 1e-5 and (np.diff(left) <= 1e-5).all()
    at_once = faded(cloud, 0.0)
    np.testing.assert_allclose(at_once([first], 0.1), before, rtol=1e-4, atol=1e-5)
    np.testing.assert_allclose(at_once([last], 0.1), after, rtol=1e-4, atol=1e-5)
    assert not respond([], 0.1).any()


def test_lights_of_patches_have_nothing_to_fade(asset: Asset) -> None:
    with pytest.raises(InputError, match="captured point lights for `fade`, found patches"):
        faded(asset, 0.2)


@pytest.mark.slow
def test_components_go_where_they_cut_the_error_most(points: Capture) -> None:
    """A mean of six per texel: better than six for all, and no better than twelve for all."""
    base = LightCloud(clusters=12, interpolation="kernel", smooth=False)
    settings = {"six": replace(base, components=6), "mixed": replace(base, mean_components=6), "twelve": base}
    error = {name: evaluate(method.encode(points), points)["train"]["relative_rmse"] for name, method in settings.items()}
    assert error["twelve"] < error["mixed"] < error["six"]


@pytest.mark.slow
def test_the_metric_is_of_place_or_of_light(points: Capture) -> None:
    """By place alone the nearest lights merge first: the mean distance within groups is least."""
    spread = []
    base = LightCloud(clusters=8, interpolation="kernel", merge="arithmetic", merged=40)
    for place, response in ((1.0, 0.0), (0.0, 1.0)):
        cloud = replace(base, distance_weight=place, response_weight=response).encode(points)
        merged = cloud.tables["cloud"][0, :40, :3].astype(np.float64)
        places = points.positions(points.indices("train"))
        spread.append(np.linalg.norm(places[:, None] - merged, axis=2).min(axis=1).mean())
    assert spread[0] < spread[1]


@pytest.mark.slow
def test_bytes_are_kept(patches: Capture) -> None:
    chosen = fit(patches, budget=13)
    assert chosen.method == "light-cloud" and chosen.bytes_per_texel()["directional"] <= 13


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"zones": 4}, "`zones` and `merge` with `interpolation=kernel`"),
        ({"interpolation": "kernel", "merged": 0}, "`merged` auto or 1 or more"),
        ({"components": 4, "mean_components": 5}, "`mean_components` auto or 0 to 4"),
        ({"distance_weight": 2.0}, "`distance_weight` auto, or 0 or more with `merge`"),
        ({"nearest": 0}, "1 or more `nearest`"),
        ({"clusters": 300}, "1 to 256 clusters"),
    ],
)
def test_settings_out_of_range_are_refused(settings: dict, words: str) -> None:
    with pytest.raises(InputError, match=words):
        LightCloud(**settings)


def test_a_capture_without_patches_is_refused(patches: Capture) -> None:
    bare = replace(patches, manifest={key: value for key, value in patches.manifest.items() if key != "patches"})
    with pytest.raises(ManifestError, match="expected patches of the surfaces"):
        LightCloud().encode(bare)
