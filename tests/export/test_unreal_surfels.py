"""Unreal's passes that light surfels: their Custom nodes drawn beside numpy and rays; the C++ and the editor script around them."""

from __future__ import annotations

import math
import runpy
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from made_surfels import LIGHTS, PANORAMA, RANK, SIDE, irradiance_of, made_asset, recolored, residual, table_of, weights_of
from made_tables import made
from passes import Passes, doublings, face_axes, frame_of, square
from test_unreal_tables import component_compiles
from unreal_passes import Unreal, node_of
from unreal_stand_in import StandIn

from srbf.asset import Asset
from srbf.errors import InputError
from srbf.export import spirv, surfel_textures, unreal
from srbf.export.engine_folder import engine_root
from srbf.export.surfel_textures import MOST_TERMS
from srbf.export.unreal_surfels import NUMBERS
from srbf.lights import EnvironmentLight, NamedLight, PointLight
from srbf.methods import in_asset_frame
from srbf.methods.kept_visibility import add_visibility, by_depths, kept_visibility
from srbf.methods.surface_changes import Surfaces, with_albedo
from srbf.visibility.cloud_lights import CloudLights
from srbf.visibility.received import ReceivedLight
from srbf.visibility.surface_cells import Cells

pytestmark = pytest.mark.engines
pytest.importorskip("embreex")
pytest.importorskip("sklearn")

SOURCE = engine_root("unreal") / "Source"
HERE = Path(__file__).parent / "unreal"
CLOSE = 5e-6  # of the largest: sums of floats
HALF = 1e-3  # of the largest: numpy rounds a repainted table to half floats
SOLVED = 1e-5  # of one: what 512 terms and sums of floats leave; 64 terms leave 100 times as much
CELLS = 0.005  # of all weights: texels that straddle cells count in parts here, wholly in numpy, which has them finer
MOVED = np.array([[0.0, -1.25, 0.0, 0.3], [1.25, 0.0, 0.0, -0.2], [0.0, 0.0, 1.25, 0.1], [0.0, 0.0, 0.0, 1.0]])  # asset from world


@pytest.fixture(scope="module")
def assets() -> dict[str, Asset]:
    """Shadows by captures of the scene, and by compressed depths; surfaces that change with three bounces."""
    plain = made_asset()
    kept = made_asset()
    cells = Cells.of_image(kept.tables["cells"])
    inside = replace(CloudLights.of_asset(kept), cells=cells, free=np.array(kept.manifest["free_places"]))
    add_visibility(kept, inside, "pca:12", False)
    plain.manifest["asset_from_world"] = MOVED.tolist()
    return {"faces": plain, "depths": kept, "few": made_asset(bounces=3)}


