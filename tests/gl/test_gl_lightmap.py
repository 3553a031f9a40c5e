"""A mesh with a lightmap, drawn in perspective by the lightmap stages, against numpy at every fragment."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from typing import Any

import numpy as np
import pytest

from srbf import methods
from srbf.asset import Asset
from srbf.gl.context import Limits, compile_program
from srbf.gl.includes import ShaderSource, resolve
from srbf.gl.textures import AssetTextures
from srbf.gl.uniforms import packed_point_lights, padded
from srbf.lights import DirectionalLight, Light, PointLight, SpotLight, moved
from srbf.methods import projected_weights
from srbf.methods.coefficient_maps import first_function

SIDE = 48  # pixels of the picture
PLACES = 4  # of point lights, three of them used
LIGHTS: list[Light] = [
    DirectionalLight((0.3, 0.5, 0.8), (1.0, 0.8, 0.3)),
    PointLight((0.4, -0.2, 1.1), (1.0, 0.5, 2.0), a0=0.7),
    PointLight((-0.6, 0.4, 0.8), (0.3, 0.9, 0.4), a0=0.9, falloff="inverse-square"),
    SpotLight((0.4, -0.3, 1.5), (0.5, 1.0, 2.0), a0=0.8, direction=(0.1, 0.2, -1.0), inner=0.3, outer=0.9),
]
CLOSE = 1e-5  # of the picture's peak, at the places that the shader itself was at
PLACED = 1 / 64  # pixels: as near to its middle is a fragment interpolated
EDGE = 0.02  # texels: nearer to an edge between two texels, either may be read

# A quad that lies in the plane z = 0.1 x of its object, its lightmap turned by a quarter: v is upwards, as meshes have it
OBJECT = np.array([[-1, -1, -0.1], [1, -1, 0.1], [1, 1, 0.1], [-1, 1, -0.1]])
UV = np.array([[0.9, 0.1], [0.9, 0.9], [0.1, 0.9], [0.1, 0.1]])
# Where its corners are in the picture, pixels: whole ones, which a rasterizer keeps, however coarsely it places corners
CORNERS = np.array([[3, 7], [45, 2], [38, 41], [12, 46]], float)
WORLD_FROM_OBJECT = np.array([[0.8, -0.6, 0, 0.1], [0.6, 0.8, 0, -0.2], [0, 0, 1, 0.05], [0, 0, 0, 1]])
ASSET_FROM_WORLD = np.array([[0, -1.5, 0, 0.3], [1.5, 0, 0, -0.1], [0, 0, 1.5, 0.2], [0, 0, 0, 1]])


def clip_from_plane(corners: np.ndarray = CORNERS) -> np.ndarray:
    """(3, 3): clip x, y and w of a point (s, t, 1) of the quad, whose corners it takes to `corners` (pixels, bottom row first).

    The projection that four points fix: each corner p gives x and y of H (s, t, 1) ~ (p, 1), eight equations for H with H[2, 2] = 1.
    """
    rows, right = [], []
    for (s, t, _), (x, y) in zip(OBJECT, 2 * corners / SIDE - 1, strict=True):
        rows += [[s, t, 1, 0, 0, 0, -x * s, -x * t], [0, 0, 0, s, t, 1, -y * s, -y * t]]
        right += [x, y]
    return np.append(np.linalg.solve(np.array(rows), np.array(right)), 1).reshape(3, 3)


def clip_from_world(corners: np.ndarray = CORNERS) -> np.ndarray:
    """A camera that sees the quad's corners at `corners`, at half its depth."""
    across, up, depth = clip_from_plane(corners)
    clip_from_object = np.zeros((4, 4))
    clip_from_object[[0, 1, 3]] = [[row[0], row[1], 0, row[2]] for row in (across, up, depth)]
    return clip_from_object @ np.linalg.inv(WORLD_FROM_OBJECT)


