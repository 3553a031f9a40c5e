"""Bakes of probes: a uniform environment, bounces in a room against Cycles, and bad input."""

from __future__ import annotations

import csv
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from light_set_commands import done, refused, scenes_in

from srbf.asset import Asset
from srbf.capture import Capture
from srbf.io.image import read_image
from srbf.lights import PointLight
from srbf.methods import captured_responses
from srbf.visibility.rays import RayTracer
from srbf.visibility.receivers import Receivers

pytestmark = pytest.mark.blender

UNTESTED = ["--validation", "0", "--holdout", "0"]


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    return scenes_in(tmp_path_factory)


def test_a_uniform_environment_gives_pi(scene, tmp_path: Path) -> None:
    capture, asset = tmp_path / "capture", tmp_path / "asset"
    done("bake", scene("white_world"), "-o", capture, "--receiver", "probes:2", "--light-set", "named", "--samples", "16", *UNTESTED)
    probes = Capture.open(capture).probes()
    assert probes is not None and probes.counts == (3, 3, 3)
    done("fit", capture, "-o", asset)
    done("relight", asset, "--light", "World=1", "-o", tmp_path / "sh.exr", "--harmonics")
    radiance = probes.values(read_image(tmp_path / "sh.exr", 3))[13]  # of the middle, where nothing hides the world
    np.testing.assert_allclose(radiance[0], np.sqrt(4 * np.pi), rtol=0.01)
    np.testing.assert_allclose(radiance[1:], 0, atol=0.03)
    (tmp_path / "places.csv").write_text("x,y,z,nx,ny,nz\n0.3,-0.2,0.1,0,0,1\n1,1,-1,0.6,-0.8,0\n")
    done("relight", asset, "--light", "World=2", "-o", tmp_path / "light.csv", "--at", tmp_path / "places.csv")
    with open(tmp_path / "light.csv", newline="") as file:
        rows = [[float(row[name]) for name in "rgb"] for row in csv.DictReader(file)]
    np.testing.assert_allclose(rows, 2 * np.pi, rtol=0.03)


def test_bounces_in_a_room(scene, tmp_path: Path) -> None:
    """Off the crate and the walls no probe is lost; with the form factors of its surfels a fit has the energy that Cycles finds."""
    capture, asset = tmp_path / "capture", tmp_path / "asset"
    surfels = ["--transport", "indirect", "--light-set", "surfels", "--surfels-per-m2", "4"]
    tested = ["--validation", "0", "--holdout", "1", "--holdout-samples", "128"]
    done("bake", scene("room"), "-o", capture, "--receiver", "probes:0.5", *surfels, *tested)
    opened = Capture.open(capture)
    probes = opened.probes()
    assert probes is not None and probes.counts == (7, 5, 5)
    places = probes.places[probes.valid]
    assert (places > 0.02).all() and (places < np.array([2.98, 1.98, 1.98])).all(), "nodes on the walls are moved off them"
    assert not ((places > [2, 1.2, 0]) & (places < [2.5, 1.7, 0.6])).all(axis=1).any(), "nor is one in the crate"
    offset = np.linalg.norm(places - (np.array(probes.origin) + 0.5 * nodes_of(probes.counts))[probes.valid], axis=1)
    assert offset.max() < 0.5 * 0.5 + 1e-6 and (offset == 0).any()
    done("fit", capture, "-o", asset, "--method", "transfer", "--clusters", "4", "--components", "12", "--rank", "32")
    relit, covered = Asset.open(asset), opened.coverage() > 0.5
    assert relit.probes is not None and (relit.probes.nearness == probes.nearness).all()
    (light,) = opened.lights
    direct = RayTracer(Receivers.of(opened)).response([PointLight(light.position, falloff="inverse-square")])
    truth = read_image(capture / str(light.direct), 3)
    assert np.linalg.norm((direct - truth)[covered]) < 0.01 * np.linalg.norm(truth[covered]), "a point has no footprint in the image"
    truth, found = opened.image(0)[covered], captured_responses(relit, opened, [0])[0][covered]
    assert abs(found.sum() / truth.sum() - 1) < 0.05


def nodes_of(counts: tuple[int, int, int]) -> np.ndarray:
    z, y, x = np.meshgrid(*(np.arange(count) for count in counts[::-1]), indexing="ij")
    return np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1)


@pytest.mark.parametrize("word", ["probes:0", "probes:-1", "probes:nan", "probes:wide", "probes:"])
def test_spacings_that_are_none(word: str, tmp_path: Path) -> None:
    assert "spacing of probes" in refused(["bake", tmp_path / "none.blend", "-o", tmp_path / "c", "--receiver", word], 2)


def test_scenes_without_room_or_with_too_much(scene, tmp_path: Path) -> None:
    output = ["-o", tmp_path / "capture", "--receiver"]
    assert "probes 2.01 m apart, found all 1" in refused(["bake", scene("block"), *output, "probes:2.01"])
    line = refused(["bake", scene("open_air"), *output, "probes:0.05"])
    assert "at most 20000 probes, found" in line and "use a larger one, such as probes:0.0" in line


def test_what_does_not_go_with_probes(tmp_path: Path) -> None:
    bake = ["bake", tmp_path / "none.blend", "-o", tmp_path / "capture", "--receiver", "probes"]
    assert "--quantity irradiance with probes" in refused([*bake, "--quantity", "radiance"], 2)
    assert "probes with transport combined" in refused([*bake, "--transport", "indirect"], 2)
