"""Every shader function against the numpy function that its header names, on a grid."""

from __future__ import annotations

import importlib
import inspect
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from twins import EPS, POINT, SPOT, SUM, TWINS, UNIT, Evaluate, K, M, N, point_light_expression, twin, units, vec4

from srbf.asset import Asset
from srbf.basis import octahedral_table
from srbf.basis.gaussian import lookup, r_table
from srbf.gl.includes import shader_root
from srbf.gl.uniforms import padded
from srbf.light_geometry import attenuation, light_vectors, spot_cone
from srbf.lights import DirectionalLight, PointLight
from srbf.methods import coefficient_maps as coefficient_maps
from srbf.methods import linear_response, projected_weights, relight
from srbf.methods.coefficient_maps import first_function
from srbf.methods.relighting_map import receiver_weights
from srbf.sphere import normalize, octahedral_encode
from srbf.visibility import shadow

for module in sorted(Path(__file__).parent.glob("*_twins.py")):  # which register theirs
    if module.stem != Path(__file__).stem:
        importlib.import_module(module.stem)

ROOT = shader_root()
FUNCTIONS = sorted(p.relative_to(ROOT).as_posix() for p in ROOT.rglob("*.glsl") if p.parent.name != "stages")
HEADER = re.compile(
    r"\A// SPDX-License-Identifier: MIT\n/\* (?P<names>srbf\w+(?:, srbf\w+)*): .+?"
    r"^   use:    (?P<use>.+?)^   domain: (?P<domain>.+?)^   twin:   (?P<twin>[\w.]+)\n   cite:   (?P<cite>.+?) \*/\n",
    re.DOTALL | re.MULTILINE,
)


@twin("basis/weight.glsl")
def _(evaluate: Evaluate, make_asset: Callable[..., Asset]) -> None:
    for spread in (0.12, 0.45, 1.0):
        table = r_table(spread)
        ends = np.geomspace(1e-7, 1e-2, 20)
        cosine = np.concatenate([np.linspace(-1.2, 1.2, 500), 1 - ends, ends - 1, [1, -1, 0]]).astype(np.float32)
        found = evaluate("basis/weight.glsl", "vec4(srbfWeight(rTable, a.x))", vec4(cosine), images={"rTable": table[None, :, None]})
        slope = np.abs(np.diff(table)).max() * (len(table) - 1) / 2  # steepest change with cosTheta
        np.testing.assert_allclose(found[:, 0], lookup(table, cosine), atol=UNIT + slope * EPS / 2)


@twin("lights/light_vector.glsl")
def _(evaluate: Evaluate, make_asset: Callable[..., Asset]) -> None:
    rng = np.random.default_rng(1)
    position = rng.uniform(2000, 2001, (N, 3))
    high = position.astype(np.float32)
    receiver = rng.uniform(2000, 2001, (N, 3)).astype(np.float32)
    expression = "vec4(srbfLightVector(a.xyz, b.xyz, c.xyz), 0.0)"
    found = evaluate("lights/light_vector.glsl", expression, vec4(high), vec4(position - high), vec4(receiver))[:, :3]
    np.testing.assert_allclose(found, np.subtract(position, receiver), rtol=EPS)


@twin("lights/light_direction.glsl")
def _(evaluate: Evaluate, make_asset: Callable[..., Asset]) -> None:
    vectors = np.random.default_rng(2).normal(size=(N, 3)) * np.geomspace(1e-6, 1e6, N)[:, None]
    vectors = vectors.astype(np.float32)
    expression = "vec4(srbfLightDirection(a.xyz), 0.0)"
    found = evaluate("lights/light_direction.glsl", expression, vec4(np.vstack([vectors, np.zeros(3)])))[:, :3]
    np.testing.assert_allclose(found[:-1], normalize(vectors), atol=UNIT)
    assert (found[-1] == 0).all()


