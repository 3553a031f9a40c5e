"""UV seams as Blender's meshes have them, and a torus in four charts baked, fitted and stitched."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from srbf.bake.job import base_job
from srbf.bake.settings import BakeSettings, Receiver
from srbf.bake.worker import Worker
from srbf.evaluation.errors_by_role import evaluate
from srbf.fitting.options import encode
from srbf.methods.eigen_map import EigenMap
from srbf.methods.relighting_map import RelightingMap
from srbf.receiver_images import Quantity

pytestmark = pytest.mark.blender

Seams = Callable[..., np.ndarray | None]


@pytest.fixture
def handed_over(blend: Callable[[str], Path], tmp_path: Path) -> Seams:
    """The array that the worker hands over for an object of a scene, (E, 8), None where there is none."""

    def run(scene: str, name: str, quantity: Quantity = "irradiance") -> np.ndarray | None:
        scratch = tmp_path / f"{scene} {quantity}"
        scratch.mkdir()
        settings = BakeSettings(Receiver("lightmap", name), 32, 32, quantity=quantity)
        job = {**base_job(blend(scene), settings, scratch), "channels": ["seams"]}
        with Worker(job, scratch, scratch / "log") as worker:
            found = [np.load(scratch / event["file"]) for event in worker.events(print) if event.get("name") == "seams"]
        return found[0].reshape(-1, 8) if found else None

    return run


def on_the_torus(uv: np.ndarray) -> np.ndarray:
    """World points (N, 3) of UV coordinates (N, 2) of the scene `torus`: its charts turned back."""
    chart = (uv[:, 0] > 0.5) + 2 * (uv[:, 1] > 0.5)
    turn = np.radians([0, 90, 17, -33])[chart]
    u, v = uv[:, 0] - 0.25 - 0.5 * (chart % 2), uv[:, 1] - 0.25 - 0.5 * (chart // 2)
    x, y = (np.cos(turn) * u + np.sin(turn) * v) / 0.36 + 0.5, (np.cos(turn) * v - np.sin(turn) * u) / 0.36 + 0.5
    a, b = (chart + x) * np.pi / 2, y * 2 * np.pi - np.pi / 2
    return np.stack([(1 + 0.4 * np.cos(b)) * np.cos(a), (1 + 0.4 * np.cos(b)) * np.sin(a), 0.4 * np.sin(b)], axis=1)


def test_both_sides_of_every_seam_are_the_same_places(handed_over: Seams) -> None:
    edges = handed_over("torus", "Torus")
    assert edges is not None and len(edges) == 4 * 24 + 48  # four circles across, one around
    left, right = edges[:, :4].reshape(-1, 2), edges[:, 4:].reshape(-1, 2)
    assert np.linalg.norm(left - right, axis=1).min() > 0.01
    np.testing.assert_allclose(on_the_torus(left), on_the_torus(right), atol=1e-5)


def test_only_smooth_edges_are_seams(handed_over: Seams) -> None:
    """The strip's vertices are split: its flat joint is a seam, its fold is none; for radiance neither, since the albedo jumps there."""
    edges = handed_over("projected", "Strip")
    assert edges is not None
    np.testing.assert_allclose(np.sort(edges.reshape(2, 2, 2), axis=1)[:, :, 0], [[0.4, 0.4], [0.6, 0.6]], atol=1e-6)
    assert handed_over("projected", "Strip", "radiance") is None


def test_a_torus_looks_whole(bake) -> None:
    capture = bake("torus", "lightmap:Torus", width=64, height=64, lights=40, domain="sphere", samples=2, holdout=6).capture
    assert len(capture.seam_edges()) == 4 * 24 + 48
    for method in (RelightingMap(k=25), EigenMap(components=12)):
        plain, stitched = encode(method, capture, stitch=False), encode(method, capture)
        seams = stitched.manifest["seams"]
        assert seams["before"] > 0.1 and seams["after"] < 0.05 * seams["before"], seams
        errors = [evaluate(asset, capture, roles=("holdout",))["holdout"]["rmse"] for asset in (plain, stitched)]
        assert errors[1] <= 1.001 * errors[0]
