"""Unreal's weights of named lights and of clouds: C++ beside numpy, pixels of the Custom node from them, and the component's text."""

from __future__ import annotations

import json
import math
import re
import runpy
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from made_tables import INSIDE, KINDS, MIX, NAMES, by_places, linear, made, size_of_terms
from pixels import FLOAT, run
from test_unreal import shader_of
from unreal_stand_in import StandIn

from srbf import methods
from srbf.asset import Asset
from srbf.export import spirv, unreal
from srbf.export.engine_folder import engine_root
from srbf.export.light_tables import first_weights, table_file
from srbf.export.unreal_surfels import SOURCES
from srbf.lights import PointLight, SpotLight, moved

pytestmark = pytest.mark.engines
HERE = Path(__file__).parent / "unreal"
SOURCE = engine_root("unreal") / "Source"
needs_compiler = pytest.mark.skipif(shutil.which("g++") is None, reason="needs g++ (Debian)")


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    found = {}
    for kind in KINDS:
        found[kind] = tmp_path_factory.mktemp("unreal")
        unreal.write(made(kind), found[kind])
    return found


@pytest.fixture(scope="module")
def ask(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., dict[str, list[str]]]:
    """What SrbfWeights.h says of a file of tables and lights: the words after each first word."""
    program = tmp_path_factory.mktemp("program") / "weights"
    command = ["g++", "-std=c++17", "-Wall", "-Wextra", "-Werror", "-O1", f"-I{SOURCE}", str(HERE / "Weights.cpp"), "-o", str(program)]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr

    def run_it(tables: Path, numbers: list[float]) -> dict[str, list[str]]:
        done = subprocess.run([str(program), str(tables), *map(repr, numbers)], capture_output=True, text=True, timeout=60)
        assert done.returncode == 0, done.stderr
        said: dict[str, list[str]] = {}
        for line in done.stdout.splitlines():
            said.setdefault(line.split()[0], []).append(line.split(maxsplit=1)[1])
        return said

    return run_it


@needs_compiler
@pytest.mark.parametrize("placed", [False, True], ids=["in place", "moved"])
@pytest.mark.parametrize("kind", KINDS)
def test_c_plus_plus_weighs_lights_as_numpy(ask: Any, kind: str, placed: bool, tmp_path: Path) -> None:
    asset = made(kind)
    matrix = np.eye(4)
    if placed:  # turned, scaled and moved
        matrix[:3, :3], matrix[:3, 3] = 1.25 * np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]]), [0.3, -0.2, 0.1]
        asset.manifest["asset_from_world"] = matrix.tolist()
    (tmp_path / "tables").write_bytes(table_file(asset))
    if asset.manifest["light_domain"] == "named":
        numbers = [value for i, name in enumerate(NAMES) for value in (i, *{light.name: light.color for light in MIX}.get(name, (0, 0, 0)))]
        expected = methods.projected_weights(asset, MIX)
    else:
        there = [light for light in (moved(light, np.linalg.inv(matrix)) for light in INSIDE) if isinstance(light, PointLight)]
        numbers = []
        for light in there:
            cone = [light.inner, light.outer] if isinstance(light, SpotLight) else [-1, -1]
            numbers += [*light.position, *(np.array(light.color) * light.a0**2).tolist(), *cone]
        expected = by_places(asset, INSIDE)
    said = ask(tmp_path / "tables", [float(number) for number in numbers])
    found = np.array(said["weights"][0].split(), np.float64).reshape(-1, 4)
    np.testing.assert_allclose(found[:, :3], expected, atol=2e-6 * np.abs(expected).max())
    rows = 1 if kind == "named-maps" else asset.clusters
    assert said["size"] == [f"{rows} {len(expected) // rows}"] and said["outside"] == ["0"]
    if asset.manifest["light_domain"] == "named":
        assert said["name"] == [f"{i} {name}" for i, name in enumerate(NAMES)]


@needs_compiler
def test_c_plus_plus_refuses_what_are_no_tables(ask: Any, tmp_path: Path) -> None:
    whole = table_file(made("light-cloud"))
    for data, complaint in ((whole[:-1], "another size"), (whole + b"x", "another size"), (b"EXR and more", "found another file")):
        (tmp_path / "tables").write_bytes(data)
        assert complaint in ask(tmp_path / "tables", [])["refused"][0]
    huge = whole[:180] + b"\xff\xff\xff\x7f" + whole[184:]  # nodes along an axis
    (tmp_path / "tables").write_bytes(huge)
    assert "another size" in ask(tmp_path / "tables", [])["refused"][0]


