"""The include resolver: once each, relative to root or file, cycles and gaps named, and logs read back as file:line."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from srbf.errors import ShaderError
from srbf.gl import includes
from srbf.gl.context import compile_program
from srbf.gl.includes import ShaderSource, dependence_order, resolve, resolve_text, shader_root

Tree = Callable[[dict[str, str]], Path]


@pytest.fixture
def tree(tmp_path: Path) -> Tree:
    def write(files: dict[str, str]) -> Path:
        for name, text in files.items():
            path = tmp_path / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
        return tmp_path

    return write


def test_each_file_is_included_once(tree: Tree) -> None:
    root = tree({"a.glsl": '#include "b.glsl"\n#include "c.glsl"\nA\n', "b.glsl": '#include "c.glsl"\nB\n', "c.glsl": "C\n"})
    source = resolve("a.glsl", root=root)
    code = [line for line in source.text.splitlines() if not line.startswith("#")]
    assert [line for line in code if line] == ["C", "B", "A"]
    assert source.files == ("a.glsl", "b.glsl", "c.glsl")


def test_includes_are_relative_to_root_or_file(tree: Tree) -> None:
    root = tree({"stages/a.frag": '#include "x/b.glsl"\n', "x/b.glsl": '#include "c.glsl"\n', "x/c.glsl": "C\n"})
    assert resolve("stages/a.frag", root=root).files == ("stages/a.frag", "x/b.glsl", "x/c.glsl")


def test_one_file_by_two_paths_is_still_one(tree: Tree) -> None:
    root = tree({"a.glsl": '#include "x/c.glsl"\n#include "x/../x/c.glsl"\n', "x/c.glsl": "C\n"})
    assert resolve("a.glsl", root=root).text.count("C\n") == 1


def test_a_cycle_names_its_chain(tree: Tree) -> None:
    root = tree({"s.frag": '#include "a.glsl"\n', "a.glsl": '#include "b.glsl"\n', "b.glsl": '#include "a.glsl"\n'})
    with pytest.raises(ShaderError, match=r"a\.glsl -> b\.glsl -> a\.glsl"):
        resolve("s.frag", root=root)
    with pytest.raises(ShaderError, match=r"found me\.glsl -> me\.glsl"):
        resolve("me.glsl", root=tree({"me.glsl": '#include "me.glsl"\n'}))


def test_a_missing_include_names_includer_and_line(tree: Tree) -> None:
    root = tree({"a.frag": '\n#include "b.glsl"\n', "b.glsl": '// one\n\n#include "wieght.glsl"\n'})
    with pytest.raises(ShaderError, match=r'b\.glsl:3: cannot find "wieght\.glsl"'):
        resolve("a.frag", root=root)


@pytest.mark.parametrize(
    ("files", "text"),
    [
        ({}, r"expected a shader at .*a\.frag"),
        ({"a.frag": "#include <b.glsl>\n"}, r"a\.frag:1: expected #include"),
        ({"a.frag": '\n#include "b.glsl"\n', "b.glsl": "#version 330\n"}, r"b\.glsl:1: expected #version in the stage alone"),
    ],
)
def test_what_cannot_be_assembled_is_refused(tree: Tree, files: dict[str, str], text: str) -> None:
    with pytest.raises(ShaderError, match=text):
        resolve("a.frag", root=tree(files))


def test_comments_are_not_directives(tree: Tree) -> None:
    text = '/* an example:\n#include "nowhere.glsl"\n*/ // #include "nowhere.glsl"\n// /*\n#include "b.glsl"\n'
    root = tree({"a.frag": text, "b.glsl": "B\n"})
    assert resolve("a.frag", root=root).files == ("a.frag", "b.glsl")


def test_dependence_puts_each_file_once_after_what_it_includes(tree: Tree) -> None:
    files = {"x/a.glsl": '#include "b.glsl"\n#include "c.glsl"\n', "x/b.glsl": '#include "c.glsl"\n', "c.glsl": "float c;\n"}
    files |= {"d.glsl": '/*\n#include "none.glsl"\n*/\n'}
    root = tree(files)
    assert list(dependence_order(["x/a.glsl", "d.glsl", "c.glsl"], root)) == ["c.glsl", "x/b.glsl", "x/a.glsl", "d.glsl"]
    assert dependence_order(["d.glsl"], root)["d.glsl"] == files["d.glsl"]
    with pytest.raises(ShaderError, match=r'cannot find "none\.glsl"'):
        dependence_order(["none.glsl"], root)
    with pytest.raises(ShaderError, match=r"e\.glsl -> f\.glsl -> e\.glsl"):
        dependence_order(["e.glsl"], tree({"e.glsl": '#include "f.glsl"', "f.glsl": '#include "e.glsl"'}))


def test_version_comes_first_then_defines(tree: Tree) -> None:
    root = tree({"a.frag": "// license\n#version 330 core\nvoid main() {}\n"})
    lines = resolve("a.frag", root=root, defines={"SRBF_K": 25, "FAST": True}).text.splitlines()
    assert lines[:4] == ["#version 330 core", "#define SRBF_K 25", "#define FAST 1", "#line 1 0"]
    assert lines[4 + 2] == "void main() {}"  # its third line, as the file has it
    assert resolve("a.frag", root=root, version="300 es").text.startswith("#version 300 es\n")


@pytest.mark.parametrize("define", [{"a b": 1}, {"A": "1\n#error"}])
def test_bad_defines_are_refused(tree: Tree, define: dict[str, object]) -> None:
    with pytest.raises(ShaderError, match="define"):
        resolve("a.frag", root=tree({"a.frag": ""}), defines=define)


@pytest.mark.parametrize(
    ("line", "found"),
    [
        ("1:12(3): error: syntax error", "b.glsl:12: error: syntax error"),
        ("0(7) : error C0000: syntax error", "a.frag:7 : error C0000: syntax error"),
        ("ERROR: 1:2: 'x' : undeclared", "ERROR: b.glsl:2: 'x' : undeclared"),
        ("2:7: a file that was never included", "2:7: a file that was never included"),
        ("0:4099(3): error: 'x' undeclared", "b.glsl:3: error: 'x' undeclared"),
        ("3 errors", "3 errors"),
    ],
)
def test_log_lines_of_every_driver_become_places(line: str, found: str) -> None:
    assert ShaderSource("", ("a.frag", "b.glsl")).locate(f"log\n{line}") == f"log\n{found}"


BROKEN = "    float x = undeclared_name;\n"
MAIN = "out vec4 color;\nvoid main() {\n    color = vec4(good());\n}\n"


@pytest.mark.parametrize("version", ["330 core", "300 es"])
@pytest.mark.parametrize(
    ("files", "place"),
    [
        ({"deep.glsl": f"// one\nfloat deep() {{\n{BROKEN}    return x;\n}}\n"}, "deep.glsl:3"),
        ({"good.glsl": f'// one\n#include "deep.glsl"\nfloat good() {{\n    // four\n{BROKEN}    return x;\n}}\n'}, "good.glsl:5"),
        (
            {"top.frag": f'#version 330 core\nprecision highp float;\n#include "good.glsl"\nfloat f() {{\n{BROKEN}}}\n{MAIN}'},
            "top.frag:5",
        ),
    ],
)
def test_a_broken_shader_is_found_in_its_file_and_line(context: Any, tree: Tree, files: dict[str, str], place: str, version: str) -> None:
    whole = {
        "deep.glsl": "float deep() { return 1.0; }\n",
        "good.glsl": '#include "deep.glsl"\nfloat good() { return deep(); }\n',
        "top.frag": f'#version 330 core\nprecision highp float;\n#include "good.glsl"\n{MAIN}',
    }
    root = tree(whole | files)
    fragment = resolve("top.frag", root=root, version=version, defines={"SRBF_K": 3})
    with context, pytest.raises(ShaderError, match=rf"{place}\b.*undeclared_name"):
        compile_program(context, resolve("stages/fullscreen.vert", version=version), fragment)


def test_a_broken_vertex_stage_is_named_too(context: Any) -> None:
    vertex = resolve_text("void main() {\n    gl_Position = nothing;\n}\n", "broken.vert")
    with context, pytest.raises(ShaderError, match=r"broken\.vert:2"):
        compile_program(context, vertex, resolve("stages/finish.frag"))


def test_the_root_is_found_in_a_wheel_and_in_a_checkout(tmp_path: Path, monkeypatch: Any) -> None:
    package = tmp_path / "srbf"
    monkeypatch.setattr(includes, "__file__", str(package / "gl" / "includes.py"))
    with pytest.raises(ShaderError, match="found neither"):
        shader_root()
    (tmp_path / "glsl" / "stages").mkdir(parents=True)
    assert shader_root() == tmp_path / "glsl"
    (package / "glsl" / "stages").mkdir(parents=True)
    assert shader_root() == package / "glsl"


def test_the_gpu_modules_import_without_moderngl() -> None:
    code = "import sys; sys.modules['moderngl'] = None; import srbf.relighting.relighter, srbf.gl.includes"
    subprocess.run([sys.executable, "-c", code], check=True)
