"""Gather samples: one triangle in closed form, plain rays, weights, linearity, order, the disk, a made room against one bounce."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from made_rooms import Room
from made_views import surfaces_of, view_of_room

from srbf.asset import Asset
from srbf.bake.gather_set import GatherSet
from srbf.capture import Capture
from srbf.errors import ImageError, InputError
from srbf.export import export
from srbf.fitting.options import fit
from srbf.io import files
from srbf.lights import AreaLight, Light, NamedLight, PointLight, SphereLight, SpotLight
from srbf.methods import linear_response
from srbf.methods.gather_samples import GatherSamples
from srbf.relighting.light_rig import LightRig
from srbf.solve.two_phase_kmeans import two_phase, two_phase_sets
from srbf.visibility.embree import EmbreeTriangles
from srbf.visibility.gathered_samples import RAYS, SAMPLES_FILE, STEPS, GatheredSamples, Hits, Samples, light_on_clusters

pytest.importorskip("embreex")

BOX = Room.box((3, 2, 2), 0.25, 0.6)
ENERGY, ONE_BOUNCE = 0.06, 0.15  # against cells of 25 cm, of a room of 3 m
OF_HALVES = 2e-3  # of the largest value: reflectance and normals are half floats
LIGHTS: list[Light] = [
    PointLight((1.2, 0.7, 1.1), (1, 0.5, 0.2), falloff="inverse-square"),
    SpotLight((2.0, 1.0, 1.5), falloff="inverse-square", direction=(0.2, 0, -1), inner=0.5, outer=0.8),
    SphereLight((0.6, 1.2, 0.8), (0.2, 1, 0.4), size=0.1),
    AreaLight((1.5, 1, 1.7), u=(0.6, 0, 0), v=(0, -0.3, 0)),
]


@pytest.fixture(scope="module")
def capture(tmp_path_factory: pytest.TempPathFactory) -> Capture:
    return view_of_room(tmp_path_factory.mktemp("samples") / "capture", BOX, 2000, 150, gather=60)


@pytest.fixture(scope="module")
def asset(capture: Capture) -> Asset:
    return GatherSamples().encode(capture)


def hits_of(rng: np.random.Generator, sets: int, rays: int) -> Hits:
    normals = rng.normal(size=(sets, rays, 3))
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    shares = np.where(rng.random((sets, rays)) < 0.9, 1 / rays, 0)
    points = rng.uniform(0, 3, (sets, rays, 3))
    return Hits(*(own.astype(np.float32) for own in (points, normals, rng.uniform(0, 1, (sets, rays, 3)), shares)))


def test_one_triangle_and_one_light_are_the_closed_form() -> None:
    """A sample of reflectance rho below a light at distance r: rho cos / r^2, and 0 behind a triangle that stands between."""
    places, box = np.array([[[0, 0, 0], [STEPS, 0, 0]]], np.uint16), np.array([[0.0, 0, 0], [2.0, 1, 1]])
    normals = np.broadcast_to(np.array([0, 0, 1], np.float16), (1, 2, 3)).copy()
    reflectance = np.array([[[0.5, 0.25, 0.125], [0.25, 0.25, 0.25]]], np.float16)
    light = PointLight((0.0, 0.0, 2.0), (1.0, 2.0, 4.0), falloff="inverse-square")
    aside = 0.25 * 2 / 8**1.5  # of a sample 2 m away, 2 m below: r^2 = 8, cos = 2 / sqrt 8
    expected = np.array([0.5 / 4 + aside, 2 * (0.25 / 4 + aside), 4 * (0.125 / 4 + aside)])
    found = light_on_clusters(places, box, normals, reflectance, EmbreeTriangles(np.zeros((0, 3, 3), np.float32)), [light])
    np.testing.assert_allclose(found[0], expected, rtol=1e-3)
    wall = EmbreeTriangles(np.array([[[-0.3, -0.3, 1], [0.3, -0.3, 1], [0, 0.4, 1]]], np.float32))
    found = light_on_clusters(places, box, normals, reflectance, wall, [light])
    np.testing.assert_allclose(found[0], aside * np.array([1, 2, 4]), rtol=1e-3)


def test_as_many_samples_as_rays_are_the_rays() -> None:
    hits = hits_of(np.random.default_rng(1), 3, 40)
    found = Samples.of_hits(hits, 40, 1.0)
    for one in range(3):
        real = hits.shares[one] > 0
        ours, theirs = (
            np.concatenate([points, normals, colors], axis=1)
            for points, normals, colors in (
                (found.points[one], found.normals[one], found.reflectance[one]),
                (hits.points[one, real], hits.normals[one, real], hits.albedo[one, real] * hits.shares[one, real, None]),
            )
        )
        ours = ours[found.reflectance[one].any(axis=1)]
        np.testing.assert_allclose(ours[np.lexsort(ours.T)], theirs[np.lexsort(theirs.T)], rtol=1e-5, atol=1e-6)


def test_samples_have_the_shares_of_all_rays_and_are_at_hits() -> None:
    hits = hits_of(np.random.default_rng(2), 4, 500)
    white = replace(hits, albedo=np.ones_like(hits.albedo))
    found = Samples.of_hits(white, 20, 1.0)
    np.testing.assert_allclose(found.reflectance.sum(axis=1), hits.shares.sum(axis=1)[:, None] * np.ones(3), rtol=1e-5)
    for one in range(4):
        known = hits.points[one, hits.shares[one] > 0]
        assert np.abs(found.points[one][:, None] - known).max(axis=2).min(axis=1).max() < 1e-6
    np.testing.assert_allclose(np.linalg.norm(found.normals, axis=2), 1, rtol=1e-5)


def test_the_order_of_rays_and_of_samples_changes_no_light() -> None:
    rng = np.random.default_rng(3)
    hits = hits_of(rng, 1, 30)
    order = rng.permutation(30)
    one, other = (
        Samples.of_hits(own, 30, 1.0)
        for own in (hits, Hits(hits.points[:, order], hits.normals[:, order], hits.albedo[:, order], hits.shares[:, order]))
    )
    box, free = np.array([[0.0, 0, 0], [3.0, 3, 3]]), EmbreeTriangles(np.zeros((0, 3, 3), np.float32))

    def light_of(samples: Samples, mixed: slice) -> np.ndarray:
        places = np.round(samples.points / 3 * STEPS).astype(np.uint16)[:, mixed]
        normals, reflectance = (own.astype(np.float16)[:, mixed] for own in (samples.normals, samples.reflectance))
        return light_on_clusters(places, box, normals, reflectance, free, [PointLight((1.0, 1.0, 4.0), falloff="inverse-square")])

    truth = light_of(one, slice(None))
    assert truth.min() > 0
    np.testing.assert_allclose(light_of(one, slice(None, None, -1)), truth, rtol=1e-6)
    np.testing.assert_allclose(light_of(other, slice(None)), truth, rtol=1e-6)


def test_two_phases_are_better_than_one_and_fill_every_cluster() -> None:
    rng = np.random.default_rng(4)
    points = rng.uniform(size=(3, 400, 6)).astype(np.float32)
    present = rng.random((3, 400)) < 0.95
    labels = two_phase_sets(points, present, 25)
    assert ((labels >= 0) == present).all()
    for one in range(3):
        assert set(np.unique(labels[one][present[one]])) == set(range(25))
        again = two_phase(points[one][present[one]].astype(np.float64), 25)
        assert len(np.unique(again)) == 25

        def spread(own: np.ndarray, chosen: np.ndarray) -> float:
            return float(sum(((chosen[own == k] - chosen[own == k].mean(axis=0)) ** 2).sum() for k in range(25)))

        known = points[one][present[one]]
        near = (((known[:, None] - known[:25]) ** 2).sum(axis=2)).argmin(axis=1)  # 25 points as centers
        assert spread(labels[one][present[one]], known) < 0.9 * spread(near, known)


def test_equal_points_are_one_cluster_and_few_points_each_their_own() -> None:
    points = np.zeros((2, 50, 6), np.float32)
    points[1, :25, 0] = 1
    present = np.ones((2, 50), bool)
    labels = two_phase_sets(points, present, 8)
    assert len(np.unique(labels[0])) == 1 and len(np.unique(labels[1])) == 2
    present[:, 5:] = False
    few = two_phase_sets(points, present, 8)
    assert (few[:, :5] == np.arange(5)).all() and (few[:, 5:] == -1).all()


@pytest.mark.lengthy
def test_a_capture_has_samples_whose_shares_are_the_albedo_of_a_closed_room(capture: Capture) -> None:
    """Of a room of two albedos all rays end on walls: the reflectance of a cluster is a mean of these."""
    found = GatheredSamples.read(capture.folder)
    assert found.places.shape == (150, 60, 3) and found.diffuse == 150 and found.gloss_nearest is None
    whole = found.reflectance.astype(np.float64).sum(axis=1)
    assert whole.min() >= BOX.albedo.min() - OF_HALVES and whole.max() <= BOX.albedo.max() + OF_HALVES
    np.testing.assert_allclose(found.weights.sum(axis=1)[: len(BOX.places)], 1, atol=2e-3)
    assert capture.manifest["gather"] == {"samples": SAMPLES_FILE, "bounces": 1} and capture.kind == "pool"


def test_lights_are_one_bounce_of_the_room(asset: Asset, capture: Capture) -> None:
    """Against form factors of square cells, F rho e: one reflection alone. Most of the error is that of cells of 25 cm."""
    covered = capture.coverage() > 0.5
    factors = BOX.factors()
    for place in BOX.free[-3:]:
        own = linear_response(asset, [PointLight(tuple(place.tolist()), falloff="inverse-square")])[covered]
        truth = factors @ (BOX.albedo * BOX.direct(place)[:, None]) * BOX.albedo / np.pi
        np.testing.assert_allclose(own.sum(axis=0) / truth.sum(axis=0), 1, atol=ENERGY)
        assert np.linalg.norm(own - truth) < ONE_BOUNCE * np.linalg.norm(truth)


def test_a_scene_without_bounces_has_no_indirect_light(asset: Asset) -> None:
    none = replace(asset, manifest={**asset.manifest, "gather": {**asset.manifest["gather"], "bounces": 0}})
    assert linear_response(asset, LIGHTS).max() > 0 and not linear_response(none, LIGHTS).any()


@pytest.mark.parametrize("light", LIGHTS, ids=lambda light: type(light).__name__)
def test_light_is_linear_in_color_and_adds_up_in_any_order(asset: Asset, light: Light) -> None:
    one = linear_response(asset, [light])
    assert one.max() > 0
    changed: Any = light
    r, g, b = changed.color
    twice = linear_response(asset, [replace(changed, color=(2 * r, 2 * g, 2 * b))])
    np.testing.assert_allclose(twice, 2 * one, rtol=1e-5, atol=1e-6 * one.max())
    forward, backward = linear_response(asset, LIGHTS), linear_response(asset, LIGHTS[::-1])
    np.testing.assert_allclose(forward, backward, rtol=1e-5, atol=1e-6 * forward.max())
    np.testing.assert_allclose(forward, sum(linear_response(asset, [own]) for own in LIGHTS), rtol=1e-4, atol=1e-5 * forward.max())


def test_blocks_of_clusters_make_no_difference(asset: Asset, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = linear_response(asset, LIGHTS[:1])
    monkeypatch.setattr("srbf.visibility.gathered_samples.AT_ONCE", 7 * 60)
    np.testing.assert_allclose(linear_response(asset, LIGHTS[:1]), whole, rtol=1e-6)


def test_a_rig_relights_it(asset: Asset) -> None:
    with LightRig(asset, "none") as rig:
        np.testing.assert_allclose(rig.picture(LIGHTS), linear_response(asset, LIGHTS), rtol=1e-4, atol=1e-6)
        assert rig.computed == len(LIGHTS) and not rig.picture([]).any()


def test_the_asset_on_disk_is_the_asset(asset: Asset, tmp_path: Path) -> None:
    asset.save(tmp_path / "asset")
    again = Asset.open(tmp_path / "asset")
    expected = linear_response(again, LIGHTS)
    np.testing.assert_array_equal(expected, linear_response(asset, LIGHTS))
    np.testing.assert_allclose(linear_response(again.at(np.array([3, 40])), LIGHTS)[0], expected.reshape(-1, 3)[[3, 40]], rtol=1e-6)
    manifest = files.read_json(tmp_path / "asset" / "asset.json")
    manifest["gather"]["samples"] += 1
    files.write_json(tmp_path / "asset" / "asset.json", manifest)
    with pytest.raises(ImageError, match="expected 61x150"):
        Asset.open(tmp_path / "asset")


def test_lobes_add_what_their_clusters_gather(asset: Asset, tmp_path: Path) -> None:
    """Rows after those of diffuse light, times the specular reflectance of the pixels that mix them."""
    rng = np.random.default_rng(6)
    neighbors = np.array(asset.stored[:4])
    neighbors[..., 0] %= 50
    neighbors[..., 2] = rng.integers(0, 2, neighbors.shape[:3]) * rng.integers(1, 256, neighbors.shape[:3])
    glossy = rng.uniform(0, 1, (asset.height, asset.width, 3)).astype(np.float32)
    tables = {name: np.concatenate([table, table[:50]]) for name, table in asset.tables.items()}
    tables["gloss_neighbors"] = neighbors.reshape(-1, asset.width, 3)
    manifest = {**asset.manifest, "gather": {**asset.manifest["gather"], "lobes": 50}, "gloss_neighbors": {"file": "gloss_neighbors.png"}}
    images = {**asset.images, "glossy": glossy, "lobe": np.full_like(glossy, 0.5)}
    shiny = replace(asset, manifest={**manifest, "glossy": "glossy.exr", "lobe": "lobe.exr"}, tables=tables, images=images)
    shiny.save(tmp_path / "shiny")
    read = Asset.open(tmp_path / "shiny")
    expected, plain = linear_response(read, LIGHTS), linear_response(asset, LIGHTS)
    half = replace(read, images={**read.images, "glossy": read.images["glossy"] / 2})
    assert (expected - plain).max() > 0
    np.testing.assert_allclose(linear_response(half, LIGHTS) - plain, (expected - plain) / 2, atol=1e-5 * expected.max())


def test_the_method_of_such_a_capture_needs_no_name(capture: Capture) -> None:
    asset = fit(capture, nearest=4)
    assert asset.method == "gather-samples" and len(asset.stored) == 4


def test_what_it_cannot_have_is_said(asset: Asset, capture: Capture, tmp_path: Path) -> None:
    links = view_of_room(tmp_path / "links", Room.box((1, 1, 1), 0.5), 100, 4, tested=0)
    assert fit(links).method == "deep-framebuffer"
    with pytest.raises(InputError, match="expected gather samples in .* found links"):
        fit(links, "gather-samples")
    for settings in ({"method": "deep-framebuffer"}, {"budget": 20}):
        with pytest.raises(InputError, match="expected links to a pool in .* found gather samples"):
            fit(capture, **settings)
    with pytest.raises(InputError, match="named"):
        linear_response(asset, [NamedLight("Bulb")])
    with pytest.raises(InputError, match="expected an asset that engines can read, found a gather-samples one"):
        export(asset, "gltf", tmp_path / "exported")
    for nearest in (0, 11):
        with pytest.raises(InputError, match="1 to 10"):
            GatherSamples(nearest=nearest)
    for count in (7, RAYS + 1):
        with pytest.raises(InputError, match="expected 8 to 2000 samples"):
            GatherSet(gather=count)
    with pytest.raises(InputError, match="expected `gather` without `pool`"):
        GatherSet.parse(500, None, None, 120)


def test_damaged_samples_are_refused(capture: Capture, tmp_path: Path) -> None:
    whole = (capture.folder / SAMPLES_FILE).read_bytes()
    (tmp_path / SAMPLES_FILE).write_bytes(whole)
    GatheredSamples.read(tmp_path)
    (tmp_path / SAMPLES_FILE).write_bytes(whole[:2000])
    with pytest.raises(ImageError, match="bake again"):
        GatheredSamples.read(tmp_path)


def test_a_bake_that_is_resumed_keeps_its_samples_and_another_count_has_others(tmp_path: Path) -> None:
    room = Room.box((1, 1, 1), 0.5)
    made = view_of_room(tmp_path / "own", room, 100, 4, longest=0.5, tested=0, gather=8)
    path, quiet = made.folder / SAMPLES_FILE, lambda done, total, what: None
    before = path.stat().st_mtime_ns
    GatherSet(100, 4, None, 8, surfaces_of(room, 0.5, 64)).trace(made, 7, quiet)
    assert path.stat().st_mtime_ns == before
    GatherSet(100, 4, None, 9, surfaces_of(room, 0.5, 64)).trace(made, 7, quiet)
    assert GatheredSamples.read(made.folder).places.shape[1] == 9
