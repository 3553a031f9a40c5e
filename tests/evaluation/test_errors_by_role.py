"""Errors by role: what a fit measures as the images stream by, against a second reading of them all."""

from __future__ import annotations

import numpy as np
import pytest

from srbf.capture import Capture
from srbf.evaluation.errors_by_role import PeakHistogram, TrainErrorAccumulator, evaluate
from srbf.methods import FitRun
from srbf.methods.relighting_map import RelightingMap

ROUNDING = 1e-5  # relative: float32 products of other shapes
HEIGHT, WIDTH = 60, 70


@pytest.fixture(params=["half", "float"])
def capture(make_capture, request: pytest.FixtureRequest) -> Capture:
    """Noise under a cosine, a third of the texels not covered and far too bright there."""
    rng = np.random.default_rng(1)
    covered = rng.random((HEIGHT, WIDTH)) > 0.3

    def response(direction: np.ndarray) -> np.ndarray:
        return np.where(covered[:, :, None], max(0, direction[2]) * rng.gamma(2, 0.3, (HEIGHT, WIDTH, 3)) - 0.05, 100)

    return make_capture(response, lights=40, encoding=request.param, coverage=covered.astype(np.float32))


@pytest.mark.lengthy
@pytest.mark.parametrize("encoding", ["half", "uint8"])
def test_watched_errors_are_those_of_a_second_reading(capture: Capture, encoding: str) -> None:
    watch = TrainErrorAccumulator(capture)
    asset = RelightingMap(k=9, encoding=encoding).encode(capture, FitRun(on_image=watch.look))
    watched, read = evaluate(asset, capture, watch=watch), evaluate(asset, capture)
    assert watched["holdout"] == read["holdout"]  # the peak of the train images included
    assert watched["train"] == pytest.approx(read["train"], rel=ROUNDING)
    for one, other in zip(watched["lights"], read["lights"], strict=True):
        assert one == {**other, **{key: pytest.approx(other[key], rel=ROUNDING) for key in ("rmse", "relative_rmse")}}


@pytest.mark.lengthy
def test_a_sample_of_texels_comes_near(capture: Capture, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("srbf.evaluation.errors_by_role.MEMORY_BYTES", 6 * 40 * 900)
    watch = TrainErrorAccumulator(capture)
    assert len(watch.texels) == 900 and (np.diff(watch.texels) > 0).all()
    assert (capture.coverage().ravel()[watch.texels] == 1).all()
    asset = RelightingMap(k=9).encode(capture, FitRun(on_image=watch.look))
    watched, read = evaluate(asset, capture, watch=watch), evaluate(asset, capture)
    assert watched["train"]["texels"] == 900 and watched["holdout"] == read["holdout"]
    assert watched["train"]["peak"] == read["train"]["peak"]
    assert watched["train"]["psnr"] == pytest.approx(read["train"]["psnr"], abs=0.25)  # dB: 2700 values an image, relative 1/sqrt(2700)


@pytest.mark.parametrize("kind", [np.float16, np.float32])
@pytest.mark.parametrize("q", [0.5, 0.9, 0.999])
def test_values_passed_over_change_no_quantile(kind: type, q: float) -> None:
    rng = np.random.default_rng(2)
    images = [np.array(rng.normal(scale=rng.gamma(1), size=(500, 3)), kind) for _ in range(30)]
    rows = rng.random(500) > 0.4
    thrifty, plain = PeakHistogram(30 * 3 * int(rows.sum()), q), PeakHistogram()
    for image in images:
        thrifty.add(image, rows)
        plain.add(image[rows])
    assert thrifty.quantile(q) == plain.quantile(q)
    expected = np.quantile(np.maximum(np.stack(images)[:, rows], 0).astype(np.float64), q)
    assert plain.quantile(q) == pytest.approx(expected, rel=2**-11 if kind is np.float32 else 1e-12)
