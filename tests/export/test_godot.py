"""The Godot project: shader text that Godot takes, a project whose every path is there, and an asset that is still an asset."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from srbf.asset import Asset
from srbf.errors import InputError, ShaderError
from srbf.export.godot import method_include, translated, write
from srbf.export.settings import Settings
from srbf.lights import DirectionalLight, PointLight
from srbf.methods import relight

METHODS = {name: name.replace("-", "_") for name in ("relighting-map", "eigen-map", "clustered-eigen-map")}  # others: test_tables.py
LIGHTS = (DirectionalLight((0.3, -0.4, 0.8), (1.0, 0.5, 0.2)), PointLight((0.3, 0.2, 1.1), (0.4, 0.9, 0.7)))
Made = Callable[..., Asset]


@pytest.fixture(scope="module")
def assets(make_asset: Made, make_planes: Made) -> dict[str, Asset]:
    """One of each method, with ambient light."""
    return {
        "relighting-map": make_asset(7, "half", ambient=True),
        "eigen-map": make_planes(9, None, "uint8", ambient=True),
        "clustered-eigen-map": make_planes(6, 5, "half", ambient=True),
    }


@pytest.fixture(scope="module")
def projects(assets: dict[str, Asset], tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folders = {}
    for method, asset in assets.items():
        folders[method] = tmp_path_factory.mktemp(method)
        write(asset, folders[method])
    return folders


@pytest.mark.parametrize("method", METHODS)
def test_the_project_is_an_asset_of_the_same_response(method: str, assets: dict[str, Asset], projects: dict[str, Path]) -> None:
    np.testing.assert_array_equal(relight(Asset.open(projects[method]), LIGHTS), relight(assets[method], LIGHTS))


@pytest.mark.parametrize("method", METHODS)
def test_every_path_of_the_project_is_there(method: str, projects: dict[str, Path]) -> None:
    folder = projects[method]
    texts = [path for path in folder.rglob("*") if path.suffix in (".gd", ".godot", ".tscn", ".gdshaderinc", ".cfg")]
    named = {match for path in texts for match in re.findall(r'"res://([^"%]+)"', path.read_text())}
    assert len(texts) >= 10
    assert len(named) >= 8
    used = set(re.findall(r"\$(\w+)", (folder / "example.gd").read_text()))
    assert used <= set(re.findall(r'^\[node name="(\w+)"', (folder / "example.tscn").read_text(), re.M))
    assert [path for path in named if not (folder / path).is_file()] == ["model.glb"]  # of those who give a mesh


def test_a_mesh_goes_along(make_asset: Made, tmp_path: Path) -> None:
    mesh = tmp_path / "room.glb"
    mesh.write_bytes(b"glTF and more")
    write(make_asset(3), tmp_path / "project", Settings(mesh=mesh))
    assert (tmp_path / "project" / "model.glb").read_bytes() == mesh.read_bytes()


def test_godot_leaves_the_images_alone(projects: dict[str, Path]) -> None:
    for folder in projects.values():
        assert (folder / "asset" / ".gdignore").is_file()
        images = [path for suffix in ("exr", "png") for path in folder.rglob(f"*.{suffix}")]
        assert images
        assert {path.parent for path in images} == {folder / "asset"}


@pytest.mark.parametrize("name", METHODS.values())
def test_an_include_is_functions_alone(name: str) -> None:
    text = method_include(name)
    code = re.sub(r"/\*.*?\*/|//[^\n]*", "", text, flags=re.DOTALL)
    assert not re.search(r"#version|#line|#include|\bprecision\b|\bhighp\b|\bgl_|\bmain\b", code)
    assert "struct SrbfPointLight" in text
    assert text.count("vec3 srbfFinish(vec3 sum, vec3 ambient) {") == 1


@pytest.mark.parametrize(
    ("glsl", "godot"),
    [
        ("#version 330 core\n#line 1 0\nint a;\n", "int a;\n"),
        ("precision highp float;\nfloat a;\n", "float a;\n"),
        ("float f(highp sampler2D t, vec2 uv);\n", "float f(sampler2D t, vec2 uv);\n"),
        ("vec4 f(mediump sampler2DArray t);\n", "vec4 f(sampler2DArray t);\n"),
        ("highp float a;\n", "highp float a;\n"),
    ],
)
def test_a_rule_takes_what_godot_lacks_and_no_more(glsl: str, godot: str) -> None:
    assert translated(glsl) == godot


@pytest.mark.parametrize(
    "stage", ["void main() {}\n", "in vec2 uv;\n", "layout(location = 0) out vec4 c;\n", "vec4 f() { return gl_FragCoord; }\n"]
)
def test_a_stage_is_refused(stage: str) -> None:
    with pytest.raises(ShaderError, match="expected only functions"):
        translated(stage)


def test_blocks_stay_blocks(make_asset: Made, tmp_path: Path) -> None:
    write(make_asset(5, "float", 8, 12), tmp_path, Settings("bc7"))
    asset = Asset.open(tmp_path)
    assert asset.encoding == "bc7"
    assert {entry["file"] for entry in asset.layers} == {"asset/maps.dds"}


def test_harmonics_are_refused(make_asset: Made, tmp_path: Path) -> None:
    asset = make_asset(4)
    asset.manifest["basis"] = {"kind": "spherical-harmonics"}
    with pytest.raises(InputError, match="Gaussians"):
        write(asset, tmp_path)


def test_script_and_shaders_name_the_same_uniforms(projects: dict[str, Path]) -> None:
    addon = projects["eigen-map"] / "addons" / "srbf"
    declared = {
        name
        for path in (addon / "shaders").glob("*.gdshaderinc")
        if not path.stem.startswith("probe_")
        for name in re.findall(r"^uniform \w+ (srbf_\w+)", path.read_text(), re.M)
    }
    script = (addon / "srbf_relight.gd").read_text()
    given = set(re.findall(r'(?:_give|set_shader_parameter)\("(\w+)"|^\t+"(srbf_\w+)": |constants\.(srbf_\w+)', script, re.M))
    assert {name for names in given for name in names if name} == declared


@pytest.mark.skipif(shutil.which("glslangValidator") is None, reason="glslangValidator is not installed (Debian: glslang-tools)")
@pytest.mark.parametrize("stage", ["canvas", "spatial"])
@pytest.mark.parametrize("method", METHODS)
def test_the_shaders_are_sound(method: str, stage: str, projects: dict[str, Path], tmp_path: Path) -> None:
    defines = {
        "relighting-map": "#define SRBF_RELIGHTING_MAP\n#define SRBF_K 7\n#define SRBF_LAYERS 7\n",
        "eigen-map": "#define SRBF_EIGEN_MAP\n#define SRBF_COMPONENTS 9\n#define SRBF_LAYERS 3\n",
        "clustered-eigen-map": "#define SRBF_CLUSTERED_EIGEN_MAP\n#define SRBF_COMPONENTS 6\n#define SRBF_LAYERS 2\n",
    }[method]
    checked(defines, stage, projects[method], tmp_path)


def checked(defines: str, stage: str, project: Path, tmp_path: Path) -> None:
    """Fails where a shader of a project does not compile as GLSL."""
    text = f'{defines}#define SRBF_POINT_LIGHTS 4\n#define SRBF_IRRADIANCE\n#include "res://addons/srbf/shaders/{stage}.gdshaderinc"\n'
    path = tmp_path / "shader.frag"
    path.write_text(as_glsl(text, project))
    result = subprocess.run(["glslangValidator", str(path)], capture_output=True, text=True)
    assert result.returncode == 0, result.stdout


def with_includes(text: str, folder: Path) -> str:
    """Text of Godot's with the files of a project in place."""
    while match := re.search(r'#include "res://([^"]+)"', text):
        text = text.replace(match[0], (folder / match[1]).read_text(), 1)
    return text


def as_glsl(text: str, folder: Path) -> str:
    """A fragment shader of Godot's as desktop GLSL: includes in place, hints off, built-ins declared."""
    text = with_includes(text, folder)
    text = re.sub(r"^render_mode .*$", "", text, flags=re.M)
    text = re.sub(r"^(uniform [\w ]+(?:\[[^\]]+\])?) : [\w, ]+(;| =)", r"\1\2", text, flags=re.M)
    text = re.sub(r"^varying ", "in ", text, flags=re.M)
    text = re.sub(r"^void vertex\(\) \{.*?^\}$", "", text, flags=re.M | re.S)
    built_in = (
        "in vec2 UV, UV2; out vec4 COLOR; vec3 ALBEDO, NORMAL; vec4 IRRADIANCE, RADIANCE; float SPECULAR, ROUGHNESS;\n"
        "uniform mat4 INV_VIEW_MATRIX; const float PI = 3.1415927;\n"
    )
    return f"#version 330 core\n{built_in}{text}\nvoid main() {{ fragment(); COLOR.rgb += ALBEDO * IRRADIANCE.rgb; }}\n"
