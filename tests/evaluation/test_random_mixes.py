"""Errors on random mixes: exact maps have none but their rounding, and each number is what a sum of images by hand gives."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from made_captures import write_capture
from made_names import NAMES, capture_of_names, smooth_images

from srbf.capture import Capture
from srbf.errors import InputError
from srbf.evaluation.random_mixes import mix_errors, mixed_images, random_colors
from srbf.methods.light_mix import LightMix
from srbf.methods.named_maps import NamedMaps
from srbf.methods.relighting_map import RelightingMap

HALF = 70.0  # dB: half floats round by 2^-12 of a value at most


@pytest.fixture(scope="module")
def capture(tmp_path_factory: pytest.TempPathFactory) -> Capture:
    return capture_of_names(tmp_path_factory.mktemp("names") / "capture")


def test_colors_are_in_their_ranges_and_follow_the_seed() -> None:
    colors = random_colors(8, 200)
    assert colors.shape == (200, 8, 3) and colors.min() >= 0 and colors.max() <= 2
    assert (colors.min(axis=2) >= 0.25 * colors.max(axis=2)).all()
    assert (colors == random_colors(8, 200, 0)).all() and not (colors == random_colors(8, 200, 1)).all()
    assert abs(colors.mean() - 0.625) < 0.02  # 1 times the mean of 0.25 to 1


def test_exact_maps_mix_exactly(capture: Capture) -> None:
    found = mix_errors(NamedMaps(encoding="half").encode(capture), capture, count=20)
    assert found.count == 20 and found.worst > HALF and found.psnr >= found.worst


def test_the_numbers_are_those_of_sums_by_hand(capture: Capture) -> None:
    asset = LightMix(clusters=1, components=2, encoding="float").encode(capture)
    found = mix_errors(asset, capture, count=12, seed=3)
    covered = capture.coverage() >= 0.5
    images = np.stack([capture.image(i) for i in range(8)])
    each = np.stack([asset.coefficients()[0], 1 + 0 * asset.coefficients()[0]])  # (2, H, W, 4)
    values = asset.tables["light_values"].astype(float) * asset.manifest["light_values"]["scale"]  # (3, 8, 3)
    relit = np.einsum("hwf,fnc->nhwc", np.dstack([each[1][..., :1], each[0][..., :2]]), values)
    true, made = (np.einsum("mnc,nhwc->mhwc", random_colors(8, 12, 3), stack) for stack in (images, relit))
    peak = np.quantile(true[:, covered], 0.999)
    errors = np.sqrt(((np.maximum(made, 0) - true)[:, covered] ** 2).mean(axis=(1, 2)))
    assert np.allclose(found.pictures, 20 * np.log10(peak / errors), atol=0.02)
    assert found.psnr == pytest.approx(found.pictures.mean()) and found.worst == found.pictures.min()
    assert found.peak == pytest.approx(peak, rel=1e-3) and set(found.as_dict()) >= {"count", "psnr", "worst"}


def test_pictures_to_show_are_whole(capture: Capture) -> None:
    asset = NamedMaps(encoding="half").encode(capture)
    colors = random_colors(8, 2)
    true, relit = mixed_images(asset, capture, colors)
    assert true.shape == relit.shape == (2, capture.height, capture.width, 3)
    covered = capture.coverage() >= 0.5
    assert np.allclose(true[:, covered], relit[:, covered], rtol=2e-3)
    assert np.allclose(true[:, covered], np.einsum("mnc,nhwc->mhwc", colors, smooth_images())[:, covered], rtol=2e-3)


def test_a_light_that_the_asset_lacks_is_told_of(capture: Capture, tmp_path: Path) -> None:
    other = capture_of_names(tmp_path / "other", names=(*NAMES[:-1], "Torch"))
    with pytest.raises(InputError, match="Torch"):
        mix_errors(NamedMaps().encode(capture), other, count=1)


def test_other_lights_are_refused(capture: Capture, tmp_path: Path) -> None:
    suns = write_capture(tmp_path / "suns", lambda d: np.full((16, 16, 3), max(0.0, d[2])))
    with pytest.raises(InputError, match="named lights"):
        mix_errors(RelightingMap(k=4, spread=0.7).encode(suns), capture)
    with pytest.raises(InputError, match="1 or more mixes"):
        mix_errors(NamedMaps().encode(capture), capture, count=0)
