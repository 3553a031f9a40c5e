"""three.js with WebGL2, in a browser: the pixels of every method under every kind of light are numpy's."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from made_assets import build_neural
from web_assets import ALBEDO, FOLLOWED, HALF_EXTENT, LIGHTS, complete, decoded, on_a_plane, tolerance

from srbf.asset import Asset
from srbf.export import Settings, export
from srbf.io.containers import read_texture_array
from srbf.methods import linear_response, relight

ENCODINGS = ("float", "half", "uint8")
METHODS = ("relighting-map", "eigen-map", "clustered-eigen-map", "neural-map")
MATERIALS = ("MeshStandardMaterial", "MeshLambertMaterial", "MeshBasicMaterial")


@pytest.fixture(scope="module")
def served(browser: Any, make_asset: Callable[..., Asset], make_planes: Callable[..., Asset]) -> dict[tuple[str, str], tuple[Asset, str]]:
    """(asset, URL) by method and encoding."""
    out = {}
    for encoding in ENCODINGS:
        for asset in (
            make_asset(k=7, encoding=encoding, ambient=True),
            make_planes(components=9, encoding=encoding, ambient=True),
            make_planes(components=5, clusters=7, encoding=encoding),
            build_neural(encoding=encoding),
        ):
            ready = complete(on_a_plane(asset))
            out[ready.method, encoding] = ready, browser.serve(ready)
    return out


@pytest.mark.parametrize("encoding", ENCODINGS)
@pytest.mark.parametrize("method", METHODS)
def test_the_lightmap_that_three_draws_is_numpys(browser: Any, served: dict, method: str, encoding: str) -> None:
    asset, url = served[method, encoding]
    kinds = list(LIGHTS) if encoding == "half" else ["several"]
    for target in ("float", "half") if encoding == "half" else ("float",):
        drawn = browser.lightmaps("three-lightmap", url, [LIGHTS[kind] for kind in kinds], target=target)
        for picture, kind in zip(drawn, kinds, strict=True):
            error = np.abs(picture - relight(asset, LIGHTS[kind]))
            assert (error <= tolerance(asset, LIGHTS[kind], target)).all(), (kind, target)


@pytest.mark.parametrize("source", ["maps", "lightmap"])
@pytest.mark.parametrize("method", METHODS)
def test_a_lambert_material_shows_albedo_times_irradiance_over_pi(browser: Any, served: dict, method: str, source: str) -> None:
    """Texel for texel, receivers from the vertex stage, the mesh's uv1 with v downwards."""
    asset, url = served[method, "half"]
    job = {
        "asset": url,
        "lights": LIGHTS["several"],
        "material": "MeshLambertMaterial",
        "color": ALBEDO,
        "half": HALF_EXTENT,
        "source": source,
    }
    if source == "maps" and method in ("clustered-eigen-map", "neural-map"):
        assert 'expected source "lightmap"' in browser.response("three-material", **job)["error"]
        return
    shown = browser.picture("three-material", **job)
    assert (np.abs(shown * np.pi / ALBEDO - relight(asset, LIGHTS["several"])) <= tolerance(asset, LIGHTS["several"])).all()
    if method != "relighting-map":
        return
    half = browser.picture("three-material", **job, target="half")
    assert (np.abs(half * np.pi / ALBEDO - relight(asset, LIGHTS["several"])) <= tolerance(asset, LIGHTS["several"], "half")).all()


@pytest.mark.parametrize("material", [*MATERIALS, "MeshPhysicalMaterial"])
def test_an_asset_adds_as_three_s_own_lightmap_does(browser: Any, served: dict, material: str) -> None:
    asset, url = served["relighting-map", "half"]
    job = {"asset": url, "lights": LIGHTS["several"], "material": material, "color": ALBEDO, "half": HALF_EXTENT, "source": "maps"}
    relit = np.concatenate([relight(asset, LIGHTS["several"]), np.ones((asset.height, asset.width, 1), np.float32)], axis=2)
    own = browser.picture("three-material", **job, reference=relit.ravel().tolist())
    assert own.max() > 0.1
    assert (np.abs(browser.picture("three-material", **job) - own) <= tolerance(asset, LIGHTS["several"])).all()


@pytest.mark.parametrize("material", MATERIALS)
def test_radiance_replaces_the_outgoing_light(browser: Any, make_asset: Callable[..., Asset], material: str) -> None:
    """A view: positions from the map, whatever the mesh is; uv with v upwards, as three's own geometries have it."""
    asset = complete(make_asset(k=5, encoding="half"), quantity="radiance", source={"receiver": {"kind": "view", "camera": "Camera"}})
    asset.images["coverage"][:] = 1
    asset.manifest["maps"] = complete(asset).manifest["maps"]
    job = {"asset": browser.serve(asset), "lights": LIGHTS["several"], "material": material, "color": ALBEDO, "half": HALF_EXTENT}
    expected = relight(asset, LIGHTS["several"])
    shown = browser.picture("three-material", **job, source="maps")
    assert (np.abs(shown - expected) <= tolerance(asset, LIGHTS["several"])).all()
    upside_down = browser.picture("three-material", **job, source="maps", apply={"uvOrigin": "bottom"})
    assert (np.abs(upside_down[::-1] - expected) <= tolerance(asset, LIGHTS["several"])).all()


