"""Twins of the functions for many lights in one pass, projected weights, R by formula and environments."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from twins import EPS, POINT, SPOT, SUM, UNIT, Evaluate, K, M, N, twin, units, vec4

from srbf.asset import Asset
from srbf.basis import gaussian, octahedral_table
from srbf.gl.coefficient_maps import projected_rows
from srbf.gl.textures import pairs_of
from srbf.gl.uniforms import packed_point_lights, padded, point_light_uniforms
from srbf.light_geometry import attenuation, environment_samples, light_vectors
from srbf.lights import DirectionalLight, EnvironmentLight, Light, PointLight
from srbf.methods import coefficient_maps as coefficient_maps
from srbf.methods import linear_response, projected_weights
from srbf.methods.relighting_map import basis_weights
from srbf.sphere import octahedral_encode

SUNS: list[Light] = [DirectionalLight((0.3, 0.5, 0.8), (1.0, 0.5, 0.2)), DirectionalLight((-0.3, 0.1, 0.4))]
POINT_LIGHTS = [
    replace(POINT, position=(0.3, 0.2, -0.9)),
    SPOT,
    replace(SPOT, position=(0.0, 0.0, 50.0), inner=0.0, outer=1e-4),  # passes every receiver by
    replace(SPOT, falloff="linear", inner=0.2, outer=1.2),
]
PLACES = 8  # more than there are point lights
MANY = "pointLights, pointLightCount"
COUNT = {"pointLightCount": len(POINT_LIGHTS)}


@twin("basis/weight_formula.glsl")
def _(evaluate: Evaluate) -> None:
    ends = np.geomspace(1e-12, 1e-2, 60)
    versine = np.concatenate([np.linspace(-0.1, 2.1, 500), ends, 2 - ends, [0, 1, 2]]).astype(np.float32)
    for spread in (0.12, 0.45, 1.0):
        found = evaluate("basis/weight_formula.glsl", f"vec4(srbfWeightFormula(a.x, {0.5 / spread**2!r}))", vec4(versine))[:, 0]
        # theta^2 is off by a few of its roundings; x exp(-x) of x = theta^2 / (2 spread^2) is at most 1 / e
        np.testing.assert_allclose(found, gaussian.weight(1 - np.clip(versine.astype(float), 0, 2), spread), atol=4 * UNIT)
        near = np.abs(versine) < 1e-7
        assert near.sum() > 20 and (np.abs(found[near] - 1) <= 1.1e-7 / spread**2 + UNIT).all()


@twin("basis/weight_curve.glsl")
def _(evaluate: Evaluate) -> None:
    """As numpy has it, and as near to R as it says."""
    versine = np.concatenate([np.linspace(-0.1, 2.1, 500), np.geomspace(1e-12, 1e-2, 60), [0, 1, 2]]).astype(np.float32)
    for spread in (0.01, 0.05, 0.12, 0.3, 0.45, 0.6, 1.0):
        curve = gaussian.weight_curve(spread)
        *first, last = (f"{coefficient:.9e}" for coefficient in curve.coefficients)
        code = f"vec4(srbfWeightCurve(a.x, vec4({', '.join(first)}), {last}))"
        found = evaluate("basis/weight_curve.glsl", code, vec4(versine))[:, 0]
        np.testing.assert_allclose(found, curve.evaluate(versine), atol=16 * UNIT)
        exact = gaussian.weight(1 - np.clip(versine.astype(float), 0, 2), spread)
        assert np.abs(curve.evaluate(versine) - exact).max() <= 1.01 * curve.error + 1e-9
        assert curve.error < (1e-6 if spread < 0.4 else 5e-6 if spread < 0.5 else 1e-4 if spread < 0.7 else 5e-3)


@twin("basis/weight_pairs.glsl")
def _(evaluate: Evaluate) -> None:
    for spread in (0.12, 0.45, 1.0):
        table = gaussian.r_table(spread)
        ends = np.geomspace(1e-9, 1e-2, 40)
        versine = np.concatenate([np.linspace(0, 2, 500), ends, 2 - ends, [0, 1, 2, 2.0000002]]).astype(np.float32)
        pairs = {"pairs": pairs_of(table)[None]}
        found = evaluate("basis/weight_pairs.glsl", "vec4(srbfWeightPairs(pairs, a.x))", vec4(versine), images=pairs)[:, 0]
        slope = np.abs(np.diff(table)).max() * (len(table) - 1) / 2  # steepest change with the versine
        np.testing.assert_allclose(found, gaussian.lookup(table, 1 - versine.astype(float)), atol=UNIT + slope * EPS)


@twin("basis/octahedral_node.glsl")
def _(evaluate: Evaluate) -> None:
    """A table that holds its own coordinates reads them back."""
    size = 17
    ramp = np.zeros((size, size, 3), np.float32)
    ramp[..., 0], ramp[..., 1] = np.meshgrid(np.arange(size), np.arange(size))
    directions = np.concatenate([units(N, 30), np.eye(3), -np.eye(3)]).astype(np.float32)
    place = np.stack(octahedral_encode(directions), axis=1).astype(np.float32)
    node = evaluate("basis/octahedral_node.glsl", f"srbfOctahedralNode({size}, a.xy)", vec4(place[:, :1], place[:, 1:]))
    expected = octahedral_table.lookup(ramp, size, 1, np.zeros(len(place), int), directions)[:, :2]
    np.testing.assert_allclose(node[:, :2] + node[:, 2:], expected, atol=UNIT * size)
    assert (node[:, :2] == np.round(node[:, :2])).all() and node[:, :2].min() >= 0 and node[:, :2].max() == size - 2
    assert node[:, 2:].min() >= 0 and node[:, 2:].max() <= 1


@twin("basis/octahedral_mix.glsl")
def _(evaluate: Evaluate) -> None:
    size, columns, count = 9, 3, 7
    atlas = np.random.default_rng(31).uniform(-1, 1, (3 * size, columns * size, 3)).astype(np.float16)
    directions = units(N, 32)
    index = np.arange(N) % count
    x, y = ((t + 1) * (0.5 * (size - 1)) for t in octahedral_encode(directions))
    node = np.minimum(np.stack([x, y]).astype(int), size - 2)
    found = evaluate(
        "basis/octahedral_mix.glsl",
        f"vec4(srbfOctahedralMix(wTable, {size}, int(b.x), a), 0.0)",
        vec4(*node, x - node[0], y - node[1]),
        vec4(index),
        images={"wTable": atlas.astype(np.float32)},
    )[:, :3]
    np.testing.assert_allclose(found, octahedral_table.lookup(atlas, size, columns, index, directions), atol=2 * UNIT)


@twin("combine/center_weight.glsl")
def _(evaluate: Evaluate, make_asset: Callable[..., Asset]) -> None:
    asset = make_asset(25)
    directions = np.concatenate([units(N, 33), np.zeros((1, 3), np.float32)])  # the last receiver lies in the light
    exact = {"table": basis_weights(asset, directions.astype(float)), "formula": asset.basis.evaluate(directions.astype(float))}
    centers = padded(asset.basis.centers)
    centers[:, 3] = 0.5 / asset.basis.spread**2
    exact["pairs"] = exact["sampled"] = exact["table"]
    defines = {"table": {}, "formula": {"SRBF_FORMULA": 1}, "pairs": {"SRBF_PAIRS": 1}}
    defines["sampled"] = defines["pairs"] | {"SRBF_SAMPLED": 1}
    for by, expected in exact.items():
        for i in (0, 7, 24):
            found = evaluate(
                "combine/center_weight.glsl",
                "vec4(srbfCenterWeight(rTable, a.xyz, b))",
                vec4(directions),
                np.broadcast_to(centers[i], (N + 1, 4)),
                images={"rTable": pairs_of(asset.table)[None] if by in ("pairs", "sampled") else asset.table[None, :, None]},
                defines=defines[by],
            )[:, 0]
            np.testing.assert_allclose(found, expected[:, i], atol=SUM)
    assert np.abs(exact["table"] - exact["formula"]).max() > SUM  # so that a mix-up shows


@twin("lights/unpack_point_light.glsl")
def _(evaluate: Evaluate) -> None:
    for light in (POINT, SPOT, *POINT_LIGHTS):
        rows = packed_point_lights([light], 1)
        u = point_light_uniforms(light)
        at_one = light.a0 if light.falloff == "linear" else light.a0**2
        expected = {
            "vec4(light.position, light.radius)": (*u["position"], u["radius"]),
            "vec4(light.positionLow, float(light.falloff))": (*u["positionLow"], u["falloff"]),
            "vec4(light.color, light.a0)": (*(at_one * c for c in light.color), 1),
            "vec4(light.axis, 0.0)": (*u["axis"], 0),
            "vec4(light.versineInner, light.versineOuter, 0.0, 0.0)": (u["versineInner"], u["versineOuter"], 0, 0),
        }
        for members, numbers in expected.items():
            unpack = (
                "vec4 members(vec4 a, vec4 b, vec4 c, vec4 d) "
                f"{{ SrbfPointLight light = srbfUnpackPointLight(a, b, c, d); return {members}; }}"
            )
            inputs = [np.broadcast_to(row, (2, 4)) for row in rows]
            found = evaluate("lights/unpack_point_light.glsl", "members(a, b, c, d)", *inputs, declarations=unpack)[0]
            np.testing.assert_allclose(found, np.float32(numbers), rtol=EPS)


@twin("lights/point_lights_at.glsl")
def _(evaluate: Evaluate) -> None:
    positions = np.random.default_rng(34).uniform(-1, 1, (N, 3)).astype(np.float32)
    pick = """
        uniform vec4 pointLights[4 * SRBF_POINT_LIGHTS];
        uniform int pointLightCount;
        vec4 pick(vec3 receiver, int j, int what) {
            vec4 directions[SRBF_POINT_LIGHTS];
            vec4 colors[SRBF_POINT_LIGHTS];
            int shining = srbfPointLightsAt(pointLights, pointLightCount, receiver, directions, colors);
            return what == 0 ? vec4(float(shining)) : (what == 1 ? directions[j] : colors[j]);
        }"""

    def run(j: int, what: int, count: int) -> np.ndarray:
        return evaluate(
            "lights/point_lights_at.glsl",
            f"pick(a.xyz, {j}, {what})",
            vec4(positions),
            declarations=pick,
            arrays={"pointLights": packed_point_lights(POINT_LIGHTS, PLACES)},
            uniforms={"pointLightCount": count},
            defines={"SRBF_POINT_LIGHTS": PLACES},
        )

    vectors = [light_vectors(light, positions) for light in POINT_LIGHTS]
    strengths = np.stack([strength for _, strength in vectors])  # (lights, N)
    shines = strengths > 0
    edge = (shines & (strengths < 1e-5)).any(axis=0)  # a cone's edge: single precision may say otherwise
    assert edge.sum() < N / 10 and len({*shines.sum(axis=0)}) > 1
    assert (run(0, 0, len(POINT_LIGHTS))[~edge, 0] == shines.sum(axis=0)[~edge]).all()
    assert (run(0, 0, 0) == 0).all() and (run(0, 0, 1)[:, 0] == 1).all()
    for j in range(len(POINT_LIGHTS)):
        which = np.argsort(~shines, axis=0, kind="stable")[j]  # the j-th that shines on each receiver
        lit = (shines.sum(axis=0) > j) & ~edge
        unit = np.stack([unit for unit, _ in vectors])[which, np.arange(N)]
        color = np.array([light.color for light in POINT_LIGHTS])[which] * strengths[which, np.arange(N)][:, None]
        np.testing.assert_allclose(run(j, 1, len(POINT_LIGHTS))[lit, :3], unit[lit], atol=2 * UNIT)
        np.testing.assert_allclose(run(j, 2, len(POINT_LIGHTS))[lit, :3], color[lit], rtol=1e-5, atol=1e-5)
        assert (run(j, 1, len(POINT_LIGHTS))[(shines.sum(axis=0) <= j) & ~edge] == 0).all()


def _far_and_point_lights(asset: Asset) -> tuple[dict[str, Any], np.ndarray]:
    """What the functions of relighting maps read, for one row of N receivers, and the bound on sums over SUNS and POINT_LIGHTS."""
    weights = projected_weights(asset, SUNS)
    positions = asset.images["position"][0]
    bias = np.abs(asset.bias[:, None])
    sizes = np.abs(asset.coefficients()[:, 0] - asset.bias[:, None]) + bias  # what decoding may round
    bound = np.einsum("knc,kc->nc", sizes, weights)
    for light in POINT_LIGHTS:
        unit, _ = light_vectors(light, positions)
        strength = attenuation(np.linalg.norm(np.array(light.position) - positions, axis=1), light)  # without the cone
        bound += np.einsum("knc,nk->nc", sizes, basis_weights(asset, unit) * strength[:, None]) * light.color
    arrays = {"scale": padded(asset.scale), "bias": padded(asset.bias), "centers": padded(asset.basis.centers)}
    declared = [f"uniform vec4 {name}[SRBF_K];" for name in ("weights", *arrays)]
    return {
        "images": {"maps": asset.stored.astype(np.float32) / 255, "rTable": asset.table[None, :, None]},
        "arrays": arrays | {"weights": padded(weights), "pointLights": packed_point_lights(POINT_LIGHTS, PLACES)},
        "defines": {"SRBF_K": asset.k, "SRBF_POINT_LIGHTS": PLACES},
        "declarations": " ".join([*declared, "uniform vec4 pointLights[4 * SRBF_POINT_LIGHTS]; uniform int pointLightCount;"]),
        "uniforms": COUNT,
    }, SUM * bound


LIT = """
    vec3 lit(vec3 receiver, vec2 uv, int cluster) {
        vec4 directions[SRBF_POINT_LIGHTS];
        vec4 colors[SRBF_POINT_LIGHTS];
        int shining = srbfPointLightsAt(%s, receiver, directions, colors);
        return %s;
    }"""


@twin("combine/point_lights.glsl")
def _(evaluate: Evaluate, make_asset: Callable[..., Asset]) -> None:
    asset = make_asset(K, "uint8", 1, N)
    uploads, bound = _far_and_point_lights(asset)
    call = "srbfCombinePointLights(maps, uv, 0.0, 0, weights, rTable, centers, scale, bias, directions, colors, shining)"
    uploads["declarations"] = '#include "lights/point_lights_at.glsl"\n' + uploads["declarations"] + LIT % (MANY, call)
    found = evaluate("combine/point_lights.glsl", "vec4(lit(a.xyz, uv, 0), 0.0)", vec4(asset.images["position"][0]), **uploads)[:, :3]
    np.testing.assert_array_less(np.abs(found - linear_response(asset, [*SUNS, *POINT_LIGHTS])[0]), bound)


@twin("methods/relighting_map_lights.glsl")
def _(evaluate: Evaluate, make_asset: Callable[..., Asset]) -> None:
    asset = make_asset(K, "uint8", 1, N)
    uploads, bound = _far_and_point_lights(asset)
    call = f"srbfRelightLights(maps, uv, 0.0, 0, weights, rTable, centers, scale, bias, a.xyz, {MANY})"
    found = evaluate("methods/relighting_map_lights.glsl", f"vec4({call}, 0.0)", vec4(asset.images["position"][0]), **uploads)[:, :3]
    np.testing.assert_array_less(np.abs(found - linear_response(asset, [*SUNS, *POINT_LIGHTS])[0]), bound)


@twin("combine/projected.glsl")
def _(evaluate: Evaluate, make_asset: Callable[..., Asset]) -> None:
    asset = make_asset(K, "uint8", 1, N)
    weights = projected_weights(asset, SUNS)
    offset = ", ".join(map(repr, (weights * asset.bias).sum(axis=0).tolist()))
    found = evaluate(
        "combine/projected.glsl",
        f"vec4(srbfCombineProjected(maps, uv, 0.0, 0, weights, vec3({offset})), 0.0)",
        vec4(np.zeros(N)),
        images={"maps": asset.stored.astype(np.float32) / 255},
        arrays={"weights": padded(weights * asset.scale)},
        defines={"SRBF_K": K},
        declarations="uniform vec4 weights[SRBF_K];",
    )[:, :3]
    sizes = np.abs(asset.coefficients()[:, 0] - asset.bias[:, None]) + np.abs(asset.bias[:, None])
    np.testing.assert_array_less(np.abs(found - linear_response(asset, SUNS)[0]), SUM * np.einsum("knc,kc->nc", sizes, weights))


@twin("combine/weighted.glsl")
def _(evaluate: Evaluate, make_asset: Callable[..., Asset]) -> None:
    asset = make_asset(K, "uint8", 1, N)
    weights = projected_weights(asset, SUNS)
    found = evaluate(
        "combine/weighted.glsl",
        "vec4(srbfCombineWeighted(maps, uv, 0.0, 0, weights, scale, bias), 0.0)",
        vec4(np.zeros(N)),
        images={"maps": asset.stored.astype(np.float32) / 255, "weights": np.pad(weights, ((0, 0), (0, 1)))[None]},
        arrays={"scale": padded(asset.scale), "bias": padded(asset.bias)},
        defines={"SRBF_K": K},
        declarations="uniform vec4 scale[SRBF_K]; uniform vec4 bias[SRBF_K];",
    )[:, :3]
    sizes = np.abs(asset.coefficients()[:, 0] - asset.bias[:, None]) + np.abs(asset.bias[:, None])
    np.testing.assert_array_less(np.abs(found - linear_response(asset, SUNS)[0]), SUM * np.einsum("knc,kc->nc", sizes, weights))


ENVIRONMENT = EnvironmentLight(np.random.default_rng(39).random((7, 12, 3)).astype(np.float32))  # its middle row straddles the horizon


@twin("lights/sine_cosine.glsl")
def _(evaluate: Evaluate) -> None:
    """Every part of turns of few, odd and many steps, and some turns more; whole right angles exactly."""
    for whole in (1, 2, 3, 7, 256, 4095):
        part = np.unique(np.linspace(-9 * whole, 9 * whole, 997).astype(int))
        found = evaluate("lights/sine_cosine.glsl", f"vec4(srbfSineCosine(int(a.x), {whole}), 0.0, 0.0)", vec4(part))
        angle = part / whole * (np.pi / 2)
        np.testing.assert_allclose(found[:, :2], np.stack([np.sin(angle), np.cos(angle)], axis=1), atol=3e-7)
        right = part % whole == 0
        np.testing.assert_array_equal(found[right, :2], np.round(np.stack([np.sin(angle), np.cos(angle)], axis=1))[right])


@twin("lights/environment_texel.glsl")
def _(evaluate: Evaluate) -> None:
    rows, columns = np.mgrid[:7, :12]
    texels = vec4(columns.ravel(), rows.ravel())
    for cut in (False, True):
        expression = f"srbfEnvironmentTexel(ivec2(a.xy), ivec2(12, 7), {str(cut).lower()})"
        found = evaluate("lights/environment_texel.glsl", expression, texels)
        directions, solid_angle = environment_samples(ENVIRONMENT.image, "hemisphere" if cut else "sphere", np.eye(3))
        np.testing.assert_allclose(found[:, :3], directions.reshape(-1, 3), atol=UNIT)
        np.testing.assert_allclose(found[:, 3], solid_angle.ravel(), atol=UNIT)
        np.testing.assert_allclose(found[:, 3].sum(), 2 * np.pi * (2 - cut), rtol=UNIT * 10)


@twin("combine/environment_row.glsl")
def _(evaluate: Evaluate, make_asset: Callable[..., Asset]) -> None:
    turns = [np.eye(3), np.array([[0, 0, 1.0], [1, 0, 0], [0, 1, 0]]), np.array([[0, -1.0, 0], [1, 0, 0], [0, 0, 1]])]
    asset = make_asset(K)
    rows = np.arange(7)
    for domain in ("sphere", "hemisphere"):
        for turn in turns:
            asset.manifest["domain"] = domain
            asset.manifest["asset_from_world"] = [[*row, 0.0] for row in turn.tolist()] + [[0, 0, 0, 1.0]]
            kind = 0 if domain == "sphere" else 1 if turn[2, 2] == 1 else 2
            for i in range(K):
                center = ", ".join(map(repr, asset.basis.centers[i].tolist()))
                row = f"environment, int(a.x), rTable, vec4({center}, 0.0), assetFromMap, {kind}"
                found = evaluate(
                    "combine/environment_row.glsl",
                    f"vec4(srbfCombineEnvironmentRow({row}), 0.0)",
                    vec4(rows),
                    images={"environment": ENVIRONMENT.image, "rTable": asset.table[None, :, None]},
                    arrays={"assetFromMap": padded(turn)},
                    declarations="uniform vec4 assetFromMap[3];",
                )[:, :3]
                expected = projected_weights(asset, [ENVIRONMENT])[i]
                np.testing.assert_allclose(found.sum(axis=0), expected, atol=SUM * (expected.max() + 1))


@twin("combine/environment_function.glsl")
def _(evaluate: Evaluate, make_planes: Callable[..., Asset]) -> None:
    asset = make_planes(K, 3)
    functions = asset.light_functions
    spreads, which = np.unique(functions.spreads, return_inverse=True)
    assert len(spreads) == 2
    directions, solid_angle = environment_samples(ENVIRONMENT.image, "sphere", np.eye(3))
    light = (ENVIRONMENT.image * solid_angle[..., None]).reshape(-1, 3)
    cosines = functions.centers @ directions.reshape(-1, 3).T
    gaussians = np.concatenate([gaussian.weight(cosines, float(spread)) @ light for spread in spreads])
    rows = np.concatenate([functions.coefficients, np.broadcast_to(which[:, None, None], (*functions.coefficients.shape[:2], 1))], axis=2)
    found = evaluate(
        "combine/environment_function.glsl",
        "vec4(srbfCombineEnvironmentFunction(gaussians, coefficients, int(a.x)), 0.0)",
        vec4(np.arange(len(rows))),
        images={"gaussians": np.pad(gaussians, ((0, 0), (0, 1)))[None], "coefficients": rows},
    )[:, :3]
    sizes = np.abs(functions.coefficients).sum(axis=1) * gaussians.max()
    assert (np.abs(found - projected_weights(asset, [ENVIRONMENT])) <= SUM * sizes).all()


def _planes(asset: Asset, point_lights: list[PointLight]) -> tuple[dict[str, Any], np.ndarray]:
    """What the functions of planes read, for one row of M receivers, and the bound on sums over SUNS and `point_lights`."""
    weights = projected_weights(asset, SUNS)
    bias = coefficient_maps.components_of(np.broadcast_to(np.abs(asset.bias[:, None, None]), asset.stored.shape), asset.components)[:, 0]
    planes = np.abs(coefficient_maps.components_of(asset.coefficients(), asset.components)[:, 0]) + 2 * bias
    terms = np.concatenate([np.ones((1, M)), planes])  # (S + 1, M)
    function = coefficient_maps.first_function(asset, slice(None))[0][:, None] + np.arange(len(terms))  # (M, S + 1)
    bound = np.einsum("fn,nfc->nc", terms, np.abs(weights[function]))
    positions = asset.images["position"][0]
    for light in point_lights:
        unit, _ = light_vectors(light, positions)
        strength = attenuation(np.linalg.norm(np.array(light.position) - positions, axis=1), light)  # without the cone
        places = np.broadcast_to(unit[:, None], (*function.shape, 3))
        table = octahedral_table.lookup(asset.tables["w_table"], 17, asset.manifest["w_table"]["columns"], function, places)
        bound += np.einsum("fn,nfc->nc", terms, np.abs(table)) * strength[:, None] * light.color
    rows = weights.reshape(asset.clusters, -1, 3)
    uploads: dict[str, Any] = {
        "images": {
            "planes": asset.stored.astype(np.float32) / 255,
            "weights": np.pad(rows, ((0, 0), (0, 0), (0, 1))),
            "wTable": asset.tables["w_table"].astype(np.float32),
            "clusters": asset.tables.get("cluster_index", np.zeros((1, M), np.uint8))[..., None] / np.float32(255),
        },
        "arrays": {"scale": asset.scale, "bias": asset.bias, "pointLights": packed_point_lights(point_lights, PLACES)},
        "defines": {"SRBF_COMPONENTS": asset.components, "SRBF_POINT_LIGHTS": PLACES},
        "declarations": "uniform vec4 scale[SRBF_LAYERS]; uniform vec4 bias[SRBF_LAYERS]; uniform vec4 pointLights[4 * SRBF_POINT_LIGHTS]; "
        "uniform int pointLightCount;",
        "uniforms": COUNT,
    }
    return uploads, SUM * bound


def _equals_planes(found: np.ndarray, asset: Asset, lights: list[Any], bound: np.ndarray) -> None:
    assert (np.abs(found[:, :3] - linear_response(asset, lights)[0]) <= bound).all()
    assert (np.abs(found[:, :3]) > bound).any()


@twin("combine/components_point_lights.glsl")
def _(evaluate: Evaluate, make_planes: Callable[..., Asset]) -> None:
    asset = make_planes(K, 7, "uint8", 1, M)
    uploads, bound = _planes(asset, POINT_LIGHTS)
    call = "srbfCombineComponentsPointLights(planes, uv, 0.0, 0, weights, cluster, wTable, 17, scale, bias, directions, colors, shining)"
    uploads["declarations"] = '#include "lights/point_lights_at.glsl"\n' + uploads["declarations"] + LIT % (MANY, call)
    rows = vec4(asset.images["position"][0], asset.tables["cluster_index"][0])
    found = evaluate("combine/components_point_lights.glsl", "vec4(lit(a.xyz, uv, int(a.w)), 0.0)", rows, **uploads)
    _equals_planes(found, asset, [*SUNS, *POINT_LIGHTS], bound)


@twin("methods/eigen_map_lights.glsl")
def _(evaluate: Evaluate, make_planes: Callable[..., Asset]) -> None:
    asset = make_planes(K, None, "uint8", 1, M)
    uploads, bound = _planes(asset, POINT_LIGHTS)
    call = f"srbfEigenMapLights(planes, uv, 0.0, 0, weights, wTable, 17, scale, bias, a.xyz, {MANY})"
    found = evaluate("methods/eigen_map_lights.glsl", f"vec4({call}, 0.0)", vec4(asset.images["position"][0]), **uploads)
    _equals_planes(found, asset, [*SUNS, *POINT_LIGHTS], bound)


@twin("methods/clustered_eigen_map_lights.glsl")
def _(evaluate: Evaluate, make_planes: Callable[..., Asset]) -> None:
    """By texel, and by the place of a texel's center."""
    asset = make_planes(K, 7, "uint8", 1, M)
    uploads, bound = _planes(asset, POINT_LIGHTS)
    for name, place in (("", "at"), ("Filtered", "uv")):
        call = f"srbfClusteredLights{name}(planes, clusters, {place}, 0, weights, wTable, 17, scale, bias, a.xyz, {MANY})"
        found = evaluate("methods/clustered_eigen_map_lights.glsl", f"vec4({call}, 0.0)", vec4(asset.images["position"][0]), **uploads)
        _equals_planes(found, asset, [*SUNS, *POINT_LIGHTS], bound)


