# SPDX-License-Identifier: GPL-3.0-or-later
"""The frame of a camera's picture by the scene's render settings, and which of these a view does not follow."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import bpy


@dataclass(frozen=True)
class Frame:
    """Resolution and pixel aspect as the scene has them, and which settings are on that a view does not follow."""

    width: int
    height: int
    pixel_aspect: tuple[float, float]
    border: tuple[float, float, float, float] | None  # left, right, bottom, top, of the frame
    motion_blur: bool
    stereoscopy: bool
    at: int  # frame of the animation

    @staticmethod
    def of(scene: bpy.types.Scene) -> Frame:
        """Of a scene before `scene.configure`."""
        render = scene.render
        bounds = (render.border_min_x, render.border_max_x, render.border_min_y, render.border_max_y)
        return Frame(
            render.resolution_x,
            render.resolution_y,
            (render.pixel_aspect_x, render.pixel_aspect_y),
            bounds if render.use_border and bounds != (0, 1, 0, 1) else None,
            render.use_motion_blur,
            render.use_multiview,
            scene.frame_current,
        )

    @property
    def aspect(self) -> float:
        """Width over height of the displayed picture."""
        return self.width * self.pixel_aspect[0] / (self.height * self.pixel_aspect[1])

    def record(self) -> dict[str, Any]:
        """For scene queries: `aspect`, and `text`, the settings that it comes from."""
        return {"aspect": self.aspect, "text": self._text()}

    def left_out(self, width: int, height: int) -> Iterator[str]:
        """A line for each setting in which a view of so many pixels differs from a render of the scene."""
        fitting = fitted(self.aspect, max(width, height))
        if max(abs(width - fitting[0]), abs(height - fitting[1])) > 1:
            yield (
                f"the picture is {width / height:.3g} times as wide as high, the camera's frame {self.aspect:.3g} times ({self._text()}); "
                f"`size={fitting[0]}x{fitting[1]}` has its shape"
            )
        if self.border is not None:
            left, right, bottom, top = (round(100 * edge) for edge in self.border)
            yield f"the render region ({left}-{right} % across, {bottom}-{top} % up) is not followed: the camera's whole frame is baked"
        if self.motion_blur:
            yield f"motion blur is left out: the scene is that of frame {self.at}"
        if self.stereoscopy:
            yield "stereoscopy is left out: the camera's own view is baked, once"

    def _text(self) -> str:
        x, y = self.pixel_aspect
        return f"{self.width}x{self.height}" + ("" if x == y else f" pixels of {x:g}:{y:g}")


def fitted(aspect: float, side: int) -> tuple[int, int]:
    """(width, height) in square pixels of that aspect, the longer one `side`."""
    return (side, max(1, round(side / aspect))) if aspect >= 1 else (max(1, round(side * aspect)), side)