@twin("lights/versine.glsl")
def _(evaluate: Evaluate, make_asset: Callable[..., Asset]) -> None:
    a, b = units(N, 3), units(N, 4)
    b[:40] = normalize(a[:40] + b[:40] * np.geomspace(1e-6, 1e-1, 40)[:, None])
    b[40] = -a[40]
    a[41] = 0
    expected = 1 - np.einsum("nc,nc->n", a.astype(float), b.astype(float))
    found = evaluate("lights/versine.glsl", "vec4(srbfVersine(a.xyz, b.xyz))", vec4(a), vec4(b))[:, 0]
    np.testing.assert_allclose(found, expected, atol=UNIT)
    lengths = (np.linalg.norm(a.astype(float), axis=1), np.linalg.norm(b.astype(float), axis=1))
    exact = (0.5 * ((a.astype(float) / np.maximum(lengths[0], 1e-9)[:, None] - b / lengths[1][:, None]) ** 2).sum(axis=1))[:40]
    chord = np.sqrt(2 * exact)
    np.testing.assert_array_less(np.abs(found[:40] - exact), UNIT * chord + UNIT**2)  # relative to the chord, not to 1


@twin("lights/attenuation.glsl")
def _(evaluate: Evaluate, make_asset: Callable[..., Asset]) -> None:
    distance = np.concatenate([[0], np.geomspace(1e-5, 1e4, N - 1)]).astype(np.float32)
    for i, falloff in enumerate(("linear", "inverse-square")):
        light = PointLight((0.0, 0.0, 0.0), a0=0.75, radius=0.125, falloff=falloff)  # type: ignore[arg-type]
        found = evaluate("lights/attenuation.glsl", f"vec4(srbfAttenuation(a.x, 0.75, 0.125, {i}))", vec4(distance))[:, 0]
        np.testing.assert_allclose(found, attenuation(distance.astype(float), light), rtol=UNIT)


@twin("lights/spot_cone.glsl")
def _(evaluate: Evaluate, make_asset: Callable[..., Asset]) -> None:
    versine = np.linspace(0, 2, 400).astype(np.float32)
    for inner, outer in ((0.25, 0.5), (0.0, 2.0), (0.0078125, 0.03125), (0.4, 0.4)):
        expression = f"vec4(srbfSpotCone(a.x, {inner!r}, {outer!r}))"
        found = evaluate("lights/spot_cone.glsl", expression, vec4(versine))[:, 0]
        expected = spot_cone(1 - versine.astype(float), 1 - inner, 1 - outer)
        np.testing.assert_allclose(found, expected, atol=UNIT * outer / max(outer - inner, 1e-2))
    assert (evaluate("lights/spot_cone.glsl", "vec4(srbfSpotCone(a.x, 3.0, 4.0))", vec4(versine)) == 1).all()


@twin("lights/point_light_strength.glsl")
def _(evaluate: Evaluate, make_asset: Callable[..., Asset]) -> None:
    asset = make_asset(K)
    positions = np.random.default_rng(6).uniform(-1, 1, (N, 3)).astype(np.float32)
    for light in (POINT, SPOT, replace(SPOT, falloff="linear", inner=0.0, outer=np.pi)):
        vectors = (np.array(light.position) - positions).astype(np.float32)
        expression = f"vec4(srbfPointLightStrength({point_light_expression(light)}, a.xyz))"
        found = evaluate("lights/point_light_strength.glsl", expression, vec4(vectors))[:, 0]
        _, expected = receiver_weights(asset, light, positions)
        strongest = attenuation(np.linalg.norm(vectors, axis=1), light)
        np.testing.assert_array_less(np.abs(found - expected), SUM * strongest)


@twin("combine/decode.glsl")
def _(evaluate: Evaluate, make_asset: Callable[..., Asset]) -> None:
    asset = make_asset(K, "uint8", 1, N)
    for i in range(K):
        stored, scale, bias = asset.stored[i, 0] / 255, asset.scale[i], asset.bias[i]
        rows = [vec4(np.broadcast_to(x, (N, 3))) for x in (stored, scale, bias)]
        found = evaluate("combine/decode.glsl", "vec4(srbfDecode(a.rgb, b.rgb, c.rgb), 0.0)", *rows)[:, :3]
        expected = asset.coefficients()[i, 0]
        np.testing.assert_allclose(found, expected, atol=UNIT * float((scale + np.abs(bias)).max()))


