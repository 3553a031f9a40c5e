"""Eigen maps and clustered eigen maps on the GPU against numpy: every light, encoding and pass layout, and what may be filtered."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from srbf import methods
from srbf.asset import Asset
from srbf.basis.octahedral_table import lookup
from srbf.errors import InputError, ShaderError
from srbf.gl.context import Limits
from srbf.light_geometry import attenuation, light_vectors
from srbf.lights import DirectionalLight, EnvironmentLight, Light, PointLight, SpotLight, moved
from srbf.methods import linear_response, projected_weights
from srbf.methods.coefficient_maps import components_of, first_function
from srbf.relighting.relighter import Relighter

FLOAT = 1e-5  # the contract, of sum |a_j w_j| a texel (times color and attenuation)
HALF = 2 * 2.0**-10  # the contract: two steps of a half float
HALF_TINY = 2.0**-24  # spacing of subnormal halves: what no relative bound covers
FINAL = 2.0**-23  # one rounding each of the sum with ambient
# stored * scale + bias rounds three times, here and in numpy, whatever cancels: a bound by |a_j| alone would be one below rounding
DECODING = 2 * 3 * 2.0**-24

SCALARS = (1, 4, 9, 16)
CLUSTERS = (None, 1, 5, 256)
ENCODINGS = ("half", "float", "uint8")
SPOT = SpotLight((0.4, -0.3, 1.1), (0.5, 1.0, 2.0), a0=0.8, direction=(0.1, 0.2, -1.0), inner=0.3, outer=0.6)


def _environment() -> EnvironmentLight:
    image = np.random.default_rng(5).random((6, 12, 3)).astype(np.float32)
    return EnvironmentLight(image, (0.3, 0.2, 0.1))


LIGHTS: dict[str, list[Light]] = {
    "directional": [DirectionalLight((0.3, 0.5, 0.8), (1.0, 0.8, 0.3))],
    "hundred": [DirectionalLight((x, 0.2, 0.9), (0.01, 0.02, 0.03)) for x in np.linspace(-1, 1, 100).tolist()],
    "point": [PointLight((0.4, -0.2, 1.1), (1.0, 0.5, 2.0), a0=0.7)],
    "spot": [SPOT],
    "two lights": [SPOT, PointLight((0.4, -0.2, 1.1), (1.0, 0.5, 2.0), a0=0.7)],
    "several": [
        DirectionalLight((0.3, -0.5, 0.4), (0.2, 0.8, 0.3)),
        PointLight((-0.4, 0.6, -0.9), (1.0, 0.5, 2.0), falloff="inverse-square"),
        _environment(),
        SPOT,
        DirectionalLight((-0.9, 0.1, -0.2)),
    ],
}


def magnitude(asset: Asset, lights: Sequence[Light], of: np.ndarray | None = None) -> np.ndarray:
    """Sum over lights of color times attenuation times |w_0| + sum |a_j w_j|, (H, W, 3): what tolerances are relative to."""
    planes = np.abs(components_of(asset.coefficients(), asset.components)) if of is None else of
    terms = np.concatenate([np.ones_like(planes[:1]), planes])  # (S + 1, H, W)
    function = first_function(asset, slice(None))[..., None] + np.arange(len(terms))  # (H, W, S + 1)
    total = np.einsum("fhw,hwfc->hwc", terms, np.abs(projected_weights(asset, lights))[function])
    entry = asset.manifest["w_table"]
    for light in (moved(light, asset.asset_from_world) for light in lights):
        if isinstance(light, PointLight):
            positions = asset.images["position"]
            unit, _ = light_vectors(light, positions)
            directions = np.broadcast_to(unit[:, :, None], (*function.shape, 3))
            weights = np.abs(lookup(asset.tables["w_table"], entry["size"], entry["columns"], function, directions))
            strength = attenuation(np.linalg.norm(np.array(light.position) - positions, axis=-1), light)  # without the cone
            total += np.einsum("fhw,hwfc->hwc", terms, weights) * strength[..., None] * light.color
    return total


def tolerance(asset: Asset, lights: Sequence[Light], target: str = "float") -> np.ndarray:
    """The contract for one asset and set of lights, (H, W, 3)."""
    bound = magnitude(asset, lights)
    ambient = asset.images.get("ambient", 0)
    if target == "half":
        return HALF * (bound + ambient) + HALF_TINY
    allowed = FLOAT * bound + FINAL * ambient
    if asset.encoding == "uint8":
        bias = np.broadcast_to(asset.bias[:, None, None], asset.stored.shape)
        sizes = components_of(np.abs(asset.coefficients() - bias) + np.abs(bias), asset.components)
        allowed += DECODING * magnitude(asset, lights, sizes)
    return allowed


Get = Callable[[int, int | None, str, str], tuple[Asset, Relighter]]


@pytest.fixture(scope="module")
def relighter_of(context: Any, make_planes: Callable[..., Asset]) -> Iterator[Get]:
    made: dict[tuple[int, int | None, str, str], tuple[Asset, Relighter]] = {}

    def get(components: int, clusters: int | None, encoding: str, target: str) -> tuple[Asset, Relighter]:
        key = (components, clusters, encoding, target)
        if key not in made:
            asset = make_planes(components, clusters, encoding)
            made[key] = asset, Relighter(asset, target=target, context=context)  # type: ignore[arg-type]
        return made[key]

    yield get
    for _, relighter in made.values():
        relighter.close()


@pytest.mark.parametrize("kind", LIGHTS)
@pytest.mark.parametrize("encoding", ENCODINGS)
@pytest.mark.parametrize("clusters", CLUSTERS)
@pytest.mark.parametrize("components", SCALARS)
def test_equals_numpy(relighter_of: Get, components: int, clusters: int | None, encoding: str, kind: str) -> None:
    asset, relighter = relighter_of(components, clusters, encoding, "float")
    lights = LIGHTS[kind]
    expected = methods.relight(asset, lights)
    assert expected.max() > 0
    found = relighter.relight(lights)
    assert found.dtype == np.float32
    assert (np.abs(found - expected) <= tolerance(asset, lights)).all()


@pytest.mark.parametrize("far", [False, True], ids=["point_lights", "with-far"])
@pytest.mark.parametrize("count", [5, 19])
@pytest.mark.parametrize("clusters", [None, 5])
def test_many_point_lights_at_once_equal_numpy(relighter_of: Get, clusters: int | None, count: int, far: bool) -> None:
    asset, relighter = relighter_of(9, clusters, "half", "float")
    places = np.linspace(-1, 1, count).tolist()
    lights: list[Light] = [PointLight((x, -x, 0.9 + x), (0.1, 0.2, 0.15 + x / 9), a0=0.9) for x in places]
    lights[1] = SPOT
    lights += LIGHTS["hundred"] if far else []
    found = relighter.relight(lights)
    assert (np.abs(found - methods.relight(asset, lights)) <= tolerance(asset, lights)).all()
    assert (np.abs(relighter.relight(lights, multipass=True) - found) <= 2 * tolerance(asset, lights)).all()


@pytest.mark.parametrize("units", [1, 3])
@pytest.mark.parametrize("clusters", [None, 5])
def test_several_passes_give_the_same_image(relighter_of: Get, clusters: int | None, units: int) -> None:
    asset, relighter = relighter_of(16, clusters, "half", "float")
    lights = LIGHTS["several"]
    found = relighter.relight(lights, multipass=True, units=units)
    assert (np.abs(found - methods.relight(asset, lights)) <= tolerance(asset, lights)).all()


@pytest.mark.parametrize("kind", LIGHTS)
@pytest.mark.parametrize("clusters", [None, 5])
def test_half_target_is_within_two_half_steps(relighter_of: Get, clusters: int | None, kind: str) -> None:
    asset, relighter = relighter_of(9, clusters, "half", "half")
    lights = LIGHTS[kind]
    assert (np.abs(relighter.relight(lights) - methods.relight(asset, lights)) <= tolerance(asset, lights, "half")).all()


@pytest.mark.parametrize("clusters", [None, 5])
def test_more_layers_than_uniforms_hold_take_several_passes(
    context: Any, make_planes: Callable[..., Asset], monkeypatch: Any, clusters: int | None
) -> None:
    limits = replace(Limits.of(context), fragment_vectors=36)  # 4 to fill
    monkeypatch.setattr(Limits, "of", staticmethod(lambda _: limits))
    asset = make_planes(18, clusters, "uint8")
    with Relighter(asset, context=context) as relighter:
        lights = LIGHTS["several"]
        assert [relighter._passes.layers_per_pass(point_lights) for point_lights in (0, 1)] == [1, 1]
        assert (np.abs(relighter.relight(lights) - methods.relight(asset, lights)) <= tolerance(asset, lights)).all()


def test_three_hundred_components(context: Any, make_planes: Callable[..., Asset]) -> None:
    asset = make_planes(300, None, "half")
    with Relighter(asset, context=context) as relighter:
        for kind in ("several", "point"):
            assert (np.abs(relighter.relight(LIGHTS[kind]) - methods.relight(asset, LIGHTS[kind])) <= tolerance(asset, LIGHTS[kind])).all()


@pytest.mark.parametrize("clusters", [None, 5])
def test_direct_light_is_added_before_the_clamp_and_ambient_after(
    context: Any, make_planes: Callable[..., Asset], clusters: int | None
) -> None:
    asset, lights = make_planes(9, clusters, ambient=True), LIGHTS["several"]
    direct = np.random.default_rng(3).random((asset.height, asset.width, 3)).astype(np.float32)
    with Relighter(asset, context=context) as relighter:
        found = relighter.relight(lights, direct=direct)
        assert (relighter.relight([]) == asset.images["ambient"]).all()
    expected = methods.relight(asset, lights, direct)
    assert (np.abs(found - expected) <= tolerance(asset, lights) + FINAL * (direct + expected)).all()
    assert (expected > methods.relight(asset, lights)).any()


@pytest.mark.parametrize("clusters", [None, 256])
def test_every_texel_stays_in_its_row_and_column(context: Any, make_planes: Callable[..., Asset], clusters: int | None) -> None:
    asset = make_planes(9, clusters, height=6, width=11)
    size, wide = asset.manifest["w_table"]["size"], asset.manifest["w_table"]["columns"]
    for mean in range(0, asset.clusters * (asset.components + 1), asset.components + 1):  # which every texel would show
        asset.tables["light_coefficients"][mean] = 0
        top, left = mean // wide * size, mean % wide * size
        asset.tables["w_table"][top : top + size, left : left + size] = 0
    keep = asset.stored[:, 1, 8].copy()
    asset.stored[...] = 0
    asset.stored[:, 1, 8] = keep
    with Relighter(asset, context=context) as relighter:
        for kind in ("directional", "point"):
            both_signs = [[replace(light, color=(sign, sign, sign)) for light in LIGHTS[kind]] for sign in (1.0, -1.0)]
            lit = sum(relighter.relight(lights) for lights in both_signs)
            assert set(zip(*np.nonzero(lit.any(axis=2)), strict=True)) == {(1, 8)}


def test_a_moved_asset_carries_its_lights(context: Any, make_planes: Callable[..., Asset]) -> None:
    asset = make_planes(9, 5)
    turn = np.array([[0, -2, 0, 0.3], [2, 0, 0, -0.1], [0, 0, 2, 0.2], [0, 0, 0, 1]], float)
    asset.manifest["asset_from_world"] = turn.tolist()
    lights = LIGHTS["several"]
    with Relighter(asset, context=context) as relighter:
        assert (np.abs(relighter.relight(lights) - methods.relight(asset, lights)) <= tolerance(asset, lights)).all()


def test_a_receiver_in_the_point_light(context: Any, make_planes: Callable[..., Asset]) -> None:
    asset = make_planes(9, 5)
    point_light = PointLight(tuple(asset.images["position"][1, 8].astype(float)), a0=0.1)  # type: ignore[arg-type]
    with Relighter(asset, context=context) as relighter:
        assert (np.abs(relighter.relight([point_light]) - methods.relight(asset, [point_light])) <= tolerance(asset, [point_light])).all()


def test_point_lights_need_positions(context: Any, make_planes: Callable[..., Asset]) -> None:
    with Relighter(make_planes(position=False), context=context) as relighter:
        assert relighter.relight(LIGHTS["directional"]).max() > 0
        with pytest.raises(InputError, match="position map"):
            relighter.relight(LIGHTS["spot"])


@pytest.mark.parametrize(
    ("limit", "text"),
    [({"array_layers": 2}, "at most 2 layers .* found 3"), ({"texture_size": 60}, "at most 60 texels a side")],
)
def test_planes_too_many_for_the_gpu_are_refused(
    context: Any, make_planes: Callable[..., Asset], monkeypatch: Any, limit: dict[str, int], text: str
) -> None:
    limits = replace(Limits.of(context), **limit)
    monkeypatch.setattr(Limits, "of", staticmethod(lambda _: limits))
    with pytest.raises(ShaderError, match=text), Relighter(make_planes(9), context=context) as relighter:
        relighter.relight(LIGHTS["directional"])


def test_filtering_comes_after_reconstruction_where_clusters_meet(make_planes: Callable[..., Asset], evaluate: Callable[..., Any]) -> None:
    """The four-texel function is numpy's picture, filtered; scalars filtered first agree with it inside a cluster and nowhere else."""
    asset, lights = make_planes(9, 5, height=8, width=16, patches=True), LIGHTS["directional"]
    weights = projected_weights(asset, lights).reshape(asset.clusters, -1, 3)
    rng = np.random.default_rng(8)
    uv = (rng.integers(0, 256, (300, 2)) + 0.5) / 256  # exact in float32
    corners, shares = neighbors(uv, asset)
    components = components_of(asset.coefficients(), asset.components)
    expected = np.einsum("nk,nkc->nc", shares, linear_response(asset, lights)[corners[..., 0], corners[..., 1]])
    size = np.einsum("nk,nkc->nc", shares, magnitude(asset, lights)[corners[..., 0], corners[..., 1]])
    uploads = {
        "images": {
            "planes": asset.stored,
            "clusters": asset.tables["cluster_index"][..., None] / np.float32(255),
            "weights": np.pad(weights, ((0, 0), (0, 0), (0, 1))),
        },
        "arrays": {"scale": asset.scale, "bias": asset.bias},
        "declarations": "uniform vec4 scale[SRBF_LAYERS]; uniform vec4 bias[SRBF_LAYERS];",
        "defines": {"SRBF_COMPONENTS": asset.components},
    }
    call = "srbfClusteredDirectionalFiltered(planes, clusters, a.xy, 0, weights, scale, bias)"
    places = np.pad(uv, ((0, 0), (0, 2))).astype(np.float32)
    found = evaluate("methods/clustered_eigen_map.glsl", f"vec4({call}, 0.0)", places, **uploads)[:, :3]
    assert (np.abs(found - expected) <= FLOAT * size).all()

    mixed = np.einsum("nk,jnk->jn", shares, components[:, corners[..., 0], corners[..., 1]])
    texel = np.minimum((uv * [asset.width, asset.height]).astype(int), [asset.width - 1, asset.height - 1])
    own = asset.tables["cluster_index"][texel[:, 1], texel[:, 0]]
    filtered_first = weights[own, 0] + np.einsum("jn,njc->nc", mixed, weights[own, 1:])
    index = asset.tables["cluster_index"][corners[..., 0], corners[..., 1]]
    inside = (index == index[:, :1]).all(axis=1)
    assert 50 < inside.sum() < 250
    assert (np.abs(found - filtered_first)[inside] <= FLOAT * size[inside]).all()
    across = np.linalg.norm(found - filtered_first, axis=1)[~inside] / np.linalg.norm(found, axis=1)[~inside]
    assert np.median(across) > 0.1


def neighbors(uv: np.ndarray, asset: Asset) -> tuple[np.ndarray, np.ndarray]:
    """(row, column) of the four texels about places (u, v), (n, 4, 2), and their bilinear shares, (n, 4)."""
    place = uv * [asset.width, asset.height] - 0.5
    base = np.floor(place).astype(int)
    part = place - base
    steps = np.array([[0, 0], [1, 0], [0, 1], [1, 1]])
    texels = np.clip(base[:, None] + steps, 0, [asset.width - 1, asset.height - 1])
    shares = np.where(steps, part[:, None], 1 - part[:, None]).prod(axis=2)
    return texels[..., ::-1], shares
