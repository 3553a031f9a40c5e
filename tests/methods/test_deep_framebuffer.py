"""Deep framebuffers of rooms solved by radiosity: unseen lights, linearity, edits of one light, budgets, bad files."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from made_rooms import Room, room_of_surfels
from made_views import surfaces_of, view_of_room, with_backs, with_lobes, with_specular_albedo

from srbf import relight
from srbf.asset import Asset
from srbf.bake.gather_set import GatherSet
from srbf.capture import Capture
from srbf.errors import ImageError, InputError, ManifestError
from srbf.evaluation.errors_by_role import evaluate
from srbf.fitting.options import fit
from srbf.lights import AreaLight, DirectionalLight, EnvironmentLight, Light, NamedLight, PointLight, SphereLight, SpotLight
from srbf.methods import linear_response, responses
from srbf.methods.deep_framebuffer import DeepFramebuffer
from srbf.methods.mixed_clusters import size
from srbf.relighting.light_rig import LightRig
from srbf.visibility.gather_operator import GATHER_FILE, GatherOperator

pytest.importorskip("embreex")

BOX = Room.box((3, 2, 2), 0.25, 0.6)
LIGHTS: list[Light] = [
    PointLight((1.2, 0.7, 1.1), (1, 0.5, 0.2), falloff="inverse-square"),
    SpotLight((2.0, 1.0, 1.5), falloff="inverse-square", direction=(0.2, 0, -1), inner=0.5, outer=0.8),
    SphereLight((0.6, 1.2, 0.8), (0.2, 1, 0.4), size=0.1),
    AreaLight((1.5, 1, 1.7), u=(0.6, 0, 0), v=(0, -0.3, 0)),
]


@pytest.fixture(scope="module")
def capture(tmp_path_factory: pytest.TempPathFactory) -> Capture:
    return view_of_room(tmp_path_factory.mktemp("view") / "capture", BOX, 2000, 400)


@pytest.fixture(scope="module")
def asset(capture: Capture) -> Asset:
    return DeepFramebuffer().encode(capture)


@pytest.mark.lengthy
def test_lights_that_no_one_rendered_are_relit(asset: Asset, capture: Capture) -> None:
    """The truth is of square cells of 25 cm, and of their centers: most of the error is its own."""
    assert evaluate(asset, capture)["holdout"]["relative_rmse"] < 0.11
    relit = responses(asset, capture.positions())
    for index, picture in enumerate(relit):
        covered = capture.coverage() > 0.5
        np.testing.assert_allclose(picture[covered].sum(axis=0) / capture.image(index)[covered].sum(axis=0), 1, atol=0.05)


@pytest.mark.lengthy
def test_a_pixel_is_a_cluster_where_there_are_enough(tmp_path: Path, capture: Capture, asset: Asset) -> None:
    whole = DeepFramebuffer(nearest=1).encode(view_of_room(tmp_path / "whole", BOX, 2000))
    assert whole.manifest["gather"]["clusters"] == len(BOX.places) and asset.manifest["gather"]["clusters"] == 400
    errors = [evaluate(one, capture)["holdout"]["relative_rmse"] for one in (whole, asset)]
    assert errors[0] < 0.12


def test_the_method_of_such_a_capture_needs_no_name(capture: Capture) -> None:
    assert fit(capture).method == "deep-framebuffer"


@pytest.mark.parametrize("light", LIGHTS, ids=lambda light: type(light).__name__)
def test_light_is_linear_in_color_and_adds_up_in_any_order(asset: Asset, light: Light) -> None:
    one = linear_response(asset, [light])
    assert one.max() > 0
    r, g, b = getattr(light, "color", (1.0, 1.0, 1.0))
    changed: Any = light
    twice = linear_response(asset, [replace(changed, color=(2 * r, 2 * g, 2 * b))])
    np.testing.assert_allclose(twice, 2 * one, rtol=1e-5, atol=1e-6 * one.max())
    forward, backward = linear_response(asset, LIGHTS), linear_response(asset, LIGHTS[::-1])
    np.testing.assert_allclose(forward, backward, rtol=1e-4, atol=1e-5 * forward.max())
    np.testing.assert_allclose(forward, sum(linear_response(asset, [own]) for own in LIGHTS), rtol=1e-4, atol=1e-5 * forward.max())


def test_no_light_is_black_and_light_outside_a_closed_box_as_well(asset: Asset) -> None:
    assert not linear_response(asset, []).any()
    outside: list[Light] = [DirectionalLight((0.3, 0.4, 1)), EnvironmentLight(np.ones((4, 8, 3), np.float32))]
    assert not linear_response(asset, [*outside, PointLight((9, 9, 9), falloff="inverse-square")]).any()


def test_a_light_that_moves_costs_one_and_equals_all_anew(asset: Asset) -> None:
    with LightRig(asset, "none") as rig:
        rig.picture(LIGHTS)
        assert rig.computed == 4
        first: Any = LIGHTS[0]
        moved = [*LIGHTS[1:], replace(first, position=(0.5, 0.4, 0.9))]
        np.testing.assert_allclose(rig.picture(moved), relight(asset, moved, "none"), rtol=1e-4, atol=1e-6)
        assert rig.computed == 5
        dimmed = [*moved[:3], replace(moved[3], color=(0.1, 0.2, 0.3))]
        np.testing.assert_allclose(rig.picture(dimmed), relight(asset, dimmed, "none"), rtol=1e-4, atol=1e-6)
        assert rig.computed == 5
        assert not rig.picture([]).any() and rig.computed == 5


@pytest.mark.lengthy
def test_the_asset_on_disk_is_the_asset(asset: Asset, tmp_path: Path) -> None:
    asset.save(tmp_path / "asset")
    again = Asset.open(tmp_path / "asset")
    np.testing.assert_array_equal(linear_response(again, LIGHTS), linear_response(asset, LIGHTS))
    whole = linear_response(again, LIGHTS).reshape(-1, 3)
    np.testing.assert_allclose(linear_response(again.at(np.array([3, 40])), LIGHTS)[0], whole[[3, 40]], rtol=1e-6)
    again.manifest["gather"]["surfels"] = 5
    with pytest.raises(ImageError, match="5"):
        linear_response(replace(again, tables=dict(again.tables, view_links=again.tables["view_links"].copy())), LIGHTS)


def test_a_budget_keeps_fewer_rays_and_the_energy(capture: Capture, asset: Asset, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("srbf.methods.deep_framebuffer.MEGABYTE", 6e5)
    small = DeepFramebuffer(budget=1).encode(capture)
    assert size(small) < 0.75 * size(asset)
    assert small.manifest["gather"]["view_rays"] < asset.manifest["gather"]["view_rays"]
    one, other = (linear_response(found, LIGHTS) for found in (small, asset))
    assert abs(one.sum() / other.sum() - 1) < 0.01
    assert 0 < np.sqrt(((one - other) ** 2).sum() / (other**2).sum()) < 0.06


@pytest.mark.parametrize(("settings", "words"), [({"nearest": 0}, "1 to 10"), ({"nearest": 11}, "1 to 10"), ({"budget": 0}, "1 megabyte")])
def test_settings_out_of_range_are_refused(settings: dict[str, int], words: str) -> None:
    with pytest.raises(InputError, match=words):
        DeepFramebuffer(**settings)


def test_pools_out_of_range_and_unknown_scenes_are_refused() -> None:
    for pool, clusters in ((3, None), (70_000, None), (100, 0), (100, 70_000)):
        with pytest.raises(InputError, match="expected"):
            GatherSet(pool, clusters)
    with pytest.raises(InputError, match="known scene"):
        GatherSet().manifest()


def test_a_view_of_nothing_is_refused(tmp_path: Path, capture: Capture) -> None:
    from srbf.io.image import write_image

    empty = view_of_room(tmp_path / "empty", Room.box((1, 1, 1), 0.5), 100, 4, tested=0)
    write_image(empty.folder / "coverage.exr", np.zeros((empty.height, empty.width, 1), np.float32), "float")
    with pytest.raises(InputError, match="every pixel is empty"):
        GatherSet(64, None, None, None, surfaces_of(BOX, 0.5)).trace(empty, 1, lambda done, total, what: None)


def test_what_fits_no_deep_framebuffer_is_refused(asset: Asset, capture: Capture, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="named"):
        linear_response(asset, [NamedLight("Bulb")])
    with pytest.raises(InputError, match="found pool"):
        fit(capture, "transfer")
    with pytest.raises(InputError, match="found surfels"):
        fit(room_of_surfels(tmp_path / "surfels", Room.box((1, 1, 1), 0.5), 60), "deep-framebuffer")


def test_damaged_links_are_refused(capture: Capture, tmp_path: Path) -> None:
    for name in ("pool.exr", GATHER_FILE):
        (tmp_path / name).write_bytes((capture.folder / name).read_bytes())
    GatherOperator.read(tmp_path)
    (tmp_path / GATHER_FILE).write_bytes((tmp_path / GATHER_FILE).read_bytes()[:2000])
    with pytest.raises(ImageError, match="bake again"):
        GatherOperator.read(tmp_path)


def test_an_asset_of_an_older_version_is_refused(asset: Asset, tmp_path: Path) -> None:
    asset.save(tmp_path / "asset")
    path = tmp_path / "asset" / "asset.json"
    told = json.loads(path.read_text())
    del told["near_labels"]
    path.write_text(json.dumps(told))
    with pytest.raises(ManifestError, match="fit again"):
        Asset.open(tmp_path / "asset")


@pytest.mark.lengthy
def test_light_from_behind_is_kept_in_files_and_at_some_pixels(asset: Asset, tmp_path: Path) -> None:
    """Of pixels alone, after a round trip; and what is let through is as much as transmittance says."""
    thin = with_backs(asset)
    thin.save(tmp_path / "thin")
    read = Asset.open(tmp_path / "thin")
    expected = linear_response(thin, LIGHTS)
    np.testing.assert_allclose(linear_response(read, LIGHTS), expected, rtol=1e-5, atol=1e-6 * expected.max())
    some = np.array([3, 40, 77])
    np.testing.assert_allclose(
        linear_response(read.at(some), LIGHTS)[0], expected.reshape(-1, 3)[some], rtol=1e-4, atol=1e-6 * expected.max()
    )
    without = linear_response(asset, LIGHTS)
    half = replace(thin, images={**thin.images, "transmission": thin.images["transmission"] / 2})
    np.testing.assert_allclose(linear_response(half, LIGHTS) - without, (expected - without) / 2, atol=1e-5 * expected.max())
    assert (expected - without).max() > 0


def test_lobes_see_what_surfels_reflect_toward_them_alone(asset: Asset) -> None:
    """Half as much again as their albedo: half as much light again in lobes, and none in diffuse pixels."""
    plain, more = with_lobes(asset), with_specular_albedo(asset)
    more.tables["pool"][3] = 0.5 * more.tables["pool"][2]
    dark = {"glossy": np.zeros_like(asset.images["albedo"])}
    light = [PointLight((1.2, 0.7, 1.1), (1, 0.5, 0.2), falloff="inverse-square")]
    without = linear_response(replace(more, images={**more.images, **dark}), light)
    np.testing.assert_allclose(without, linear_response(asset, light), rtol=1e-4)
    lobes, whole = linear_response(plain, light) - without, linear_response(more, light) - without
    np.testing.assert_allclose(whole, 1.5 * lobes, rtol=1e-3, atol=1e-4 * whole.max())