def _uploads(asset: Asset) -> dict[str, Any]:
    """Everything that the combining functions read, for one row of N receivers, decoded from floats that are stored / 255."""
    return {
        "images": {"maps": asset.stored.astype(np.float32) / 255, "rTable": asset.table[None, :, None]},
        "arrays": {"scale": padded(asset.scale), "bias": padded(asset.bias), "centers": padded(asset.basis.centers)},
        "defines": {"SRBF_K": asset.k},
        "declarations": "uniform vec4 scale[SRBF_K]; uniform vec4 bias[SRBF_K]; uniform vec4 centers[SRBF_K];",
    }


def _sizes(asset: Asset) -> np.ndarray:
    """|stored scale| + |bias| of every coefficient, (K, N, 3): what decoding may round."""
    bias = np.abs(asset.bias[:, None])
    return np.abs(asset.coefficients()[:, 0] - asset.bias[:, None]) + bias


def _directional(evaluate: Evaluate, asset: Asset, file: str, function: str) -> None:
    lights = [DirectionalLight((0.3, 0.5, 0.8), (1.0, 0.5, 0.2)), DirectionalLight((-0.3, 0.1, 0.4))]
    uploads = _uploads(asset)
    directions = np.array([light.direction for light in lights])
    weights = lookup(asset.table, asset.basis.centers @ directions.T) @ np.array([light.color for light in lights])
    uploads["arrays"]["weights"] = padded(weights)
    del uploads["arrays"]["centers"]
    uploads["declarations"] += " uniform vec4 weights[SRBF_K];"
    found = evaluate(file, f"vec4({function}(maps, uv, 0, weights, scale, bias), 0.0)", vec4(np.zeros(N)), **uploads)[:, :3]
    bound = np.einsum("kc,knc->nc", weights, _sizes(asset))
    np.testing.assert_array_less(np.abs(found - linear_response(asset, lights)[0]), SUM * bound)


@twin("combine/directional.glsl")
def _(evaluate: Evaluate, make_asset: Callable[..., Asset]) -> None:
    _directional(evaluate, make_asset(K, "uint8", 1, N), "combine/directional.glsl", "srbfCombineDirectional")


@twin("combine/point.glsl")
def _(evaluate: Evaluate, make_asset: Callable[..., Asset]) -> None:
    asset = make_asset(K, "uint8", 1, N)
    positions = asset.images["position"][0]
    directions = normalize(np.array(POINT.position) - positions)
    expression = "vec4(srbfCombinePoint(maps, uv, 0, rTable, a.xyz, centers, scale, bias), 0.0)"
    found = evaluate("combine/point.glsl", expression, vec4(directions), **_uploads(asset))[:, :3]
    weights, _ = receiver_weights(asset, POINT, positions)
    expected = np.einsum("knc,nk->nc", asset.coefficients()[:, 0], weights)
    np.testing.assert_array_less(np.abs(found - expected), SUM * np.einsum("knc,nk->nc", _sizes(asset), weights))


@twin("combine/finish.glsl")
def _(evaluate: Evaluate, make_asset: Callable[..., Asset]) -> None:
    """On an asset of one map whose R is read at its center, relight is the clamp and the ambient alone."""
    asset = make_asset(1, "float", 1, N, ambient=True)
    lights = [DirectionalLight(tuple(asset.basis.centers[0].tolist()))]
    rows = vec4(linear_response(asset, lights)[0]), vec4(asset.images["ambient"][0])
    found = evaluate("combine/finish.glsl", "vec4(srbfFinish(a.rgb, b.rgb), 0.0)", *rows)[:, :3]
    assert (found == relight(asset, lights)[0]).all()
    assert (linear_response(asset, lights) < 0).any()


