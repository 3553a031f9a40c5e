"""Twins of a neural decoder's functions."""

from __future__ import annotations

import numpy as np
from made_assets import build_neural
from twins import POINT, SPOT, SUM, UNIT, Evaluate, N, twin, units, vec4

from srbf.basis.neural_decoder import NeuralDecoder, elu
from srbf.gl.neural_map import network_vectors
from srbf.gl.uniforms import packed_point_lights, padded
from srbf.lights import DirectionalLight
from srbf.methods import linear_response
from srbf.methods.component_maps import components_of

HIDDEN, CODES = 8, 6
LAYERS = "uniform vec4 network[SRBF_NETWORK]; uniform vec4 scale[SRBF_LAYERS]; uniform vec4 bias[SRBF_LAYERS];"
FOUND = "vec4 found[SRBF_UNIT_VECTORS]; srbfNeuralCodes(planes, uv, 0.0, network, scale, bias, found);"
DEFINES: dict[str, object] = {"SRBF_COMPONENTS": CODES, "SRBF_UNIT_VECTORS": HIDDEN // 4}


@twin("basis/elu.glsl")
def _(evaluate: Evaluate) -> None:
    x = np.random.default_rng(81).normal(size=(N, 4)).astype(np.float32) * np.geomspace(1e-4, 30, N, dtype=np.float32)[:, None]
    np.testing.assert_allclose(evaluate("basis/elu.glsl", "srbfElu(a)", x), elu(x), atol=UNIT, rtol=UNIT)


@twin("combine/neural_codes.glsl")
def _(evaluate: Evaluate) -> None:
    asset = build_neural(CODES, HIDDEN, height=1, width=N)
    decoder = NeuralDecoder.of_table(asset.tables["network"])
    codes = components_of(asset.coefficients(), CODES).reshape(CODES, -1).T
    expected = decoder.of_codes(codes)
    used = network_vectors(asset.tables["network"])[: (CODES + 4) * HIDDEN // 4]  # drivers drop the end of an array that nothing reads
    share = np.random.default_rng(85).normal(size=(N, 2)).astype(np.float32)
    found = evaluate(
        "combine/neural_codes.glsl",
        "mixed(uv, a.xy)",
        vec4(share[:, :1], share[:, 1:]),
        images={"planes": asset.stored.astype(np.float32) / 255},
        arrays={"network": used, "scale": asset.scale, "bias": asset.bias},
        defines=DEFINES,
        declarations=f"{LAYERS} vec4 mixed(vec2 uv, vec2 share) {{ {FOUND} return share.x * found[0] + share.y * found[1]; }}",
    )
    mixed = share[:, :1] * expected[:, :4] + share[:, 1:] * expected[:, 4:]
    np.testing.assert_allclose(found, mixed, atol=SUM * np.abs(expected).max())


@twin("combine/neural_toward.glsl")
def _(evaluate: Evaluate) -> None:
    asset = build_neural(CODES, HIDDEN)
    first = np.random.default_rng(82).normal(size=(N, HIDDEN)).astype(np.float32)
    directions = units(N, 83)
    expected = NeuralDecoder.of_table(asset.tables["network"]).toward(first, directions)
    found = evaluate(
        "combine/neural_toward.glsl",
        "vec4(srbfNeuralToward(vec4[2](a, b), c.xyz, network), 0.0)",
        first[:, :4],
        first[:, 4:],
        vec4(directions),
        arrays={"network": network_vectors(asset.tables["network"])},
        defines=DEFINES,
        declarations="uniform vec4 network[SRBF_NETWORK];",
    )[:, :3]
    np.testing.assert_allclose(found, expected, atol=SUM * np.abs(expected).max())


@twin("methods/neural_map.glsl")
def _(evaluate: Evaluate) -> None:
    asset = build_neural(CODES, HIDDEN, height=1, width=N)
    suns = [DirectionalLight(tuple(d), tuple(abs(d))) for d in units(3, 84).astype(float)]
    distant = np.zeros((4, 2, 4), np.float32)  # one place is not in use
    distant[:3, 0] = padded(np.array([light.direction for light in suns]))
    distant[:3, 1] = padded(np.array([light.color for light in suns]))
    distant[3] = 7
    shared = {"network": network_vectors(asset.tables["network"]), "scale": asset.scale, "bias": asset.bias}
    declared = f"{LAYERS} uniform int count; vec3 sum(vec2 uv, vec3 receiver) {{{{ {FOUND} return {{}}; }}}}"
    cases = (
        ("srbfNeuralMapDistant(found, network, lights, count)", suns, distant.reshape(-1, 4), {"SRBF_DISTANT": 4}, 8),
        (
            "srbfNeuralMapPoints(found, network, receiver, lights, count)",
            [POINT, SPOT],
            packed_point_lights([POINT, SPOT], 4),
            {"SRBF_POINT_LIGHTS": 4},
            16,
        ),
    )
    for call, lights, rows, define, size in cases:
        expected = linear_response(asset, lights)[0]
        found = evaluate(
            "methods/neural_map.glsl",
            "vec4(sum(uv, a.xyz), 0.0)",
            vec4(asset.images["position"][0]),
            images={"planes": asset.stored.astype(np.float32) / 255},
            arrays={**shared, "lights": rows},
            uniforms={"count": len(lights)},
            defines=DEFINES | define,
            declarations=f"uniform vec4 lights[{size}]; {declared.format(call)}",
        )[:, :3]
        np.testing.assert_allclose(found, expected, atol=len(lights) * SUM * np.abs(expected).max())
        assert np.abs(expected).max() > 0.1
