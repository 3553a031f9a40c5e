"""The command line as a user has it: every verb, what it prints, and bad input as one line: wrong usage exits 2, failed work 1."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from made_captures import write_capture
from typer.testing import CliRunner, Result

from srbf import methods
from srbf.asset import Asset
from srbf.capture import Capture
from srbf.cli import app
from srbf.cli.light_arguments import read_frames
from srbf.io.image import encode_srgb, read_image, write_image
from srbf.lights import DirectionalLight, EnvironmentLight, PointLight, SpotLight


def srbf(*arguments: object) -> Result:
    """The command in this process: a process each would cost the suite a minute. `test_a_real_process` has one."""
    return CliRunner().invoke(app, list(map(str, arguments)))


def ok(*arguments: object) -> str:
    done = srbf(*arguments)
    assert done.exit_code == 0, done.stderr
    return done.stdout


def refused(*arguments: object, status: int = 1) -> str:
    """One line on stderr that starts with srbf:, nothing on stdout, exit 1."""
    done = srbf(*arguments)
    lines = done.stderr.strip().splitlines()
    assert done.exit_code == status and done.stdout == "" and len(lines) == 1 and lines[0].startswith("srbf: "), (done, done.stderr)
    return lines[0]


def misused(*arguments: object) -> str:
    """The same of wrong usage, exit 2."""
    return refused(*arguments, status=2)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory, plane_positions: np.ndarray) -> Path:
    """A folder of a capture and of an asset fitted to it, to be copied."""
    folder = tmp_path_factory.mktemp("made")
    write_capture(folder / "capture", lambda d: np.full((10, 14, 3), max(0, d[2])) * [1, 0.5, 0.25], position=plane_positions)
    ok("fit", folder / "capture", "-o", folder / "asset", "-k", 9, "--spread", "mean", "--ridge", 0)
    return folder


@pytest.fixture
def capture(made: Path, tmp_path: Path) -> Capture:
    return Capture.open(shutil.copytree(made / "capture", tmp_path / "capture"))


@pytest.fixture
def asset(made: Path, tmp_path: Path) -> Path:
    return shutil.copytree(made / "asset", tmp_path / "asset")


@pytest.mark.lengthy
def test_fit_evaluate_and_info(capture: Capture, asset: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened = Asset.open(asset)
    assert opened.k == 9 and set(opened.manifest["error"]) == {"train", "holdout"}
    result = json.loads(ok("evaluate", asset, capture.folder, "--json"))
    assert set(result) == {"train", "holdout", "lights"}
    assert set(result["train"]) == {"rmse", "relative_rmse", "psnr", "psnr_pooled", "peak"}
    assert set(result["lights"][0]) == {"file", "role", "rmse", "relative_rmse"} and len(result["lights"]) == 68
    assert result["holdout"] == opened.manifest["error"]["holdout"]
    assert json.loads(ok("info", asset, "--json"))["bytes_per_texel"]["point"] == 72
    assert json.loads(ok("info", capture.folder, "--json"))["lights"]["train"] == 60
    assert "holdout" in ok("evaluate", asset, capture.folder)
    monkeypatch.setattr("srbf.cli.info.describe", lambda path: {"format": "srbf-asset", "receiver_visibility": {"points": 517}})
    assert ok("info", asset).splitlines() == ["format              srbf-asset", "receiver visibility points 517"]
    monkeypatch.undo()
    shown = dict(line.split(maxsplit=1) for line in ok("info", asset).splitlines())
    assert [shown[name] for name in ("format", "method", "k", "width", "height")] == ["srbf-asset", "relighting-map", "9", "14", "10"]


def test_point_lights_have_their_former_key_too(asset: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = {"point_lights": [[0, 0, 1]], "by_distance": []}
    monkeypatch.setattr("srbf.cli.evaluate.compare_with_point_lights", lambda *_: found)
    result = json.loads(ok("evaluate", asset, tmp_path / "scene.blend", "--point-reference", 1, "--json"))
    assert result == {**found, "lamps": [[0, 0, 1]]}  # for one version; words: ok


@pytest.mark.parametrize(
    "flags", [[], ["--centers", "hammersley3", "--spread", "min"], ["--domain", "sphere", "--ridge", "0.1", "--spread", "0.7"]]
)
@pytest.mark.parametrize("encoding", ["half", "float", "uint8"])
def test_fit_flags_reach_the_asset(capture: Capture, tmp_path: Path, flags: list[str], encoding: str) -> None:
    ok("fit", capture.folder, "-o", tmp_path / "asset", "-k", 12, "--encoding", encoding, *flags)
    asset = Asset.open(tmp_path / "asset")
    settings = asset.manifest["source"]["settings"]
    assert asset.encoding == encoding
    for flag, value in zip(flags[::2], flags[1::2], strict=True):
        assert str(settings[flag[2:]]) == value
    assert all((tmp_path / "asset" / f"map_{i:02d}.{'png' if encoding == 'uint8' else 'exr'}").is_file() for i in range(12))


@pytest.mark.parametrize("renderer", ["numpy", "gl"])
def test_relight_adds_up_every_kind_of_light(asset: Path, tmp_path: Path, renderer: str) -> None:
    environment = np.random.default_rng(0).random((8, 16, 3)).astype(np.float32)
    write_image(tmp_path / "environment.exr", environment, "float")
    flags = [
        "--directional",
        "-1,0,1,1,0.5,0.2",
        "--directional",
        "0,0,1",
        "--point",
        "-0.2,0.1,0.8",
        "--environment",
        tmp_path / "environment.exr",
        "--turn",
        -0.6,
    ]
    flags += ["--spot", "0,0,1,0,0,-1,0.2,0.5,2,2,2", "--reference-distance", 0.7, "--falloff", "inverse-square", "--renderer", renderer]
    ok("relight", asset, "-o", tmp_path / "out.exr", *flags)
    lights = [
        DirectionalLight((-1, 0, 1), (1, 0.5, 0.2)),
        DirectionalLight((0, 0, 1)),
        PointLight((-0.2, 0.1, 0.8), a0=0.7, falloff="inverse-square"),
        EnvironmentLight(environment).turned(-0.6),
        SpotLight((0, 0, 1), (2, 2, 2), direction=(0, 0, -1), inner=0.2, outer=0.5, a0=0.7, falloff="inverse-square"),
    ]
    expected = methods.relight(Asset.open(asset), lights)
    np.testing.assert_allclose(read_image(tmp_path / "out.exr"), expected, atol=1e-5 * 60)  # 1e-5 of the sum of |c R|, below 60 here
    ok("relight", asset, "-o", tmp_path / "out.png", *flags, "--exposure", -2)
    picture = np.round(encode_srgb(np.clip(expected / 4, 0, 1)) * 255)
    assert np.abs(np.round(read_image(tmp_path / "out.png") * 255) - picture).max() <= 1


def test_a_picture_that_no_light_reaches(asset: Path, tmp_path: Path) -> None:
    for axis, black in ((1, True), (-1, False)):  # of a spot above the plane
        done = srbf("relight", asset, "-o", tmp_path / f"{axis}.exr", "--spot", f"0,0,1,0,0,{axis},0.2,0.5")
        assert done.exit_code == 0 and ("the picture is black" in done.stderr) == black


@pytest.mark.slow
@pytest.mark.parametrize("flags", [["eigen-map", "--components", 6], ["clustered-eigen-map", "--components", 3, "--clusters", 4]])
def test_both_renderers_relight_every_method(make_capture, plane_positions, tmp_path: Path, flags: list) -> None:
    waves = np.random.default_rng(6).normal(size=(10, 14, 3, 3))
    capture = make_capture(lambda d: 1 + np.sin(waves @ d), position=plane_positions)
    ok("fit", capture.folder, "-o", tmp_path / "asset", "--method", *flags)
    images = []
    for renderer in ("numpy", "gl"):
        out = tmp_path / f"{renderer}.exr"
        ok("relight", tmp_path / "asset", "-o", out, "--directional", "0,1,1", "--point", "0.2,0.1,0.8", "--renderer", renderer)
        images.append(read_image(out))
    assert images[0].max() > 0.5
    np.testing.assert_allclose(*images, atol=1e-5 * 60)  # 1e-5 of the sum of |a w|, below 60 here


def test_frames(asset: Path, tmp_path: Path) -> None:
    around = np.random.default_rng(9).random((4, 8, 3)).astype(np.float32)
    write_image(tmp_path / "environment.exr", around, "float")
    spot = {"kind": "spot", "position": [0, 0, 1], "direction": [0, 0, -1], "inner": 0.1, "outer": 0.4}
    point = {"kind": "point", "position": [0, 0, 1], "color": [1, 2, 3], "a0": 2, "falloff": "inverse-square"}
    frames = [
        [{"kind": "directional", "direction": [0, 0, 3], "color": [1, 1, 1]}, point],
        [spot, {"kind": "environment", "file": "environment.exr", "turn": 2.5}],
        [],
    ]
    (tmp_path / "frames.json").write_text(json.dumps({"frames": [{"lights": lights} for lights in frames]}))
    ok("relight", asset, "--lights", tmp_path / "frames.json", "-o", tmp_path / "out")
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == ["0000.exr", "0001.exr", "0002.exr"]
    opened = Asset.open(asset)
    below = {"frames": [{"lights": [{"kind": "directional", "direction": [0, 0, -1]}]}]}
    (tmp_path / "below.json").write_text(json.dumps(below))
    assert "frame 0: light 0" in srbf("relight", asset, "--lights", tmp_path / "below.json", "-o", tmp_path / "below").stderr
    for number, lights in enumerate(read_frames(tmp_path / "frames.json")):
        np.testing.assert_array_equal(read_image(tmp_path / "out" / f"{number:04d}.exr"), methods.relight(opened, lights))
    assert not read_image(tmp_path / "out" / "0002.exr").any()
    (read,) = (light for light in read_frames(tmp_path / "frames.json")[1] if isinstance(light, EnvironmentLight))
    np.testing.assert_array_equal(methods.relight(opened, [read]), methods.relight(opened, [EnvironmentLight(around).turned(2.5)]))


@pytest.mark.parametrize(
    ("lights", "words"),
    [
        ([{"kind": "laser"}], "laser"),
        ([{"kind": "point"}], "position"),
        ([{"kind": "directional", "direction": [0, 0, 0]}], "direction"),
        ([{"kind": "point", "position": [0, 0, 1], "a_o": 1}], "a_o"),
        ([{"kind": "spot", "position": [0, 0, 1], "direction": [0, 0, 1], "inner": 1, "outer": 0.5}], "inner"),
        ([{"kind": "environment", "file": "nowhere.exr"}], "nowhere.exr"),
    ],
)
def test_bad_frames(asset: Path, tmp_path: Path, lights: list, words: str) -> None:
    (tmp_path / "frames.json").write_text(json.dumps({"frames": [{"lights": lights}]}))
    assert words in refused("relight", asset, "--lights", tmp_path / "frames.json", "-o", tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_import_to_relight(tmp_path: Path) -> None:
    for i, level in enumerate((40, 80, 120, 160)):
        write_image(tmp_path / f"{i}.png", np.full((4, 5, 3), level, np.uint8), "uint8")
    (tmp_path / "l.lp").write_text("4\n0.png 0 0 1\n1.png 0.6 0 0.8\n2.png -0.6 0 0.8\n3.png 0 0.6 0.8\n")
    ok("import", "--lp", tmp_path / "l.lp", "-o", tmp_path / "capture", "--transfer", "srgb", "--holdout-lp", tmp_path / "l.lp")
    ok("fit", tmp_path / "capture", "-o", tmp_path / "asset", "-k", 4, "--spread", "mean", "--ridge", 0)
    result = json.loads(ok("evaluate", tmp_path / "asset", tmp_path / "capture", "--json"))
    assert result["holdout"]["psnr"] > 55 and result["holdout"]["peak"] == 1  # four maps interpolate four lights, up to half floats
    assert "position" in refused("relight", tmp_path / "asset", "-o", tmp_path / "x.exr", "--point", "0,0,1")


@pytest.mark.slow
def test_report_of_a_synthetic_capture(asset: Path, capture: Capture, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("srbf.report.compared_methods", lambda: ())
    ok("report", asset, capture.folder, "-o", tmp_path / "report")
    assert (tmp_path / "report" / "index.html").is_file() and (tmp_path / "report" / "contact_sheet.png").is_file()
    page = tmp_path / "page.html"
    ok("report", asset, capture.folder, "-o", page)
    assert "data:image/" in page.read_text() and not list(tmp_path.glob(".*"))
    assert "--force" in refused("report", asset, capture.folder, "-o", page)


def test_outputs_that_exist_are_refused_unless_forced(asset: Path, capture: Capture, tmp_path: Path) -> None:
    before = (asset / "asset.json").read_bytes()
    assert "--force" in refused("fit", capture.folder, "-o", asset, "-k", 4)
    assert (asset / "asset.json").read_bytes() == before
    ok("fit", capture.folder, "-o", asset, "-k", 4, "--force")
    assert Asset.open(asset).k == 4 and not list(asset.glob("map_05*"))
    ok("relight", asset, "-o", tmp_path / "a.exr", "--ambient-only")
    assert "--force" in refused("relight", asset, "-o", tmp_path / "a.exr", "--ambient-only")
    ok("relight", asset, "-o", tmp_path / "a.exr", "--ambient-only", "--force")


@pytest.mark.lengthy
def test_bad_captures_and_assets_leave_nothing(asset: Path, capture: Capture, tmp_path: Path) -> None:
    out = tmp_path / "new"
    assert "capture.json" in refused("fit", tmp_path, "-o", out)
    (tmp_path / "file").write_text("")
    assert "folder" in refused("fit", capture.folder, "-o", tmp_path / "file" / "asset", "-k", 4)
    assert "60 lights for -k 200" in refused("fit", capture.folder, "-o", out, "-k", 200, "--ridge", 0)
    light = capture.folder / capture.lights[3].file
    pixels = capture.image(3).copy()
    pixels[1, 2] = np.nan
    import OpenImageIO as oiio

    target = oiio.ImageOutput.create(str(light))
    target.open(str(light), oiio.ImageSpec(14, 10, 3, oiio.FLOAT))
    target.write_image(pixels)
    target.close()
    assert "0003.exr" in refused("fit", capture.folder, "-o", out, "-k", 4)
    light.write_bytes(light.read_bytes()[:200])
    assert "0003.exr" in refused("fit", capture.folder, "-o", out, "-k", 4)
    assert "0003.exr" in refused("evaluate", asset, capture.folder, "--json")
    light.unlink()
    assert "0003.exr" in refused("info", capture.folder)
    assert not out.exists() and not list(tmp_path.glob(".*partial*"))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--directional", "0,0,0"], "direction"),
        (["--directional", "0,0"], "expected --directional X,Y,Z[,R,G,B], found '0,0'"),
        (["--directional", "a,b,c"], "--directional X,Y,Z"),
        (["--point", "0,0,1", "--reference-distance", "0"], "--reference-distance: expected a number above 0, found '0'"),
        (["--spot", "0,0,1,0,0,-1,0.5,0.2"], "inner"),
        (["--exposure", "bright"], "--exposure: expected a number from -100 to 100, found 'bright'"),
        (
            [],
            "expected a light, found none; add --directional, --point, --spot, --sphere, --area, --light, --emissive, --environment, "
            "--scene-lights or --ambient-only",
        ),
        (["--ambient-only", "--point", "0,0,1"], "expected --ambient-only without a light"),
        (["--ambient-only", "--no-ambient"], "expected --ambient-only or --no-ambient"),
        (["--lights", "frames.json", "--point", "0,0,1"], "put all lights into the file"),
        (["--point", "0,0,1", "--samples", "9"], "expected --reference with --samples"),
    ],
)
def test_bad_lights(tmp_path: Path, arguments: list[str], words: str) -> None:
    """Wrong usage: no asset is looked at."""
    assert words in misused("relight", tmp_path / "none", "-o", tmp_path / "x.exr", *arguments)
    assert not (tmp_path / "x.exr").exists()


def test_a_turn_of_no_environment(asset: Path, tmp_path: Path) -> None:
    line = refused("relight", asset, "-o", tmp_path / "x.exr", "--directional", "0,0,1", "--turn", "1", status=2)
    assert "expected --environment with --turn, found none" in line


def test_an_environment_map_that_is_not_there(asset: Path, tmp_path: Path) -> None:
    assert "nowhere.exr" in refused("relight", asset, "-o", tmp_path / "x.exr", "--environment", "nowhere.exr")


def test_the_light_of_the_scene_itself_is_left_out_where_asked(asset: Path, tmp_path: Path) -> None:
    opened = Asset.open(asset)
    shape = (opened.manifest["height"], opened.manifest["width"], 3)
    opened.images["ambient"] = np.random.default_rng(0).uniform(0.5, 1, shape).astype(np.float32)
    opened.manifest["ambient"] = "ambient.exr"
    opened.save(tmp_path / "own")
    for name, more in (("with", []), ("without", ["--no-ambient"])):
        ok("relight", tmp_path / "own", "-o", tmp_path / f"{name}.exr", "--directional", "0.2,0.3,1", *more)
    both, alone = (read_image(tmp_path / f"{name}.exr")[..., :3] for name in ("with", "without"))
    np.testing.assert_allclose(both - alone, opened.images["ambient"], atol=1e-5)


def test_the_ambient_light_alone_is_asked_for(asset: Path, tmp_path: Path) -> None:
    ok("relight", asset, "-o", tmp_path / "x.exr", "--ambient-only")
    np.testing.assert_array_equal(read_image(tmp_path / "x.exr"), methods.relight(Asset.open(asset), []))


def test_a_reference_that_cannot_be_rendered_is_told_before_any_work(asset: Path, tmp_path: Path) -> None:
    """Of a missing scene, and of an asset of another receiver; the picture is not written either."""
    words = ["relight", asset, "-o", tmp_path / "x.exr", "--directional", "0,0,1", "--reference"]
    assert "expected a .blend at" in refused(*words, tmp_path / "none.blend")
    (tmp_path / "shot.blend").write_bytes(b"")
    assert "expected an asset of a view" in refused(*words, tmp_path / "shot.blend")
    assert "expected --scene with --blender" in misused("view", asset, "--blender", tmp_path)
    assert not (tmp_path / "x.exr").exists()


def test_a_full_or_read_only_target(asset: Path) -> None:
    assert "cannot write" in refused("relight", asset, "-o", "/proc/x.exr", "--ambient-only")
    assert "no folder" in refused("relight", asset, "-o", asset / "none" / "x.exr", "--ambient-only")
    assert "cannot write" in refused("relight", asset, "-o", asset / "asset.json" / "x.exr", "--ambient-only")


@pytest.mark.slow
def test_gl_missing(asset: Path, tmp_path: Path) -> None:
    code = "import sys; sys.modules['moderngl'] = None; from srbf.cli import app; app()"
    done = subprocess.run(
        [sys.executable, "-c", code, "relight", str(asset), "-o", str(tmp_path / "x.exr"), "--renderer", "gl", "--ambient-only"],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 1 and "moderngl" in done.stderr and len(done.stderr.strip().splitlines()) == 1


def test_usage_is_exit_2_and_version(tmp_path: Path) -> None:
    assert ok("--version").startswith("srbf 0.")
    for arguments in (["fit"], ["nonsense"], ["--nonsense"], ["relight", "x"], ["fit", "x", "-o", "y", "--encoding", "jpeg"]):
        misused(*arguments)
    assert "Did you mean 'info'" in misused("inof") and "--output" in misused("fit", "x", "--outptu", "y")
    assert "expected CAPTURE, found none; see " in misused("fit")
    assert "x.blend" in refused("bake", tmp_path / "x.blend", "-o", tmp_path / "y", "--receiver", "view")
    assert not (tmp_path / "y").exists()


@pytest.mark.slow
def test_a_real_process(capture: Capture, tmp_path: Path) -> None:
    def run(*arguments: object) -> subprocess.CompletedProcess[str]:
        return subprocess.run([sys.executable, "-m", "srbf", *map(str, arguments)], capture_output=True, text=True)

    done = run("fit", capture.folder, "-o", tmp_path / "asset", "-k", 5)
    assert done.returncode == 0 and done.stdout == "" and "holdout: PSNR" in done.stderr
    again = run("fit", capture.folder, "-o", tmp_path / "asset", "-k", 5)
    assert again.returncode == 1 and len(again.stderr.strip().splitlines()) == 1
    assert json.loads(run("info", tmp_path / "asset", "--json").stdout)["k"] == 5


@pytest.mark.slow
def test_the_example_runs(capture: Capture, tmp_path: Path) -> None:
    example = Path(__file__).parents[2] / "examples" / "relighting_map.py"
    done = subprocess.run([sys.executable, str(example), str(capture.folder), str(tmp_path / "x.png")], capture_output=True, text=True)
    assert done.returncode == 0 and "holdout" in done.stdout, done.stderr
    assert read_image(tmp_path / "x.png").max() > 0.3


@pytest.mark.slow
def test_the_library_needs_numpy_and_scipy_alone() -> None:
    code = (
        "import sys, pkgutil, importlib\n"
        "for name in ('OpenImageIO', 'moderngl', 'bpy', 'typer', 'rich', 'jsonschema', 'jaxtyping', 'matplotlib', 'filelock', 'PIL',\n"
        "             'pygltflib'):\n"
        "    sys.modules[name] = None\n"
        "import srbf\n"
        "names = [m.name for m in pkgutil.walk_packages(srbf.__path__, 'srbf.') if '.cli' not in m.name and '__main__' not in m.name]\n"
        "[importlib.import_module(name) for name in names]\n"
        "print(len(names))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) > 30


@pytest.mark.lengthy
@pytest.mark.parametrize(
    "flags",
    [
        ["--method", "eigen-map", "--components", "6", "--weighting", "relative", "--encoding", "uint8"],
        ["--method", "clustered-eigen-map", "--components", "2", "--clusters", "3", "--ridge", "0.1", "--spread", "0.5"],
        ["--method", "relighting-map", "-k", "9", "--basis", "spherical-harmonics"],
        ["--method", "relighting-map", "-k", "6", "--basis", "ptm", "--ridge", "0.1"],
    ],
)
def test_every_method_fits_shows_and_relights(capture: Capture, tmp_path: Path, flags: list[str]) -> None:
    ok("fit", capture.folder, "-o", tmp_path / "asset", *flags)
    asset = Asset.open(tmp_path / "asset")
    assert asset.method == flags[1]
    settings = asset.manifest["source"]["settings"]
    for flag, value in zip(flags[2::2], flags[3::2], strict=True):
        assert str(settings[flag.lstrip("-")]) == value
    facts = json.loads(ok("info", tmp_path / "asset", "--json"))
    assert facts["bytes_per_texel"]["directional"] == asset.bytes_per_texel()["directional"]
    ok("relight", tmp_path / "asset", "-o", tmp_path / "out.exr", "--directional", "0.3,0,1", "--point", "0,0.2,1")
    expected = methods.relight(asset, [DirectionalLight((0.3, 0, 1)), PointLight((0, 0.2, 1))])
    np.testing.assert_array_equal(read_image(tmp_path / "out.exr"), expected)
    assert set(json.loads(ok("evaluate", tmp_path / "asset", capture.folder, "--json"))) == {"train", "holdout", "lights"}


@pytest.mark.slow
def test_a_budget_chooses_and_says_so(capture: Capture, tmp_path: Path) -> None:
    done = srbf("fit", capture.folder, "-o", tmp_path / "asset", "--method", "auto", "--budget", 6)
    assert done.exit_code == 0 and "chose 4 components as bytes" in done.stderr  # Lambert needs one, and an image holds four
    assert Asset.open(tmp_path / "asset").bytes_per_texel()["directional"] == 4
    ok("fit", capture.folder, "-o", tmp_path / "asset", "--method", "auto", "--psnr", 20, "--force")
    assert Asset.open(tmp_path / "asset").bytes_per_texel()["directional"] == 4


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        (["--method", "relighting-map", "--components", 4], "--components applies only to method eigen-map or clustered-eigen-map"),
        (["--method", "relighting-map", "--budget", 8], "--budget applies only to method auto"),
        (["-k", 9, "--budget", 8], "-k applies only to method relighting-map"),
        (["-k", 9, "--clusters", 8], "-k applies only to method relighting-map"),
        (["--method", "eigen-map", "-k", 9], "-k applies only to method relighting-map"),
        (["--method", "eigen-map", "--clusters", 4], "--clusters applies only to"),
        (["--method", "eigen-map", "--psnr", 30], "--psnr applies only to method auto"),
        (["--method", "eigen-map", "--basis", "ptm"], "--basis"),
        (["--method", "eigen-map", "--spread", "mean"], "spread"),
        (["--method", "eigen-map", "--ridge", 0], "ridge"),
        (["--method", "eigen-map", "--components", 0], "--components: expected a whole number of 1 or more, found '0'"),
        (["--method", "clustered-eigen-map", "--weighting", "plain"], "--weighting"),
        (["--method", "clustered-eigen-map", "--clusters", 300], "256 clusters"),
        (["--method", "auto", "--encoding", "half"], "--encoding"),
        (["--method", "auto", "--budget", 3], "a --budget of at least 4"),
        (["--budget", 8, "--psnr", 30], "a --budget or a --psnr, found both"),
        (["--psnr", "nan"], "--psnr: expected a number, found 'nan'"),
        (["--basis", "ptm", "-k", 7], "-k of 6"),
        (["--basis", "spherical-harmonics", "-k", 10], "found 10"),
        (["--ridge", "some"], "--ridge: expected auto or a number, found 'some'"),
        (["--spread", "narrow"], "--spread: expected auto, mean, min or a number, found 'narrow'"),
        (["-k", 0], "-k: expected a whole number of 1 or more, found '0'"),
    ],
)
def test_flags_that_do_not_go_together(tmp_path: Path, flags: list, words: str) -> None:
    """Wrong usage: no capture is looked at."""
    assert words in misused("fit", tmp_path / "none", "-o", tmp_path / "asset", *flags)


@pytest.mark.parametrize(
    ("flags", "words"),
    [(["--components", 181], "at most 180 components for 60 lights"), (["-k", 200, "--ridge", 0], "60 lights for -k 200")],
)
def test_flags_that_a_capture_does_not_allow(made: Path, tmp_path: Path, flags: list, words: str) -> None:
    assert words in refused("fit", made / "capture", "-o", tmp_path / "asset", *flags)
    assert not (tmp_path / "asset").exists()
