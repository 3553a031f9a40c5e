"""Running sums: passes add up to the mean, noise is what the passes differ by, damaged files count as nothing."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from srbf.bake.accumulation import NOTHING, Accumulation
from srbf.bake.folder import LOG, LONGEST_LOG, sweep
from srbf.bake.light_sets import PlacedLight
from srbf.bake.planned_lights import PlannedLight

LIGHT = PlannedLight(3, PlacedLight("directional", (0.0, 0.0, 1.0)), "validation", 8, 0)
SINGLE = 1e-6  # float32's rounding of a few sums


def test_the_mean_is_that_of_all_samples() -> None:
    rng = np.random.default_rng(0)
    parts = [(2, rng.random((4, 5, 3), np.float32)), (2, rng.random((4, 5, 3), np.float32)), (4, rng.random((4, 5, 3), np.float32))]
    total = NOTHING
    for samples, image in parts:
        total = total.with_pass(samples, image, image / 2, squares=False)
    expected = sum(n * image.astype(np.float64) for n, image in parts) / 8
    np.testing.assert_allclose(total.mean, expected, rtol=SINGLE)
    np.testing.assert_allclose(total.direct_mean, expected / 2, rtol=SINGLE)
    assert (total.passes, total.samples) == (3, 8)


def test_one_pass_is_the_image_to_the_bit() -> None:
    image = np.random.default_rng(1).random((7, 3, 3), np.float32)
    np.testing.assert_array_equal(NOTHING.with_pass(2, image, None, squares=False).mean, image)


def test_noise_is_told_without_bias() -> None:
    """Passes of 1, 1, 2 and 4 samples of unit variance: the mean of 8 has the variance 1/8."""
    rng = np.random.default_rng(2)
    total = NOTHING
    for samples in (1, 1, 2, 4):
        total = total.with_pass(samples, 5 + rng.normal(0, samples**-0.5, (200, 200, 3)).astype(np.float32), None, squares=True)
    assert float(total.noise_variance().mean()) == pytest.approx(1 / 8, rel=0.02)  # 120,000 texels of 3 degrees of freedom
    assert float(total.mean.var()) == pytest.approx(1 / 8, rel=0.02)
    assert total.noise == pytest.approx(8**-0.5 / 5, rel=0.02)


def test_the_noise_of_a_light_outlives_its_sum(tmp_path: Path) -> None:
    """One pass tells none, nor does a black image."""
    image = np.ones((3, 4, 3), np.float32)
    one = NOTHING.with_pass(2, image, None, squares=False)
    two = one.with_pass(2, 2 * image, None, squares=False)
    assert one.noise is None and one.with_pass(2, image, None, squares=False).noise is None
    Accumulation(tmp_path, [LIGHT]).write(LIGHT, two, keep=False)
    assert two.noise == pytest.approx((0.25 / 2) ** 0.5)  # of a mean of 1.5: 2.25 is power and a variance of 0.25
    assert Accumulation(tmp_path, [LIGHT]).noise(LIGHT) == two.noise


def test_the_noise_of_an_indirect_image_is_its_own() -> None:
    rng = np.random.default_rng(3)
    total = NOTHING
    for _ in range(8):
        direct = rng.random((64, 64, 3), np.float32)  # as noisy as can be, and taken away
        total = total.with_pass(1, direct + 1, direct, squares=True)
    assert float(total.noise_variance().max()) < 1e-5


def test_what_is_written_is_read_and_what_is_damaged_is_nothing(tmp_path: Path) -> None:
    total = NOTHING.with_pass(2, np.ones((3, 4, 3), np.float32), None, squares=True)
    accumulation = Accumulation(tmp_path, [LIGHT])
    assert accumulation.passes(LIGHT) == 0 and accumulation.can_grow(LIGHT)
    accumulation.write(LIGHT, total, keep=True)
    again = Accumulation(tmp_path, [LIGHT])
    assert (again.passes(LIGHT), again.samples(LIGHT), again.can_grow(LIGHT)) == (1, 2, True)
    np.testing.assert_array_equal(again.read(LIGHT).mean, total.mean)
    path = next((tmp_path / "accumulation").glob("0003*"))
    whole = path.read_bytes()
    for damaged in (b"", whole[:100], whole[: len(whole) // 2], whole[:300] + bytes([whole[300] ^ 1]) + whole[301:]):
        path.write_bytes(damaged)
        broken = Accumulation(tmp_path, [LIGHT])
        assert broken.passes(LIGHT) == 0
    accumulation.write(LIGHT, total, keep=False)
    kept = Accumulation(tmp_path, [LIGHT])
    assert (kept.passes(LIGHT), kept.samples(LIGHT), kept.can_grow(LIGHT)) == (1, 2, False)
    assert kept.read(LIGHT).whole is None


def test_a_long_log_keeps_its_end(tmp_path: Path) -> None:
    (tmp_path / LOG).write_bytes(b"x" * LONGEST_LOG + b"last words\n")
    sweep(tmp_path)
    kept = (tmp_path / LOG).read_bytes()
    assert kept.endswith(b"last words\n") and len(kept) < LONGEST_LOG / 8
    sweep(tmp_path)
    assert (tmp_path / LOG).read_bytes() == kept