@pytest.fixture(scope="module")
def folders(assets: dict[str, Asset], tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    found = {name: tmp_path_factory.mktemp(name) for name in assets}
    for name, asset in assets.items():
        unreal.write(asset, found[name])
    return found


@pytest.fixture(scope="module")
def passes() -> Iterator[Passes]:
    with Passes() as made_:
        yield made_


needs_spirv = pytest.mark.skipif(not spirv.available(), reason="needs glslang-tools, spirv-tools and spirv-cross (Debian)")


@needs_spirv
def test_captures_of_the_scene_shadow_cells_as_rays_do(passes: Passes, assets: dict[str, Asset], folders: dict[str, Path]) -> None:
    """All kinds of light, one after the other, of an asset that is turned and scaled; then their weights."""
    asset = assets["faces"]
    drawn = Unreal(passes, folders["faces"], asset)
    lights = [replace(light, falloff="inverse-square") if isinstance(light, PointLight) else light for light in LIGHTS.values()]
    sum_ = drawn.irradiance(lights, faces=True)
    found = passes.read(sum_).reshape(-1, 4)[: len(drawn.made.order), :3]
    expected = np.sum([irradiance_of(asset, light) for light in lights], axis=0)[drawn.made.order]
    np.testing.assert_allclose(found, expected, atol=CLOSE * expected.max())
    weights = weights_of(asset, lights)
    np.testing.assert_allclose(drawn.weights(sum_), weights, atol=CLOSE * np.abs(weights).max())


@needs_spirv
def test_an_environment_and_changed_surfaces_add_what_numpy_says(
    passes: Passes, assets: dict[str, Asset], folders: dict[str, Path]
) -> None:
    """The map as Blender has it, in the frame of an asset that is turned; an object that emits, before and after another is repainted."""
    asset = assets["faces"]
    drawn = Unreal(passes, folders["faces"], asset)
    nothing = passes.texture(np.zeros((*drawn.made.places.shape[:2], 4)))
    axes = MOVED[:3, :3] / 1.25
    at = [(*axes @ [1, 0, 0], SIDE), (*axes @ [0, 1, 0], 0), (*axes @ [0, 0, 1], 0.7)]
    found = drawn.weights(nothing, drawn.lit_by(PANORAMA, at, passes.column(np.zeros((RANK, 3)))))
    fine = EnvironmentLight(PANORAMA.repeat(4, axis=0).repeat(4, axis=1), (0.7,) * 3)
    expected = weights_of(asset, list(in_asset_frame(asset, [fine])))
    assert np.linalg.norm(found - expected) < CELLS * np.linalg.norm(expected)
    surfaces = Surfaces.of(asset)
    light, painted = NamedLight("Screen", (0.5, 2.0, 1.0)), {"Walls": (0.1, 0.6, 0.9)}
    first = passes.column(surfaces.emission[:, 1] * light.color)
    exchange, series, table = drawn.repainted(recolored(asset, painted))
    assert np.abs(residual(passes.read(exchange), passes.read(series))).max() < SOLVED
    images = {"First": series, "Second": first, "Addend": first}
    reflected = drawn.made_by("SurfelProduct", 1, RANK, images, Matrix=(RANK, 1, 0, 0))
    images = {"First": exchange, "Second": reflected, "Addend": first}
    bounced = drawn.made_by("SurfelProduct", 1, RANK, images, Matrix=(RANK, 1, 1, 0))
    point = LIGHTS["point"]
    lit = np.zeros((drawn.made.places.shape[0] * drawn.made.places.shape[1], 4))
    lit[: len(drawn.made.order), :3] = irradiance_of(asset, point)[drawn.made.order]
    found = drawn.weights(passes.texture(lit.reshape(*drawn.made.places.shape[:2], 4)), bounced, table)
    after = weights_of(with_albedo(Asset.open(folders["faces"]), painted), [point, light])
    np.testing.assert_allclose(found, after, atol=HALF * np.abs(after).max())
    assert np.abs(after - weights_of(asset, [point, light])).max() > 20 * HALF * np.abs(after).max()


@needs_spirv
def test_repainting_sums_as_few_bounces_as_the_bake_has(passes: Passes, assets: dict[str, Asset], folders: dict[str, Path]) -> None:
    few, painted = assets["few"], {"Walls": (0.1, 0.6, 0.9)}
    exchange, series, table = (passes.read(image) for image in Unreal(passes, folders["few"], few).repainted(recolored(few, painted)))
    left = -np.linalg.matrix_power(np.moveaxis(exchange[..., :3], 2, 0), 3)
    np.testing.assert_allclose(residual(exchange, series), left, atol=SOLVED)
    expected = table_of(few) + Surfaces.of(few).repainted(painted)[1]
    np.testing.assert_allclose(table[..., :3], expected, atol=CLOSE * np.abs(expected).max())


@needs_spirv
def test_compressed_depths_shadow_cells_as_numpy_has_it(passes: Passes, assets: dict[str, Asset], folders: dict[str, Path]) -> None:
    asset = assets["depths"]
    drawn = Unreal(passes, folders["depths"], asset)
    cells = Cells.of_image(asset.tables["cells"])
    shadows = kept_visibility(by_depths(asset), "surfel_visibility", cells.normals)
    for light in (replace(LIGHTS["point"]), LIGHTS["spot"], LIGHTS["directional"]):
        found = passes.read(drawn.irradiance([light], faces=False)).reshape(-1, 4)[: len(cells.places), :3]
        expected = ReceivedLight(cells, shadows).irradiance(light)[drawn.made.order]
        off = np.abs(found - expected).max(axis=1) > 1e-4 * expected.max()
        assert off.mean() <= 0.02, "depths that a comparison ends up on either side of"
        assert (expected > 0.05 * expected.max()).any(axis=1).mean() > 0.05 and (expected.max(axis=1) == 0).mean() > 0


@pytest.mark.skipif(shutil.which("g++") is None, reason="needs g++ (Debian)")
def test_c_plus_plus_takes_lights_into_the_assets_frame(assets: dict[str, Asset], folders: dict[str, Path], tmp_path: Path) -> None:
    program = tmp_path / "surfels"
    command = ["g++", "-std=c++17", "-Wall", "-Wextra", "-Werror", f"-I{SOURCE}", str(HERE / "Surfels.cpp"), "-o", str(program)]
    assert subprocess.run(command, capture_output=True).returncode == 0

    def ask(file: Path) -> dict[str, np.ndarray]:
        done = subprocess.run([str(program), str(file), "120", "-50", "80"], capture_output=True, text=True, check=True)
        if done.stdout.startswith("refused"):
            raise ValueError(done.stdout)
        lines = [line.split() for line in done.stdout.splitlines()]
        return {name: np.array([[float(x) for x in line[1:]] for line in lines if line[0] == name]) for name in {line[0] for line in lines}}

    asset, made_ = assets["faces"], surfel_textures.surfel_textures(assets["faces"])
    said = ask(folders["faces"] / NUMBERS)
    widths = [(image.shape[1], image.shape[0]) for image in (made_.places, made_.ranges)]
    assert said["sizes"].tolist() == [[*widths[0], *widths[1], asset.components + 1, asset.clusters, 0]]
    np.testing.assert_allclose(said["meters"], [[made_.reach, made_.lift, 0, 0.0125]])
    shapes = [(*asset.tables[name].shape[:2], asset.manifest[name]["scale"]) for name in ("surfel_transfer", "light_values")]
    assert said["table"].tolist() == [[*shape, -(-shape[1] // 64)] for shape in shapes]
    told, surfaces = asset.manifest["environment_transfer"], Surfaces.of(asset)
    scales = asset.manifest["surfaces"]["scales"]
    assert said["environment"].tolist() == [[len(told["cells"]), SIDE, told["scale"]]]
    products = (scales["surface_gather"] * scales["surface_sent"], scales["surface_gather"], scales["surface_feedback"])
    assert said["changes"].tolist() == [[len(surfaces.albedo), MOST_TERMS, *products]] and said["object"].ravel().tolist() == [0, 1]
    assert said["doubling"].ravel().tolist() == doublings(MOST_TERMS)
    assert ask(folders["few"] / NUMBERS)["doubling"].ravel().tolist() == [True, False]
    radiance = np.array([0.5, 2.0, 1.0])
    bounced, first = (said[name].reshape(-1, 4)[:, :3] for name in ("emitted", "first"))
    np.testing.assert_allclose(bounced, surfaces.emitted("Screen", radiance), rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(first, surfaces.emission[:, 1] * radiance, rtol=1e-5, atol=1e-6)
    now = surfaces.repainted({"Screen": tuple(radiance)})[0].albedo
    np.testing.assert_allclose(said["painted"].reshape(-1, 2, 4)[..., :3], np.stack([now, surfaces.albedo], axis=1), atol=1e-6)
    blender = np.array([1.2, 0.5, 0.8])  # of (120, -50, 80) in Unreal
    np.testing.assert_allclose(said["place"][0], MOVED[:3, :3] @ blender + MOVED[:3, 3] - made_.middle)
    turned = MOVED[:3, :3] @ blender
    np.testing.assert_allclose(said["direction"][0], turned / np.linalg.norm(turned))
    np.testing.assert_allclose(said["back"][0], np.array([120, -50, 80]) / np.linalg.norm([120, -50, 80]))
    world = np.linalg.inv(MOVED) @ [*made_.middle, 1]
    np.testing.assert_allclose(said["middle"][0], world[:3] * [100, -100, 100])
    np.testing.assert_array_equal(said["face"].reshape(6, 3, 3), [face_axes(face) for face in range(6)])
    across, up, toward = frame_of(np.array([0.48, -0.6, 0.64]))
    np.testing.assert_allclose(said["frame"], [across, up, -toward], atol=1e-12)
    assert said["square"].tolist() == [list(square(90))]
    np.testing.assert_allclose(said["versine"], [[1 - math.cos(0.3)]])
    whole = (folders["depths"] / NUMBERS).read_bytes()
    for data, complaint in ((whole[:-1], "another size"), (b"EXR and more", "another file")):
        (tmp_path / "wrong").write_bytes(data)
        with pytest.raises(ValueError, match=complaint):
            ask(tmp_path / "wrong")


@pytest.mark.skipif(shutil.which("g++") is None, reason="needs g++ (Debian)")
def test_the_component_compiles_against_unreals_interfaces(tmp_path: Path) -> None:
    component_compiles("SrbfSurfelLights", tmp_path)
    component_compiles("SrbfSurfelShapes", tmp_path, "SrbfSurfelLights")


@pytest.mark.parametrize("kind", ["faces", "depths"])
def test_the_script_makes_the_passes(
    folders: dict[str, Path],
    stand_in: StandIn,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    kind: str,
) -> None:
    folder, node = folders[kind], node_of(folders[kind])
    monkeypatch.setattr(sys, "argv", ["import_srbf.py"])
    runpy.run_path(str(folder / "import_srbf.py"), run_name="__main__")
    assert (tmp_path / "Project/Shaders" / Path(node["include"]).name).is_file()
    [copied] = (tmp_path / "Project/Srbf").glob("*_surfels.bin")
    assert copied.read_bytes() == (folder / NUMBERS).read_bytes()
    customs = {made_.properties.get("description"): made_ for made_ in stand_in.made if made_.kind == "MaterialExpressionCustom"}
    for name, told in node["materials"].items():
        custom = customs[name]
        connected = [call[4] for call in stand_in.calls if call[0].endswith("connect_material_expressions") and call[3] is custom]
        assert connected == told["inputs"] and custom.properties["code"] == told["code"]
    signed = [made_ for made_ in stand_in.made if made_.properties.get("allow_negative_emissive_color")]
    assert len(signed) == len(node["materials"]) == 11
    shadows = {"Face0", "Face5", "Across"} if kind == "faces" else {"Coefficients", "Bases", "Clusters"}
    assert shadows <= set(node["materials"]["SurfelIrradiance"]["inputs"])
    assert {path.name for path in (folder / "Source").iterdir()} == {path.name for path in SOURCE.iterdir()}


def test_assets_of_names_have_no_surfels_and_large_tables_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    unreal.write(made("light-mix"), tmp_path)
    assert not (tmp_path / NUMBERS).exists() and "SrbfSurfels.h" not in {path.name for path in (tmp_path / "Source").iterdir()}
    monkeypatch.setattr(surfel_textures, "LARGEST", 16)
    with pytest.raises(InputError, match="expected surfel_transfer of at most 16 rows and columns, found 17 x"):
        unreal.write(made_asset(), tmp_path / "large")
