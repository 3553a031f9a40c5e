"""The npm package's shaders have their includes resolved as the library's own are."""

from __future__ import annotations

import json
import re
import subprocess
from collections.abc import Callable

import pytest
from npm_package import ENVIRONMENT, WEB

from srbf.gl.includes import resolve, shader_root

STAGES = sorted(path.relative_to(shader_root()).as_posix() for path in (shader_root() / "stages").iterdir())
SCRIPT = """
import { runnerImport } from "vite";
const { module } = await runnerImport("./build/glsl_includes.ts");
const texts = JSON.parse(process.argv[1]).map((stage) => module.resolveIncludes(`../glsl/${stage}`, "../glsl").text);
console.log(JSON.stringify(texts));
"""


@pytest.fixture(scope="module")
def resolved(npm: Callable[..., str]) -> dict[str, str]:
    """Every stage by the package's resolver."""
    command = ["node", "--input-type=module", "-e", SCRIPT, json.dumps(STAGES)]
    done = subprocess.run(command, cwd=WEB, env=ENVIRONMENT, capture_output=True, text=True, timeout=120, check=True)
    return dict(zip(STAGES, json.loads(done.stdout), strict=True))


@pytest.mark.parametrize("stage", STAGES)
def test_the_package_resolves_a_stage_as_the_library_does(resolved: dict[str, str], stage: str) -> None:
    """The same lines in the same order, except comments, #version and #line."""
    text = re.sub(r"/\*.*?\*/|//[^\n]*|^\s*#\s*(?:version|line)\b[^\n]*", "", resolve(stage).text, flags=re.DOTALL | re.MULTILINE)
    lines = [line.rstrip() for line in text.splitlines() if line.strip()]
    assert len(lines) >= 5
    assert resolved[stage].splitlines() == lines
