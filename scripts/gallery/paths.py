"""Paths of a scene's files."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from scripts.gallery.scenes import Fit, Scene
from srbf.capture import Capture


@dataclass(frozen=True)
class ScenePaths:
    """Paths of a scene's files: bakes and assets below `folder`, pictures in `docs`."""

    scene: Scene
    folder: Path
    docs: Path

    @property
    def blend(self) -> Path:
        return self.folder / f"{self.scene.name}.blend"

    @property
    def capture(self) -> Path:
        return self.folder / "capture"

    @property
    def rendered(self) -> Path:
        """The capture that Blender rendered; with a dome, its photographs are then imported into `capture`."""
        return self.folder / "dome" if self.scene.dome else self.capture

    @property
    def photographs(self) -> Path:
        return self.folder / "photographs"

    @property
    def true_point_lights(self) -> Path:
        return self.folder / "true-point-lights"

    @property
    def scores(self) -> Path:
        return self.folder / "scores.json"

    @property
    def strip(self) -> Path:
        return self.docs / f"{self.scene.name}-strip.webp"

    @property
    def clip(self) -> Path:
        return self.docs / f"{self.scene.name}-clip.webp"

    @property
    def point_light_strip(self) -> Path:
        return self.docs / f"{self.scene.name}-point-lights.webp"

    def asset(self, fit: Fit) -> Path:
        return self.folder / fit.folder

    def errors(self, fit: Fit) -> Path:
        return self.folder / f"{fit.folder}.errors.json"

    def point_light_errors(self, fit: Fit) -> Path:
        return self.folder / f"{fit.folder}.point-lights.json"

    def responses(self, fit: Fit) -> Capture:
        """The capture that a fit uses: combined or indirect images."""
        opened = Capture.open(self.capture)
        return opened.combined() if fit.light == "all" else opened
