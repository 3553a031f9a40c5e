"""OpenEXR: the part and layer with the picture's color, in the display window."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from picture_files import DISPLAY_P3, P3_TO_709, exr, rgb
from typer.testing import CliRunner

from srbf.capture import Capture
from srbf.cli import app
from srbf.cli.light_arguments import read_environment
from srbf.errors import ImageError
from srbf.importing.photographs import LightListImport
from srbf.importing.pictures import read_picture

PICTURE, OTHER = (0.25, 0.5, 0.75), (9.0, 8.0, 7.0)
DEPTH = {"Z": np.full((4, 6), 5.0)}


def layered(*names: str) -> dict[str, np.ndarray]:
    """Channels of layers, the picture's colors in those that end in Combined, rgb or beauty."""
    channels: dict[str, np.ndarray] = {}
    for name in names:
        channels |= rgb(f"{name}.", PICTURE if name.lower().endswith(("combined", "rgb", "beauty")) else OTHER)
    return channels


CASES: dict[str, list[dict[str, Any]]] = {
    "depth before color": [{"name": "depth", "channels": DEPTH}, {"name": "color", "channels": rgb("", PICTURE)}],
    "color before depth": [{"name": "rgba", "channels": rgb("", PICTURE)}, {"name": "depth", "channels": DEPTH}],
    "normals as RGB": [{"name": "normal", "channels": rgb("", OTHER)}, {"name": "rgba", "channels": rgb("", PICTURE)}],
    "Blender": [{"channels": layered("ViewLayer.AO", "ViewLayer.Combined", "ViewLayer.DiffDir") | {"ViewLayer.Depth.Z": DEPTH["Z"]}}],
    "Blender with cryptomatte": [
        {
            "channels": layered("View Layer.Combined")
            | {f"View Layer.CryptoObject00.{c}": np.full((4, 6), 3.0) for c in "rgba"}
            | {f"View Layer.Normal.{c}": np.full((4, 6), 3.0) for c in "XYZ"}
        }
    ],
    "plain beside layers": [{"channels": rgb("", PICTURE) | layered("diffuse", "albedo")}],
    "layers in parts": [{"name": "V.AO", "channels": layered("V.AO")}, {"name": "V.Combined", "channels": layered("V.Combined")}],
    "another renderer": [{"channels": layered("AO", "beauty", "normal")}],
    "Blender, a part a pass": [
        {"name": f"ViewLayer.{name}", "channels": rgb("", PICTURE if name == "Combined" else OTHER)}
        for name in ("Ambient Occlusion", "Combined", "Diffuse Direct", "Noisy Image", "Denoising Albedo")
    ],
    "a view layer that is called Shadow": [{"channels": layered("Shadow.AO", "Shadow.Combined", "Shadow.Emit")}],
    "one eye": [{"channels": rgb("V.Combined.left.", PICTURE) | rgb("V.AO.left.", OTHER) | rgb("V.Emit.left.", OTHER)}],
    "one layer alone": [{"channels": rgb("left.", PICTURE)}],
    "alone in a part that is called depth": [{"name": "depth", "channels": rgb("", PICTURE)}],
    "one light layer beside data": [{"channels": rgb("render.", PICTURE) | layered("normal", "AO", "Position")}],
}


@pytest.mark.parametrize("case", CASES)
def test_the_picture_is_chosen_by_names(tmp_path: Path, case: str) -> None:
    exr(tmp_path / "a.exr", *CASES[case])
    picture = read_picture(tmp_path / "a.exr", "linear")
    np.testing.assert_array_equal(picture.pixels, np.broadcast_to(np.float32(PICTURE), (4, 6, 3)))
    assert any(note.startswith("took ") for note in picture.notes) == ("alone in" not in case)


@pytest.mark.parametrize(
    ("parts", "listed"),
    [
        ([{"channels": layered("A.Combined", "B.Combined")}], "A.Combined, B.Combined"),
        ([{"channels": layered("diffuse", "specular")}], "diffuse, specular"),
        ([{"channels": layered("V.AO")}], "V.AO"),
        ([{"channels": rgb("V.Combined.left.", OTHER) | rgb("V.Combined.right.", OTHER)}], "V.Combined.left, V.Combined.right"),
        ([{"channels": layered("V.AO", "V.Albedo")}], "V.AO, V.Albedo"),
        ([{"name": "key", "channels": rgb("", OTHER)}, {"name": "fill", "channels": rgb("", OTHER)}], "key, fill"),
        ([{"channels": DEPTH}], "found Z"),
        ([{"channels": {"a.X": DEPTH["Z"], "a.Y": DEPTH["Z"], "a.Z": DEPTH["Z"], "b.V": DEPTH["Z"]}}], ""),
    ],
)
def test_what_may_be_meant_is_listed(tmp_path: Path, parts: list[dict[str, Any]], listed: str) -> None:
    exr(tmp_path / "a.exr", *parts)
    with pytest.raises(ImageError, match=r"a\.exr") as error:
        read_picture(tmp_path / "a.exr", "linear")
    assert listed in str(error.value) and "\n" not in str(error.value)


