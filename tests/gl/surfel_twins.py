"""Twins of the functions that light cells of surfaces and multiply tables."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from made_profiles import picture, uneven
from twins import EPS, POINT, SPOT, SUM, UNIT, Evaluate, N, point_light_expression, twin, units, vec4

from srbf.gl.uniforms import profile_uniforms
from srbf.light_geometry import environment_samples
from srbf.light_profile import Profile, axes_of
from srbf.lights import EnvironmentLight, PointLight
from srbf.methods.surface_changes import Surfaces
from srbf.visibility.environment_cells import cell_radiance
from srbf.visibility.received import NEAR, NEAR_CONE, ReceivedLight, patch_means
from srbf.visibility.surface_cells import Cells, frames

WIDTH = 16  # texels of a map
STEEP = 1e-4  # of the largest value: an angle's rounding times how fast a profile changes
CELLS = 0.01  # of a mean over 100 places in place of all of a cell


class Unshadowed:
    """Everything sees everything."""

    side = 4

    def visible(self, points: np.ndarray, toward: np.ndarray, distance: np.ndarray | None) -> np.ndarray:
        return np.ones(len(points), bool)


def cells(seed: int, areas: np.ndarray) -> Cells:
    rng = np.random.default_rng(seed)
    places = rng.uniform(-1, 1, (len(areas), 3)).astype(np.float32)
    patches = np.sort(rng.integers(7, size=len(areas)))
    return Cells(places, units(len(areas), seed), areas.astype(np.float32), np.zeros((len(areas), 3), np.float32), patches)


@twin("surfels/tangents.glsl")
def _(evaluate: Evaluate) -> None:
    normals = np.concatenate([units(N, 61), np.eye(3, dtype=np.float32), -np.eye(3, dtype=np.float32)])
    both = "vec3 t(vec3 n, bool second) { vec3 u; vec3 v; srbfTangents(n, u, v); return second ? v : u; }"
    for second, expected in zip(("false", "true"), frames(normals.astype(np.float64)), strict=True):
        found = evaluate("surfels/tangents.glsl", f"vec4(t(a.xyz, {second}), 0.0)", vec4(normals), declarations=both)[:, :3]
        scale = 1 / (1 + np.abs(normals[:, 2:]))  # of the division, far from where it would cancel
        assert (np.abs(found - expected) <= 8 * UNIT * scale).all()


@twin("surfels/part_irradiance.glsl")
def _(evaluate: Evaluate) -> None:
    for light in (POINT, SPOT):
        own = cells(62, np.full(N, 1e-5))  # far: one point each
        vector = np.asarray(light.position, np.float32) - own.places
        far = (vector**2).sum(axis=1) >= NEAR_CONE**2 * 1e-5
        expression = f"vec4(srbfPartIrradiance(a.xyz, b.xyz, {point_light_expression(light)}, 0.0, 1e-5))"
        found = evaluate("surfels/part_irradiance.glsl", expression, vec4(vector), vec4(own.normals))[:, 0]
        expected = ReceivedLight(own, Unshadowed()).irradiance(light) / np.array(light.color)
        np.testing.assert_allclose(found[far], expected[far, 0], atol=4 * SUM * expected.max())
        assert far.mean() > 0.9 and (found[far] > 0.1).any()


@twin("surfels/cell_irradiance.glsl")
def _(evaluate: Evaluate) -> None:
    own = cells(63, np.random.default_rng(64).uniform(1e-4, 0.04, N))  # near and far
    for light in (SPOT, PointLight((0.1, 0.2, 0.3), falloff="inverse-square")):
        vector = np.asarray(light.position, np.float32) - own.places
        near = (vector**2).sum(axis=1) < (NEAR_CONE if light is SPOT else NEAR) ** 2 * own.areas
        expression = f"vec4(srbfCellIrradiance(a, b.xyz, {point_light_expression(light)}, 0.0))"
        found = evaluate("surfels/cell_irradiance.glsl", expression, vec4(own.places, own.areas), vec4(own.normals))[:, 0]
        expected = ReceivedLight(own, Unshadowed()).irradiance(light)[:, 0] / light.color[0]
        np.testing.assert_allclose(found, expected, atol=4 * SUM * expected.max())
        assert near.mean() > 0.2 and (light is SPOT or near.mean() < 0.9) and (expected[near] > 0).any()


def profile_arguments(light: PointLight) -> str:
    """The last arguments of srbfProfile: across, up, tangent."""
    told = profile_uniforms(light)
    vectors = [f"vec3({', '.join(map(repr, told[name]))})" for name in ("profileAcross", "profileUp")]
    return f"{', '.join(vectors)}, {told['profileTangent']!r}"


PROFILED = (
    PointLight((0.1, 0.2, 0.3), falloff="inverse-square", direction=(0.1, 0.7, -0.4), roll=0.4, profile=uneven),
    replace(SPOT, falloff="inverse-square", roll=-0.6, profile=Profile(picture(), projected=True)),
)


@twin("lights/profile.glsl")
def _(evaluate: Evaluate) -> None:
    for light in PROFILED:
        assert light.profile is not None
        x, y, _ = axes_of(light.direction, light.roll)
        away = np.concatenate([units(8 * N, 71), [x, y, -x, -y]]).astype(np.float32)
        axis = f"vec3({', '.join(map(repr, light.direction))})"
        expression = f"vec4(srbfProfile(profile, a.xyz, {axis}, {profile_arguments(light)}), 0.0)"
        found = evaluate("lights/profile.glsl", expression, vec4(away), images={"profile": light.profile.table})[:, :3]
        expected = light.factors(away)
        if light.profile.projected:  # the edge of what is in front
            found, expected = found[:-4], expected[:-4]
        np.testing.assert_allclose(found, expected, atol=STEEP * expected.max())
        assert (expected.max(axis=1) > 0.1 * expected.max()).mean() > 0.2
    falling = np.repeat(np.linspace(1, 0, 7, dtype=np.float32)[:, None, None], 3, axis=2)
    poles = vec4(np.array([[0, 0, 1], [0, 0, -1]]))
    call = "vec4(srbfProfile(profile, a.xyz, vec3(0.0, 0.0, 1.0), vec3(1.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0), 0.0), 0.0)"
    found = evaluate("lights/profile.glsl", call, poles, images={"profile": falling})
    np.testing.assert_allclose(found[:, 0], Profile(falling).at(poles[:, :3], 0.0)[:, 0], atol=UNIT)


@twin("surfels/profiled_irradiance.glsl")
def _(evaluate: Evaluate) -> None:
    own = cells(63, np.random.default_rng(64).uniform(1e-4, 0.04, N))  # near and far
    for light in PROFILED:
        assert light.profile is not None
        call = f"srbfProfiledIrradiance(a, b.xyz, {point_light_expression(light)}, profile, {profile_arguments(light)})"
        inputs = (vec4(own.places, own.areas), vec4(own.normals))
        found = evaluate("surfels/profiled_irradiance.glsl", f"vec4({call}, 0.0)", *inputs, images={"profile": light.profile.table})[:, :3]
        expected = ReceivedLight(own, Unshadowed()).irradiance(light) / np.array(light.color)
        np.testing.assert_allclose(found, expected, atol=STEEP * expected.max())
        assert (expected > 0).any()


def on_map(evaluate: Evaluate, file: str, call: str, *rows: np.ndarray) -> np.ndarray:
    """(texel, what it must not exceed) of a function that also gives a texel."""
    kind = "ivec3" if "Cube" in call else "ivec2"
    wrapper = f"vec4 on(vec3 a, vec3 b, vec3 c) {{ {kind} t; float own = {call}; return vec4(vec3(t{', 0' * (kind == 'ivec2')}), own); }}"
    return evaluate(file, "on(a.xyz, b.xyz, c.xyz)", *rows, declarations=wrapper)


@twin("surfels/cell_on_cube.glsl")
def _(evaluate: Evaluate) -> None:
    """The plane of a cell, cut by the ray through the middle of the texel."""
    toward, normal = units(8 * N, 65), units(8 * N, 66)
    normal *= -np.sign(np.einsum("nk,nk->n", toward, normal))[:, None]  # towards the light
    place = 2 * toward.astype(np.float64)
    call = f"srbfCellOnCube(a, b, {WIDTH}, t)"
    found = on_map(evaluate, "surfels/cell_on_cube.glsl", call, vec4(place), vec4(normal), vec4(place))
    column, row, face = np.round(found[:, :3]).astype(int).T
    axis, sign = face // 2, 1 - 2 * (face % 2)
    count = np.arange(len(place))
    ray = np.zeros((len(place), 3))
    ray[count, axis] = sign
    ray[count, (axis + 1) % 3] = (column + 0.5) / WIDTH * 2 - 1
    ray[count, (axis + 2) % 3] = (row + 0.5) / WIDTH * 2 - 1
    depth = np.abs(place[count, axis])
    assert (np.abs(place / depth[:, None] - ray).max(axis=1) <= 1 / WIDTH + 8 * EPS).all(), "the texel that it falls on"
    exact = np.einsum("nk,nk->n", normal, ray) / np.einsum("nk,nk->n", normal, place)
    expected = np.clip(exact, 0.75 / depth, 1.25 / depth) * (1 + 1e-4)
    np.testing.assert_allclose(found[:, 3], expected, rtol=2e-4)
    assert (np.abs(exact * depth - 1) < 0.25).mean() > 0.5 and set(face) == set(range(6))


@twin("surfels/cell_on_map.glsl")
def _(evaluate: Evaluate) -> None:
    across, up, toward = np.linalg.qr(np.random.default_rng(67).normal(size=(3, 3)))[0].T.astype(np.float32)
    normal = units(N, 68)
    normal *= np.sign(normal @ toward)[:, None]
    place = np.random.default_rng(69).uniform(-1, 1, (N, 3)).astype(np.float32)
    values = ", ".join(f"vec3({', '.join(map(str, axis))})" for axis in (toward, across, up))
    found = on_map(
        evaluate, "surfels/cell_on_map.glsl", f"srbfCellOnMap(a, b, {values}, 2.0, {WIDTH}, t)", *map(vec4, (place, normal, place))
    )
    flat = np.stack([place @ across, place @ up], axis=1)
    middle = ((np.round(found[:, :2]) + 0.5) / WIDTH * 2 - 1) * 2
    assert (np.abs(flat - middle) <= 2 / WIDTH + 8 * EPS).all()
    step = (middle - flat) @ np.stack([across, up])
    exact = place @ toward - np.einsum("nk,nk->n", normal, step) / (normal @ toward)
    own = place @ toward
    np.testing.assert_allclose(found[:, 3], np.clip(exact, own - 0.25, own + 0.25) + 4, atol=2e-4)
    assert (np.abs(exact - own) < 0.25).mean() > 0.5


@twin("surfels/patch_mean.glsl")
def _(evaluate: Evaluate) -> None:
    own = cells(70, np.random.default_rng(71).uniform(0.1, 1, 60))
    values = np.random.default_rng(72).uniform(0, 2, (60, 3))
    total = np.bincount(own.patches, own.areas, 7)
    counts = np.bincount(own.patches, minlength=7)
    ranges = np.column_stack([np.cumsum(counts) - counts, counts, counts, counts])[None]
    normals = np.column_stack([own.normals, own.areas / total[own.patches]]).reshape(6, 10, 4)
    images = {"irradiance": values.reshape(6, 10, 3), "normals": normals, "ranges": ranges}
    expression = "vec4(srbfPatchMean(irradiance, normals, ranges, at), 0.0)"
    found = evaluate("surfels/patch_mean.glsl", expression, np.zeros((7, 4)), images=images)
    np.testing.assert_allclose(found[:, :3], patch_means(own, values), rtol=SUM)


@twin("surfels/table_part.glsl")
def _(evaluate: Evaluate) -> None:
    rng = np.random.default_rng(73)
    rows, count, blocks = 5, 23, 4
    table, numbers = rng.normal(size=(rows, count, 3)), rng.normal(size=(count, 3))
    folded = np.zeros((8, 16, 3))  # rows of 16 texels
    folded.reshape(-1, 3)[: rows * count] = table.reshape(-1, 3)
    images = {"table": folded, "numbers": np.concatenate([numbers, np.zeros((1, 3))]).reshape(4, 6, 3)}
    for gray in ("false", "true"):
        expression = f"vec4(srbfTablePart(table, numbers, {rows}, {count}, {blocks}, {gray}, int(a.x)), 0.0)"
        found = evaluate("surfels/table_part.glsl", expression, vec4(np.arange(24.0)), images=images)[:, :3]
        used = np.repeat(table[:, :, :1], 3, axis=2) if gray == "true" else table
        np.testing.assert_allclose(found[:20].reshape(rows, blocks, 3).sum(axis=1), np.einsum("rnc,nc->rc", used, numbers), atol=10 * SUM)
        assert not found[20:].any()


@twin("surfels/block_sum.glsl")
def _(evaluate: Evaluate) -> None:
    parts = np.random.default_rng(74).normal(size=(4, 6, 3))
    found = evaluate("surfels/block_sum.glsl", "vec4(srbfBlockSum(parts, 3, int(a.x)), 0.0)", vec4(np.arange(9.0)), images={"parts": parts})
    np.testing.assert_allclose(found[:8, :3], parts.reshape(8, 3, 3).sum(axis=1), atol=SUM)
    assert not found[8:, :3].any()


@twin("surfels/matrix_product.glsl")
def _(evaluate: Evaluate) -> None:
    rng = np.random.default_rng(75)
    left, right = rng.normal(size=(5, 7, 3)), rng.normal(size=(7, 4, 3))
    expression = "vec4(srbfMatrixProduct(left, right, 7, ivec2(a.xy)), 0.0)"
    found = evaluate("surfels/matrix_product.glsl", expression, entries(5, 4), images={"left": left, "right": right})
    np.testing.assert_allclose(found[:, :3].reshape(5, 4, 3), np.einsum("ikc,kjc->ijc", left, right), atol=10 * SUM)


@twin("surfels/changed_exchange.glsl")
def _(evaluate: Evaluate) -> None:
    own, painted, _ = repainted()
    images = {"gather": own.gather[..., None], "sent": own.sent[..., None], "albedo": np.stack([painted.albedo, own.albedo], axis=1)}
    expression = "vec4(srbfChangedExchange(gather, sent, albedo, 9, ivec2(a.xy)), 0.0)"
    found = evaluate("surfels/changed_exchange.glsl", expression, entries(4, 4), images=images)
    np.testing.assert_allclose(found[:, :3].reshape(4, 4, 3), painted.feedback - own.feedback, atol=SUM)


@twin("surfels/repainted_entry.glsl")
def _(evaluate: Evaluate) -> None:
    own, painted, added = repainted()
    images = {"before": own.series() / 2, "after": painted.series(), "gather": own.gather[..., None]}
    images["albedo"] = np.stack([painted.albedo, own.albedo], axis=1)
    expression = "vec4(srbfRepaintedEntry(before, after, gather, albedo, 4, 2.0, ivec2(a.xy)), 0.0)"
    found = evaluate("surfels/repainted_entry.glsl", expression, entries(4, 9), images=images)
    np.testing.assert_allclose(found[:, :3].reshape(4, 9, 3), added, atol=10 * SUM)


@twin("surfels/environment_cell.glsl")
def _(evaluate: Evaluate) -> None:
    """Of a map that is another in every direction. Texels across cells count in parts here: numpy has the map eight times as fine."""
    side = 6
    turned = np.linalg.qr(np.random.default_rng(76).normal(size=(3, 3)))[0]
    turned *= np.linalg.det(turned)
    directions, _ = environment_samples(np.zeros((64, 128, 3), np.float32), "sphere", np.eye(3))
    image = np.exp(directions @ np.random.default_rng(77).normal(size=(3, 3))).astype(np.float32)
    ahead, left, up = (f"vec3({', '.join(map(str, axis))})" for axis in turned.T)
    call = f"srbfEnvironmentCell(panorama, {ahead}, {left}, {up}, int(a.x), {side})"
    found = evaluate("surfels/environment_cell.glsl", f"vec4({call}, 0.0)", vec4(np.arange(36.0)), images={"panorama": image})[:, :3]
    fine = EnvironmentLight(image.repeat(8, axis=0).repeat(8, axis=1), rotation=turned)
    np.testing.assert_allclose(found, cell_radiance(fine, side), rtol=CELLS)
    assert np.ptp(found, axis=0).min() > 0.5
    even = evaluate(
        "surfels/environment_cell.glsl", f"vec4({call}, 0.0)", vec4(np.arange(36.0)), images={"panorama": np.full_like(image, 0.5)}
    )
    np.testing.assert_allclose(even[:, :3], 0.5, rtol=SUM)


def entries(rows: int, columns: int) -> np.ndarray:
    """Column and row of every entry of a matrix, row by row."""
    row, column = np.divmod(np.arange(rows * columns), columns)
    return vec4(np.stack([column, row, row], axis=1).astype(float))


def repainted() -> tuple[Surfaces, Surfaces, np.ndarray]:
    """(surfaces of 4 shapes and 9 surfels, the same with one object repainted, what that adds to the table)."""
    rng = np.random.default_rng(78)
    gather, sent = rng.normal(size=(2, 4, 9)).astype(np.float32) / 3
    albedo = rng.uniform(0.2, 0.6, (9, 3)).astype(np.float32)
    feedback = (np.einsum("is,sc,js->ijc", gather, albedo, sent) / 4).astype(np.float32)
    shares = np.stack([np.arange(9) % 2, 1 - np.arange(9) % 2]).astype(np.float32)
    own = Surfaces(gather, sent / 4, feedback, shares, albedo, ("Wall", "Floor"), None, np.zeros((4, 2, 3), np.float32))
    return own, *own.repainted({"Wall": (0.1, 0.7, 0.9)})
