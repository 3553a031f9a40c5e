"""Shaders through SPIR-V: compiled by glslangValidator, checked by spirv-val, written in another language by spirv-cross.

Whole stages come out of it with globals of its own naming: right for Metal, whose compiler is not to be had everywhere, and the independent
twin of the includes that `srbf.export.hlsl` and `srbf.export.wgsl` write.
"""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Literal

from srbf.errors import MissingLibraryError, ShaderError
from srbf.gl.includes import ShaderSource, resolve

Language = Literal["hlsl", "metal", "es", "glsl"]

PACKAGES = {"glslangValidator": "glslang-tools", "spirv-val": "spirv-tools", "spirv-cross": "spirv-cross"}
ARGUMENTS: dict[Language, list[str]] = {
    "hlsl": ["--hlsl", "--shader-model", "50"],
    "metal": ["--msl", "--msl-version", "20100"],
    "es": ["--version", "300", "--es"],
    "glsl": ["--version", "330", "--no-es", "--no-420pack-extension", "--glsl-emit-ubo-as-plain-uniforms"],
}
GATHERED = ["-R", "--amb", "--aml"]  # loose uniforms into a block, bindings and locations by order


def available() -> bool:
    """Whether every tool is installed."""
    return all(shutil.which(tool) for tool in PACKAGES)


def compile_stage(name: str, defines: Mapping[str, object]) -> bytes:
    """A stage of the pack as SPIR-V for Vulkan, validated. Raises ShaderError with the compiler's message, MissingLibraryError."""
    source = resolve(f"stages/{name}", version="450", defines=defines)
    return compile_glsl(source, "vert" if name.endswith(".vert") else "frag")


def compile_glsl(source: ShaderSource, stage: Literal["vert", "frag"]) -> bytes:
    """GLSL 4.50 as SPIR-V, validated."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"shader.{stage}"
        path.write_text(source.text, encoding="utf-8")
        log, code = _compile([*GATHERED, "-S", stage], path)
    if code is None:
        raise ShaderError(f"expected {source.files[0]} to compile to SPIR-V, found {_complaints(source.locate(log))}")
    return code


def compile_hlsl(text: str, stage: Literal["vert", "frag"] = "frag", entry: str = "main") -> bytes:
    """HLSL as SPIR-V, validated. ShaderError with the compiler's message."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "shader.hlsl"
        path.write_text(text, encoding="utf-8")
        log, code = _compile(["-D", "-e", entry, "-S", stage, "--auto-map-bindings", "--auto-map-locations"], path)
    if code is None:
        raise ShaderError(f"expected HLSL that compiles to SPIR-V, found {_complaints(log)}")
    return code


def cross_compile(code: bytes, language: Language) -> str:
    """SPIR-V in another language. ShaderError with spirv-cross's message."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "shader.spv"
        path.write_bytes(code)
        done = _run("spirv-cross", str(path), *ARGUMENTS[language])
    if done.returncode:
        raise ShaderError(f"expected spirv-cross to write {language}, found {_complaints(done.stderr)}")
    return done.stdout


def _compile(arguments: list[str], path: Path) -> tuple[str, bytes | None]:
    out = path.with_suffix(".spv")
    done = _run("glslangValidator", "-V", *arguments, "-o", str(out), str(path))
    if done.returncode or not out.is_file():
        return done.stdout, None
    checked = _run("spirv-val", "--target-env", "vulkan1.0", str(out))
    return checked.stdout + checked.stderr, None if checked.returncode else out.read_bytes()


def _run(tool: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    if shutil.which(tool) is None:
        raise MissingLibraryError(
            f"translating whole stages needs {tool}, which is not installed (Debian: apt-get install {PACKAGES[tool]})"
        )
    return subprocess.run([tool, *arguments], capture_output=True, text=True, timeout=120)


def _complaints(log: str) -> str:
    lines = [line.strip() for line in log.splitlines() if line.strip()]
    return "; ".join([line for line in lines if "error" in line.lower()][:4] or lines[:4])
