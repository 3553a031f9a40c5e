"""A view on an empty background is relit with its coverage as alpha: no streaks outside, edges neither dark nor fringed over anything."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from made_captures import write_capture
from typer.testing import CliRunner

from srbf.asset import Asset
from srbf.capture import Capture
from srbf.cli import app
from srbf.io import files
from srbf.io.image import decode_srgb, encode_srgb, read_image
from srbf.lights import DirectionalLight
from srbf.methods import relight

SIZE, RADIUS, FINER = 24, 8.3, 16
COLOR = np.array([0.8, 0.45, 0.2], np.float32)  # of the disc under the light, over all of it
FLAGS = ["--directional", "0.3,0.2,1"]
BACKGROUNDS = [(0, 0, 0), (1, 1, 1), (0.1, 0.6, 0.9)]


def disc() -> np.ndarray:
    """(H, W) shares of the pixels that a disc covers, by FINER^2 samples each."""
    middles = (np.arange(SIZE * FINER) + 0.5) / FINER - SIZE / 2 - 0.21
    inside = (middles[:, None] ** 2 + middles**2 < RADIUS**2).astype(np.float32)
    return inside.reshape(SIZE, FINER, SIZE, FINER).mean(axis=(1, 3)).astype(np.float32)


def run(*arguments: object) -> str:
    done = CliRunner().invoke(app, list(map(str, arguments)))
    assert done.exit_code == 0, done.stderr
    return done.stderr


def described(capture: Capture, **facts: object) -> Capture:
    files.write_json(capture.folder / "capture.json", {**capture.manifest, **facts})
    return Capture.open(capture.folder)


@pytest.fixture(scope="module")
def view(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A disc of one color, its pixels unpremultiplied and spread outside, as a bake writes it; fitted."""
    share = disc()
    assert ((share > 0) & (share < 1)).sum() > 20 and (share == 0).mean() > 0.5
    response = lambda d: np.full((SIZE, SIZE, 3), max(0, d[2]), np.float32) * COLOR  # noqa: E731
    folder = tmp_path_factory.mktemp("view")
    capture = write_capture(folder / "capture", response, coverage=share)
    capture = described(capture, receiver={"kind": "view", "camera": "Camera"}, quantity="radiance")
    run("fit", capture.folder, "-o", folder / "asset", "-k", 9)
    return folder / "asset"


@pytest.mark.lengthy
@pytest.mark.parametrize("renderer", ["numpy", "gl"])
def test_over_any_background_edges_are_the_mixture_by_coverage(view: Path, tmp_path: Path, renderer: str) -> None:
    share, asset = disc()[..., None], Asset.open(view)
    color = relight(asset, [DirectionalLight((0.3, 0.2, 1))])[share[..., 0] == 1].mean(axis=0)  # one all over the disc
    assert np.abs(color - COLOR * np.cos(np.arctan(np.hypot(0.3, 0.2)))).max() < 0.05
    run("relight", view, "-o", tmp_path / "straight.exr", *FLAGS, "--renderer", renderer)
    run("relight", view, "-o", tmp_path / "premultiplied.exr", *FLAGS, "--renderer", renderer, "--alpha", "premultiplied")
    run("relight", view, "-o", tmp_path / "picture.png", *FLAGS, "--renderer", renderer)
    straight, premultiplied = read_image(tmp_path / "straight.exr"), read_image(tmp_path / "premultiplied.exr")
    picture = read_image(tmp_path / "picture.png")
    for image in (straight, premultiplied, picture):
        assert image.shape == (SIZE, SIZE, 4)
        np.testing.assert_allclose(image[..., 3:], share, atol=0.5 / 255 + 1e-6 if image is picture else 0)
        assert not image[share[..., 0] == 0].any()
    for background in BACKGROUNDS:
        expected = color * share + np.float32(background) * (1 - share)
        np.testing.assert_allclose(straight[..., :3] * straight[..., 3:] + background * (1 - straight[..., 3:]), expected, atol=1e-5)
        np.testing.assert_allclose(premultiplied[..., :3] + background * (1 - premultiplied[..., 3:]), expected, atol=1e-5)
        over = decode_srgb(picture[..., :3]) * picture[..., 3:] + background * (1 - picture[..., 3:])
        np.testing.assert_allclose(over, expected, atol=0.006)  # half a byte of sRGB's steepest step, and of alpha
    covered = share[..., 0] > 0.02
    np.testing.assert_allclose(straight[covered, :3], np.broadcast_to(color, (covered.sum(), 3)), atol=1e-5)


