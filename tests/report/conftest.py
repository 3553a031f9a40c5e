"""Captures written to disk that a report has something to show of: spheres on a chequered plane, hard shadows, seen from above."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from srbf.capture import Capture
from srbf.io import files
from srbf.io.image import write_image
from srbf.report import abrdf_mosaic, canvas
from srbf.sphere import point_set, random_directions

SPHERES = np.array([[-0.75, 0.1, 0.38, 0.38], [0.35, 0.35, 0.26, 0.26], [0.75, -0.4, 0.45, 0.2]])  # x, y, z, radius; meters


@dataclass(frozen=True)
class Scene:
    """What orthographic pixels looking down on the scene see: (H, W, 3) float64 each."""

    position: np.ndarray
    normal: np.ndarray
    albedo: np.ndarray

    def response(self, light: np.ndarray) -> np.ndarray:
        """Radiance under a directional light of unit irradiance: albedo / pi * NoL * visibility."""
        lit = np.maximum(self.normal @ light, 0)
        start = self.position + 1e-4 * self.normal
        for *center, radius in SPHERES:
            along = (center - start) @ light
            square = ((center - start) ** 2).sum(axis=-1) - along**2
            lit = np.where((along > 0) & (square < radius**2), 0, lit)
        return self.albedo / np.pi * lit[..., None]


def scene(height: int, width: int) -> Scene:
    """Spheres on a plane, x to the right over 3 m, y up."""
    x = ((np.arange(width) + 0.5) / width - 0.5) * 3
    y = (0.5 - (np.arange(height) + 0.5) / height) * 3 * height / width
    x, y = np.meshgrid(x, y)
    chequer = ((np.floor(x * 3) + np.floor(y * 3)) % 2)[..., None]
    position, normal = np.stack([x, y, 0 * x], 2), np.broadcast_to([0.0, 0.0, 1.0], (height, width, 3))
    albedo = np.where(chequer > 0, [0.75, 0.72, 0.66], [0.30, 0.42, 0.50])
    for (cx, cy, cz, radius), color in zip(SPHERES, ([0.8, 0.3, 0.2], [0.85, 0.7, 0.25], [0.35, 0.65, 0.4]), strict=True):
        square = radius**2 - (x - cx) ** 2 - (y - cy) ** 2
        top = cz + np.sqrt(np.maximum(square, 0))
        hit = (square > 0) & (top > position[..., 2])
        surface = np.stack([x, y, top], 2)
        normal = np.where(hit[..., None], (surface - [cx, cy, cz]) / radius, normal)
        albedo = np.where(hit[..., None], color, albedo)
        position = np.where(hit[..., None], surface, position)
    return Scene(position, normal, albedo)


MakeCapture = Callable[..., Capture]


@pytest.fixture(scope="session", autouse=True)
def coarse_sheets() -> Iterator[None]:
    """Sheets of fewer pixels: the layout is the same, and the PNGs are written sooner."""
    with pytest.MonkeyPatch.context() as patch:
        for module in (canvas, abrdf_mosaic):
            patch.setattr(module, "DPI", 60)
        yield


def write_capture(
    folder: Path, size: tuple[int, int] = (32, 48), train: int = 90, validation: int = 4, holdout: int = 8,
    domain: str = "hemisphere", geometry: bool = True, holes: bool = False,
) -> Capture:  # fmt: skip
    """A capture of the scene on disk; `holes` leaves a corner and a band uncovered, and puts nonsense there."""
    seen = scene(*size)
    rng = np.random.default_rng(7)
    directions = [(d, "train") for d in point_set("hammersley", train, domain)]
    directions += [(d, "validation") for d in random_directions(validation, domain, rng)]
    directions += [(d, "holdout") for d in random_directions(holdout, domain, rng)]
    coverage = np.ones(size, np.float32)
    if holes:
        coverage[: size[0] // 4, : size[1] // 3] = 0
        coverage[-3:] = 0
    (folder / "lights").mkdir(parents=True)
    lights = []
    for i, (direction, role) in enumerate(directions):
        image = np.where(coverage[..., None] > 0, seen.response(direction), 50.0).astype(np.float32)
        write_image(folder / f"lights/{i:04d}.exr", image, "half")
        lights.append({"kind": "directional", "direction": direction.tolist(), "role": role, "file": f"lights/{i:04d}.exr"})
    manifest = {
        "format": "srbf-capture",
        "version": 1,
        "quantity": "radiance",
        "width": size[1],
        "height": size[0],
        "lights": lights,
    }
    if geometry:
        for name in ("position", "normal"):
            write_image(folder / f"{name}.exr", getattr(seen, name).astype(np.float32), "float")
            manifest[name] = f"{name}.exr"
    if holes:
        write_image(folder / "coverage.exr", coverage, "float")
        manifest["coverage"] = "coverage.exr"
    files.write_json(folder / "capture.json", manifest)
    return Capture.open(folder)


@pytest.fixture(scope="session")
def make_capture(tmp_path_factory: pytest.TempPathFactory) -> MakeCapture:
    """write_capture into a fresh folder."""
    return lambda **options: write_capture(tmp_path_factory.mktemp("scene") / "capture", **options)
