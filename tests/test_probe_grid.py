"""Light between probes: linear fields exactly, nothing through a thin wall, nodes without a probe, and files."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from srbf.errors import ImageError
from srbf.io.image import read_image
from srbf.probe_grid import NEARNESS_FILE, PLACES_FILE, ProbeGrid, probes_of
from srbf.visibility.embree import EmbreeTriangles
from srbf.visibility.probe_nearness import nearness_atlas

pytest.importorskip("embreex")

COUNTS = (7, 5, 4)
SPACING = 0.25
LEAK = 0.01  # of the light on the other side of a wall
OFF = 0.02  # m from all walls: where light is looked up


def nodes(counts: tuple[int, int, int] = COUNTS) -> np.ndarray:
    z, y, x = np.meshgrid(*(np.arange(count) for count in counts[::-1]), indexing="ij")
    return (SPACING * np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1)).astype(np.float32)


def grid(places: np.ndarray, sources: np.ndarray | None = None, corners: np.ndarray | None = None) -> ProbeGrid:
    own = np.arange(len(places)) if sources is None else sources
    triangles = EmbreeTriangles(np.zeros((0, 3, 3), np.float32) if corners is None else corners)
    return ProbeGrid((0.0, 0.0, 0.0), SPACING, COUNTS, places[own], own, nearness_atlas(triangles, places, own))


def mixed(probes: ProbeGrid, values: np.ndarray, points: np.ndarray) -> np.ndarray:
    index, weight = probes.weights(points)
    np.testing.assert_allclose(weight.sum(axis=1), 1, rtol=1e-12)
    return (values[index] * weight).sum(axis=1)


def inside(count: int = 2000) -> np.ndarray:
    return np.random.default_rng(2).uniform(OFF, (np.array(COUNTS) - 1) * SPACING - OFF, (count, 3))


def test_a_linear_field_is_exact_in_the_open() -> None:
    slope = np.array([0.3, -1.2, 0.7])
    points = inside()
    np.testing.assert_allclose(mixed(grid(nodes()), nodes() @ slope + 2, points), points @ slope + 2, rtol=1e-6)


def test_beyond_the_grid_the_outermost_probes_hold_on() -> None:
    values = np.arange(np.prod(COUNTS), dtype=float)
    assert mixed(grid(nodes()), values, np.array([[-5.0, -5, -5], [9, 9, 9]])).tolist() == [0, values[-1]]


@pytest.mark.parametrize("at", [0.5, 0.62, 0.73])
def test_no_light_passes_a_thin_wall(at: float) -> None:
    """Left of it all is light, right of it dark; in the first case the nodes on it were moved to the light."""
    wall = np.array([[[at, -1, -1], [at, 3, -1], [at, 3, 3]], [[at, -1, -1], [at, 3, 3], [at, -1, 3]]], np.float32)
    places = nodes()
    near = np.abs(places[:, 0] - at) < 0.2 * SPACING
    places[near, 0] = at + 0.2 * SPACING * np.where(places[near, 0] > at, 1, -1)
    light = (places[:, 0] < at).astype(float)
    points = inside()
    points = points[np.abs(points[:, 0] - at) > OFF]
    found = mixed(grid(places, corners=wall), light, points)
    assert found[points[:, 0] > at].max() < LEAK and found[points[:, 0] < at].min() > 1 - LEAK
    leaky = mixed(grid(places), light, points)
    assert np.abs(leaky - (points[:, 0] < at)).max() > 0.3, "without the wall light leaks"


def test_nodes_without_a_probe_count_where_there_is_no_other() -> None:
    places = nodes()
    sources = np.arange(len(places))
    sources[0] = 1
    light = np.where(sources == np.arange(len(places)), 1.0, 7.0)
    probes = grid(places, sources)
    assert probes.valid.sum() == len(places) - 1
    assert mixed(probes, light, inside()) == pytest.approx(1.0), "the light of node 0 itself is never taken"
    assert mixed(probes, np.arange(len(places), dtype=float), np.zeros((1, 3)))[0] == 1


def test_images_and_files(tmp_path: Path) -> None:
    probes = grid(nodes() + np.float32(0.01))
    values = np.random.default_rng(0).normal(size=(probes.count, 12, 3)).astype(np.float32)
    image = probes.image(values)
    assert image.shape == (20, 84, 3) == (*probes.image_size[::-1], 3)
    assert (probes.values(image) == values).all() and (image[3 * 5 + 2, 4 * 7 + 6] == values[6 + 7 * (2 + 5 * 3), 4]).all()
    probes.write(tmp_path)
    again = probes_of(probes.described(), lambda name, channels: read_image(tmp_path / name, channels))
    assert again is not None and again.counts == COUNTS
    for name in ("places", "sources", "nearness"):
        np.testing.assert_array_equal(getattr(again, name), getattr(probes, name))
    assert probes_of({"kind": "view"}, lambda name, channels: image) is None


def test_files_that_do_not_fit_are_refused(tmp_path: Path) -> None:
    probes = grid(nodes())
    probes.write(tmp_path)
    told = probes.described()

    def read(name: str, channels: int) -> np.ndarray:
        return read_image(tmp_path / name, channels)

    with pytest.raises(ImageError, match="expected 3x20 probes in"):
        ProbeGrid.read({**told, "counts": [3, 5, 4]}, read)
    replace(probes, sources=np.full(probes.count, 10_000)).write(tmp_path)
    with pytest.raises(ImageError, match=f"expected sources of 0 to 139 in {PLACES_FILE}"):
        ProbeGrid.read(told, read)
    replace(probes, nearness=probes.nearness[:17]).write(tmp_path)
    with pytest.raises(ImageError, match=f"expected 140 tiles of 17x17 in {NEARNESS_FILE}"):
        ProbeGrid.read(told, read)
