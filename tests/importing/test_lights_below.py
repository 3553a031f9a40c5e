"""Sets whose lights are below the horizon: imported with a warning, fitted on the sphere, relit as they were lit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from srbf import methods
from srbf.asset import Asset
from srbf.capture import Capture
from srbf.cli import app
from srbf.io.image import write_image
from srbf.lights import DirectionalLight
from srbf.sphere import fibonacci

ALBEDO = np.array([1, 0.8, 0.6])
LEAST = 28.0  # dB at lights that were fitted and others; the least of the four is 29.5 at 24x24 pixels, and black has 5 to 12


def srbf(*arguments: object) -> Result:
    return CliRunner().invoke(app, list(map(str, arguments)))


def normals(facing: str) -> np.ndarray:
    """(20, 20, 3): a ball's lower half seen from below (its corners face straight down), or normals all around."""
    if facing == "around":
        return fibonacci(400).reshape(20, 20, 3)
    across = (np.arange(20) + 0.5) / 10 - 1
    x, y = np.meshgrid(across, -across)
    inside = x**2 + y**2 < 1
    x, y = np.where(inside, x, 0), np.where(inside, y, 0)
    return np.stack([x, y, -np.sqrt(1 - x**2 - y**2)], axis=-1)


def lambert(facing: str, direction: np.ndarray) -> np.ndarray:
    return np.maximum(normals(facing) @ direction, 0)[..., None] * ALBEDO


def imported(folder: Path, facing: str, directions: np.ndarray) -> Result:
    """An import of 8-bit photographs of the ball; every sixth light is held out."""
    for i, direction in enumerate(directions):
        write_image(folder / f"{i}.png", np.round(lambert(facing, direction) * 255).astype(np.uint8), "uint8")
    for name, chosen in (("train", [i for i in range(len(directions)) if i % 6]), ("unseen", range(0, len(directions), 6))):
        lines = [f"{i}.png {' '.join(f'{v:.9f}' for v in directions[i])}\n" for i in chosen]
        (folder / f"{name}.lp").write_text(f"{len(lines)}\n{''.join(lines)}")
    return srbf(
        "import", "--lp", folder / "train.lp", "--holdout-lp", folder / "unseen.lp", "-o", folder / "capture", "--transfer", "linear"
    )


@pytest.mark.slow
@pytest.mark.parametrize("facing", ["down", "around"])
@pytest.mark.parametrize("flags", [["-k", 25], ["--method", "eigen-map"]])
def test_all_below_relight_as_they_were_lit(tmp_path: Path, facing: str, flags: list) -> None:
    directions = fibonacci(200)
    directions = directions[directions[:, 2] < 0]
    done = imported(tmp_path, facing, directions)
    assert done.exit_code == 0 and done.stderr.count("below the horizon") == 1 and "all 83 lights of train.lp" in done.stderr
    done = srbf("fit", tmp_path / "capture", "-o", tmp_path / "asset", *flags)
    assert done.exit_code == 0, done.stderr
    asset = Asset.open(tmp_path / "asset")
    assert asset.domain == "sphere"
    assert min(asset.manifest["error"][role]["psnr"] for role in ("train", "holdout")) > LEAST
    for direction in (directions[0], directions[40], np.array([0.3, -0.2, -0.8]) / np.sqrt(0.77)):
        relit = methods.relight(asset, [DirectionalLight(tuple(direction))])
        assert np.sqrt(np.mean((relit - lambert(facing, direction)) ** 2)) < 10 ** (-LEAST / 20)
    below, above = (srbf("relight", tmp_path / "asset", "--directional", d, "-o", tmp_path / f"{d}.exr") for d in ("0,0,-1", "0,0,1"))
    assert below.exit_code == 0 and "extrapolated" not in below.stderr
    assert above.exit_code == 0 and above.stderr.count("light 0 is at 90 degrees of elevation, far from all captured lights") == 1


@pytest.mark.slow
def test_some_below_are_counted_and_kept(tmp_path: Path) -> None:
    directions = fibonacci(120)
    directions = directions[directions[:, 2] > -0.3]
    train = [i for i in range(len(directions)) if i % 6]
    below = int((directions[train, 2] <= 0).sum())
    done = imported(tmp_path, "around", directions)
    assert f"{below} of {len(train)} lights of train.lp are below the surface" in done.stderr
    assert srbf("fit", tmp_path / "capture", "-o", tmp_path / "asset", "-k", 25).exit_code == 0
    asset = Asset.open(tmp_path / "asset")
    assert asset.domain == "sphere" and asset.manifest["error"]["holdout"]["psnr"] > LEAST


def test_a_hemisphere_without_lights_is_refused(tmp_path: Path) -> None:
    directions = fibonacci(80)
    assert imported(tmp_path, "down", directions[directions[:, 2] < 0]).exit_code == 0
    for flags in (["--domain", "hemisphere"], ["--basis", "hemispherical-harmonics"]):
        done = srbf("fit", tmp_path / "capture", "-o", tmp_path / "asset", *flags)
        assert done.exit_code == 1 and "above the horizon" in done.stderr and not (tmp_path / "asset").exists()


@pytest.mark.lengthy
def test_a_whole_sphere_has_no_far_lights(make_capture, tmp_path: Path) -> None:
    folder = make_capture(lambda d: np.full((2, 3, 3), max(0, d[2])), lights=60, domain="sphere").folder
    assert srbf("fit", folder, "-o", tmp_path / "asset", "-k", 9).exit_code == 0
    for direction in ("0,0,-1", "0,0,1", "1,0,0"):
        done = srbf("relight", tmp_path / "asset", "--directional", direction, "-o", tmp_path / "o.exr", "--force")
        assert done.exit_code == 0 and "extrapolated" not in done.stderr
    assert Capture.open(folder).kind == "directional"
