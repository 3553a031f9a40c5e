"""Captures under point lights: read, imported, refused where a method wants directions, and what an asset is measured against."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from srbf.asset import Asset
from srbf.capture import Capture
from srbf.cli import app
from srbf.errors import InputError, ManifestError
from srbf.evaluation.errors_by_role import evaluate
from srbf.importing.light_list import read_light_list
from srbf.importing.photographs import LightListImport
from srbf.info import describe
from srbf.io import files
from srbf.io.image import write_image
from srbf.methods.relighting_map import RelightingMap

POINT_LIGHTS = {
    "train": [(0.3, 0.1, 0.8), (-0.4, 0.2, 0.6), (0.0, 0.0, 1.5)],
    "validation": [(0.5, -0.5, 0.9)],
    "holdout": [(-0.2, -0.6, 1.1)],
}
FIT = 0.03  # of 40 Gaussians to the cosine, relative


@pytest.fixture
def suns(make_capture, plane_positions) -> Capture:
    """A white square under directional lights: the cosine."""
    return make_capture(lambda d: np.full((10, 14, 3), max(0, d[2])), lights=200, position=plane_positions)


@pytest.fixture
def point_lights(plane_positions: np.ndarray, tmp_path: Path) -> Callable[..., Capture]:
    """The same square under point lights: cos / d^2, times `shade` (H, W, 1)."""

    def make(shade: float | np.ndarray = 1.0, **changes: object) -> Capture:
        folder = tmp_path / "point_lights"
        (folder / "lights").mkdir(parents=True, exist_ok=True)
        entries: list[dict[str, object]] = []
        for role, places in POINT_LIGHTS.items():
            for place in places:
                vectors = np.array(place) - plane_positions
                response = vectors[..., 2:] / np.linalg.norm(vectors, axis=2, keepdims=True) ** 3 * shade
                file = f"lights/{len(entries):04d}.exr"
                write_image(folder / file, np.repeat(response, 3, axis=2).astype(np.float32), "float")
                entries.append({"kind": "point", "position": list(place), "role": role, "file": file, **changes})
        manifest = {"format": "srbf-capture", "version": 1, "quantity": "irradiance", "width": 14, "height": 10, "lights": entries}
        files.write_json(folder / "capture.json", manifest)
        return Capture.open(folder)

    return make


def test_a_point_capture_is_read(point_lights) -> None:
    capture = point_lights()
    assert capture.kind == "point" and capture.indices("holdout") == [4]
    np.testing.assert_array_equal(capture.positions([4, 0]), [POINT_LIGHTS["holdout"][0], POINT_LIGHTS["train"][0]])
    assert capture.lights[0].position == POINT_LIGHTS["train"][0]
    for ask in (capture.directions, lambda: capture.lights[0].direction):
        with pytest.raises(InputError, match="directional"):
            ask()
    assert describe(capture.folder)["light_kind"] == "point"


def test_a_directional_capture_has_no_positions(suns: Capture) -> None:
    assert suns.kind == "directional" and "light_kind" not in describe(suns.folder)
    with pytest.raises(InputError, match="point"):
        suns.positions()


def test_mixed_and_half_said_lights_are_refused(point_lights) -> None:
    folder = point_lights().folder
    manifest = files.read_json(folder / "capture.json")
    one, *rest = manifest["lights"]
    for light, words in [
        ({"kind": "directional", "direction": [0, 0, 1], "role": "train", "file": one["file"]}, "one kind"),
        ({"kind": "point", "direction": [0, 0, 1], "role": "train", "file": one["file"]}, "position"),
        ({"kind": "point", "position": [0, 0], "role": "train", "file": one["file"]}, "position"),
        ({"kind": "laser", "position": [0, 0, 1], "role": "train", "file": one["file"]}, "laser"),
    ]:
        files.write_json(folder / "capture.json", {**manifest, "lights": [light, *rest]})
        with pytest.raises(ManifestError, match=words) as caught:
            Capture.open(folder)
        assert "\n" not in str(caught.value)


@pytest.mark.slow
def test_the_approximation_is_measured_by_role(suns: Capture, point_lights) -> None:
    """Without occluders a directional asset predicts point lights up to its fit; for lights twice as strong it is off by half."""
    asset = RelightingMap(k=40).encode(suns)
    errors = evaluate(asset, point_lights())
    assert [light["role"] for light in errors["lights"]] == ["train"] * 3 + ["validation", "holdout"]
    assert all(errors[role]["relative_rmse"] < FIT for role in POINT_LIGHTS)
    shade = np.linspace(0, 1, 14)[:, None]  # the shadow of an occluder near the light, which a directional capture lacks
    shaded = evaluate(asset, point_lights(shade))
    assert all(shaded[role]["relative_rmse"] > 0.3 for role in POINT_LIGHTS)
    doubled = evaluate(asset, point_lights(2.0))
    assert doubled["holdout"]["relative_rmse"] == pytest.approx(0.5, abs=FIT)


def test_an_asset_without_positions_cannot_be_compared(make_capture, point_lights) -> None:
    asset = RelightingMap(k=9).encode(make_capture(lambda d: np.full((10, 14, 3), max(0, d[2]))))
    with pytest.raises(InputError, match="position map"):
        evaluate(asset, point_lights())


@pytest.mark.slow
def test_commands_say_which_captures_they_take(suns: Capture, point_lights, tmp_path: Path) -> None:
    def run(*arguments: object) -> tuple[int, str, str]:
        done = CliRunner().invoke(app, list(map(str, arguments)))
        return done.exit_code, done.stdout, done.stderr

    folder = point_lights().folder
    RelightingMap(k=9).encode(suns).save(tmp_path / "asset")
    flags = [["--method", name] for name in ("relighting-map", "eigen-map", "clustered-eigen-map", "auto")]
    domain, scene = "expected a capture in the light domain directions", "expected scene.glb"
    for command, expected in [
        *((["fit", folder, "-o", tmp_path / "new", *method], domain) for method in flags[:3]),
        (["fit", folder, "-o", tmp_path / "new", *flags[3]], scene),
        (["evaluate", folder, "--leave-one-out"], scene),
        (["report", tmp_path / "asset", folder, "-o", tmp_path / "page.html"], "found point lights"),
    ]:
        code, out, error = run(*command)
        assert code == 1 and out == "" and len(error.strip().splitlines()) == 1, command
        assert expected in error, error
    assert not (tmp_path / "new").exists() and not (tmp_path / "page.html").exists()
    code, out, _ = run("evaluate", tmp_path / "asset", folder, "--json")
    assert code == 0 and set(json.loads(out)) == {"train", "validation", "holdout", "lights"}
    code, out, _ = run("info", folder)
    assert code == 0 and "point" in out and "directional" in out
    assert Asset.open(tmp_path / "asset").k == 9


def test_positions_are_imported_as_they_are(tmp_path: Path) -> None:
    for name in ("a", "b", "c"):
        write_image(tmp_path / f"{name}.exr", np.full((2, 3, 3), 0.5, np.float32), "float")
    (tmp_path / "l.lp").write_text("2\na.exr 0 0 0\nb.exr 1.5 -2 0.25\n")
    (tmp_path / "h.lp").write_text("1\nc.exr 3 0 1\n")
    LightListImport(tmp_path / "l.lp", "linear", tmp_path / "h.lp", kind="point").write(tmp_path / "capture")
    capture = Capture.open(tmp_path / "capture")
    np.testing.assert_array_equal(capture.positions(), [[0, 0, 0], [1.5, -2, 0.25], [3, 0, 1]])
    assert capture.indices("holdout") == [2]
    with pytest.raises(ManifestError, match="zero vector"):
        read_light_list(tmp_path / "l.lp")
    arguments = ["import", "--lp", tmp_path / "l.lp", "-o", tmp_path / "again", "--transfer", "linear", "--light-kind", "point"]
    assert CliRunner().invoke(app, list(map(str, arguments))).exit_code == 0
    assert Capture.open(tmp_path / "again").kind == "point"