def test_a_picture_shows_what_a_texture_holds_only_when_asked(view: Path, tmp_path: Path) -> None:
    run("relight", view, "-o", tmp_path / "none.exr", *FLAGS, "--alpha", "none")
    run("relight", view, "-o", tmp_path / "none.png", *FLAGS, "--alpha", "none")
    filled = relight(Asset.open(view), [DirectionalLight((0.3, 0.2, 1))])
    np.testing.assert_array_equal(read_image(tmp_path / "none.exr"), filled)
    assert np.abs(read_image(tmp_path / "none.png") - encode_srgb(np.clip(filled, 0, 1))).max() < 0.003
    done = CliRunner().invoke(app, ["relight", str(view), "-o", str(tmp_path / "x.png"), *FLAGS, "--alpha", "premultiplied"])
    assert done.exit_code == 2 and "straight" in done.stderr and not (tmp_path / "x.png").exists()


def test_every_frame_of_a_sequence_has_its_alpha(view: Path, tmp_path: Path) -> None:
    frames = {"frames": [{"lights": [{"kind": "directional", "direction": [x, 0, 1]}]} for x in (-0.5, 0.5)]}
    (tmp_path / "frames.json").write_text(json.dumps(frames))
    run("relight", view, "-o", tmp_path / "frames", "--lights", tmp_path / "frames.json")
    for n in range(2):
        image = read_image(tmp_path / "frames" / f"{n:04d}.exr")
        np.testing.assert_array_equal(image[..., 3], disc())
        assert not image[disc() == 0].any() and image[disc() == 1, :3].min() > 0.05


@pytest.mark.parametrize(
    ("facts", "channels"),
    [
        ({"receiver": {"kind": "lightmap", "object": "Plane"}}, 3),
        ({"receivers": [{"kind": "lightmap", "object": "A"}, {"kind": "lightmap", "object": "B"}]}, 3),
        ({"receiver": {"kind": "vertices", "object": "Plane"}}, 3),
        ({"receiver": {"kind": "view"}}, 4),
        ({}, 4),  # photographs with a mask
    ],
)
def test_textures_have_no_alpha_and_pictures_have(make_capture, tmp_path: Path, facts: dict, channels: int) -> None:
    response = lambda d: np.full((SIZE, SIZE, 3), max(0, d[2]), np.float32)  # noqa: E731
    capture = described(make_capture(response, lights=20, coverage=(disc() > 0.5).astype(np.float32)), **facts)
    run("fit", capture.folder, "-o", tmp_path / "asset", "-k", 4)
    run("relight", tmp_path / "asset", "-o", tmp_path / "x.exr", *FLAGS)
    run("relight", tmp_path / "asset", "-o", tmp_path / "x.png", *FLAGS)
    relit = relight(Asset.open(tmp_path / "asset"), [DirectionalLight((0.3, 0.2, 1))])
    for name in ("x.exr", "x.png"):
        image = read_image(tmp_path / name)
        assert image.shape[2] == channels
        assert (image[disc() <= 0.5].max() == 0) == (channels == 4)
    np.testing.assert_array_equal(read_image(tmp_path / "x.exr", 3)[disc() > 0.5], relit[disc() > 0.5])


def test_a_view_that_fills_its_picture_stays_rgb(make_capture, tmp_path: Path) -> None:
    response = lambda d: np.full((SIZE, SIZE, 3), max(0, d[2]), np.float32)  # noqa: E731
    capture = described(make_capture(response, lights=20, coverage=np.ones((SIZE, SIZE), np.float32)), receiver={"kind": "view"})
    run("fit", capture.folder, "-o", tmp_path / "asset", "-k", 4)
    run("relight", tmp_path / "asset", "-o", tmp_path / "x.exr", *FLAGS)
    assert read_image(tmp_path / "x.exr").shape[2] == 3
