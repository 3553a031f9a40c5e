"""Stitching of UV seams: a surface cut into two charts, one turned against the other, looks whole again, and is no worse."""

from __future__ import annotations

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from srbf.asset import Asset
from srbf.capture import Capture
from srbf.cli import app
from srbf.encode.dilation import dilate, nearest_covered
from srbf.encode.uv_seams import FREE, HOLD, Stitch, bilinear, edge_points
from srbf.evaluation.errors_by_role import evaluate
from srbf.fitting.options import encode
from srbf.io import files
from srbf.io.image import write_image
from srbf.methods import responses
from srbf.methods.clustered_eigen_map import ClusteredEigenMap
from srbf.methods.eigen_map import EigenMap
from srbf.methods.relighting_map import RelightingMap

SIZE = 48
TURN = np.radians(31)
PIECES = 5  # of the cut
CLUSTERS_LEAVE = 0.3  # of a gap


def charts() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(world points (H, W, 2), covered (H, W), edges (E, 8)): the square [0, 1]^2 cut at x = 1/2, the right half turned by TURN in UV."""
    turn = np.array([[np.cos(TURN), -np.sin(TURN)], [np.sin(TURN), np.cos(TURN)]])

    def uv(world: np.ndarray, right: bool) -> np.ndarray:
        local = (world - [0.75, 0.5]) @ turn.T if right else world - [0.25, 0.5]
        return local * 0.42 + ([0.72, 0.5] if right else [0.2, 0.5])

    texels = (np.arange(SIZE) + 0.5) / SIZE
    u, v = np.meshgrid(texels, 1 - texels)
    places = np.stack([u, v], axis=2)
    left = (places - [0.2, 0.5]) / 0.42 + [0.25, 0.5]
    right = (places - [0.72, 0.5]) / 0.42 @ turn + [0.75, 0.5]
    in_left = (left >= 0).all(axis=2) & (left[..., 0] <= 0.5) & (left[..., 1] <= 1)
    in_right = (right[..., 0] >= 0.5) & (right[..., 1] >= 0) & (right <= 1).all(axis=2)
    assert in_left.any() and in_right.any() and not (in_left & in_right).any()
    y = np.linspace(0, 1, PIECES + 1)
    ends = [np.array([[0.5, a], [0.5, b]]) for a, b in zip(y[:-1], y[1:], strict=True)]
    edges = np.array([np.concatenate([uv(end, False).ravel(), uv(end, True).ravel()]) for end in ends], np.float32)
    return np.where(in_right[..., None], right, left), in_left | in_right, edges


@pytest.fixture
def cut(make_capture) -> Capture:
    """A capture of smooth waves over the cut square, dilated as a bake's images are, with its seams."""
    world, covered, edges = charts()
    nearest = nearest_covered(covered.astype(np.float32))
    waves, shifts = np.random.default_rng(5).normal(scale=8, size=(2, 3)), np.random.default_rng(6).normal(size=(3, 3))

    def response(direction: np.ndarray) -> np.ndarray:
        return dilate((max(0, direction[2]) * (1.2 + np.sin(world @ waves + shifts @ direction))).astype(np.float32), nearest)

    capture = make_capture(response, lights=80, holdout=12, coverage=covered.astype(np.float32))
    write_image(capture.folder / "seams.exr", edges[None], "float")
    manifest = {**files.read_json(capture.folder / "capture.json"), "seams": "seams.exr"}
    files.write_json(capture.folder / "capture.json", manifest)
    return Capture.open(capture.folder)


def test_bilinear_weights_reproduce_planes() -> None:
    points = np.random.default_rng(0).uniform([0, 0], [9, 6], (200, 2))
    texels, weights = bilinear(points, 10, 7)
    columns, rows = texels % 10, texels // 10
    np.testing.assert_allclose(np.stack([(columns * weights).sum(1), (rows * weights).sum(1)], axis=1), points, atol=1e-12)
    texels, weights = bilinear(np.array([[-0.4, 20.0]]), 10, 7)  # past the border: clamped
    assert set(texels[0].tolist()) == {60} and weights.sum() == pytest.approx(1)


def test_points_of_an_edge_are_the_same_on_both_sides() -> None:
    world, covered, edges = charts()
    left, right = edge_points(edges, SIZE, SIZE)
    length = 0.42 * SIZE / PIECES
    assert len(left) == PIECES * np.ceil(length)
    for points in (left, right):
        steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
        assert steps.min() > 0.5 and steps.max() <= 1  # about a texel
    np.testing.assert_allclose(left[:, 0], (0.2 + 0.25 * 0.42) * SIZE - 0.5, atol=1e-5)
    assert (np.diff(left[:, 1]) < 0).all()  # y, and with it v, goes up: rows go down


