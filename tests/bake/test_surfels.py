"""Bakes of surfels: what a capture holds, bounces against Cycles, and a bake that is stopped, resumed, or without held-out lights."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from faults import contents
from light_set_commands import done, refused, scenes_in

from srbf.asset import Asset
from srbf.capture import Capture
from srbf.methods import captured_responses
from srbf.visibility import transfer_basis
from srbf.visibility.transfer_operator import OPERATOR_FILE, SURFELS_FILE, TransferOperator

pytestmark = pytest.mark.blender

ATLAS = ["--receiver", "lightmap:Floor", "--receiver", "lightmap:Walls", "--size", "32"]
SURFELS = [*ATLAS, "--transport", "indirect", "--light-set", "surfels", "--seed", "77"]
TESTED = ["--validation", "0", "--holdout", "3", "--holdout-samples", "256"]


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    return scenes_in(tmp_path_factory)


@pytest.fixture(scope="module")
def whole(scene, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("whole") / "capture"
    done("bake", scene("room"), "-o", folder, *SURFELS, *TESTED)
    return folder


def test_a_capture_holds_an_operator_in_place_of_train_lights(whole: Path) -> None:
    capture = Capture.open(whole)
    assert capture.kind == "surfel" and [light.role for light in capture.lights] == ["holdout"] * 3
    told = capture.manifest["surfels"]
    operator = TransferOperator.read(whole)
    assert told["count"] == len(operator.cells.places) == operator.exchange.shape[0] and 1000 < told["count"] <= 8000
    assert len(told["objects"]) > operator.objects.max() and {"Floor", "Walls"} <= set(told["objects"])
    rows = np.asarray(operator.receivers.sum(axis=1))
    covered = capture.coverage().ravel() > 0.5
    assert operator.receivers.shape == (32 * 32, told["count"]) and not rows[capture.coverage().ravel() == 0].any()
    assert np.quantile(rows[covered], 0.1) > 0.5 and rows.max() < 1.03  # openings take the rest; what emits is measured apart
    flux = operator.cells.areas[:, None] * operator.exchange.toarray()
    assert np.linalg.norm(flux - flux.T) < 0.5 * np.linalg.norm(flux), "the rays of both agree"


def test_bounces_are_those_of_cycles(whole: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(transfer_basis, "MOST_PLACED", 700)
    done("fit", whole, "-o", tmp_path / "asset", "--method", "transfer", "--clusters", "8", "--components", "12", "--rank", "128")
    errors = json.loads(done("evaluate", tmp_path / "asset", whole, "--json").stdout)
    assert errors["holdout"]["relative_rmse"] < 0.25, errors["holdout"]  # most of it the noise of 256 samples
    capture, relit = Capture.open(whole), Asset.open(tmp_path / "asset")
    covered = capture.coverage() > 0.5
    for index in range(3):
        truth, found = capture.image(index)[covered], captured_responses(relit, capture, [index])[0][covered]
        assert abs(found.sum() / truth.sum() - 1) < 0.05


def test_a_bake_resumes_to_the_same_files(scene, tmp_path: Path) -> None:
    """After one that has ended, and elsewhere."""
    few = [*SURFELS, "--surfels-per-m2", "8", "--validation", "0", "--holdout", "0"]
    done("bake", scene("room"), "-o", tmp_path / "begun", *few)
    capture = Capture.open(tmp_path / "begun")
    assert not capture.lights
    before = (tmp_path / "begun" / OPERATOR_FILE).stat().st_mtime_ns
    done("bake", scene("room"), "-o", tmp_path / "begun", *few)
    assert (tmp_path / "begun" / OPERATOR_FILE).stat().st_mtime_ns == before
    done("bake", scene("room"), "-o", tmp_path / "again", *few)
    assert contents(tmp_path / "begun").keys() == contents(tmp_path / "again").keys()
    for name in (SURFELS_FILE, "capture.json"):
        assert (tmp_path / "begun" / name).read_bytes() == (tmp_path / "again" / name).read_bytes()
    one, other = (TransferOperator.read(tmp_path / name) for name in ("begun", "again"))
    np.testing.assert_array_equal(one.receivers.toarray(), other.receivers.toarray())
    assert len(one.cells.places) < 20 * one.cells.areas.sum(), "a density gives fewer surfels"


def test_a_dry_run_counts_surfels(scene, tmp_path: Path) -> None:
    assert "surfels" in done("bake", scene("room"), "-o", tmp_path / "dry", *SURFELS, "--dry-run").output
    assert not (tmp_path / "dry").exists()


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        (["--transport", "combined"], "expected `transport=indirect`"),
        (["--patches", "5"], "without"),
        (["--grid", "0.5"], "without"),
    ],
)
def test_flags_of_others_are_refused(scene, tmp_path: Path, flags: list[str], words: str) -> None:
    line = refused(["bake", scene("room"), "-o", tmp_path / "no", *SURFELS, *flags], 2)
    assert words.replace("`", "").split("=")[0].split()[-1] in line and not (tmp_path / "no").exists()
