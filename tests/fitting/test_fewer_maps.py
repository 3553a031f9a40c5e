"""Fewer maps out of many."""

from __future__ import annotations

import numpy as np
import pytest

from srbf.errors import InputError
from srbf.fitting.fewer_maps import keep
from srbf.methods import responses
from srbf.methods.clustered_eigen_map import ClusteredEigenMap
from srbf.methods.eigen_map import EigenMap
from srbf.methods.relighting_map import RelightingMap
from srbf.sphere import all_around


def smooth(d: np.ndarray) -> np.ndarray:
    y, x = np.mgrid[0:1:5j, 0:1:6j]
    return np.stack([1 + d[0] * x + d[1] * y, d[2] * (1 + x), d[2] ** 2 + y], axis=2)


def dropped(asset, count: int) -> np.ndarray:
    return np.tensordot(asset.basis.evaluate(all_around("hemisphere", 300))[:, :count], asset.coefficients()[:count], 1)


@pytest.mark.lengthy
def test_projection_keeps_the_picture_where_dropping_does_not(make_capture) -> None:
    asset = RelightingMap(k=25, encoding="float").encode(make_capture(smooth, lights=80))
    kept = keep(asset, 12)
    directions = all_around("hemisphere", 300)
    before = responses(asset, directions)
    change = np.sqrt(((responses(kept, directions) - before) ** 2).mean())
    assert change < 0.05 * before.std()
    assert change < 0.1 * np.sqrt(((dropped(asset, 12) - before) ** 2).mean())
    assert kept.manifest["source"]["kept"]["relative_residual"] == pytest.approx(change / np.sqrt((before**2).mean()), rel=0.2)


@pytest.mark.lengthy
def test_keeping_fewer_loses_more(make_capture) -> None:
    asset = RelightingMap(k=25).encode(make_capture(smooth, lights=80))
    lost = [keep(asset, count).manifest["source"]["kept"]["relative_residual"] for count in (20, 9, 4, 1)]
    assert lost == sorted(lost)


@pytest.mark.slow
def test_an_eigen_map_drops_its_last_planes(make_capture, tmp_path) -> None:
    capture = make_capture(smooth, lights=80)
    asset, fewer = EigenMap(components=6, encoding="float").encode(capture), EigenMap(components=3, encoding="float").encode(capture)
    kept = keep(asset, 3)
    kept.save(tmp_path / "kept")
    directions = all_around("hemisphere", 50)
    opened = type(kept).open(tmp_path / "kept")
    np.testing.assert_allclose(responses(opened, directions), responses(fewer, directions), atol=1e-4)


@pytest.mark.lengthy
def test_what_cannot_be_kept_is_refused(make_capture) -> None:
    capture = make_capture(smooth, lights=80)
    asset = RelightingMap(k=4).encode(capture)
    with pytest.raises(InputError, match="1 to 4"):
        keep(asset, 5)
    with pytest.raises(InputError, match="clustered"):
        keep(ClusteredEigenMap(clusters=2, components=2).encode(capture), 1)
