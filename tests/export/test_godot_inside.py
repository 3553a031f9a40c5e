"""Lights inside a scene, and probes, in the Godot project: the tables go along, and the shaders are sound.

Godot itself runs in scripts/test_godot_surfels.py and scripts/test_godot_probes.py.
"""

from __future__ import annotations

import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from made_surfels import RANK, made_asset, residual
from made_tables import INSIDE, made
from test_godot import checked, with_includes

from srbf.asset import Asset
from srbf.export import export
from srbf.export.engine_folder import engine_root
from srbf.export.godot import write
from srbf.export.surfel_textures import MOST_TERMS
from srbf.io.image import read_image
from srbf.methods import relight
from srbf.methods.surface_changes import Surfaces
from srbf.probe_grid import ProbeGrid

HALF_STEP = 2.0**-11  # of a value: the series are half floats
ADDON = engine_root("godot") / "addons" / "srbf"
SHADERS = {"surfel_irradiance", "surfel_means", "table_sums", "block_sums", "matrix_product", "repainted_table", "probe_harmonics"}
PROBES = "probe_harmonics"
BUILT_IN = {
    "canvas_item": "in vec2 UV; out vec4 COLOR;\n",
    "spatial": "in vec2 UV, UV2; vec4 POSITION; uniform mat4 PROJECTION_MATRIX; vec3 ALBEDO, NORMAL, LIGHT, LIGHT_COLOR, DIFFUSE_LIGHT;\n"
    "float ROUGHNESS, ATTENUATION; uniform bool LIGHT_IS_DIRECTIONAL, OUTPUT_IS_SRGB; out vec4 COLOR;\n",
}


def test_the_tables_go_along(tmp_path: Path) -> None:
    base = made("light-cloud")
    surfels = base.tables["light_values"].shape[1]
    rng = np.random.default_rng(2)
    told = {"file": "transfer.exr", "rank": surfels, "surfels": surfels, "scale": 0.25}
    manifest = base.manifest | {
        "method": "transfer",
        "light_domain": "surfels",
        "surfel_transfer": told,
        "interpolation": {"kind": "surfels"},
    }
    table = rng.normal(size=(surfels, surfels, 3)).astype(np.float16)
    asset = replace(base, manifest=manifest, tables={**base.tables, "surfel_transfer": table})
    write(asset, tmp_path)
    found = Asset.open(tmp_path)
    assert relight(asset, INSIDE).max() > 0
    np.testing.assert_array_equal(relight(found, INSIDE), relight(asset, INSIDE))
    named = [found.manifest[key]["file"] for key in ("cells", "surfel_transfer", "light_values", "position_nodes")]
    assert all((tmp_path / file).is_file() and file.startswith("asset/") for file in named)


def test_passes_get_the_uniforms_that_they_have() -> None:
    declared = {name for shader in SHADERS - {PROBES} for name in uniforms_of(f"{shader}.gdshader")}
    script = "".join((ADDON / f"srbf_{name}_weights.gd").read_text() for name in ("surfel", "shape"))
    assert set(re.findall(r'"(srbf_\w+)"', script)) == declared
    assert set(re.findall(r"shaders/(\w+)\.gdshader", script)) == SHADERS - {PROBES}
    assert {path.stem for path in (ADDON / "shaders").glob("*.gdshader")} == SHADERS
    declared = {*uniforms_of(f"{PROBES}.gdshader"), *uniforms_of("probe_lit.gdshaderinc")}
    given = set(re.findall(r'"(srbf_\w+)"', "".join((ADDON / f"srbf_{name}.gd").read_text() for name in ("probes", "probe_grid"))))
    assert given | {"srbf_asset_from_world"} == declared  # which SrbfRelight gives


def test_all_exchanges_of_light_go_along(tmp_path: Path) -> None:
    """The residual of the series: (1 - F) (1 + F + F² + …) = 1."""
    asset = made_asset()
    write(asset, tmp_path)
    told = Asset.open(tmp_path).manifest["surface_series"]
    series = read_image(tmp_path / told["file"]).astype(np.float64) * told["scale"]
    feedback = Surfaces.of(asset).feedback
    assert told["terms"] == MOST_TERMS
    assert np.abs(residual(feedback, series)).max() < HALF_STEP * np.abs(series).max()