@twin("combine/components_projected.glsl")
def _(evaluate: Evaluate, make_planes: Callable[..., Asset]) -> None:
    asset = make_planes(K, None, "uint8", 1, M)
    uploads, bound = _planes(asset, [])
    rows = projected_rows(asset, projected_weights(asset, SUNS))[0]
    offset = ", ".join(map(repr, rows[0, :3].tolist()))
    found = evaluate(
        "combine/components_projected.glsl",
        f"vec4(srbfCombineComponentsProjected(planes, uv, 0.0, 0, weights, vec3({offset})), 0.0)",
        vec4(np.zeros(M)),
        images={"planes": uploads["images"]["planes"]},
        arrays={"weights": rows[1:]},
        defines={"SRBF_COMPONENTS": K},
        declarations="uniform vec4 weights[3 * SRBF_LAYERS];",
    )
    _equals_planes(found, asset, SUNS, bound)


@twin("combine/components_projected_cluster.glsl")
def _(evaluate: Evaluate, make_planes: Callable[..., Asset]) -> None:
    asset = make_planes(K, 7, "uint8", 1, M)
    uploads, bound = _planes(asset, [])
    found = evaluate(
        "combine/components_projected_cluster.glsl",
        "vec4(srbfCombineComponentsProjectedCluster(planes, uv, 0, weights, int(a.x)), 0.0)",
        vec4(asset.tables["cluster_index"][0]),
        images={
            "planes": uploads["images"]["planes"],
            "weights": projected_rows(asset, projected_weights(asset, SUNS)),
        },
        defines={"SRBF_COMPONENTS": K},
    )
    _equals_planes(found, asset, SUNS, bound)


@twin("combine/mip_level.glsl")
def _(evaluate: Evaluate) -> None:
    steps = np.random.default_rng(35).uniform(-1, 1, (N, 4)) * np.geomspace(0.1, 100, N)[:, None]
    found = evaluate("combine/mip_level.glsl", "vec4(srbfMipLevel(a.xy, a.zw))", steps.astype(np.float32))[:, 0]
    longest = np.maximum(np.linalg.norm(steps[:, :2], axis=1), np.linalg.norm(steps[:, 2:], axis=1))
    np.testing.assert_allclose(found, np.maximum(np.log2(longest), 0), atol=8 * UNIT)  # logarithms up to 7
    assert (found == 0).any() and (found > 3).any()