def test_the_stitch_is_the_least_squares_solution() -> None:
    _, covered, edges = charts()
    stitch = Stitch.along(edges, covered)
    held = np.where(covered.ravel()[stitch.texels], HOLD, FREE)
    values = np.random.default_rng(1).normal(size=(len(stitch.texels), 4))
    # Its slow twin: all rows of |D x|^2 + sum h (x - x0)^2 in one dense system.
    system = np.concatenate([stitch.differences.toarray(), np.diag(np.sqrt(held))])
    wanted = np.concatenate([np.zeros((stitch.samples, 4)), np.sqrt(held)[:, None] * values])
    expected = np.linalg.lstsq(system, wanted, rcond=None)[0]
    np.testing.assert_allclose(values + stitch.change(values), expected, atol=1e-8)


def test_it_is_linear_keeps_what_agrees_and_touches_seams_alone() -> None:
    _, covered, edges = charts()
    stitch = Stitch.along(edges, covered)
    rng = np.random.default_rng(2)
    maps = rng.normal(size=(2, SIZE, SIZE, 3)).astype(np.float32)
    stitched, both = maps.copy(), (2 * maps[:1] - 3 * maps[1:]).copy()
    stitch.apply(stitched)
    stitch.apply(both)
    np.testing.assert_allclose(both[0], 2 * stitched[0] - 3 * stitched[1], atol=1e-4)
    far = np.ones(SIZE * SIZE, bool)
    far[stitch.texels] = False
    np.testing.assert_array_equal(stitched.reshape(2, -1, 3)[:, far], maps.reshape(2, -1, 3)[:, far])
    even = np.full((1, SIZE, SIZE, 1), 0.7, np.float32)
    stitch.apply(even)
    np.testing.assert_allclose(even, 0.7, rtol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("encoding", ["half", "uint8"])
@pytest.mark.parametrize("method", [RelightingMap(k=30), EigenMap(components=16)], ids=["relighting-map", "eigen-map"])
def test_seams_close_and_nothing_gets_worse(cut: Capture, method: RelightingMap | EigenMap, encoding: str) -> None:
    method = type(method)(**{**method.__dict__, "encoding": encoding})
    plain, stitched = encode(method, cut, stitch=False), encode(method, cut)
    assert "seams" not in plain.manifest
    seams = stitched.manifest["seams"]
    assert seams["edges"] == PIECES and seams["samples"] == len(edge_points(cut.seam_edges(), SIZE, SIZE)[0])
    assert seams["before"] > 0.05
    assert seams["after"] < 0.06 * seams["before"]  # 2 to 4 % were measured
    before, after = (evaluate(asset, cut)["holdout"]["rmse"] for asset in (plain, stitched))
    # The waves are sampled without noise, so that a fit is nearly exact: what covered texels give way by is far below the gap closed.
    mean = float(np.mean([cut.image(i)[cut.coverage() > 0].mean() for i in cut.indices("train")]))
    assert after**2 <= before**2 + (0.05 * seams["before"] * mean) ** 2


@pytest.mark.slow
@pytest.mark.parametrize("encoding", ["half", "uint8"])
def test_clusters_agree_as_well_as_they_hold_the_images(cut: Capture, encoding: str) -> None:
    method = ClusteredEigenMap(clusters=3, components=12, encoding=encoding)
    plain, stitched = encode(method, cut, stitch=False), encode(method, cut)
    seams = stitched.manifest["seams"]
    assert seams["before"] > 0.05 and seams["after"] < CLUSTERS_LEAVE * seams["before"]
    stitch = Stitch.of(cut)
    assert stitch is not None
    # `before` is what an asset fitted without stitching shows.
    directions = cut.directions(cut.indices("train")[:: -(-80 // 32)])
    relit = responses(plain, directions).reshape(len(directions), -1, 3)
    mean = np.abs(relit[:, (cut.coverage() > 0).ravel()]).mean()
    gap = stitch.difference(relit[:, stitch.texels].transpose(1, 0, 2).reshape(len(stitch.texels), -1)) / mean
    assert seams["before"] == pytest.approx(gap, rel=0.1)  # the two fits share their clusters, and their ranges nearly
    before, after = (evaluate(asset, cut)["holdout"]["rmse"] for asset in (plain, stitched))
    assert after**2 <= before**2 + (0.05 * seams["before"] * mean) ** 2


@pytest.mark.lengthy
def test_the_command_says_what_it_stitched(cut: Capture, tmp_path) -> None:
    flags = ["-k", "9", "--spread", "mean", "--ridge", "0.1"]
    done = CliRunner().invoke(app, ["fit", str(cut.folder), "-o", str(tmp_path / "a"), *flags])
    assert done.exit_code == 0 and "5 edges stitched" in done.stderr
    assert Asset.open(tmp_path / "a").manifest["seams"]["edges"] == PIECES
    done = CliRunner().invoke(app, ["fit", str(cut.folder), "-o", str(tmp_path / "b"), *flags, "--no-stitch"])
    assert done.exit_code == 0 and "stitched" not in done.stderr
    assert "seams" not in json.loads((tmp_path / "b" / "asset.json").read_text())


def test_captures_without_seams_have_nothing_to_stitch(make_capture) -> None:
    capture = make_capture(lambda d: np.ones((4, 4, 3)), lights=4, holdout=0)
    assert capture.seam_edges() is None and Stitch.of(capture) is None
