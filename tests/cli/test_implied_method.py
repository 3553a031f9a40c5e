"""The method of `srbf fit` where --method is left out: that of the flags that were given."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from made_captures import write_capture
from typer.testing import CliRunner, Result

from srbf.asset import Asset
from srbf.capture import Capture
from srbf.cli import app
from srbf.fitting.options import implied_method
from srbf.sphere import fibonacci


def srbf(*arguments: object) -> Result:
    return CliRunner().invoke(app, list(map(str, arguments)))


@pytest.fixture(scope="module")
def capture(tmp_path_factory: pytest.TempPathFactory) -> Capture:
    return write_capture(tmp_path_factory.mktemp("made") / "capture", lambda d: np.full((6, 8, 3), max(0, d[2])) * [1, 0.5, 0.25])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("flags", "method"),
    [
        ([], "eigen-map"),
        (["--spread", 0.3, "--ridge", 0.01], "eigen-map"),
        (["-k"], "relighting-map"),
        (["--components"], "eigen-map"),
        (["-k", 9], "relighting-map"),
        (["--basis", "ptm", "-k", 6], "relighting-map"),
        (["--centers", "hammersley"], "relighting-map"),
        (["--components", 4], "eigen-map"),
        (["--weighting", "relative"], "eigen-map"),
        (["--clusters", 2], "clustered-eigen-map"),
        (["--clusters", 2, "--components", 3], "clustered-eigen-map"),
        (["--method", "clustered-eigen-map", "--components", 3], "clustered-eigen-map"),
    ],
)
def test_flags_name_their_method(capture: Capture, tmp_path: Path, flags: list, method: str) -> None:
    done = srbf("fit", capture.folder, "-o", tmp_path / "asset", *flags)
    assert done.exit_code == 0, done.stderr
    assert Asset.open(tmp_path / "asset").method == method


@pytest.mark.slow
@pytest.mark.parametrize("flags", [["--budget", 6], ["--psnr", 20]])
def test_bytes_or_decibels_alone_choose(capture: Capture, tmp_path: Path, flags: list) -> None:
    done = srbf("fit", capture.folder, "-o", tmp_path / "asset", *flags)
    assert done.exit_code == 0 and "chose 4 components as bytes" in done.stderr  # Lambert needs one, and an image holds four
    assert Asset.open(tmp_path / "asset").bytes_per_texel()["directional"] == 4


@pytest.mark.lengthy
def test_leaving_one_out_takes_the_same_method(make_capture) -> None:
    folder = make_capture(lambda d: np.full((2, 3, 3), max(0, d[2])), holdout=2, directions=fibonacci(24)[:12]).folder
    assert srbf("evaluate", "--leave-one-out", folder, "--components", 2).exit_code == 0
    done = srbf("evaluate", "--leave-one-out", folder, "--components", 2, "--method", "relighting-map")
    assert done.exit_code == 2 and "--components applies only to" in done.stderr
    assert implied_method({"components": 2}) == "eigen-map" and implied_method({}) == "auto"


def test_more_maps_than_lights_is_a_caution(make_capture, tmp_path: Path) -> None:
    folder = make_capture(lambda d: np.full((2, 3, 3), max(0, d[2])), holdout=2, directions=fibonacci(24)[:12]).folder
    few, enough = (srbf("fit", folder, "-o", tmp_path / f"{k}", "-k", k) for k in (13, 12))
    assert few.exit_code == 0 and few.stderr.count("caution: 13 maps of 12 train lights") == 1
    assert enough.exit_code == 0 and "caution" not in enough.stderr
