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
from srbf.gl.includes import resolve
from srbf.gl.textures import AssetTextures
from srbf.gl.uniforms import packed_lamps, padded
from srbf.lights import DirectionalLight, Light, PointLight, SpotLight, moved
from srbf.methods import folded_weights
from srbf.scalar_planes import first_function

SIDE = 48  # pixels of the picture
PLACES = 4  # of lamps, three of them used
LIGHTS: list[Light] = [
    DirectionalLight((0.3, 0.5, 0.8), (1.0, 0.8, 0.3)),
    PointLight((0.4, -0.2, 1.1), (1.0, 0.5, 2.0), a0=0.7),
    PointLight((-0.6, 0.4, 0.8), (0.3, 0.9, 0.4), a0=0.9, falloff="inverse-square"),
    SpotLight((0.4, -0.3, 1.5), (0.5, 1.0, 2.0), a0=0.8, direction=(0.1, 0.2, -1.0), inner=0.3, outer=0.9),
]
CLOSE = 1e-4  # of the picture's peak: P and uv are interpolated in single precision
EDGE = 0.02  # texels: nearer to an edge between two texels, either may be read

# A quad that lies in the plane z = 0.1 x of its object, its lightmap turned by a quarter: v is upwards, as meshes have it
OBJECT = np.array([[-1, -1, -0.1], [1, -1, 0.1], [1, 1, 0.1], [-1, 1, -0.1]])
UV = np.array([[0.9, 0.1], [0.9, 0.9], [0.1, 0.9], [0.1, 0.1]])
WORLD_FROM_OBJECT = np.array([[0.8, -0.6, 0, 0.1], [0.6, 0.8, 0, -0.2], [0, 0, 1, 0.05], [0, 0, 0, 1]])
ASSET_FROM_WORLD = np.array([[0, -1.5, 0, 0.3], [1.5, 0, 0, -0.1], [0, 0, 1.5, 0.2], [0, 0, 0, 1]])


def clip_from_world() -> np.ndarray:
    """A camera that looks down at the quad from the side."""
    eye, target = np.array([0.3, -2.5, 2.0]), np.zeros(3)
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, [0, 0, 1])
    right /= np.linalg.norm(right)
    view = np.eye(4)
    view[:3, :3] = np.stack([right, np.cross(right, forward), -forward])
    view[:3, 3] = -view[:3, :3] @ eye
    projection = np.array([[2.0, 0, 0, 0], [0, 2.0, 0, 0], [0, 0, -1.02, -0.404], [0, 0, -1, 0]])
    return projection @ view


def fragments() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """For every pixel, bottom row first: whether the quad is there, its object's position, its (u, v) with v downwards."""
    x = (2 * (np.arange(SIDE) + 0.5) / SIDE - 1)[None, :]
    y = x.T
    # clip = C (s, t, 1) for the point s, t of the quad in [-1, 1]^2, homogeneous; so (s, t, 1) ~ C^-1 (x, y, 1)
    corner = np.array([[1, 0, 0], [0, 1, 0], [0.1, 0, 0], [0, 0, 1]])
    clip = (clip_from_world() @ WORLD_FROM_OBJECT @ corner)[[0, 1, 3]]
    place = np.stack([x + 0 * y, y + 0 * x, 1 + 0 * x * y], axis=2) @ np.linalg.inv(clip).T
    s, t = place[..., 0] / place[..., 2], place[..., 1] / place[..., 2]
    inside = (np.abs(s) < 1) & (np.abs(t) < 1) & (place[..., 2] > 0)
    uv = np.stack([0.5 - 0.4 * t, 1 - (0.5 + 0.4 * s)], axis=2)
    return inside, np.stack([s, t, 0.1 * s], axis=2), uv


def draw(context: Any, asset: Asset) -> np.ndarray:
    """The picture, bottom row first."""
    maps = asset.method == "relighting-map"
    inside = [moved(light, asset.asset_from_world) for light in LIGHTS]
    lamps = [light for light in inside if isinstance(light, PointLight)]
    weights = folded_weights(asset, LIGHTS)
    stage = "lightmap.frag" if maps else f"{asset.method.replace('-', '_')}_lightmap.frag"
    defines = {"SRBF_LAMPS": PLACES} | ({"SRBF_K": asset.k, "SRBF_PAIRS": 1} if maps else {"SRBF_SCALARS": asset.scalars})
    with context, ExitStack() as resources:
        textures = AssetTextures(context, asset, Limits.of(context), resources)
        program = compile_program(context, resolve("stages/lightmap.vert"), resolve(f"stages/{stage}", defines=defines))
        resources.callback(program.release)
        used = {"maps" if maps else "planes": textures.layers(), "ambient": textures.ambient()}
        arrays = {"lamps": packed_lamps(lamps, PLACES)}
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
        program["lampCount"].value = len(lamps)
        matrices = {"worldFromObject": WORLD_FROM_OBJECT, "assetFromWorld": ASSET_FROM_WORLD, "clipFromWorld": clip_from_world()}
        for name, matrix in matrices.items():
            program[name].write(np.ascontiguousarray(matrix.T, np.float32))
        mesh = context.buffer(np.concatenate([OBJECT, UV], axis=1)[[0, 1, 2, 0, 2, 3]].astype(np.float32))
        resources.callback(mesh.release)
        drawn = context.vertex_array(program, [(mesh, "3f 2f", "position", "lightmapUv")])
        resources.callback(drawn.release)
        target = context.texture((SIDE, SIDE), 4, dtype="f4")
        resources.callback(target.release)
        frame = context.framebuffer([target])
        resources.callback(frame.release)
        frame.use()
        frame.clear()
        context.enable_only(context.NOTHING)
        drawn.render()
        return np.frombuffer(frame.read(components=4, dtype="f4"), np.float32).reshape(SIDE, SIDE, 4).copy()


def expected_at(asset: Asset, texels: np.ndarray, positions: np.ndarray) -> np.ndarray:
    """Numpy's answer of texels (n, 2: row, column) to LIGHTS, standing at positions (n, 3) of the asset's frame: an asset of one row."""
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
    picture = draw(context, asset)
    inside, place, uv = fragments()
    drawn = picture[..., 3] == 1
    assert inside.sum() > 300 and (drawn != inside).sum() <= 4  # the quad's rim
    shown = inside & drawn
    size = np.array([asset.width, asset.height])
    at = uv[shown] * size
    world = place[shown] @ WORLD_FROM_OBJECT[:3, :3].T + WORLD_FROM_OBJECT[:3, 3]
    positions = world @ ASSET_FROM_WORLD[:3, :3].T + ASSET_FROM_WORLD[:3, 3]
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