@pytest.mark.parametrize("source", ["maps", "lightmap"])
def test_lights_may_come_and_go_and_nothing_is_left_behind(browser: Any, served: dict, source: str) -> None:
    """From frame to frame, any number of point lights; every texture and program is gone after dispose."""
    asset, url = served["eigen-map", "half"]
    job = {"material": "MeshLambertMaterial", "color": ALBEDO, "half": HALF_EXTENT, "source": source, "lights": LIGHTS["several"]}
    sets = [LIGHTS["point"], LIGHTS["several"], [], LIGHTS["directional"], LIGHTS["point"] + LIGHTS["spot"]]
    pictures = browser.lightmaps("three-material", url, sets, **job)
    for picture, lights in zip(pictures, sets, strict=True):
        assert (np.abs(picture * np.pi / ALBEDO - relight(asset, lights)) <= tolerance(asset, lights)).all(), lights
    again = browser.response("three-material", asset=url, lightSets=sets[:1], **job)
    once_more = browser.response("three-material", asset=url, lightSets=sets, **job)
    for name in ("textures", "programs"):
        assert once_more[name] == again[name], name


@pytest.mark.parametrize("kind", FOLLOWED)
def test_three_s_own_lights_are_followed(browser: Any, served: dict, kind: str) -> None:
    """In three's units and its y-up world; the light replaces three's own diffuse light of the same lights."""
    asset, url = served["relighting-map", "half"]
    followed, lights = FOLLOWED[kind]
    job = {"asset": url, "material": "MeshLambertMaterial", "color": ALBEDO, "half": HALF_EXTENT, "source": "maps", "follow": followed}
    shown = browser.picture("three-material", **job)
    assert (np.abs(shown * np.pi / ALBEDO - relight(asset, lights)) <= tolerance(asset, lights)).all()


def test_direct_light_stays_three_s_where_the_asset_has_none(browser: Any, served: dict) -> None:
    asset, url = served["relighting-map", "half"]
    followed, lights = FOLLOWED["directional"]
    job = {"asset": url, "material": "MeshLambertMaterial", "color": ALBEDO, "half": HALF_EXTENT, "source": "maps", "follow": followed}
    shown = browser.picture("three-material", **job, apply={"direct": "engine"})
    direct = np.array(lights[0].color) * lights[0].direction[2]  # N.L: the quad faces +z
    assert (np.abs(shown * np.pi / ALBEDO - relight(asset, lights) - direct) <= tolerance(asset, lights) + 1e-6).all()
    indirect = browser.serve(complete(asset, transport="indirect"))
    np.testing.assert_array_equal(browser.picture("three-material", **{**job, "asset": indirect}), shown)


def test_lights_are_moved_into_a_moved_asset(browser: Any, make_asset: Callable[..., Asset]) -> None:
    turn, scale = np.eye(4), 1.7
    turn[:3, :3] = scale * np.array([[0.6, -0.8, 0], [0.8, 0.6, 0], [0, 0, 1]]) @ np.array([[1, 0, 0], [0, 0.28, -0.96], [0, 0.96, 0.28]])
    turn[:3, 3] = 0.3, -0.2, 0.1
    asset = complete(make_asset(k=6, encoding="half"), asset_from_world=turn.tolist())
    drawn = browser.lightmaps("three-lightmap", browser.serve(asset), [LIGHTS["several"]])[0]
    assert (np.abs(drawn - relight(asset, LIGHTS["several"])) <= tolerance(asset, LIGHTS["several"])).all()


def test_linear_filtering_is_bilinear(browser: Any, served: dict) -> None:
    """Between texels the sum of filtered maps is the filtered sum; the hardware's fractions have 8 bits."""
    asset, url = served["relighting-map", "half"]
    bare = replace(asset, images={"position": asset.images["position"]})
    lights = LIGHTS["directional"]
    height, width = asset.height, asset.width
    job = {"asset": url, "lights": lights, "material": "MeshBasicMaterial", "color": (1, 1, 1), "half": HALF_EXTENT, "source": "maps"}
    shown = browser.picture("three-material", **job, filter="linear", size=[2 * width, 2 * height]) * np.pi
    signed = _doubled(linear_response(bare, lights))
    ambient = _doubled(asset.images["ambient"].astype(np.float32))
    bound = 2 / 256 * np.abs(asset.coefficients()).sum(axis=0).max()
    assert np.abs(shown - (np.maximum(signed, 0) + ambient)).max() < bound
    assert np.abs(shown - np.repeat(np.repeat(relight(asset, lights), 2, 0), 2, 1)).max() > 10 * bound