@twin("combine/direct.glsl")
def _(evaluate: Evaluate, make_asset: Callable[..., Asset]) -> None:
    normal, light = units(N, 11), units(1, 12)[0]
    visibility = np.random.default_rng(13).random((N, 3)).astype(np.float32)
    expression = f"vec4(srbfDirect(a.xyz, vec3({', '.join(map(repr, map(float, light)))}), b.rgb), 0.0)"
    found = evaluate("combine/direct.glsl", expression, vec4(normal), vec4(visibility))[:, :3]
    np.testing.assert_allclose(found, shadow.direct(normal, light, visibility), atol=UNIT)
    assert (found == 0).any() and (found > 0).any()


@twin("shadow/shadow_place.glsl")
def _(evaluate: Evaluate, make_asset: Callable[..., Asset]) -> None:
    points = np.random.default_rng(14).uniform(-3, 3, (N, 3)).astype(np.float32)
    frame = shadow.SunFrame.around(points, normalize(np.array([0.3, -0.4, 0.8])))
    axes = [f"vec3({', '.join(map(repr, axis))})" for axis in (frame.across, frame.up, frame.to_light)]
    expression = f"vec4(srbfShadowPlace(a.xyz, {', '.join(axes)}, vec2{frame.low!r}, {frame.extent!r}), 0.0)"
    found = evaluate("shadow/shadow_place.glsl", expression, vec4(points))[:, :3]
    axes = [np.array(axis) for axis in (frame.across, frame.up, frame.to_light)]
    expected = shadow.place(points, *axes, np.array(frame.low), frame.extent)
    np.testing.assert_allclose(found, expected, atol=8 * UNIT)  # sums of three products of numbers up to 3
    assert (expected[:, :2] > 0).all() and (expected[:, :2] < 1).all()


@twin("shadow/shadow_fraction.glsl")
def _(evaluate: Evaluate, make_asset: Callable[..., Asset]) -> None:
    rng = np.random.default_rng(15)
    heights = rng.uniform(0, 1, (16, 16)).astype(np.float32)
    uv = ((rng.integers(0, 256, (N, 2)) + 0.5) / 256).astype(np.float32)  # sixteenths of a texel: exact in float32
    height, slope = rng.uniform(0, 1, N).astype(np.float32), rng.uniform(-0.1, 0.1, (N, 2)).astype(np.float32)
    found = evaluate(
        "shadow/shadow_fraction.glsl",
        "vec4(srbfShadowFraction(heights, a.xy, b.x, b.yz, 0.03125))",
        vec4(uv),
        vec4(height, slope),
        images={"heights": heights[:, :, None]},
    )[:, 0]
    np.testing.assert_allclose(found, shadow.fraction(heights, uv, height, slope, 0.03125), atol=UNIT)
    assert found.min() < 0.1 and found.max() > 0.9


@twin("shadow/transmittance.glsl")
def _(evaluate: Evaluate, make_asset: Callable[..., Asset]) -> None:
    curve = np.random.default_rng(16).uniform(0, 2, (8, 3)).astype(np.float32)
    cosine = np.linspace(-1, 1, N).astype(np.float32)
    found = evaluate(
        "shadow/transmittance.glsl",
        "vec4(srbfTransmittance(curve, a.x), 0.0)",
        vec4(cosine),
        declarations="uniform vec4 curve[8];",
        arrays={"curve": padded(curve)},
    )[:, :3]
    np.testing.assert_allclose(found, shadow.transmittance(np.broadcast_to(curve, (N, 8, 3)), cosine), atol=16 * UNIT)