def test_as_few_exchanges_of_light_as_the_bake_has_go_along(tmp_path: Path) -> None:
    few = made_asset(bounces=3)
    write(few, tmp_path)
    told = Asset.open(tmp_path).manifest["surface_series"]
    series = read_image(tmp_path / told["file"]).astype(np.float64) * told["scale"]
    feedback = Surfaces.of(few).feedback
    assert told["terms"] == 3
    expected = np.eye(RANK)[:, :, None] + feedback + np.einsum("ijc,jkc->ikc", feedback, feedback)
    np.testing.assert_allclose(series, expected, rtol=HALF_STEP, atol=1e-6)


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("project")
    write(made_asset(), folder)
    return folder


def uniforms_of(shader: str) -> set[str]:
    return set(re.findall(r"^uniform \w+ (srbf_\w+)", (ADDON / "shaders" / shader).read_text(), re.M))


def probes() -> Asset:
    base = made("light-cloud", height=4, width=24)
    grid = ProbeGrid(
        (0.1, 0.2, 0.3), 0.5, (2, 2, 2), np.zeros((8, 3), np.float32), np.arange(8), np.arange(51 * 51, dtype=np.float16).reshape(51, 51, 1)
    )
    return replace(base, manifest=base.manifest | {"receiver": grid.described()}, probes=grid)


@pytest.mark.lengthy
def test_probes_go_along_and_come_back(tmp_path: Path) -> None:
    asset = probes()
    write(asset, tmp_path / "project")
    found = Asset.open(tmp_path / "project")
    assert found.manifest["receiver"]["nearness"] == "asset/probe_nearness.exr" and found.probes is not None
    np.testing.assert_array_equal(found.probes.nearness, probes().probes.nearness)  # type: ignore[union-attr]
    export(found, "exr", tmp_path / "again")  # whose files lay elsewhere
    again = Asset.open(tmp_path / "again")
    assert again.probes is not None and again.manifest["receiver"] == asset.manifest["receiver"]


@pytest.mark.skipif(shutil.which("glslangValidator") is None, reason="glslangValidator is not installed (Debian: glslang-tools)")
@pytest.mark.parametrize("stage", ["probe_facets", "probe_spatial"])
def test_shaders_of_probes_are_sound(stage: str, tmp_path: Path) -> None:
    write(probes(), tmp_path)
    defines = "#define SRBF_WEIGHTED\n#define SRBF_CLUSTERED_EIGEN_MAP\n#define SRBF_COMPONENTS 6\n#define SRBF_LAYERS 2\n"
    checked(defines, stage, tmp_path, tmp_path)


@pytest.mark.skipif(shutil.which("glslangValidator") is None, reason="glslangValidator is not installed (Debian: glslang-tools)")
@pytest.mark.parametrize("shader", sorted(SHADERS))
def test_passes_are_sound(shader: str, project: Path, tmp_path: Path) -> None:
    text = with_includes((ADDON / "shaders" / f"{shader}.gdshader").read_text(), project)
    kind = re.search(r"^shader_type (\w+);$", text, re.M)
    assert kind is not None
    text = re.sub(r"^(shader_type|render_mode) .*$", "", text, flags=re.M)
    text = re.sub(r"^(uniform \w+ \w+(?:\[\d+\])?) : [\w, ]+;", r"\1;", text, flags=re.M)
    text = re.sub(r"^varying ", "", text, flags=re.M)
    calls = "".join(f"{stage}(); " for stage in ("vertex", "fragment", "light") if f"void {stage}()" in text)
    path = tmp_path / "shader.frag"
    path.write_text(f"#version 330 core\n{BUILT_IN[kind[1]]}{text}\nvoid main() {{ {calls}}}\n")
    result = subprocess.run(["glslangValidator", str(path)], capture_output=True, text=True)
    assert result.returncode == 0, result.stdout
