"""The glossy cloud on a room in closed form: unseen lights and viewers, Lambert, linearity, the disk, a place in the world, bad input."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from made_gloss import glossy_room, radiance_of
from made_rooms import Room, room_of_points

from srbf.asset import Asset
from srbf.capture import Capture
from srbf.errors import InputError, ManifestError
from srbf.evaluation.errors_by_role import evaluate
from srbf.evaluation.viewer_errors import viewer_errors
from srbf.fitting.options import fit, method_for
from srbf.io import files
from srbf.io.image import write_image
from srbf.lights import PointLight, SphereLight, SpotLight
from srbf.methods import linear_response, projected_weights, radiance_to, relight
from srbf.methods.glossy_cloud import GlossyCloud
from srbf.methods.light_cloud import LightCloud

pytest.importorskip("embreex")
pytest.importorskip("sklearn")
pytestmark = pytest.mark.slow

BOX = Room.box((3, 2, 2), 0.25, 0.6)
LIGHTS = 60
VIEWER = (1.4, 1.1, 0.9)
OF_HALVES = 2e-3  # of weights and table as half floats


@pytest.fixture(scope="module")
def capture(tmp_path_factory: pytest.TempPathFactory) -> Capture:
    return glossy_room(tmp_path_factory.mktemp("glossy") / "capture", BOX, LIGHTS)


@pytest.fixture(scope="module")
def asset(capture: Capture) -> Asset:
    return GlossyCloud(clusters=8, components=16).encode(capture)


def light(place, **changes) -> PointLight:
    return PointLight(tuple(place), falloff="inverse-square", **changes)


def toward(viewer: tuple[float, float, float]) -> np.ndarray:
    ways = np.array(viewer) - BOX.places
    return ways / np.linalg.norm(ways, axis=1, keepdims=True)


def of_cells(image: np.ndarray) -> np.ndarray:
    return image.reshape(-1, 3)[: len(BOX.places)]


def relative(found: np.ndarray, true: np.ndarray) -> float:
    return float(np.sqrt(((found - true) ** 2).sum() / (true**2).sum()))


@pytest.mark.parametrize(("interpolation", "most"), [("fingerprint", 0.2), ("kernel", 0.3)])
def test_unseen_lights_are_relit_toward_unseen_viewers(capture: Capture, interpolation, most) -> None:
    """Seen from places that no viewer of the bake was at; surfaces that are seen at a slant of more than 11.5 degrees count."""
    asset = GlossyCloud(clusters=8, components=16, interpolation=interpolation).encode(capture)
    assert asset.manifest["interpolation"]["kind"] == interpolation
    for viewer in (VIEWER, (0.4, 0.4, 1.7)):
        ways = toward(viewer)
        clear = (ways * BOX.normals).sum(axis=1) > 0.2
        places = capture.positions(capture.indices("holdout"))
        found = np.stack([of_cells(radiance_to(asset, [light(place)], viewer))[clear] for place in places])
        true = np.stack([radiance_of(BOX, place, ways)[clear] for place in places])
        from_above = np.stack([of_cells(linear_response(asset, [light(place)]))[clear] for place in places])
        assert relative(found, true) < most
        assert relative(from_above, true) > 1.5 * relative(found, true)  # who forgets the viewer misses most of the lobe


def test_errors_toward_viewers_are_measured(asset: Asset, capture: Capture) -> None:
    found = viewer_errors(asset, capture)
    assert set(found) == {"validation", "holdout"}
    for error in found.values():
        assert 0 < error["mean"] < 0.25 and error["mean"] <= error["worst"]
    assert evaluate(asset, capture)["holdout"]["relative_rmse"] < 0.3
    assert asset.bytes_per_texel()["point"] == 17


def test_lambert_looks_alike_from_everywhere(tmp_path: Path) -> None:
    asset = GlossyCloud(clusters=6, components=12).encode(glossy_room(tmp_path / "capture", BOX, 40, gloss=0.0))
    lights = [light((1.2, 0.9, 1.1))]
    seen = of_cells(linear_response(asset, lights))
    for viewer in (VIEWER, (0.3, 1.8, 0.4)):
        assert relative(of_cells(radiance_to(asset, lights, viewer)), seen) < 0.05


def test_lights_add_up_and_scale(asset: Asset) -> None:
    one, other = light((0.5, 0.6, 0.7), color=(2.0, 1.0, 0.5)), light((2.5, 1.5, 1.2))
    both = radiance_to(asset, [one, other], VIEWER)
    parts = radiance_to(asset, [one], VIEWER) + radiance_to(asset, [other], VIEWER)
    np.testing.assert_allclose(both, parts, atol=1e-5 * np.abs(both).max())
    np.testing.assert_allclose(
        radiance_to(asset, [replace(one, a0=2.0)], VIEWER), 4 * radiance_to(asset, [one], VIEWER), rtol=1e-3, atol=1e-5
    )
    assert not radiance_to(asset, [], VIEWER).any() and not linear_response(asset, []).any()
    assert relight(asset, [one, other], viewer=VIEWER).min() >= 0
    terms = 16 * asset.clusters * (asset.components + 1)
    assert projected_weights(asset, [one]).shape == (terms, 3)


@pytest.mark.parametrize("interpolation", ["fingerprint", "kernel"])
def test_the_asset_on_disk_is_the_asset(capture: Capture, tmp_path: Path, interpolation) -> None:
    asset = GlossyCloud(clusters=4, components=6, interpolation=interpolation).encode(capture)
    asset.save(tmp_path / "asset")
    lights = [light((1.0, 1.0, 1.0)), SphereLight((2.0, 1.0, 1.5), size=0.01)]
    again = Asset.open(tmp_path / "asset")
    np.testing.assert_array_equal(radiance_to(again, lights, VIEWER), radiance_to(asset, lights, VIEWER))
    np.testing.assert_array_equal(linear_response(again, lights), linear_response(asset, lights))


def test_viewers_move_with_the_asset(asset: Asset) -> None:
    shift = np.eye(4)
    shift[:3, 3] = (-5, 2, 1)
    moved = replace(asset, manifest={**asset.manifest, "asset_from_world": shift.tolist()})
    there = radiance_to(moved, [light((6.0, -1.0, 0.0))], (6.4, -0.9, -0.1))
    np.testing.assert_allclose(there, radiance_to(asset, [light((1.0, 1.0, 1.0))], (1.4, 1.1, 0.9)), rtol=1e-3, atol=1e-4)


def test_seen_from_above_is_seen_along_the_normals(asset: Asset) -> None:
    lights = [light((1.0, 1.0, 1.0))]
    weights = projected_weights(asset, lights)
    np.testing.assert_array_equal(GlossyCloud.toward(asset, weights, asset.images["normal"]), linear_response(asset, lights))


def test_it_is_chosen_where_the_capture_has_harmonics(capture: Capture) -> None:
    assert method_for(capture) == GlossyCloud()
    assert method_for(capture, None, {"clusters": 8}) == GlossyCloud(clusters=8)
    assert method_for(capture, "light-cloud", {}) == LightCloud()
    assert fit(capture, clusters=4, components=4).method == "glossy-cloud"


def test_a_combined_capture_has_no_walls(capture: Capture, tmp_path: Path) -> None:
    shutil.copytree(capture.folder, tmp_path / "combined")
    manifest = files.read_json(tmp_path / "combined" / "capture.json")
    files.write_json(tmp_path / "combined" / "capture.json", {**manifest, "transport": "combined"})
    combined = Capture.open(tmp_path / "combined")
    method = GlossyCloud(clusters=4, components=8)
    asset = method.encode(combined)
    assert asset.manifest["interpolation"]["kind"] == "kernel" and "cells" not in asset.tables
    caution = method.caution(combined)
    assert caution is not None and "through walls" in caution
    assert (
        relative(of_cells(linear_response(asset, [light((1.5, 1.0, 1.0))])), radiance_of(BOX, np.array([1.5, 1.0, 1.0]), BOX.normals)) < 0.4
    )
    with pytest.raises(InputError, match="expected a capture of indirect transport"):
        GlossyCloud(interpolation="fingerprint").encode(combined)


def test_what_is_wrong_is_said(asset: Asset, capture: Capture, tmp_path: Path) -> None:
    diffuse = room_of_points(tmp_path / "diffuse", BOX, 20)
    with pytest.raises(InputError, match="expected harmonics of the viewer's direction .*bake with `gloss=3`"):
        GlossyCloud().encode(diffuse)
    with pytest.raises(InputError, match="expected an asset of glossy surfaces for `viewer`, found a light-cloud one"):
        radiance_to(LightCloud(clusters=2, components=4).encode(diffuse), [], VIEWER)
    with pytest.raises(InputError, match="expected an asset that a shader relights, found a glossy-cloud one"):
        GlossyCloud.gl_passes()
    with pytest.raises(InputError, match="export it as exr"):
        GlossyCloud.shader_parts(asset)
    with pytest.raises(InputError, match="harmonics of one order"):
        viewer_errors(asset, diffuse)
    kernel = GlossyCloud(clusters=2, components=4, interpolation="kernel").encode(capture)
    with pytest.raises(InputError, match="expected point lights of inverse-square falloff"):
        linear_response(kernel, [SpotLight((1, 1, 1), falloff="inverse-square", direction=(0, 0, -1), inner=0.3, outer=0.5)])
    wrong: tuple[dict[str, Any], ...] = ({"components": 0}, {"clusters": 300}, {"nearest": 0})
    for settings in wrong:
        with pytest.raises(InputError):
            GlossyCloud(**settings)


def test_a_light_that_lacks_harmonics_is_refused(capture: Capture, tmp_path: Path) -> None:
    shutil.copytree(capture.folder, tmp_path / "broken")
    manifest = files.read_json(tmp_path / "broken" / "capture.json")
    del manifest["lights"][2]["harmonics"]
    files.write_json(tmp_path / "broken" / "capture.json", manifest)
    with pytest.raises(ManifestError, match="expected 16 images of harmonics of light 2"):
        Capture.open(tmp_path / "broken")
    assert capture.harmonics(0).shape == (16, capture.height, capture.width, 3)
    assert len(capture.of_harmonics().lights) == 16 * len(capture.lights)


def test_seams_are_closed(capture: Capture, tmp_path: Path) -> None:
    shutil.copytree(capture.folder, tmp_path / "seams")
    manifest = files.read_json(tmp_path / "seams" / "capture.json")
    write_image(tmp_path / "seams" / "seams.exr", np.array([[[0.1, 0.1, 0.4, 0.1, 0.5, 0.6, 0.8, 0.6]]], np.float32), "float")
    files.write_json(tmp_path / "seams" / "capture.json", {**manifest, "seams": "seams.exr"})
    asset = fit(Capture.open(tmp_path / "seams"), clusters=4, components=8, interpolation="kernel", method="glossy-cloud")
    assert 0 < asset.manifest["seams"]["after"] < asset.manifest["seams"]["before"]
