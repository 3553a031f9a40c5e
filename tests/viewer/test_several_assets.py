"""Several assets of one capture: switched between, each with its error by direction and its spectrum."""

from __future__ import annotations

import json
import urllib.request
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_page import HEIGHT, STEP, WIDTH, ZOOM, shown_as
from typer.testing import CliRunner
from web_assets import complete, on_a_plane

from srbf.asset import Asset
from srbf.capture import Capture
from srbf.cli import app
from srbf.errors import InputError
from srbf.evaluation.errors_by_role import evaluate
from srbf.lights import DirectionalLight
from srbf.methods import relight
from srbf.methods.eigen_map import EigenMap
from srbf.methods.relighting_map import RelightingMap
from srbf.viewer.contents import contents_of
from srbf.viewer.measures import Measures
from srbf.viewer.page_manifest import title

PICTURE = f"#{{'zoom':{ZOOM},'middle':[7,5]"
SUN = [DirectionalLight((-0.45, -0.5, 0.74))]


@pytest.fixture
def fitted(make_capture: Callable[..., Capture], plane_positions: np.ndarray, tmp_path: Path) -> tuple[Capture, list[Path]]:
    """A plane whose texels see the light from different sides, as six maps and as five components."""
    axes = np.random.default_rng(3).normal(size=(10, 14, 3, 3))
    axes /= np.linalg.norm(axes, axis=3, keepdims=True)
    capture = make_capture(lambda direction: np.maximum(axes @ direction, 0) ** 2, lights=60, holdout=6, position=plane_positions)
    folders = [tmp_path / "maps", tmp_path / "planes"]
    RelightingMap(k=6, spread="mean", ridge=1e-3).encode(capture).save(folders[0])
    EigenMap(components=5).encode(capture).save(folders[1])
    return capture, folders


def ask(url: str) -> dict[str, Any]:
    with urllib.request.urlopen(url, timeout=20) as response:
        return dict(json.loads(response.read()))


def test_the_page_switches_between_them(chromium: Any, fitted: tuple[Capture, list[Path]], serve: Callable[..., str]) -> None:
    capture, folders = fitted
    maps, planes = (Asset.open(folder) for folder in folders)
    url = serve(folders, capture.folder)
    chromium("open", url=url + PICTURE + "}", width=WIDTH, height=HEIGHT)
    assert (np.abs(chromium.texels(14, 10, ZOOM) - shown_as(relight(maps, SUN))) <= STEP).all()
    chromium("press", keys=["a"])
    assert chromium.state()["asset"] == 1
    expected = shown_as(relight(planes, SUN))
    assert (np.abs(expected - shown_as(relight(maps, SUN))) > 2 * STEP).any()
    assert (np.abs(chromium.texels(14, 10, ZOOM) - expected) <= STEP).all()
    assert "eigen map · 5 components" in chromium("run", script="document.getElementById('title').textContent")
    there = chromium("address")
    chromium("open", url=there, width=WIDTH, height=HEIGHT)
    assert (np.abs(chromium.texels(14, 10, ZOOM) - expected) <= STEP).all(), "the address opens the second"
    chromium("press", keys=["a"])
    assert (np.abs(chromium.texels(14, 10, ZOOM) - shown_as(relight(maps, SUN))) <= STEP).all()


def test_every_light_s_error_is_the_evaluation_s(chromium: Any, fitted: tuple[Capture, list[Path]], serve: Callable[..., str]) -> None:
    """As numbers, and as colors on the disc: the worst light's dot is redder than the best one's."""
    capture, folders = fitted
    url = serve(folders, capture.folder)
    for i, folder in enumerate(folders):
        told = ask(f"{url}capture/errors-{i}.json")
        expected = evaluate(Asset.open(folder), capture)
        by_file = {light["file"]: light["rmse"] for light in expected["lights"]}
        np.testing.assert_allclose(told["rmse"], [by_file[light.file] for light in capture.lights], rtol=1e-4)
        assert told["peak"] == pytest.approx(expected["train"]["peak"], rel=2e-3)
        assert told["texels"] == int((capture.coverage() >= 0.5).sum())
    chromium("open", url=url + PICTURE + ",'errors':true,'asset':1}", width=WIDTH, height=HEIGHT)
    colors = {}
    for name, index in {"best": int(np.argmax(told["psnr"])), "worst": int(np.argmin(told["psnr"]))}.items():
        x, y, z = capture.directions()[index]
        script = f"""(() => {{
            const disc = document.getElementById('directions'), ratio = disc.width / disc.clientWidth;
            const radius = Math.min(disc.clientWidth, disc.clientHeight) / 2 - 12;
            const r = radius * Math.sin(Math.acos({z}) / 2) / Math.sin(54 * Math.PI / 180);
            const flat = Math.hypot({x}, {y}) || 1, at = [disc.clientWidth / 2 + r * {x} / flat, disc.clientHeight / 2 - r * {y} / flat];
            return [...disc.getContext('2d').getImageData(at[0] * ratio, at[1] * ratio, 1, 1).data];
        }})()"""
        colors[name] = chromium("run", script=script)
    assert colors["worst"][0] > colors["worst"][2] + 60
    assert colors["best"][2] > colors["best"][0] + 60