def test_a_mesh_far_away_shows_the_file_s_own_mip_level(browser: Any, make_asset: Callable[..., Asset]) -> None:
    """At two texels per pixel, level 1 of BC7 layers as the export filtered them."""
    asset = complete(on_a_plane(make_asset(k=4, encoding="half", height=16, width=24)))
    asset.images["coverage"][:] = 1
    url = browser.place(lambda folder: export(asset, "dds", folder, Settings(levels=2)))
    exported = Asset.open(browser.folder(url))
    smaller = read_texture_array(browser.folder(url) / "maps.dds").pixels(1)[..., :3]
    half = replace(exported, stored=smaller, manifest={**exported.manifest, "height": 8, "width": 12}, images={})
    job = {"asset": url, "lights": LIGHTS["directional"], "material": "MeshBasicMaterial", "color": (1, 1, 1), "half": HALF_EXTENT}
    shown = browser.picture("three-material", **job, source="maps", filter="linear", size=[12, 8]) * np.pi
    bound = 2 / 256 * np.abs(exported.coefficients()).sum(axis=0).max()  # the filter's fractions have 8 bits
    assert np.abs(shown - relight(half, LIGHTS["directional"])).max() < bound
    assert np.abs(shown - relight(exported, LIGHTS["directional"])[::2, ::2]).max() > 10 * bound


def test_a_gltf_export_loads_and_is_lit_by_the_asset_that_it_names(browser: Any, make_asset: Callable[..., Asset]) -> None:
    """Its mesh reaches from the first texel's center to the last one's, so the pixels at the edge are not all its own."""
    asset = complete(on_a_plane(make_asset(k=7, encoding="half")), source={"receiver": {"kind": "lightmap", "object": "Plate"}})
    asset.images["coverage"][:] = 1
    asset.images["normal"] = np.broadcast_to(np.float32([0, 0, 1]), asset.images["position"].shape).copy()
    asset.manifest["normal"] = "normal.exr"
    url = browser.place(lambda folder: export(asset, "gltf", folder, Settings(encoding="half")))
    response = browser.response("three-gltf", asset=url, lights=LIGHTS["several"], half=HALF_EXTENT)
    assert "error" not in response, response
    assert all(width for width in response["fallback"]), "a viewer that does not know the extension shows a picture"
    inner = (slice(1, -1), slice(1, -1))
    exported = Asset.open(browser.folder(url))
    error = np.abs(decoded(response) * np.pi - relight(exported, LIGHTS["several"]))
    assert (error <= tolerance(exported, LIGHTS["several"]))[inner].all()


@pytest.mark.parametrize(
    ("light", "message"),
    [
        (
            {"type": "HemisphereLight"},
            "expected a DirectionalLight, PointLight, SpotLight or RectAreaLight to follow, found HemisphereLight",
        ),
        ({"type": "PointLight", "decay": 1.5}, "expected a decay of 2"),
        ({"type": "PointLight", "distance": 3}, "expected a light of distance 0"),
    ],
)
def test_lights_that_no_asset_supports_are_refused(browser: Any, served: dict, light: dict, message: str) -> None:
    _, url = served["relighting-map", "half"]
    light = {"color": (1, 1, 1), "intensity": 1, "position": (0, 1, 0), **light}
    job = {"asset": url, "material": "MeshLambertMaterial", "color": ALBEDO, "half": HALF_EXTENT, "source": "maps", "follow": [light]}
    assert message in browser.response("three-material", **job)["error"]


def _doubled(image: np.ndarray) -> np.ndarray:
    """`image` at twice the size, bilinear, edges clamped."""

    def along(axis: int, pixels: np.ndarray) -> np.ndarray:
        n = pixels.shape[axis]
        place = (np.arange(2 * n) + 0.5) / 2 - 0.5
        low = np.floor(place).astype(int)
        part = (place - low).reshape([-1 if i == axis else 1 for i in range(3)])
        first, second = np.clip(low, 0, n - 1), np.clip(low + 1, 0, n - 1)
        return pixels.take(first, axis) * (1 - part) + pixels.take(second, axis) * part

    return along(1, along(0, image))


@pytest.mark.parametrize(("target", "form"), [("dds", "bc7"), ("ktx2", "bc1"), ("ktx2", "half")])
def test_texture_arrays_are_relit_as_they_are_read_by_numpy(
    browser: Any, make_asset: Callable[..., Asset], make_planes: Callable[..., Asset], target: str, form: str
) -> None:
    """The GPU's decoder of blocks against OpenImageIO's: BC7 is exact, BC1's mixed colors may round to another byte."""
    made = [make_asset(k=4, encoding="half", height=12, width=20)]
    if form == "bc7":
        made += [make_planes(components=5, clusters=7, encoding="half", height=12, width=20)]
    for asset in map(complete, made):
        url = browser.place(lambda folder, asset=asset: export(asset, target, folder, Settings(encoding=form)))
        exported = Asset.open(browser.folder(url))
        drawn = browser.lightmaps("three-lightmap", url, [LIGHTS["several"]])[0]
        error = np.abs(drawn - relight(exported, LIGHTS["several"]))
        step = replace(exported, stored=np.ones_like(exported.stored), bias=np.zeros_like(exported.bias))
        allowed = tolerance(exported, LIGHTS["several"]) + (relight(step, LIGHTS["several"]) if form == "bc1" else 0)
        assert (error <= allowed).all()
