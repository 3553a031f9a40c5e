"""The npm package built once, and one headless Chromium that relights what the tests serve it."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from npm_package import BUILD, WEB, browser_program, built, driven, npm
from web_assets import decoded

from srbf.asset import Asset
from srbf.lights import DirectionalLight, EnvironmentLight, Light, PointLight, SpotLight

sys.path.append(str(Path(__file__).resolve().parents[1] / "viewer"))

__all__ = ["npm"]  # a fixture
KINDS = {DirectionalLight: "directional", PointLight: "point", SpotLight: "spot", EnvironmentLight: "environment"}


@pytest.fixture(scope="session")
def pages(npm: Callable[..., str]) -> Path:
    """The folder of the built test page, newer than every file that it is made of."""
    folder = BUILD / "pages"
    sources = [*WEB.glob("*.ts"), *WEB.glob("*.json")]
    sources += [file for part in ("src", "build", "test") for file in (WEB / part).rglob("*") if file.is_file()]
    built("build:pages", npm, sources, [folder / "index.html"], "--", "--outDir", str(folder))
    return folder


class Browser:
    """Chromium with the test page open; runs one job at a time."""

    def __init__(self, process: subprocess.Popen[str], assets: Path) -> None:
        self._process, self._assets, self._saved = process, assets, 0

    def serve(self, asset: Asset) -> str:
        """Save an asset where the page finds it; its URL."""
        return self.place(asset.save)

    def place(self, write: Callable[[Path], Any]) -> str:
        """Have a new folder written where the page finds it; its URL."""
        self._saved += 1
        name = f"asset{self._saved:03d}"
        write(self._assets / name)
        return f"/served/{name}"

    def folder(self, url: str) -> Path:
        """Where the asset of a URL lies."""
        return self._assets / url.removeprefix("/served/")

    def response(self, run: str, **job: Any) -> dict[str, Any]:
        """What the page says to a job, errors included."""
        job = {"run": run, **job, "lights": [as_json(light) for light in job.get("lights", [])]}
        job["lightSets"] = [[as_json(light) for light in lights] for lights in job.get("lightSets", [])]
        assert self._process.stdin is not None and self._process.stdout is not None
        self._process.stdin.write(json.dumps(job) + "\n")
        self._process.stdin.flush()
        line = self._process.stdout.readline()
        assert line, "expected a response of the browser, found it gone"
        return json.loads(line)

    def picture(self, run: str, **job: Any) -> np.ndarray:
        """The picture of a job, (H, W, 3) float32, row 0 at the top."""
        response = self.response(run, **job)
        assert "error" not in response, response
        return decoded(response)

    def lightmaps(self, run: str, asset: str, light_sets: list[list[Any]], **job: Any) -> list[np.ndarray]:
        """The pictures of a job under one set of lights after the other, each (H, W, 3) float32."""
        response = self.response(run, asset=asset, lightSets=light_sets, **job)
        assert "error" not in response, response
        return [decoded(one) for one in response["pictures"]]


@pytest.fixture(scope="session")
def browser(pages: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """One headless Chromium for all tests of a session."""
    assets = tmp_path_factory.mktemp("web_assets")
    arguments = (browser_program(), str(pages), str(assets))
    with driven(WEB / "test" / "driver.mjs", *arguments, log=assets.parent / "browser.log") as process:
        yield Browser(process, assets)


def as_json(light: Light | dict[str, Any]) -> dict[str, Any]:
    """A light's fields and its kind; an environment's pixels row by row."""
    if isinstance(light, dict):
        return light
    if isinstance(light, EnvironmentLight):
        height, width = light.image.shape[:2]
        told = {"kind": "environment", "width": width, "height": height, "pixels": light.image.ravel().tolist(), "color": light.color}
        return {**told, "turn": float(np.arctan2(light.rotation[1, 0], light.rotation[0, 0]))}
    return {"kind": KINDS[type(light)], **asdict(light)}
