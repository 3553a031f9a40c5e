"""Patch-to-patch transfer on rooms of surfels: exact with all coefficients, linear, on disk, flags that name it, its splats."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from made_rooms import Room, room_of_surfels

from srbf.asset import Asset
from srbf.capture import Capture
from srbf.errors import ImageError, InputError, ManifestError
from srbf.evaluation.errors_by_role import evaluate
from srbf.export import export
from srbf.fitting.options import check_settings, fit
from srbf.io import files
from srbf.lights import AreaLight, Light, NamedLight, PointLight
from srbf.methods import linear_response
from srbf.methods.kept_visibility import by_depths
from srbf.methods.transfer_paper import TransferPaper, light_on_surfels
from srbf.visibility import patch_transfer as patches
from srbf.visibility.cloud_lights import CloudLights
from srbf.visibility.embree import EmbreeTriangles
from srbf.visibility.received import ReceivedLight
from srbf.visibility.splats import splats_at
from srbf.visibility.surface_cells import Cells
from srbf.visibility.transfer_operator import TransferOperator

pytest.importorskip("embreex")
pytest.importorskip("sklearn")
pytestmark = pytest.mark.slow

BOX = Room.box((2, 2, 2), 0.4, 0.6)
SIZE = 12  # surfels per cluster, and more coefficients than any cluster has surfels:
ALL = 40
OF_HALVES = 2e-3
LIGHTS: list[Light] = [
    PointLight((0.7, 0.9, 1.1), (2.0, 1.0, 0.5), falloff="inverse-square"),
    AreaLight((1.2, 1.0, 1.9), u=(0.4, 0, 0), v=(0, -0.4, 0)),
]


@pytest.fixture(scope="module")
def capture(tmp_path_factory: pytest.TempPathFactory) -> Capture:
    return room_of_surfels(tmp_path_factory.mktemp("paper") / "capture", BOX, 180)


@pytest.fixture(scope="module")
def exact(capture: Capture) -> Asset:
    return TransferPaper(d2=ALL, cluster_size=SIZE, dropped="none").encode(capture)


@pytest.fixture(scope="module")
def asset(capture: Capture) -> Asset:
    return TransferPaper(d2=4, cluster_size=SIZE, visibility="pca:12").encode(capture)


def operator_of(asset: Asset, capture: Capture, received: np.ndarray) -> np.ndarray:
    """What the capture's form factors make of direct light on the asset's surfels."""
    operator = TransferOperator.read(capture.folder)
    places = {tuple(place): i for i, place in enumerate(operator.cells.places.tolist())}
    order = np.array([places[tuple(place)] for place in asset.tables["cells"][0, :, :3].tolist()])
    own = np.empty_like(received)
    own[order] = received
    exchange = patches.Exchange(operator.exchange, operator.cells)
    columns = [exchange.indirect(c, own[:, c : c + 1].astype(np.float32))[:, 0] for c in range(3)]
    return np.stack(columns, axis=1)[order]


def test_all_coefficients_are_the_operator(exact: Asset, capture: Capture) -> None:
    """Of any light on the surfels, not of examples alone: the bases are complete, and nothing is left out but digits of halves."""
    received = np.random.default_rng(1).uniform(size=(exact.tables["cells"].shape[1], 3))
    truth = operator_of(exact, capture, received)
    np.testing.assert_allclose(light_on_surfels(exact, received), truth, atol=OF_HALVES * truth.max())


def test_few_coefficients_are_close_and_held_out_lights_are_relit(asset: Asset, exact: Asset, capture: Capture) -> None:
    few, all_ = linear_response(asset, LIGHTS), linear_response(exact, LIGHTS)
    assert 1e-3 < np.linalg.norm(few - all_) / np.linalg.norm(all_) < 0.1
    error = evaluate(exact, capture)["holdout"]["relative_rmse"]  # the truth is of square cells, and of their centers
    assert error < 0.2 and evaluate(asset, capture)["holdout"]["relative_rmse"] < error + 0.05
    assert asset.bytes_per_texel()["directional"] == 12


def test_lights_add_up_and_scale_and_none_is_dark(asset: Asset) -> None:
    one, other = LIGHTS
    both = linear_response(asset, LIGHTS)
    apart = linear_response(asset, [one]) + linear_response(asset, [other])
    np.testing.assert_allclose(both, apart, atol=1e-5 * both.max())
    assert isinstance(one, PointLight)
    twice = linear_response(asset, [replace(one, a0=2.0)])
    np.testing.assert_allclose(twice, 4 * linear_response(asset, [one]), rtol=1e-4, atol=1e-5)
    assert not linear_response(asset, []).any()


def test_the_asset_on_disk_is_the_asset(asset: Asset, tmp_path: Path) -> None:
    asset.save(tmp_path / "asset")
    opened = Asset.open(tmp_path / "asset")
    np.testing.assert_array_equal(linear_response(opened, LIGHTS), linear_response(asset, LIGHTS))
    assert opened.at(np.arange(5)).width == 5
    few = np.array([3, 1, 20])
    np.testing.assert_array_equal(linear_response(opened.at(few), LIGHTS)[0], linear_response(asset, LIGHTS).reshape(-1, 3)[few])
    manifest = files.read_json(tmp_path / "asset" / "asset.json")
    manifest["direct_bases"]["clusters"][0] += 1
    files.write_json(tmp_path / "asset" / "asset.json", manifest)
    with pytest.raises(ManifestError, match="expected clusters of"):
        Asset.open(tmp_path / "asset")
    manifest["direct_bases"]["clusters"][0] -= 1
    manifest["direct_bases"]["coefficients"] += 1
    files.write_json(tmp_path / "asset" / "asset.json", manifest)
    with pytest.raises(ImageError, match=r"expected \d+x5 texels in .*direct_bases.exr"):
        Asset.open(tmp_path / "asset")


def test_radiance_has_the_albedo(asset: Asset) -> None:
    albedo = np.random.default_rng(2).uniform(size=(asset.height, asset.width, 3)).astype(np.float32)
    shown = replace(asset, manifest={**asset.manifest, "quantity": "radiance"}, images={**asset.images, "albedo": albedo})
    np.testing.assert_allclose(linear_response(shown, LIGHTS), linear_response(asset, LIGHTS) * albedo / np.pi, rtol=1e-5)
    texels = np.array([7, 2])
    np.testing.assert_allclose(linear_response(shown.at(texels), LIGHTS)[0], linear_response(shown, LIGHTS).reshape(-1, 3)[texels])


def test_depths_take_the_place_of_rays(asset: Asset) -> None:
    rays, depths = linear_response(asset, LIGHTS), linear_response(by_depths(asset), LIGHTS)
    assert 0 < np.linalg.norm(rays - depths) < 0.1 * np.linalg.norm(rays)


def test_entries_of_0_hold_the_share_that_was_asked_for(capture: Capture) -> None:
    operator, inside = TransferOperator.read(capture.folder), CloudLights.of(capture)
    clusters = np.sort(patches.surfel_clusters(operator.cells, SIZE))
    cells = operator.cells
    examples = patches.example_light(ReceivedLight(cells, inside.occluders), cells.areas, inside.free)
    found = patches.patch_transfer(patches.Exchange(operator.exchange, cells), cells, clusters, examples, 6)
    thin = patches.thinned(found, 0.1)
    lost = (found.strengths[:, None, None] ** 2 * (found.matrices - thin) ** 2).sum(axis=(0, 2))
    whole = (found.strengths[:, None, None] ** 2 * found.matrices**2).sum(axis=(0, 2))
    assert (lost <= 0.1**2 * whole * 1.001).all() and (lost > 0.05**2 * whole).mean() > 0.9
    assert 0.05 < (thin != 0).any(axis=2).mean() < 0.8


@pytest.mark.parametrize(("bounces", "error"), [(0, 0), (1, 1e-5), (2, 1e-5), (5, 0.01), (None, 0.02)])
def test_many_surfels_exchange_later_bounces_in_groups(
    capture: Capture, monkeypatch: pytest.MonkeyPatch, bounces: int | None, error: float
) -> None:
    operator = TransferOperator.read(capture.folder)
    direct = np.random.default_rng(3).uniform(size=(len(operator.cells.places), 2)).astype(np.float32)
    whole = patches.Exchange(operator.exchange, operator.cells, bounces).indirect(0, direct)
    monkeypatch.setattr(patches, "MOST_DENSE", 0)
    monkeypatch.setattr(patches, "GROUPS", 30)
    found = patches.Exchange(operator.exchange, operator.cells, bounces).indirect(0, direct)
    np.testing.assert_allclose(found, whole, rtol=error)


def walls_about(x: float) -> EmbreeTriangles:
    """Two walls, 2 cm apart."""
    sides = [[[at, -1, -0.01], [at, 2, -0.01], [at, 2, 1]] for at in (x - 0.01, x + 0.01)]
    others = [[[at, -1, -0.01], [at, 2, 1], [at, -1, 1]] for at in (x - 0.01, x + 0.01)]
    return EmbreeTriangles(np.array([*sides, *others], np.float32))


def test_splats_end_at_walls_and_far_from_surfels() -> None:
    """A floor of squares of 10 cm, a wall across it at x = 1."""
    x, y = (grid.ravel() for grid in np.meshgrid(np.arange(0.05, 2, 0.1), np.arange(0.05, 1, 0.1)))
    places = np.stack([x, y, 0 * x], axis=1).astype(np.float32)
    up = np.broadcast_to(np.array([0, 0, 1], np.float32), places.shape).copy()
    count = len(places)
    cells = Cells(places, up, np.full(count, 0.01, np.float32), np.ones((count, 3), np.float32), np.arange(count))
    wall = EmbreeTriangles(np.array([[[1, -1, -0.01], [1, 2, -0.01], [1, 2, 1]], [[1, -1, -0.01], [1, 2, 1], [1, -1, 1]]], np.float32))
    points = np.array([[0.99, 0.5, 0.0], [1.01, 0.5, 0.0], [0.5, 0.5, 0.0], [0.5, 0.5, 0.4], [0.5, 3.0, 0.0]])
    surfels, weights = splats_at(points, np.broadcast_to([0.0, 0.0, 1.0], points.shape), cells, wall, 4)
    np.testing.assert_allclose(weights.sum(axis=1), [1, 1, 1, 0, 0])
    assert (places[surfels[0], 0] < 1).all() and (places[surfels[1], 0] > 1).all()
    np.testing.assert_allclose(weights[2], 0.25)
    inside_wall = np.array([[1.0, 0.5, 0.0]])
    for is_seen in (False, True):
        hidden = splats_at(inside_wall, np.array([[0.0, 0.0, 1.0]]), cells, walls_about(1.0), 4, is_seen)[1]
        assert hidden.sum() == (1 if is_seen else 0)
    np.testing.assert_allclose(weights[2] @ places[surfels[2]], points[2], atol=1e-6)


@pytest.mark.parametrize(
    ("method", "settings", "chosen"),
    [
        (None, {"basis": "paper"}, "transfer-paper"),
        (None, {"d2": 5}, "transfer-paper"),
        ("transfer", {"basis": "paper", "d2": 5}, "transfer-paper"),
        ("transfer-paper", {}, "transfer-paper"),
        (None, {"basis": "gaussian"}, "relighting-map"),
        ("transfer", {"rank": 20}, "transfer"),
    ],
)
def test_flags_name_it(method: str | None, settings: dict, chosen: str) -> None:
    assert check_settings(method, settings) == chosen


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"d2": 0}, "expected 1 to 256 coefficients, found `d2=0`"),
        ({"d2": 4, "cluster_size": 0}, "expected `cluster_size` auto or 1 or more, found 0"),
        ({"d2": 4, "dropped": 1.5}, "expected `dropped` none or a share from 0 to below 1, found 1.5"),
        ({"basis": "gaussian", "d2": 4}, "expected a basis of paper for method transfer-paper, found 'gaussian'"),
        ({"basis": "paper", "rank": 4}, "`rank` applies only to method transfer, found it with method transfer-paper"),
    ],
)
def test_settings_out_of_range_are_refused(settings: dict, words: str) -> None:
    with pytest.raises(InputError, match=words):
        check_settings(None, settings)


def test_what_it_cannot_have_is_said(asset: Asset, capture: Capture, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="expected an asset that engines can read, found a transfer-paper one"):
        export(asset, "gltf", tmp_path / "exported")
    with pytest.raises(InputError, match="expected lights inside the scene for a transfer-paper asset, found a named one"):
        linear_response(asset, [NamedLight("Walls")])
    blind = replace(capture, manifest={key: told for key, told in capture.manifest.items() if key != "normal"})
    with pytest.raises(InputError, match="expected position and normal of the receivers"):
        fit(blind, basis="paper", d2=2)