def fragments() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """For every pixel, bottom row first: whether the quad is there, its object's position, its (u, v) with v downwards."""
    x = (2 * (np.arange(SIDE) + 0.5) / SIDE - 1)[None, :]
    y = x.T
    # clip = C (s, t, 1) for the point s, t of the quad in [-1, 1]^2, homogeneous; so (s, t, 1) ~ C^-1 (x, y, 1)
    place = np.stack([x + 0 * y, y + 0 * x, 1 + 0 * x * y], axis=2) @ np.linalg.inv(clip_from_plane()).T
    s, t = place[..., 0] / place[..., 2], place[..., 1] / place[..., 2]
    inside = (np.abs(s) < 1) & (np.abs(t) < 1) & (place[..., 2] > 0)
    uv = np.stack([0.5 - 0.4 * t, 1 - (0.5 + 0.4 * s)], axis=2)
    return inside, np.stack([s, t, 0.1 * s], axis=2), uv


def telling(source: ShaderSource) -> ShaderSource:
    """The lightmap stage with two more outputs: the receiver's position and the place on the lightmap that it is given."""
    text = source.text.replace("void main() {", "layout(location = 1) out vec4 at;\nlayout(location = 2) out vec4 on;\nvoid main() {")
    assert text.count("void main() {") == 1
    return ShaderSource(
        text.replace("void main() {", "void main() {\n    at = vec4(receiver, 1.0);\n    on = vec4(uv, 0.0, 1.0);"), source.files
    )


def draw(context: Any, asset: Asset, corners: np.ndarray = CORNERS) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Bottom row first: the picture, and of each fragment its receiver's position and its place on the lightmap."""
    maps = asset.method == "relighting-map"
    inside = [moved(light, asset.asset_from_world) for light in LIGHTS]
    point_lights = [light for light in inside if isinstance(light, PointLight)]
    weights = projected_weights(asset, LIGHTS)
    stage = "lightmap.frag" if maps else f"{asset.method.replace('-', '_')}_lightmap.frag"
    defines = {"SRBF_POINT_LIGHTS": PLACES} | ({"SRBF_K": asset.k, "SRBF_PAIRS": 1} if maps else {"SRBF_COMPONENTS": asset.components})
    with context, ExitStack() as resources:
        textures = AssetTextures(context, asset, Limits.of(context), resources)
        program = compile_program(context, resolve("stages/lightmap.vert"), telling(resolve(f"stages/{stage}", defines=defines)))
        resources.callback(program.release)
        used = {"maps" if maps else "planes": textures.layers(), "ambient": textures.ambient()}
        arrays = {"pointLights": packed_point_lights(point_lights, PLACES)}
        if maps:
            used["rTable"] = textures.r_pairs()
            arrays |= {"weights": padded(weights), "centers": padded(asset.basis.centers)}
            arrays |= {"scale": padded(asset.scale), "bias": padded(asset.bias)}
        else:
            arrays |= {"scale": asset.scale, "bias": asset.bias}
            rows = np.pad(weights.reshape(asset.clusters, -1, 3), ((0, 0), (0, 0), (0, 1)))
            used["wTable"] = textures.w_table()
            used["weights"] = resources.enter_context(textures.passing(rows.astype(np.float32)))
            program["tableSize"].value = asset.manifest["w_table"]["size"]
            if asset.method.startswith("clustered"):
                used["clusters"] = textures.clusters()
        for unit, (name, texture) in enumerate(used.items()):
            texture.use(unit)
            program[name].value = unit
        for name, array in arrays.items():
            program[name].write(np.ascontiguousarray(array, np.float32))
        program["pointLightCount"].value = len(point_lights)
        matrices = {"worldFromObject": WORLD_FROM_OBJECT, "assetFromWorld": ASSET_FROM_WORLD, "clipFromWorld": clip_from_world(corners)}
        for name, matrix in matrices.items():
            program[name].write(np.ascontiguousarray(matrix.T, np.float32))
        mesh = context.buffer(np.concatenate([OBJECT, UV], axis=1)[[0, 1, 2, 0, 2, 3]].astype(np.float32))
        resources.callback(mesh.release)
        drawn = context.vertex_array(program, [(mesh, "3f 2f", "position", "lightmapUv")])
        resources.callback(drawn.release)
        targets = [context.texture((SIDE, SIDE), 4, dtype="f4") for _ in range(3)]
        for target in targets:
            resources.callback(target.release)
        frame = context.framebuffer(targets)
        resources.callback(frame.release)
        frame.use()
        frame.clear()
        context.enable_only(context.NOTHING)
        drawn.render()
        read = [np.frombuffer(target.read(), np.float32).reshape(SIDE, SIDE, 4).copy() for target in targets]
        return read[0], read[1][..., :3], read[2][..., :2]


