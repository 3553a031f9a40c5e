"""Run-time checks of every annotation in srbf, and captures with known answers."""

from __future__ import annotations

import importlib.util
import pkgutil
import signal
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))

# Begun in the background of a script, Python is told to ignore Ctrl-C, and so would be the processes that tests interrupt.
signal.signal(signal.SIGINT, signal.default_int_handler)

from jaxtyping import install_import_hook  # noqa: E402

# Before srbf is first imported: shapes and dtypes of every annotated function are checked in all tests of this process.
# Not the commands: typer reads their annotations its own way.
ROOT = Path(__file__).parent.parent / "srbf"
CHECKED = [f"srbf.{module.name}" for module in pkgutil.iter_modules([str(ROOT)]) if module.name not in ("cli", "__main__")]
install_import_hook(CHECKED, "annotation_checks.check")

from made_assets import build_asset, build_planes  # noqa: E402

from srbf.asset import Asset  # noqa: E402
from srbf.capture import Capture  # noqa: E402
from srbf.io import files  # noqa: E402
from srbf.io.image import write_image  # noqa: E402
from srbf.sphere import point_set, random_directions  # noqa: E402

OTHER_LANGUAGES = ("web/", "viewer/", "export/test_translation", "export/test_unity", "export/test_unreal")  # below tests/
Response = Callable[[np.ndarray], np.ndarray]  # (3,) direction -> (H, W, 3) image


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark what compiles other languages, or drives a browser: minutes in all; without bpy, skip what needs it."""
    here = Path(__file__).parent
    lacks_blender = importlib.util.find_spec("bpy") is None
    for item in items:
        if lacks_blender and item.get_closest_marker("blender"):
            item.add_marker(pytest.mark.skip(reason="this Python has no bpy"))
        if item.path.is_relative_to(here) and item.path.relative_to(here).as_posix().startswith(OTHER_LANGUAGES):
            item.add_marker(pytest.mark.engines)


@pytest.fixture(scope="session")
def make_planes() -> Callable[..., Asset]:
    return build_planes


@pytest.fixture(scope="session")
def make_asset() -> Callable[..., Asset]:
    return build_asset


@pytest.fixture
def make_capture(tmp_path: Path) -> Callable[..., Capture]:
    """Write a capture whose images are given by a function of the light direction."""

    def make(
        response: Response,
        lights: int = 60,
        holdout: int = 8,
        domain: str = "hemisphere",
        encoding: str = "float",
        name: str = "capture",
        directions: np.ndarray | None = None,
        validation: int = 0,
        **images: np.ndarray,
    ) -> Capture:
        folder = tmp_path / name
        (folder / "lights").mkdir(parents=True)
        train = point_set("hammersley", lights, domain) if directions is None else directions
        groups = [
            ("train", train),
            ("validation", random_directions(validation, domain, np.random.default_rng(8))),
            ("holdout", random_directions(holdout, domain, np.random.default_rng(7))),
        ]
        entries = []
        for role, chosen in groups:
            for direction in chosen:
                file = f"lights/{len(entries):04d}.exr"
                pixels = response(direction).astype(np.float32)
                write_image(folder / file, pixels, encoding)
                entries.append({"kind": "directional", "direction": direction.tolist(), "role": role, "file": file})
        for image, values in images.items():
            write_image(folder / f"{image}.exr", values, "float")
        height, width = pixels.shape[:2]
        manifest = {
            "format": "srbf-capture",
            "version": 1,
            "quantity": "irradiance",
            "width": width,
            "height": height,
            "lights": entries,
            **{image: f"{image}.exr" for image in images},
        }
        files.write_json(folder / "capture.json", manifest)
        return Capture.open(folder)

    return make


@pytest.fixture
def plane_positions() -> np.ndarray:
    """World positions of a 10 x 14 lightmap of the square [-1, 1]^2 at z = 0, row 0 at y = +1."""
    height, width = 10, 14
    x = -1 + 2 * (np.arange(width) + 0.5) / width
    y = 1 - 2 * (np.arange(height) + 0.5) / height
    positions = np.zeros((height, width, 3), np.float32)
    positions[..., 0], positions[..., 1] = x[None, :], y[:, None]
    return positions
