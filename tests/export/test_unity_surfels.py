"""Unity's passes that light surfels: the HLSL, drawn one pass after the other, and the C# that prepares them, beside numpy and rays."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from closed_forms import glb
from made_surfels import DOOR, LIGHTS, PANORAMA, RANK, WALL, irradiance_of, made_asset, recolored, residual, table_of, weights_of
from passes import Passes, doublings, face_axes, frame_of
from test_unity import needs_mono, needs_spirv
from unity_passes import Unity, shader_of

from srbf.asset import Asset
from srbf.export import spirv, unity
from srbf.export.surfel_textures import MOST_TERMS, PASSES, surfel_textures
from srbf.io import files
from srbf.io.image import read_image
from srbf.lights import DirectionalLight, EnvironmentLight, NamedLight, PointLight
from srbf.methods.surface_changes import Surfaces, with_albedo
from srbf.visibility.surface_cells import Cells, frames

pytestmark = pytest.mark.engines
pytest.importorskip("embreex")

CLOSE = 5e-6  # of the largest: sums of floats
HALF = 1e-3  # of the largest: numpy rounds a repainted table to half floats
MATRICES = [("gather", "columns"), ("gather", "scale"), ("sent", "scale"), ("feedback", "columns"), ("feedback", "scale")]
SOLVED = 1e-5  # of one: what 512 terms and sums of floats leave; 64 terms leave 100 times as much
CELLS = 0.005  # of all weights: texels that straddle cells count in parts here, wholly in numpy, which has them finer


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("surfels")
    (place / "out").mkdir()
    unity.write(made_asset(), place / "out")
    return place / "out"


@pytest.fixture(scope="module")
def asset(folder: Path) -> Asset:
    return Asset.open(folder)


@pytest.fixture(scope="module")
def told(folder: Path) -> dict[str, Any]:
    return files.read_json(folder / "asset.json")[PASSES]


@pytest.fixture(scope="module")
def drawn(folder: Path, told: dict[str, Any], asset: Asset) -> Iterator[Unity]:
    with Passes() as passes:
        yield Unity(passes, folder, told, asset)


@needs_spirv
@pytest.mark.parametrize("name", LIGHTS)
def test_passes_measure_what_rays_do(drawn: Unity, asset: Asset, name: str) -> None:
    """Irradiance of every cell, none of which is at the edge of a shadow; then the weights of the light."""
    light = LIGHTS[name]
    sum_ = drawn.irradiance([light])
    order = surfel_textures(asset).order
    found = drawn.passes.read(sum_).reshape(-1, 4)[: len(order), :3]
    expected = irradiance_of(asset, light)[order]
    np.testing.assert_allclose(found, expected, atol=CLOSE * expected.max())
    facing = irradiance_of(replace(asset, scene=glb(np.zeros((1, 3, 3), np.float32))), light)[order]
    assert ((expected == 0) & (facing > 0.01 * facing.max())).any(axis=1).mean() > 0.03, "the wall hides some"
    weights = weights_of(asset, [light])
    np.testing.assert_allclose(drawn.weights(sum_), weights, atol=CLOSE * np.abs(weights).max())


@needs_spirv
def test_tables_give_numpys_weights(drawn: Unity, asset: Asset, folder: Path, told: dict[str, Any]) -> None:
    """Of all lights and of an object that emits, from the irradiance of rays."""
    lights = [*LIGHTS.values()]
    order = surfel_textures(asset).order
    shape = read_image(folder / told["places"]).shape[:2]
    rays = np.zeros((shape[0] * shape[1], 4))
    rays[: len(order), :3] = np.sum([irradiance_of(asset, light) for light in lights], axis=0)[order]
    name, radiance = told["objects"][1], np.array([0.5, 2.0, 1.0])
    added = drawn.passes.column(read_image(folder / told["emission"])[1] * radiance)
    found = drawn.weights(drawn.passes.texture(rays.reshape(*shape, 4)), added)
    emitting = NamedLight(name, tuple(radiance))
    expected = weights_of(asset, [*lights, emitting])
    np.testing.assert_allclose(found, expected, atol=CLOSE * np.abs(expected).max())
    painted = {told["objects"][0]: (0.1, 0.6, 0.9)}
    exchange, series, table = drawn.repainted(recolored(asset, painted))
    first = drawn.passes.column(read_image(folder / told["changes"]["first"])[1] * radiance)
    reflected = drawn.multiplied("product", (RANK, 1), series, first, RANK, 1, (drawn.passes.target(1, 1), 0))
    bounced = drawn.multiplied("product", (RANK, 1), exchange, reflected, RANK, 1, (first, 1))
    found = drawn.weights(drawn.passes.texture(rays.reshape(*shape, 4)), bounced, table)
    after = weights_of(with_albedo(asset, painted), [*lights, emitting])
    np.testing.assert_allclose(found, after, atol=HALF * np.abs(after).max())
    assert np.abs(after - expected).max() > 20 * HALF * np.abs(expected).max()


@needs_spirv
def test_repainting_sums_all_bounces(drawn: Unity, asset: Asset, told: dict[str, Any]) -> None:
    """The residual of the drawn series: (1 - F) (1 + F + F² + …) = 1."""
    exchange, series, _ = drawn.repainted(recolored(asset, {told["objects"][0]: (0.95, 0.9, 0.9)}))
    assert np.abs(residual(drawn.passes.read(exchange), drawn.passes.read(series))).max() < SOLVED


@needs_spirv
def test_repainting_sums_as_few_bounces_as_the_bake_has(drawn: Unity, tmp_path: Path) -> None:
    few, painted = made_asset(bounces=3), {"Walls": (0.1, 0.6, 0.9)}
    unity.write(few, tmp_path)
    told = files.read_json(tmp_path / "asset.json")[PASSES]
    passes = drawn.passes
    exchange, series, table = (passes.read(image) for image in Unity(passes, tmp_path, told, few).repainted(recolored(few, painted)))
    left = -np.linalg.matrix_power(np.moveaxis(exchange[..., :3], 2, 0), 3)
    np.testing.assert_allclose(residual(exchange, series), left, atol=SOLVED)
    expected = table_of(few) + Surfaces.of(few).repainted(painted)[1]
    np.testing.assert_allclose(table[..., :3], expected, atol=CLOSE * np.abs(expected).max())


@needs_mono
def test_c_sharp_doubles_as_often_as_the_bake_bounces(tmp_path: Path, ask: Callable[..., Any]) -> None:
    unity.write(made_asset(bounces=3), tmp_path)
    assert ask(tmp_path, [0.5, 2.0, 1.0])["doublings"] == [[True, False]]


@needs_spirv
def test_an_environment_adds_what_numpy_says(drawn: Unity, asset: Asset) -> None:
    """Of a map in Unity's layout, u = 1/2 - atan2(z, x) / 2 pi, whose rows start below; Unity's (x, y, z) is the asset's (-x, -z, y)."""
    axes = np.array([[-1, 0, 0], [0, -1, 0], [0, 0, -1]], float)  # of Unity's x, z, -y
    found = drawn.weights(drawn.irradiance([]), drawn.lit_by(PANORAMA[::-1], axes, 0.7, drawn.passes.target(1, 1)))
    turned = np.roll(PANORAMA, PANORAMA.shape[1] // 2, axis=1)  # whose middle is at -x
    expected = weights_of(asset, [EnvironmentLight(turned.repeat(4, axis=0).repeat(4, axis=1), (0.7,) * 3)])
    assert np.linalg.norm(found - expected) < CELLS * np.linalg.norm(expected)
    other = weights_of(asset, [EnvironmentLight(PANORAMA, (0.7,) * 3)])
    assert np.linalg.norm(other - expected) > 10 * CELLS * np.linalg.norm(expected)


@needs_spirv
def test_lights_add_up(drawn: Unity) -> None:
    pair = [LIGHTS["point"], LIGHTS["spot"]]
    read = drawn.passes.read
    np.testing.assert_allclose(
        read(drawn.irradiance(pair))[..., :3], sum(read(drawn.irradiance([light]))[..., :3] for light in pair), rtol=1e-6, atol=1e-6
    )
    assert not read(drawn.irradiance([])).any()


URP = """
struct Light { half3 direction; half3 color; float distanceAttenuation; half shadowAttenuation; uint layerMask; };
float4 lightPlace, lightColor, sunPlace, sunColor, wall;

// Whether the wall is not between; in Unity's axes its plane is at -x.
float open(float3 from, float3 toward)
{
    float t = (-wall.x - from.x) / toward.x;
    float3 through = from + t * toward;
    return t > 0.0 && t < 1.0 && -through.z < wall.z && -through.z > wall.y ? 1.0 : t <= 0.0 || t >= 1.0 ? 1.0 : 0.0;
}
float4 TransformWorldToShadowCoord(float3 place) { return float4(place, 1.0); }
Light GetMainLight(float4 at)
{
    Light light = { half3(sunPlace.xyz), half3(sunColor.rgb), 1.0, half(open(at.xyz, 1e3 * sunPlace.xyz)), 0u };
    return light;
}
int GetAdditionalLightsCount() { return 1; }
Light GetAdditionalLight(uint i, float3 place, half4 mask)
{
    float3 toward = lightPlace.xyz - place;
    Light light = { half3(normalize(toward)), half3(lightColor.rgb), 1.0 / dot(toward, toward), half(open(place, toward)), 0u };
    return light;
}
"""


@needs_spirv
def test_urps_lights_fall_on_cells(folder: Path, told: dict[str, Any], asset: Asset) -> None:
    """By a stand-in for URP's functions, with the shadow of the wall: the mean over 16 points of every cell, in Unity's axes."""
    light = PointLight((-0.29, 0.03, 1.37), (1.0, 0.5, 2.0), falloff="inverse-square")
    sun = LIGHTS["directional"]
    assert isinstance(sun, DirectionalLight)
    axes = np.array([[-1, 0, 0], [0, 0, -1], [0, 1, 0]], float)  # of the asset from Unity's
    turned = np.eye(4)
    turned[:3, :3], turned[:3, 3] = axes.T, axes.T @ told["middle"]
    toward = axes.T @ sun.direction
    place = axes.T @ light.position
    values: dict[str, Any] = {
        "lightPlace": (*place, 1),
        "lightColor": (*light.color, 1),
        "sunPlace": (*toward, 0),
        "sunColor": (*sun.color, 1),
    }
    values |= {"wall": (WALL, *DOOR, 0), "_SrbfWorldFromCell": turned, "_SrbfLift": [told["lift"]]}
    with Passes() as passes:
        program = passes.program(URP + shader_of(folder, "SrbfUrpIrradiance.hlsl"), "SrbfUrpIrradiance")
        images = {f"_Srbf{name.capitalize()}": passes.texture(read_image(folder / told[name])) for name in ("places", "normals")}
        shape = read_image(folder / told["places"]).shape[:2]
        target = passes.texture(np.zeros((*shape, 4)))
        passes.draw(program, target, images, values)
        found = passes.read(target).reshape(-1, 4)[:, :3]
    order = surfel_textures(asset).order
    expected = by_points(Cells.of_image(asset.tables["cells"]), light, sun, told["lift"])[order]
    assert not found[len(order) :].any()
    np.testing.assert_allclose(found[: len(order)], expected, atol=5 * CLOSE * expected.max())
    assert 0.05 < (expected[:, 0] == 0).mean() < 0.5


def by_points(cells: Cells, light: PointLight, sun: DirectionalLight, lift: float) -> np.ndarray:
    normals = cells.normals.astype(np.float64)
    tangent, bitangent = frames(normals)
    steps = (np.arange(4) + 0.5) / 4 - 0.5
    total = np.zeros((len(normals), 3))
    for s in steps:
        for t in steps:
            there = cells.places + np.sqrt(cells.areas)[:, None] * (s * tangent + t * bitangent) + lift * normals
            vector = np.array(light.position) - there
            squared = (vector**2).sum(axis=1)
            cosine = np.maximum((vector * normals).sum(axis=1), 0) / np.sqrt(squared)
            amount = cosine * np.minimum(1 / squared, 32 * np.pi / cells.areas) * seen(there, vector)
            distant = np.broadcast_to(1e3 * np.array(sun.direction), vector.shape)
            total += amount[:, None] * light.color + (np.maximum(normals @ sun.direction, 0) * seen(there, distant))[:, None] * sun.color
    return total / 16


def seen(start: np.ndarray, toward: np.ndarray) -> np.ndarray:
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (WALL - start[:, 0]) / toward[:, 0]
        y = start[:, 1] + t * toward[:, 1]
    return ~((t > 0) & (t < 1) & ((y <= DOOR[0]) | (y >= DOOR[1])))


@needs_spirv
def test_every_entry_compiles_for_direct3d_too(folder: Path) -> None:
    text = shader_of(folder, "SrbfSurfels.hlsl").replace("#define SHADER_API_GLCORE\n", "")
    shader = (folder / "Srbf/Resources/SrbfSurfels.shader").read_text()
    entries = {line.split()[-1] for line in shader.splitlines() if "#pragma vertex" in line}
    assert all(spirv.compile_hlsl(text, "vert", entry) for entry in entries) and len(entries) == 3
    for entry in (line.split()[-1] for line in shader.splitlines() if "#pragma fragment" in line):
        assert spirv.compile_hlsl(text, "frag", entry)


@needs_mono
def test_c_sharp_reads_what_passes_need(folder: Path, told: dict[str, Any], ask: Callable[..., Any]) -> None:
    said = ask(folder, [0.5, 2.0, 1.0])
    assert said["surfels"] == [[told["patches"], told["triangles"], told["reach"], told["lift"], *told["middle"]]]
    assert said["table"] == [[t["rows"], t["columns"], t["channels"], t["scale"], -(-t["columns"] // 64)] for t in told["tables"]]
    np.testing.assert_array_equal(said["face"], [np.ravel(face_axes(face)) for face in range(6)])
    np.testing.assert_allclose(said["frame"][0], np.ravel(frame_of(np.array([0.48, -0.6, 0.64]))), atol=1e-12)
    np.testing.assert_allclose(said["frame"][1], np.ravel(frame_of(np.array([0.0, 0.0, 1.0]))), atol=1e-12)
    emission = read_image(folder / told["emission"])
    added = np.array(said["added"]).reshape(-1, 4)[:, :3]
    np.testing.assert_allclose(added, emission[1] * [0.5, 2.0, 1.0], rtol=1e-6, atol=1e-7)
    changes, surfaces = told["changes"], Surfaces.of(Asset.open(folder))
    first = np.array(said["first"]).reshape(-1, 4)[:, :3]
    np.testing.assert_allclose(first, surfaces.emission[:, 1] * [0.5, 2.0, 1.0], rtol=1e-6, atol=1e-7)
    assert said["doublings"] == [doublings(MOST_TERMS)]
    numbers = [MOST_TERMS, *(changes[name][key] for name, key in MATRICES)]
    assert said["changes"] == [numbers]
    assert said["environment"] == [[told["environment"][key] for key in ("columns", "scale", "side")]]
    painted = np.array(said["painted"]).reshape(-1, 2, 4)[..., :3]
    now = surfaces.repainted({told["objects"][1]: (0.5, 2.0, 1.0)})[0].albedo
    np.testing.assert_allclose(painted, np.stack([now, surfaces.albedo], axis=1), atol=1e-6)
    assert [row[0] > 50 for row in said["told"]] == [True, True]