@pytest.mark.parametrize("name", ["V.Combined", "v.combined", "Combined"])
def test_a_layer_by_name(tmp_path: Path, name: str) -> None:
    exr(tmp_path / "a.exr", {"channels": layered("V.AO", "V.Combined", "W.AO")})
    np.testing.assert_array_equal(read_picture(tmp_path / "a.exr", "linear", name).pixels[0, 0], PICTURE)
    np.testing.assert_array_equal(read_picture(tmp_path / "a.exr", "linear", "V.AO").pixels[0, 0], OTHER)
    with pytest.raises(ImageError, match=r"several \(V\.AO, W\.AO\)"):
        read_picture(tmp_path / "a.exr", "linear", "AO")
    with pytest.raises(ImageError, match=r"only V\.AO, V\.Combined, W\.AO"):
        read_picture(tmp_path / "a.exr", "linear", "nothing")


def test_the_command_takes_a_layer_and_says_what_it_took(tmp_path: Path) -> None:
    exr(tmp_path / "a.exr", {"channels": layered("A.Combined") | rgb("B.Combined.", OTHER)})
    (tmp_path / "l.lp").write_text("1\na.exr 0 0 1\n")
    arguments = ["import", "--lp", str(tmp_path / "l.lp"), "--transfer", "linear", "-o", str(tmp_path / "capture")]
    refused = CliRunner().invoke(app, arguments)
    assert refused.exit_code == 1 and not (tmp_path / "capture").exists()
    assert "A.Combined, B.Combined" in refused.stderr and "--layer" in refused.stderr
    taken = CliRunner().invoke(app, [*arguments, "--layer", "B.Combined"])
    assert taken.exit_code == 0 and "took B.Combined of a.exr" in taken.stderr
    np.testing.assert_array_equal(Capture.open(tmp_path / "capture").image(0)[0, 0], OTHER)


def test_one_channel_is_gray(tmp_path: Path) -> None:
    exr(tmp_path / "a.exr", {"channels": {"Y": np.full((4, 6), 0.5)}})
    np.testing.assert_array_equal(read_picture(tmp_path / "a.exr", "linear").pixels, np.full((4, 6, 3), np.float32(0.5)))


@pytest.mark.parametrize("origin", [(0, 0), (-7, -3), (100, 40)])
@pytest.mark.parametrize("window", [(0, 0, 12, 9), (2, 3, 5, 4), (-4, -3, 20, 15), (-2, 5, 6, 9), (11, 8, 4, 4), (30, 30, 2, 2)])
def test_the_data_window_is_placed_in_the_display_window(
    tmp_path: Path, origin: tuple[int, int], window: tuple[int, int, int, int]
) -> None:
    x, y, width, height = window
    rows, columns = np.mgrid[y : y + height, x : x + width].astype(np.float32)
    channels = {"R": rows + 100, "G": columns + 100, "B": rows * columns}
    exr(tmp_path / "a.exr", {"channels": channels, "at": (x + origin[0], y + origin[1]), "frame": (*origin, 12, 9)})
    expected = np.zeros((9, 12, 3), np.float32)
    for r in range(9):
        for c in range(12):
            if x <= c < x + width and y <= r < y + height:
                expected[r, c] = (r + 100, c + 100, r * c)
    picture = read_picture(tmp_path / "a.exr", "linear")
    np.testing.assert_array_equal(picture.pixels, expected)
    assert any("display window" in note for note in picture.notes) == (window != (0, 0, 12, 9))


def test_crops_that_move_from_light_to_light_fit_each_other(tmp_path: Path) -> None:
    scene = np.random.default_rng(3).uniform(0.5, 1, (9, 12, 3)).astype(np.float16).astype(np.float32)
    crops = [(0, 0, 12, 9), (1, 2, 8, 6), (3, 1, 9, 8), (2, 2, 6, 5)]
    for i, (x, y, w, h) in enumerate(crops):
        part = scene[y : y + h, x : x + w]
        exr(
            tmp_path / f"{i}.exr",
            {"channels": dict(zip("RGB", part.transpose(2, 0, 1), strict=True)), "at": (x, y), "frame": (0, 0, 12, 9)},
        )
    (tmp_path / "l.lp").write_text("4\n" + "".join(f"{i}.exr {i} 0 4\n" for i in range(4)))
    said: list[str] = []
    LightListImport(tmp_path / "l.lp", "linear").write(tmp_path / "capture", say=said.append)
    assert said == ["placed the data window of 3 images in their display window"]
    capture = Capture.open(tmp_path / "capture")
    for i in range(4):
        np.testing.assert_array_equal(capture.image(i)[3:6, 3:8], scene[3:6, 3:8])


def test_chromaticities_of_an_exr_are_converted(tmp_path: Path) -> None:
    exr(tmp_path / "a.exr", {"channels": rgb("", (0.2, 0.5, 2.0)), "chromaticities": DISPLAY_P3})
    picture = read_picture(tmp_path / "a.exr", "linear")
    np.testing.assert_allclose(picture.pixels[0, 0], P3_TO_709 @ (0.2, 0.5, 2.0), atol=1e-4)
    assert any("Rec.709" in note for note in picture.notes)
    with pytest.warns(UserWarning, match=r"a\.exr"):
        environment = read_environment(tmp_path / "a.exr")
    np.testing.assert_array_equal(environment.image, picture.pixels)