def test_a_capture_of_held_out_lights_alone_has_no_spectrum(fitted: tuple[Capture, list[Path]]) -> None:
    """As of surfels: it has no images that were fitted."""
    capture, folders = fitted
    path = capture.folder / "capture.json"
    told = json.loads(path.read_text())
    path.write_text(json.dumps({**told, "lights": [{**light, "role": "holdout"} for light in told["lights"]]}))
    measured = json.loads(Measures([Asset.open(folders[0])], Capture.open(capture.folder)).spectrum(0))
    assert measured["capture"] is None
    assert len(measured["asset"]) > 15


def test_a_spectrum_is_the_singular_values_of_the_responses(
    chromium: Any, fitted: tuple[Capture, list[Path]], serve: Callable[..., str]
) -> None:
    capture, folders = fitted
    url = serve(folders, capture.folder)
    told = ask(f"{url}spectrum-1.json")
    responses = np.stack([capture.image(i).reshape(-1, 3) for i in capture.indices("train")], axis=1).reshape(140, -1)
    values = np.linalg.svd(responses - responses.mean(axis=0), compute_uv=False) / np.sqrt(responses.size)
    np.testing.assert_allclose(told["capture"][:20], values[:20], rtol=2e-3)
    assert told["scalars"] == 5
    assert len(told["asset"]) == 5, "five components span five dimensions"
    assert len(ask(f"{url}spectrum-0.json")["asset"]) > 15, "six maps of three channels in eighteen at most"
    assert ask(f"{url}spectrum-0.json")["scalars"] == 18
    chromium("open", url=url + PICTURE + ",'spectrum':true}", width=WIDTH, height=HEIGHT)
    drawn = json.loads(chromium("run", script="document.getElementById('spectrum').dataset.drawn"))
    assert drawn == {"asset": len(ask(f"{url}spectrum-0.json")["asset"]), "capture": len(told["capture"]), "components": 18}


def test_assets_of_other_captures_are_refused(make_asset: Callable[..., Asset], built: Path, tmp_path: Path) -> None:
    complete(on_a_plane(make_asset(k=3))).save(tmp_path / "small")
    complete(on_a_plane(make_asset(k=3, height=18, width=28))).save(tmp_path / "large")
    with pytest.raises(InputError, match="expected assets of one capture") as refused:
        contents_of([tmp_path / "small", tmp_path / "large"])
    assert "\n" not in str(refused.value)


def test_what_the_page_does_not_know_is_refused(make_asset: Callable[..., Asset], built: Path, tmp_path: Path, monkeypatch) -> None:
    complete(on_a_plane(make_asset(k=3))).save(tmp_path / "maps")
    monkeypatch.setattr(RelightingMap, "on_page", False)
    with pytest.raises(InputError, match="expected an asset that the page shows, found relighting-map") as refused:
        contents_of([tmp_path / "maps"])
    assert "srbf relight" in str(refused.value) and "\n" not in str(refused.value)


@pytest.mark.parametrize("given", [[], ["capture", "capture"], ["asset", "capture", "capture"]])
def test_the_command_wants_an_asset_and_at_most_one_capture(fitted: tuple[Capture, list[Path]], given: list[str]) -> None:
    capture, folders = fitted
    named = {"capture": str(capture.folder), "asset": str(folders[0])}
    done = CliRunner().invoke(app, ["view", *(named[name] for name in given), "--no-browser"])
    assert done.exit_code == 2 and len(done.stderr.strip().splitlines()) == 1


def test_an_asset_that_cannot_be_read_is_said_and_the_other_stays(
    chromium: Any, fitted: tuple[Capture, list[Path]], serve: Callable[..., str]
) -> None:
    capture, folders = fitted
    url = serve(folders, capture.folder)
    chromium("open", url=url + PICTURE + "}", width=WIDTH, height=HEIGHT)
    before = chromium.texels(14, 10, ZOOM)
    chromium.may_fail = True
    next(folders[1].glob("plane_*")).unlink()
    chromium("press", keys=["a"])
    assert "plane_" in chromium("run", script="document.getElementById('toast').textContent")
    assert chromium.state()["asset"] == 0
    assert (chromium.texels(14, 10, ZOOM) == before).all()


def test_assets_are_called_by_what_they_lie_in(tmp_path: Path) -> None:
    assert title([tmp_path / "room" / "asset"]) == "room"
    assert title([tmp_path / "room" / "maps"]) == "maps"
    assert title([tmp_path / "room" / "maps", tmp_path / "room" / "planes"]) == "room"
    assert title([tmp_path / "room" / "maps", tmp_path / "hall" / "planes"]) == "maps"
