"""Twins of the functions of specular lobes."""

from __future__ import annotations

import numpy as np
from twins import SUM, Evaluate, twin, units, vec4

from srbf.io.scene_glb import KNOTS, Triangles
from srbf.microfacets import GRAZING, LEAST_ALPHA, albedo_table, albedo_terms, reflected
from srbf.visibility.glossy_direct import GlossyPixels
from srbf.visibility.receivers import Receivers

N = 400
LOBE = 1e-3  # of the largest value of a lobe: single precision of a narrow one beside its axis


@twin("gloss/lobe_albedo.glsl")
def _(evaluate: Evaluate) -> None:
    """At places past both ends of the table, too."""
    rng = np.random.default_rng(90)
    cosine, alpha = rng.uniform(GRAZING / 2, 1, N), rng.uniform(0, 1, N) ** 2
    cosine[0], alpha[:2] = 1, 1
    found = evaluate(
        "gloss/lobe_albedo.glsl",
        "vec4(srbfLobeAlbedo(lobeAlbedo, a.x, a.y), 0.0, 0.0)",
        vec4(cosine, alpha),
        images={"lobeAlbedo": albedo_table()},
    )
    np.testing.assert_allclose(found[:, :2], np.stack(albedo_terms(cosine, alpha), axis=1), atol=SUM)


@twin("gloss/specular_lobe.glsl")
def _(evaluate: Evaluate) -> None:
    """Lobes as narrow as there are, at their middle and far from it; dark and bright ones; lights of some size, and from below."""
    rng = np.random.default_rng(91)
    normals, view, away = (units(N, seed) for seed in (92, 93, 94))
    view *= np.sign(np.einsum("nc,nc->n", view, normals))[:, None]
    view = np.where(np.einsum("nc,nc->n", view, normals)[:, None] > 0.05, view, normals)
    mirrored = 2 * np.einsum("nc,nc->n", view, normals)[:, None] * normals - view
    alpha = np.maximum(rng.uniform(0, 1, N) ** 3, LEAST_ALPHA)
    lights = mirrored + (alpha * rng.uniform(0, 3, N))[:, None] * away
    lights[: N // 4] = away[: N // 4]
    lights /= np.linalg.norm(lights, axis=1, keepdims=True)
    color, share = rng.uniform(0, 1, (N, 3)), rng.uniform(0, 1, N)
    inputs = [vec4(normals, alpha), vec4(view, share), vec4(lights), vec4(color)]
    single = [own.astype(np.float64) for own in inputs]
    for own in single[:3]:  # a narrow lobe of numpy's sees how far a rounded vector is from a unit one
        own[:, :3] /= np.linalg.norm(own[:, :3], axis=1, keepdims=True)
    for spread in (0.0, 0.1):
        found = evaluate(
            "gloss/specular_lobe.glsl",
            f"vec4(srbfSpecularLobe(lobeAlbedo, a.xyz, b.xyz, c.xyz, d.xyz, a.w, b.w, {spread}), 0.0)",
            *inputs,
            images={"lobeAlbedo": albedo_table()},
        )[:, :3]
        expected = reflected(
            single[0][:, :3], single[1][:, :3], single[2][:, :3], single[3][:, :3], single[0][:, 3], single[1][:, 3], spread
        )
        assert 0.1 * N < (expected.max(axis=1) == 0).sum() < 0.9 * N
        peak = 1 / (4 * np.pi * (single[0][:, 3:] ** 2 + spread**2 / 4) * np.maximum(np.einsum("nc,nc->n", normals, view), 1e-3)[:, None])
        assert (np.abs(found - expected) <= LOBE * peak).all()


@twin("gloss/texel_lobe.glsl")
def _(evaluate: Evaluate) -> None:
    """Of texels with and without a lobe, seen from a place and along a direction."""
    rng = np.random.default_rng(95)
    width = 40
    color, lobes = rng.uniform(0, 1, (2, 1, width, 3)).astype(np.float32)
    lobes[0, ::5, 2], color[0, 1::5] = 0, 5e-5
    lobes[0, :, 0] = 0.2 + 0.8 * lobes[0, :, 0]
    points, normals, lights = rng.uniform(-1, 1, (width, 3)).astype(np.float32), units(width, 96), units(width, 97)
    normals[:, 2] = np.abs(normals[:, 2])
    for kind, eye in (("PERSP", [0.5, -1.0, 9.0, 1.0]), ("ORTHO", [0.0, 0.6, 0.8, 0.0])):
        matrix = np.eye(4)
        matrix[:3, 3 if kind == "PERSP" else 2] = eye[:3]
        images = {"glossy": color, "lobe": lobes, "normal": normals[None]}
        nothing = np.zeros((0, 3, 3), np.float32)
        triangles = Triangles(nothing, nothing, np.zeros(0, np.int64), np.zeros(0, bool), np.zeros((0, KNOTS, 3), np.float32))
        receivers = Receivers(width, 1, "radiance", images, triangles, {"camera": {"type": kind, "matrix_world": matrix.tolist()}})
        pixels = GlossyPixels(receivers)
        found = evaluate(
            "gloss/texel_lobe.glsl",
            "vec4(srbfTexelLobe(glossy, lobes, lobeAlbedo, at, a.xyz, b.xyz, eye, c.xyz, 0.0), 0.0)",
            vec4(points),
            vec4(normals),
            vec4(lights),
            images={"glossy": color, "lobes": lobes, "lobeAlbedo": albedo_table()},
            declarations="uniform vec4 eye;",
            uniforms={"eye": tuple(eye)},
        )[:, :3]
        expected = np.zeros((width, 3))
        own = pixels.texels
        expected[own] = pixels.reflected(own, points[own], normals[own], lights[own].astype(np.float64))
        assert 5 < (expected.max(axis=1) > 0).sum() < width - 10
        np.testing.assert_allclose(found, expected, atol=LOBE * expected.max())
