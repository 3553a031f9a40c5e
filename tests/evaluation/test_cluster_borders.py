"""Cluster borders on made-up assets: the measure finds a jump of known height, and none where the asset has none."""

from __future__ import annotations

import numpy as np
import pytest

from srbf.asset import Asset
from srbf.capture import Capture
from srbf.errors import InputError
from srbf.evaluation.cluster_borders import cluster_borders
from srbf.methods.clustered_eigen_map import ClusteredEigenMap
from srbf.methods.relighting_map import RelightingMap

HEIGHT, WIDTH = 6, 8
LIGHT, CLUSTERS = 0.5, 2
HALVES = np.repeat([[0, 0, 0, 0, 1, 1, 1, 1]], HEIGHT, axis=0)  # two clusters, one border of HEIGHT pairs
PAIRS = HEIGHT * (WIDTH - 1) + (HEIGHT - 1) * WIDTH
HALF_FLOATS = 2e-3  # relative, of stored coefficients and images


@pytest.fixture
def capture(make_capture) -> Capture:
    """A constant response under every light."""
    return make_capture(lambda direction: np.full((HEIGHT, WIDTH, 3), LIGHT), lights=40, holdout=5)


def relit_as(monkeypatch: pytest.MonkeyPatch, image: np.ndarray) -> None:
    """Let every asset give one image (H, W) under every light."""
    gray = np.repeat(image[..., None], 3, axis=2).astype(np.float32)
    monkeypatch.setattr(
        "srbf.evaluation.cluster_borders.responses", lambda asset, coordinates: np.repeat(gray[None], len(coordinates), axis=0)
    )


def any_asset(capture: Capture) -> Asset:
    return RelightingMap(k=4, spread=0.9, ridge=0.1).encode(capture)


def test_a_step_at_the_border_is_a_jump_of_its_height(capture: Capture, monkeypatch: pytest.MonkeyPatch) -> None:
    relit_as(monkeypatch, LIGHT + np.where(HALVES == 0, 0.1, -0.1))
    found = cluster_borders(any_asset(capture), capture, index=HALVES)
    assert found.border == pytest.approx(HEIGHT / PAIRS)
    assert found.jump_at_border == pytest.approx(0.2, rel=HALF_FLOATS)
    assert found.jump_beside == pytest.approx(0, abs=1e-6)
    assert (found.error_at_border, found.error_beside) == pytest.approx((0.1, 0.1), rel=HALF_FLOATS)
    assert found.error_ratio == pytest.approx(1) and found.jump_ratio > 1e3
    assert found.contrast_at_border == 0


def test_an_even_ramp_has_no_visible_border(capture: Capture, monkeypatch: pytest.MonkeyPatch) -> None:
    relit_as(monkeypatch, LIGHT + 0.01 * np.arange(WIDTH)[None] + np.zeros((HEIGHT, 1)))
    found = cluster_borders(any_asset(capture), capture, index=HALVES)
    assert found.jump_ratio == pytest.approx(1, rel=1e-4)


def test_error_at_the_border_alone(capture: Capture, monkeypatch: pytest.MonkeyPatch) -> None:
    """Texels 3 and 4 beside the border are off by 0.1; the pairs beside it hold one such texel and one correct one."""
    wrong = np.isin(np.arange(WIDTH), (3, 4))[None] & np.ones((HEIGHT, 1), bool)
    relit_as(monkeypatch, LIGHT + 0.1 * wrong)
    found = cluster_borders(any_asset(capture), capture, index=HALVES)
    assert found.error_at_border == pytest.approx(0.1, rel=HALF_FLOATS)
    assert 0 < found.error_beside < found.error_at_border
    assert found.jump_at_border == pytest.approx(0, abs=1e-6)


@pytest.mark.lengthy
def test_a_clustered_asset_is_measured_at_its_own_borders(make_capture) -> None:
    """Two materials: an exact fit of each has neither error nor jump, though the picture changes at the border."""
    albedo = np.where(HALVES[..., None] == 0, [0.8, 0.2, 0.1], [0.1, 0.3, 0.9])
    capture = make_capture(lambda direction: albedo * max(direction[2], 0), lights=60, holdout=6)
    found = cluster_borders(ClusteredEigenMap(clusters=CLUSTERS, components=4, encoding="float").encode(capture), capture)
    assert found.contrast_at_border > 0.1
    assert max(found.error_at_border, found.jump_at_border) < 0.1 * found.contrast_at_border


def test_without_clusters_or_lights_it_refuses(capture: Capture, make_capture) -> None:
    asset = any_asset(capture)
    with pytest.raises(InputError, match="clusters"):
        cluster_borders(asset, capture)
    with pytest.raises(InputError, match="validation lights"):
        cluster_borders(asset, capture, "validation", HALVES)
