"""Scenes built once a session by Blender, and bakes of them through the library."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from building import FEW, ROOT, SCENES, built
from surfaces import check_normals

from srbf.bake.run import Bake, Reporter
from srbf.bake.settings import BakeSettings, Receiver
from srbf.capture import Capture

__all__ = ["ROOT", "SCENES", "built"]
sys.path.insert(0, str(ROOT / "benchmarks"))  # faults, for tests that put them in


@pytest.fixture(scope="session")
def blend(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """The .blend of a named scene of closed_form_scenes.py."""
    return built("closed_form_scenes.py", tmp_path_factory)


@pytest.fixture(scope="session")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """The .blend of a named scene of real_scenes.py."""
    return built("real_scenes.py", tmp_path_factory)


@pytest.fixture(scope="session", autouse=True)
def few_places_and_cells() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        for name, few in FEW.items():
            patch.setattr(f"srbf.{name}", few)
        yield


LEANING = {"normal mapped"}  # scenes whose materials turn normals away from the surface, as their tests check
FINE = {
    "lattice",
    "coin",
}  # scenes whose laths, leaves and relief are finer than the pixels of a tiny view: neighbors lie on other surfaces


class Baked:
    """A finished bake and what it told the user."""

    def __init__(self, scene: Path, folder: Path, settings: BakeSettings) -> None:
        self.said: list[str] = []
        self.job = Bake(scene, folder, settings)
        self.job.run(Reporter(say=self.said.append))
        self.capture = Capture.open(folder)
        if scene.stem not in LEANING and not (scene.stem in FINE and settings.receiver.kind == "view"):
            check_normals(self.capture)


@pytest.fixture
def bake(blend: Callable[[str], Path], tmp_path: Path) -> Callable[..., Baked]:
    """Bake a scene small and quick; keyword arguments are BakeSettings."""

    def run(scene: str, receiver: str, name: str = "capture", uv_layer: str | None = None, **settings: object) -> Baked:
        parsed = Receiver.parse(receiver, uv_layer)
        small = {"width": 32, "height": 32, "lights": 8, "samples": 1, "validation": 0, "holdout": 1, "holdout_samples": 4}
        small["quantity"] = "irradiance" if parsed.kind == "lightmap" else "radiance"
        return Baked(blend(scene), tmp_path / name, BakeSettings(parsed, **{**small, **settings}))

    return run
