"""Compressed depths in an asset: as rays have it, without a scene and without rays, on disk, and what cannot be is said."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from made_rooms import Room, room_of_patches

from srbf.asset import Asset
from srbf.capture import Capture
from srbf.errors import ImageError, InputError
from srbf.info import light_facts
from srbf.lights import AreaLight, Light, PointLight, SpotLight
from srbf.methods import linear_response, relight
from srbf.methods.kept_visibility import by_depths, coefficient_count
from srbf.methods.light_cloud import LightCloud
from srbf.methods.transfer import Transfer
from srbf.relighting.direct_light import Added, chosen
from srbf.unshadowed import irradiance_from

pytest.importorskip("embreex")
pytest.importorskip("sklearn")
pytestmark = pytest.mark.slow

ROOM = Room.box((3, 2, 2), 0.5, 0.6, (1.5, 0.6, 1.4))
POINT = PointLight((0.7, 0.8, 1.1), (1.0, 0.5, 0.2), falloff="inverse-square")
LIGHTS: list[Light] = [
    POINT,
    SpotLight((2.4, 1.0, 1.5), falloff="inverse-square", direction=(-1, 0, -0.5), inner=0.5, outer=0.8),
    AreaLight((0.8, 1.0, 1.7), u=(0.4, 0, 0), v=(0, -0.4, 0)),
]
SETTINGS = LightCloud(clusters=4, components=8, visibility="pca:16", receiver_visibility=True)


@pytest.fixture(scope="module")
def capture(tmp_path_factory) -> Capture:
    return room_of_patches(tmp_path_factory.mktemp("patches") / "capture", ROOM, 48)


@pytest.fixture(scope="module")
def asset(capture: Capture) -> Asset:
    return SETTINGS.encode(capture)


def relative(found: np.ndarray, expected: np.ndarray) -> float:
    return float(np.linalg.norm(found - expected) / np.linalg.norm(expected))


def test_bounces_by_depths_are_those_by_rays(asset: Asset) -> None:
    for light in LIGHTS:
        exact = linear_response(asset, [light])
        assert 0 < relative(linear_response(by_depths(asset), [light]), exact) < 0.06


def test_without_rays_all_lights_are_relit(asset: Asset, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the table of places knows point lights alone."""
    expected = linear_response(by_depths(asset), LIGHTS)
    for place in ("methods.lights_inside_maps", "methods.kept_visibility", "methods.light_cloud"):
        monkeypatch.setattr(f"srbf.{place}.has_embree", lambda: False)
    np.testing.assert_array_equal(linear_response(asset, LIGHTS), expected)


def test_the_asset_on_disk_is_the_asset(asset: Asset, tmp_path: Path) -> None:
    asset.save(tmp_path / "asset")
    opened = Asset.open(tmp_path / "asset")
    np.testing.assert_array_equal(linear_response(by_depths(opened), LIGHTS), linear_response(by_depths(asset), LIGHTS))
    by_depths(asset).save(tmp_path / "without")
    without = Asset.open(tmp_path / "without")
    assert without.scene is None and not (tmp_path / "without" / "scene.glb").exists()
    np.testing.assert_array_equal(linear_response(without, LIGHTS), linear_response(by_depths(asset), LIGHTS))
    with Added(asset, "pca") as one, Added(without, "pca") as other:
        first, second = one.response(LIGHTS), other.response(LIGHTS)
        assert first is not None and second is not None
        np.testing.assert_array_equal(first, second)
    told = light_facts(opened)["receiver_visibility"]
    assert told["points"] == opened.covered.sum() and told["coefficients"] == 16 and told["bytes"] > 16 * told["points"]
    opened.manifest["surfel_visibility"]["points"] += 1
    del opened.manifest["sha256"]
    (tmp_path / "asset" / "surfel_visibility_clusters.png").unlink()
    with pytest.raises(ImageError):
        Asset.open(tmp_path / "asset")


def test_direct_light_by_depths_is_that_of_rays(asset: Asset) -> None:
    """From the middles of the texels."""
    with Added(asset, chosen(asset, "pca")) as pca:
        found = pca.response([POINT])
        assert found is not None
        seen = ROOM.sees(ROOM.places + 1e-3 * ROOM.normals, np.broadcast_to(POINT.position, ROOM.places.shape))
        exact = (irradiance_from(POINT, ROOM.places, ROOM.normals) * seen)[:, None] * POINT.color
        assert 0 < relative(found.reshape(-1, 3)[: len(exact)], exact) < 0.06
        assert pca.notes(LIGHTS) == ["added direct light by compressed depths"]
        whole = relight(by_depths(asset), LIGHTS, pca.response(LIGHTS))
    assert (whole >= linear_response(by_depths(asset), LIGHTS) - 1e-5).all()


def test_a_trial_on_a_sample_measures_by_rays() -> None:
    assert SETTINGS.on_sample(4.0) == replace(LightCloud(clusters=2, components=8), visibility="none")  # a half: at least two


@pytest.mark.parametrize("text", ["pca:0", "pca:5000", "pca:", "pca", "pca:1.5", "pca:-3", "pca:²", "rays", "", "PCA:50"])
def test_other_words_are_refused(text: str) -> None:
    for method in (LightCloud, Transfer):
        with pytest.raises(InputError, match="expected `visibility` none or pca:COUNT with 1 to 256 coefficients, as pca:50, found"):
            method(visibility=text)
    assert coefficient_count("pca:50") == 50 and coefficient_count("none") == 0


def test_what_cannot_be_is_said(capture: Capture, asset: Asset) -> None:
    with pytest.raises(InputError, match="with `receiver_visibility`, found none"):
        LightCloud(receiver_visibility=True)
    with pytest.raises(InputError, match="expected `visibility=none` with `interpolation=kernel`"):
        LightCloud(visibility="pca:9", interpolation="kernel")
    plain = replace(asset, manifest={key: told for key, told in asset.manifest.items() if "_visibility" not in key})
    with pytest.raises(InputError, match="fit with `visibility=pca:50`"):
        by_depths(plain)
    for source in (plain, capture):
        with pytest.raises(InputError, match="expected an asset that keeps what its receivers see"):
            Added(source, "pca")