def expected_at(asset: Asset, texels: np.ndarray, positions: np.ndarray) -> np.ndarray:
    """Numpy's response of texels (n, 2: row, column) to LIGHTS, standing at positions (n, 3) of the asset's frame: an asset of one row."""
    rows, columns = texels.T
    images = {"position": positions[None].astype(np.float32), "ambient": asset.images["ambient"][rows, columns][None]}
    tables = dict(asset.tables)
    if "cluster_index" in tables:
        tables["cluster_index"] = tables["cluster_index"][rows, columns][None]
    manifest = asset.manifest | {"width": len(texels), "height": 1}
    gathered = Asset(manifest, asset.stored[:, rows, columns][:, None], asset.scale, asset.bias, tables, images)
    return methods.linear_response(gathered, LIGHTS)[0]


@pytest.mark.parametrize("method", ["relighting-map", "eigen-map", "clustered-eigen-map"])
def test_a_mesh_is_lit_as_numpy_lights_its_fragments(
    context: Any, make_asset: Callable[..., Asset], make_planes: Callable[..., Asset], method: str
) -> None:
    if method == "relighting-map":
        asset = make_asset(7, "uint8", ambient=True)
    else:
        asset = make_planes(9, 5 if method.startswith("clustered") else None, "uint8", ambient=True)
    asset.manifest["asset_from_world"] = ASSET_FROM_WORLD.tolist()
    picture, positions, uv = draw(context, asset)
    inside, _, _ = fragments()
    drawn = picture[..., 3] == 1
    assert inside.sum() > 300 and (drawn != inside).sum() <= 4  # the quad's rim
    shown = inside & drawn
    size = np.array([asset.width, asset.height])
    at = uv[shown].astype(float) * size
    positions = positions[shown].astype(float)
    nearest = np.floor(at).astype(int)
    if method.startswith("clustered"):  # rebuilt first, filtered then
        base = np.floor(at - 0.5).astype(int)
        part = at - 0.5 - base
        total = np.zeros((len(at), 3))
        for step in ((0, 0), (1, 0), (0, 1), (1, 1)):
            texel = np.clip(base + step, 0, size - 1)
            share = np.where(step, part, 1 - part).prod(axis=1)
            total += share[:, None] * expected_at(asset, texel[:, ::-1], positions)
        sure = np.ones(len(at), bool)
    else:
        total = expected_at(asset, nearest[:, ::-1], positions)
        sure = (np.abs(at - np.round(at)) > EDGE).all(axis=1)
    steady = (np.abs(at - np.round(at)) > EDGE).all(axis=1)  # the ambient image is read nearest
    expected = np.maximum(total, 0) + asset.images["ambient"][nearest[:, 1], nearest[:, 0]]
    found = picture[shown][:, :3]
    np.testing.assert_allclose(found[sure & steady], expected[sure & steady], atol=CLOSE * expected.max())
    assert (sure & steady).mean() > 0.8 and (total[sure] > 0).any() and expected.std() > 0.1
    if method.startswith("clustered"):
        clusters = first_function(asset, slice(None))[nearest[:, 1], nearest[:, 0]]
        assert len(np.unique(clusters)) == 5


def test_fragments_are_at_their_places(context: Any, make_asset: Callable[..., Asset]) -> None:
    """Position and lightmap coordinates of each fragment, against the projection's inverse at the pixel's middle."""
    asset = make_asset(7, "uint8", ambient=True)
    asset.manifest["asset_from_world"] = ASSET_FROM_WORLD.tolist()
    picture, positions, uv = draw(context, asset)
    inside, place, expected_uv = fragments()
    world = place @ WORLD_FROM_OBJECT[:3, :3].T + WORLD_FROM_OBJECT[:3, 3]
    expected = world @ ASSET_FROM_WORLD[:3, :3].T + ASSET_FROM_WORLD[:3, 3]
    shown = inside & (picture[..., 3] == 1)
    for found, right in ((positions, expected), (uv, expected_uv)):
        across, up = (np.abs(np.gradient(right, axis=axis)).max(axis=2) for axis in (1, 0))
        off = np.abs(found - right).max(axis=2)
        assert (off[shown] <= PLACED * (across + up)[shown]).all()