@twin("methods/relighting_map.glsl")
def _(evaluate: Evaluate, make_asset: Callable[..., Asset]) -> None:
    asset, file = make_asset(K, "uint8", 1, N), "methods/relighting_map.glsl"
    _directional(evaluate, asset, file, "srbfRelightDirectional")
    positions = asset.images["position"][0]
    for light in (POINT, SPOT):
        expression = f"vec4(srbfRelightPoint(maps, uv, 0, rTable, centers, scale, bias, a.xyz, {point_light_expression(light)}), 0.0)"
        found = evaluate(file, expression, vec4(positions), **_uploads(asset))[:, :3]
        weights, _ = receiver_weights(asset, light, positions)
        strength = attenuation(np.linalg.norm(np.array(light.position) - positions, axis=1), light)
        bound = np.einsum("knc,nk->nc", _sizes(asset), weights * strength[:, None]) * light.color
        np.testing.assert_array_less(np.abs(found - linear_response(asset, [light])[0]), SUM * bound)


@twin("basis/octahedral_encode.glsl")
def _(evaluate: Evaluate) -> None:
    axes = np.concatenate([np.eye(3), -np.eye(3), [[1, 1, 0], [-1, 1, 0], [0, -1, -1], [1, 0, -1], [0, 0, 0]]])
    directions = np.concatenate([units(N, 20) * np.geomspace(1e-3, 1e3, N)[:, None], axes]).astype(np.float32)
    found = evaluate("basis/octahedral_encode.glsl", "vec4(srbfOctahedralEncode(a.xyz), 0.0, 0.0)", vec4(directions))[:, :2]
    np.testing.assert_allclose(found, np.stack(octahedral_encode(directions), axis=1), atol=UNIT)


@twin("basis/octahedral_lookup.glsl")
def _(evaluate: Evaluate) -> None:
    """Nodes of random numbers: a place that is off by one single-precision step moves the result by as much of their difference."""
    size, columns, count = 9, 3, 7
    atlas = np.random.default_rng(21).uniform(-1, 1, (3 * size, columns * size, 3)).astype(np.float16)
    directions = np.concatenate([units(N, 22), np.eye(3), -np.eye(3)]).astype(np.float32)
    index = np.arange(len(directions)) % count
    expression = f"vec4(srbfOctahedralLookup(wTable, {size}, int(b.x), srbfOctahedralEncode(a.xyz)), 0.0)"
    both = "basis/octahedral_encode.glsl", "basis/octahedral_lookup.glsl"
    found = evaluate(
        both[0],
        expression,
        vec4(directions),
        vec4(index),
        declarations=f'#include "{both[1]}"',
        images={"wTable": atlas.astype(np.float32)},
    )[:, :3]
    expected = octahedral_table.lookup(atlas, size, columns, index, directions)
    np.testing.assert_allclose(found, expected, atol=UNIT + 2 * EPS * size)


@twin("combine/decode_components.glsl")
def _(evaluate: Evaluate, make_planes: Callable[..., Asset]) -> None:
    asset = make_planes(6, None, "uint8", 1, M)
    for i in range(2):
        rows = [np.broadcast_to(x, (M, 4)) for x in (asset.stored[i, 0] / 255, asset.scale[i], asset.bias[i])]
        found = evaluate("combine/decode_components.glsl", "srbfDecodeComponents(a, b, c)", *rows)
        np.testing.assert_allclose(found, asset.coefficients()[i, 0], atol=UNIT * float((asset.scale[i] + np.abs(asset.bias[i])).max()))
    assert (found[:, 2:] == 0).all()  # past the last scalar


@twin("combine/cluster_index.glsl")
def _(evaluate: Evaluate, make_planes: Callable[..., Asset]) -> None:
    asset = make_planes(3, 256, "float", 1, 256)
    bytes_ = np.arange(256, dtype=np.uint8)
    asset.tables["cluster_index"] = bytes_[None]
    expression = "vec4(srbfClusterIndex(clusters, ivec2(a.x, 0)))"
    images = {"clusters": (bytes_ / np.float32(255))[None, :, None]}
    found = evaluate("combine/cluster_index.glsl", expression, vec4(bytes_), images=images)[:, 0]
    assert (found * (asset.components + 1) == first_function(asset, slice(None))[0]).all()


