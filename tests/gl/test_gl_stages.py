"""Every stage compiles as desktop 330 core, as ES 3.00 and for Vulkan, and keeps the pack's rules."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

from srbf.errors import ShaderError
from srbf.gl.context import compile_program
from srbf.gl.includes import resolve, resolve_text, shader_root

ROOT = shader_root()
STAGES = sorted(path.name for path in (ROOT / "stages").iterdir())
FILES = sorted(path.relative_to(ROOT).as_posix() for path in ROOT.rglob("*") if path.suffix in (".glsl", ".vert", ".frag"))
# 384 scalars are 96 layers, 192 of the 224 vec4 that ES 3.00 promises; more take passes of some layers
PLANES: list[dict[str, object]] = [{"SRBF_COMPONENTS": s} for s in (1, 9, 384)] + [{"SRBF_COMPONENTS": 1024, "SRBF_LAYERS": 64}]
PROJECTED: list[dict[str, object]] = [{"SRBF_COMPONENTS": s} for s in (1, 9, 288)]  # three vec4 a layer
# 4 vec4 per map, 2 per layer, 4 per point light, within the same 224
POINT_LIGHTS: list[dict[str, object]] = [{"SRBF_POINT_LIGHTS": 1}, {"SRBF_POINT_LIGHTS": 16}, {"SRBF_POINT_LIGHTS": 16, "SRBF_DEPTH": 1}]
SAMPLED: dict[str, object] = {"SRBF_PAIRS": 1, "SRBF_SAMPLED": 1}
LIT_MAPS = [{"SRBF_K": k} | point_lights for k in (1, 25, 32) for point_lights in POINT_LIGHTS] + [
    {"SRBF_K": 25, "SRBF_POINT_LIGHTS": 16, "SRBF_FORMULA": 1}
]
LIT_MAPS += [{"SRBF_K": 25, "SRBF_POINT_LIGHTS": 16, "SRBF_PAIRS": 1, "SRBF_PLAIN": 1}]
LIT_MAPS += [
    {
        "SRBF_K": 25,
        "SRBF_POINT_LIGHTS": 4,
        "SRBF_UNROLLED": 1,
        "SRBF_CURVE": "vec4(-7.12, -1.18, -0.356, -6.28e-3)",
        "SRBF_CURVE_LAST": -0.122,
    }
]
LIT_PLANES = [{"SRBF_COMPONENTS": s} | point_lights for s in (9, 256) for point_lights in POINT_LIGHTS] + [
    {"SRBF_COMPONENTS": 9, "SRBF_POINT_LIGHTS": 4, "SRBF_PLAIN": 1}
]
UNITS: list[dict[str, object]] = [{}, *({"SRBF_UNITS": units} for units in range(1, 9))]
NETWORK: dict[str, object] = {"SRBF_COMPONENTS": 9, "SRBF_UNIT_VECTORS": 2}
METHODS = ("", "eigen_map_", "clustered_eigen_map_")
DEFINES: dict[str, list[dict[str, object]]] = {
    "directional.frag": [{"SRBF_K": k} for k in (1, 25, 64)],  # 64 fit the 224 vec4 that ES 3.00 promises
    "point.frag": [
        {"SRBF_K": k} | by for k in (1, 25, 64) for by in ({}, {"SRBF_FORMULA": 1}, {"SRBF_PAIRS": 1, "SRBF_PLAIN": 1}, SAMPLED)
    ],
    "projected.frag": [{"SRBF_K": k} for k in (1, 25, 192)],
    **{f"{method}_{lights}.frag": PLANES for method in ("eigen_map", "clustered_eigen_map") for lights in ("directional", "point")},
    "weighted.frag": [{"SRBF_K": k} for k in (1, 25, 64)],
    "environment_rows.frag": [{}, {"SRBF_FORMULA": 1}],
    **{f"{method}projected.frag": PROJECTED for method in METHODS[1:]},
    **{f"{method}{kind}.frag": LIT_PLANES if method else LIT_MAPS for method in METHODS for kind in ("lights", "lightmap")},
    **{f"{method}accumulate.frag": UNITS for method in METHODS},
    **{stage: [{}, {"SRBF_LOBES": 1}] for stage in ("direct.frag", "direct_point.frag")},
    "neural_map_distant.frag": [NETWORK | {"SRBF_DISTANT": 4}],
    "neural_map_points.frag": [
        NETWORK | point_lights for point_lights in ({"SRBF_POINT_LIGHTS": 1}, {"SRBF_POINT_LIGHTS": 8, "SRBF_DEPTH": 1})
    ],
}
CASES = [(name, defines) for name in STAGES for defines in DEFINES.get(name, [{}])]
IDS = [f"{name}-{'-'.join(map(str, defines.values()))}" for name, defines in CASES]
VALIDATOR = {"330 core": [], "300 es": [], "450": ["-V", "-R", "--amb", "--aml"]}  # -R gathers loose uniforms into a block


def test_every_method_has_the_same_stages() -> None:
    kinds = ["accumulate", "directional", "projected", "lightmap", "lights", "point"]
    methods = [f"{method}{kind}.frag" for method in METHODS for kind in kinds]
    shadows = ["direct.frag", "direct_on_mesh.frag", "shadow.vert", "shadow_height.frag", "shadow_transmittance.frag"]
    shadows += [
        "direct_point.frag",
        "direct_point_on_mesh.frag",
        "point_shadow.vert",
        "point_shadow_nearness.frag",
        "point_shadow_transmittance.frag",
    ]
    environments = ["environment_functions.frag", "environment_rows.frag", "environment_weights.frag", "weighted.frag"]
    pool = [f"deep_framebuffer_{part}.frag" for part in ("bounce", "clusters", "near", "pixels", "seen", "sum", "surfels")]
    neural = ["neural_map_distant.frag", "neural_map_points.frag"]
    assert (
        sorted([*methods, *shadows, *environments, *pool, *neural, "add.frag", "finish.frag", "fullscreen.vert", "lightmap.vert"]) == STAGES
    )


@pytest.mark.parametrize("version", ["330 core", "300 es"])
@pytest.mark.parametrize(("name", "defines"), CASES, ids=IDS)
def test_the_driver_compiles_every_stage(context: Any, name: str, defines: dict[str, object], version: str) -> None:
    if version == "300 es" and "GL_ARB_ES3_compatibility" not in context.extensions:
        pytest.skip("this driver compiles no ES 3.00 on a desktop context")
    fragments = {"fullscreen.vert": "finish.frag", "shadow.vert": "shadow_height.frag", "point_shadow.vert": "point_shadow_nearness.frag"}
    fragment = fragments.get(name, name)
    if name == "lightmap.vert":
        fragment, defines = "lightmap.frag", DEFINES["lightmap.frag"][0]
    vertex = resolve(f"stages/{vertex_of(fragment)}", version=version)
    with context:
        program = compile_program(context, vertex, resolve(f"stages/{fragment}", version=version, defines=defines))
        assert program.glo > 0
        program.release()


def vertex_of(fragment: str) -> str:
    """The vertex stage that goes with a fragment stage."""
    if fragment.startswith("point_shadow"):
        return "point_shadow.vert"
    return "shadow.vert" if "shadow" in fragment else "lightmap.vert" if "lightmap" in fragment else "fullscreen.vert"


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("glslangValidator") is None, reason="glslangValidator is not installed (Debian: glslang-tools)")
@pytest.mark.parametrize("version", VALIDATOR)
@pytest.mark.parametrize("name", STAGES)
def test_the_reference_compiler_accepts_every_stage(name: str, version: str, tmp_path: Path) -> None:
    """And what it makes of it for Vulkan is valid SPIR-V, where spirv-val (Debian: spirv-tools) is there to say so."""
    source = resolve(f"stages/{name}", version=version, defines=DEFINES.get(name, [{}])[-1])
    path, binary = tmp_path / name, tmp_path / "out.spv"
    path.write_text(source.text)
    output = ["-o", str(binary)] if "-V" in VALIDATOR[version] else []
    done = subprocess.run(["glslangValidator", *VALIDATOR[version], *output, str(path)], capture_output=True, text=True)
    assert done.returncode == 0, source.locate(done.stdout)
    if output and shutil.which("spirv-val"):
        done = subprocess.run(["spirv-val", "--target-env", "vulkan1.0", str(binary)], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("file", FILES)
def test_every_file_states_its_license_and_only_stages_have_a_main(file: str) -> None:
    text = (ROOT / file).read_text()
    assert text.splitlines()[0] == "// SPDX-License-Identifier: MIT"
    is_stage = file.startswith("stages/")
    assert bool(re.search(r"^#version", text, re.MULTILINE)) == is_stage
    assert bool(re.search(r"\bvoid main\(", text)) == is_stage
    assert "texture(" not in text  # implicit derivatives: undefined in loops and branches


@pytest.mark.parametrize(
    ("stage", "complaint"),
    [
        ("directional", r"combine/directional\.glsl:\d+.*SRBF_K"),
        ("eigen_map_point", r"combine/components_directional\.glsl:\d+.*SRBF_COMPONENTS"),
        ("lights", r"combine/point_lights\.glsl:\d+.*SRBF_K"),
        ("eigen_map_lights", r"combine/components_point_lights\.glsl:\d+.*SRBF_COMPONENTS"),
    ],
)
def test_a_pass_without_its_count_says_which_define_is_missing(context: Any, stage: str, complaint: str) -> None:
    with context, pytest.raises(ShaderError, match=complaint):
        compile_program(context, resolve("stages/fullscreen.vert"), resolve(f"stages/{stage}.frag"))


def test_the_readme_lists_every_file() -> None:
    assert sorted(re.findall(r"^\| `(\w+/\w+\.\w+)` \|", (ROOT / "README.md").read_text(), re.MULTILINE)) == FILES


def test_the_readme_says_what_every_stage_and_define_takes() -> None:
    """Every fragment stage of a method has a row, and every uniform and define that a stage names is explained."""
    text = (ROOT / "README.md").read_text()
    after = text[text.index("## Defines") :]
    for name in STAGES:
        source = (ROOT / "stages" / name).read_text()
        if name.split(".")[0] in (
            "direct",
            "direct_on_mesh",
            "direct_point",
            "direct_point_on_mesh",
            "point_shadow",
            "point_shadow_nearness",
            "point_shadow_transmittance",
            "shadow",
            "shadow_height",
            "shadow_transmittance",
            "add",
            "finish",
            "fullscreen",
        ):
            continue
        kind = name.split("_")[-1]
        assert f"`{name}`" in after or (f"`…{kind}`" in after), name
        for uniform in re.findall(r"^uniform (?:highp )?\w+ (\w+)", source, re.MULTILINE):
            if not name.startswith("environment_"):
                assert f"`{uniform}`" in after or f"`{uniform}[" in after, f"{name}: {uniform}"
    for file in FILES:
        for define in re.findall(
            r"\bSRBF_(?:K|COMPONENTS|LAYERS|POINT_LIGHTS|UNITS|PLAIN|PAIRS|SAMPLED|FORMULA|DEPTH)\b", (ROOT / file).read_text()
        ):
            assert f"| `{define}` |" in after


@pytest.mark.parametrize("version", ["330 core", "300 es"])
@pytest.mark.parametrize("which", range(4))
def test_the_readme_snippets_compile(context: Any, version: str, which: int) -> None:
    snippets = re.findall(r"```glsl\n(.+?)```", (ROOT / "README.md").read_text(), re.DOTALL)
    assert len(snippets) == 4
    snippet = snippets[which]
    head = "precision highp float; precision highp int;\n"
    tail = "out vec4 o;\nvoid main() { o = relitLightmap(vec2(0.5), vec3(1.0)).rgbr; }\n"
    vertex = resolve("stages/fullscreen.vert", version=version)
    with context:
        compile_program(context, vertex, resolve_text(head + snippet + tail, "README.md", version=version)).release()