def component_compiles(name: str, folder: Path, declared: str | None = None) -> None:
    """Against handwritten interfaces: each header that it includes and srbf does not have is all of them; `declared`: its own header."""
    own = declared or name
    shutil.copy(SOURCE / f"{name}.cpp", folder)
    header = (SOURCE / f"{own}.h").read_text()
    for file in re.findall(r'#include "(.+)"', header + (SOURCE / f"{name}.cpp").read_text()):
        if not (SOURCE / file).exists():
            (folder / file).parent.mkdir(parents=True, exist_ok=True)
            (folder / file).write_text('#include "Declarations.h"\n')
    (folder / f"{own}.h").write_text(header.replace("public:\n", "public:\n    using Super = UActorComponent;\n", 1))
    command = ["g++", "-std=c++17", "-Wall", "-fsyntax-only", f"-I{folder}", f"-I{SOURCE}", f"-I{HERE}", str(folder / f"{name}.cpp")]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@needs_compiler
def test_the_component_compiles_against_unreals_interfaces(tmp_path: Path) -> None:
    component_compiles("SrbfRelit", tmp_path)


@pytest.mark.skipif(not spirv.available(), reason="needs glslang-tools, spirv-tools and spirv-cross (Debian)")
@pytest.mark.parametrize("kind", KINDS)
def test_the_custom_node_gives_numpys_pixels(folders: dict[str, Path], kind: str) -> None:
    asset = Asset.open(folders[kind])
    weights = methods.projected_weights(asset, MIX) if asset.manifest["light_domain"] == "named" else by_places(asset, INSIDE)
    rows = np.concatenate([weights, np.ones((len(weights), 1))], axis=1).reshape(*first_weights(asset).shape[:2], 4).astype(np.float32)
    given = {"MaterialWeights": rows, "positions": asset.images["position"], "MaterialAmbient": asset.images["ambient"]}
    given |= {"MaterialClusters": asset.tables["cluster_index"][..., None] / 255} if "cluster_index" in asset.tables else {}
    found = run(spirv.cross_compile(spirv.compile_hlsl(shader_of(folders[kind])), "glsl"), asset, given, {})[..., :3]
    expected = (np.maximum(linear(asset, weights), 0) + asset.images["ambient"]) / math.pi
    assert expected.max() > 0.1
    assert (np.abs(found - expected) <= FLOAT * size_of_terms(asset, weights) + 1e-6).all()


@pytest.mark.parametrize("kind", ["named-maps", "light-cloud"])
def test_the_script_connects_the_weights_and_copies_the_tables(
    folders: dict[str, Path],
    stand_in: StandIn,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    kind: str,
) -> None:
    node = json.loads((folders[kind] / "node.json").read_text())
    monkeypatch.setattr(sys, "argv", ["import_srbf.py"])
    runpy.run_path(str(folders[kind] / "import_srbf.py"), run_name="__main__")
    copied = tmp_path / "Project/Srbf" / f"{Path(node['include']).stem}.bin"
    assert copied.read_bytes() == (folders[kind] / "SrbfTables.bin").read_bytes()
    sources = {"SrbfWeights.h", "SrbfRelit.h", "SrbfRelit.cpp"} | (set(SOURCES) if kind == "light-cloud" else set())
    assert {path.name for path in (folders[kind] / "Source").iterdir()} == sources
    custom = next(part for part in stand_in.made if part.kind == "MaterialExpressionCustom")
    connected = [call[4] for call in stand_in.calls if call[0].endswith("connect_material_expressions") and call[3] is custom]
    assert connected == node["inputs"] and "Weights" in connected and "WorldPosition" not in connected
    assert not [part for part in stand_in.made if "ParameterCollection" in part.kind]
    monkeypatch.setattr(sys, "argv", ["import_srbf.py", "follow"])
    with pytest.raises(RuntimeError, match="add the component SrbfRelit"):
        runpy.run_path(str(folders[kind] / "import_srbf.py"), run_name="__main__")
