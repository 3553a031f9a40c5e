"""Lights inside a scene in the Godot project: the tables go along, and the passes of the surfels are sound.

Godot itself runs in scripts/test_godot_surfels.py.
"""

from __future__ import annotations

import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from made_tables import INSIDE, made

from srbf.asset import Asset
from srbf.export.engine_folder import engine_root
from srbf.export.godot import write
from srbf.methods import relight

ADDON = engine_root("godot") / "addons" / "srbf"
SHADERS = {"surfel_irradiance", "surfel_means", "table_sums", "block_sums"}
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
    declared = {name for shader in SHADERS for name in uniforms_of(shader)}
    script = (ADDON / "srbf_surfel_weights.gd").read_text()
    assert set(re.findall(r'"(srbf_\w+)"', script)) == declared
    assert set(re.findall(r"shaders/(\w+)\.gdshader", script)) == SHADERS == {path.stem for path in (ADDON / "shaders").glob("*.gdshader")}


def uniforms_of(shader: str) -> set[str]:
    return set(re.findall(r"^uniform \w+ (srbf_\w+)", (ADDON / "shaders" / f"{shader}.gdshader").read_text(), re.M))


@pytest.mark.skipif(shutil.which("glslangValidator") is None, reason="glslangValidator is not installed (Debian: glslang-tools)")
@pytest.mark.parametrize("shader", sorted(SHADERS))
def test_passes_are_sound(shader: str, tmp_path: Path) -> None:
    text = (ADDON / "shaders" / f"{shader}.gdshader").read_text()
    kind = re.search(r"^shader_type (\w+);$", text, re.M)
    assert kind is not None
    text = re.sub(r"^(shader_type|render_mode) .*$", "", text, flags=re.M)
    text = re.sub(r"^(uniform \w+ \w+) : [\w, ]+;", r"\1;", text, flags=re.M)
    text = re.sub(r"^varying ", "", text, flags=re.M)
    calls = "".join(f"{stage}(); " for stage in ("vertex", "fragment", "light") if f"void {stage}()" in text)
    path = tmp_path / "shader.frag"
    path.write_text(f"#version 330 core\n{BUILT_IN[kind[1]]}{text}\nvoid main() {{ {calls}}}\n")
    result = subprocess.run(["glslangValidator", str(path)], capture_output=True, text=True)
    assert result.returncode == 0, result.stdout