SUNS = [DirectionalLight((0.3, 0.5, 0.8), (1.0, 0.5, 0.2)), DirectionalLight((-0.3, 0.1, 0.4))]


def _plane_uploads(asset: Asset) -> dict[str, Any]:
    """Everything that the plane functions read, for one row of M receivers, decoded from floats that are stored / 255."""
    weights = projected_weights(asset, SUNS).reshape(asset.clusters, -1, 3)
    return {
        "images": {
            "planes": asset.stored.astype(np.float32) / 255,
            "weights": np.pad(weights, ((0, 0), (0, 0), (0, 1))),
            "wTable": asset.tables["w_table"].astype(np.float32),
            "clusters": asset.tables.get("cluster_index", np.zeros((1, M), np.uint8))[..., None] / np.float32(255),
        },
        "arrays": {"scale": asset.scale, "bias": asset.bias},
        "defines": {"SRBF_COMPONENTS": asset.components},
        "declarations": "uniform vec4 scale[SRBF_LAYERS]; uniform vec4 bias[SRBF_LAYERS];",
    }


def _equals_planes(evaluate: Evaluate, file: str, call: str, asset: Asset, light: PointLight | None, *rows: np.ndarray) -> None:
    """`call` against linear_response, within the contract's share of |w_0| + sum (|stored scale| + |bias|) |w_j|."""
    found = evaluate(file, f"vec4({call}, 0.0)", *rows, **_plane_uploads(asset))[:, :3]
    lights: list[Any] = SUNS if light is None else [light]
    bias = coefficient_maps.components_of(np.broadcast_to(np.abs(asset.bias[:, None, None]), asset.stored.shape), asset.components)[:, 0]
    planes = coefficient_maps.components_of(asset.coefficients(), asset.components)[:, 0]
    terms = np.concatenate([np.ones((1, M)), np.abs(planes) + 2 * bias])  # (S + 1, M)
    function = first_function(asset, slice(None))[0][:, None] + np.arange(len(terms))  # (M, S + 1)
    if light is None:
        weights = projected_weights(asset, lights)[function]
    else:
        positions = asset.images["position"][0]
        unit, _ = light_vectors(light, positions)
        strength = attenuation(np.linalg.norm(np.array(light.position) - positions, axis=1), light)  # without the cone
        size, columns = asset.manifest["w_table"]["size"], asset.manifest["w_table"]["columns"]
        places = np.broadcast_to(unit[:, None], (*function.shape, 3))
        weights = octahedral_table.lookup(asset.tables["w_table"], size, columns, function, places) * strength[:, None, None] * light.color
    bound = np.einsum("fn,nfc->nc", terms, np.abs(weights))
    assert (np.abs(found - linear_response(asset, lights)[0]) <= SUM * bound).all()
    assert (bound > 0).any()


@twin("combine/components_directional.glsl")
def _(evaluate: Evaluate, make_planes: Callable[..., Asset]) -> None:
    call = "srbfCombineComponentsDirectional(planes, uv, 0, weights, int(a.x), scale, bias)"
    asset = make_planes(K, 7, "uint8", 1, M)
    _equals_planes(evaluate, "combine/components_directional.glsl", call, asset, None, vec4(asset.tables["cluster_index"][0]))


@twin("combine/components_point.glsl")
def _(evaluate: Evaluate, make_planes: Callable[..., Asset]) -> None:
    asset = make_planes(K, 7, "uint8", 1, M)
    light = replace(POINT, color=(1.0, 1.0, 1.0))
    unit, strength = light_vectors(light, asset.images["position"][0])
    call = "b.x * srbfCombineComponentsPoint(planes, uv, 0, wTable, 17, int(a.w), a.xyz, scale, bias)"
    rows = vec4(unit, asset.tables["cluster_index"][0]), vec4(strength)
    _equals_planes(evaluate, "combine/components_point.glsl", call, asset, light, *rows)


@twin("methods/eigen_map.glsl")
def _(evaluate: Evaluate, make_planes: Callable[..., Asset]) -> None:
    asset, file = make_planes(K, None, "uint8", 1, M), "methods/eigen_map.glsl"
    positions = vec4(asset.images["position"][0])
    _equals_planes(evaluate, file, "srbfEigenMapDirectional(planes, uv, 0, weights, scale, bias)", asset, None, positions)
    for light in (POINT, SPOT):
        call = f"srbfEigenMapPoint(planes, uv, 0, wTable, 17, scale, bias, a.xyz, {point_light_expression(light)})"
        _equals_planes(evaluate, file, call, asset, light, positions)


@twin("methods/clustered_eigen_map.glsl")
def _(evaluate: Evaluate, make_planes: Callable[..., Asset]) -> None:
    """By texel, and by the place of a texel's center; what lies between is tested against numpy's filtered picture elsewhere."""
    asset, file = make_planes(K, 7, "uint8", 1, M), "methods/clustered_eigen_map.glsl"
    positions = vec4(asset.images["position"][0])
    for name, place in (("", "at"), ("Filtered", "uv")):
        call = f"srbfClusteredDirectional{name}(planes, clusters, {place}, 0, weights, scale, bias)"
        _equals_planes(evaluate, file, call, asset, None, positions)
        for light in (POINT, SPOT):
            point_light = f"scale, bias, a.xyz, {point_light_expression(light)}"
            call = f"srbfClusteredPoint{name}(planes, clusters, {place}, 0, wTable, 17, {point_light})"
            _equals_planes(evaluate, file, call, asset, light, positions)


@pytest.mark.parametrize("file", FUNCTIONS)
def test_the_shader_functions_equal_their_twins(file: str, request: pytest.FixtureRequest) -> None:
    """And the test calls each function that the file's header names."""
    assert file in TWINS, f"{file} has no twin test: register one here"
    test, run = TWINS[file], request.getfixturevalue("evaluate")
    ran: list[str] = []

    def evaluate(file: str, expression: str, *inputs: np.ndarray, **options: Any) -> np.ndarray:
        ran.append(expression + options.get("declarations", ""))
        return run(file, expression, *inputs, **options)

    test(*(evaluate if name == "evaluate" else request.getfixturevalue(name) for name in inspect.signature(test).parameters))
    header = HEADER.match((ROOT / file).read_text())
    assert header is not None
    assert [name for name in header["names"].split(", ") if not any(f"{name}(" in text for text in ran)] == []


def test_every_file_of_functions_has_a_twin_test_and_the_reverse() -> None:
    assert set(TWINS) == set(FUNCTIONS) and "basis/weight.glsl" in TWINS


@pytest.mark.parametrize("file", FUNCTIONS)
def test_the_header_names_its_function_and_an_importable_twin(file: str) -> None:
    text = (ROOT / file).read_text()
    header = HEADER.match(text)
    assert header is not None, f"{file}: expected a header with use, domain, twin, cite in this order"
    names = header["names"].split(", ")
    body = text[header.end() :]
    defined = re.findall(r"^(?:float|i?vec\d|int|void|mat\d|Srbf\w+)\s+(\w+)\(", body, re.MULTILINE)
    assert defined == names
    for name in names:
        assert f" {name}(" in header["use"]
    if not file.startswith("methods/"):
        snake = re.sub(r"(?<!^)(?=[A-Z])", "_", names[0].removeprefix("srbf")).lower()
        assert len(names) == 1
        assert snake in (file.split("/")[1].removesuffix(".glsl"), "combine_" + file.split("/")[1].removesuffix(".glsl"))
    assert callable(_import(header["twin"]))


def _import(dotted: str) -> Any:
    parts = dotted.split(".")
    for split in range(len(parts) - 1, 0, -1):
        try:
            found: Any = importlib.import_module(".".join(parts[:split]))
        except ModuleNotFoundError:
            continue
        for part in parts[split:]:
            found = getattr(found, part)
        return found
    raise AssertionError(f"no module of {dotted} imports")
