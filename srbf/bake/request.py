"""What a worker's receiver is asked to render: the message that host and worker exchange for every image."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from srbf.bake.planned_lights import PlannedLight, Rendered
from srbf.receiver_share import Share


@dataclass(frozen=True)
class RenderRequest:
    """A light's images with `samples` samples per texel of one `seed`.

    light: None for the scene's own light alone (the ambient image).
    region: the receivers to render, a share of the texels or flat indices, row by row from the top; None: all. A worker refuses a region
    that it cannot render.
    channels: which images. `response`, all of the light; `direct`, its direct diffuse part, of the same seed; `indirect`, the rest;
    `denoised`, the response without its noise, biased; `toward`, the radiance toward each of the job's viewers, of an indirect capture
    without the direct diffuse light.
    """

    light: PlannedLight | None
    samples: int
    seed: int
    region: Share | tuple[int, ...] | None = None
    channels: tuple[Rendered, ...] = ("response",)

    def message(self) -> dict[str, Any]:
        """As JSON, one line to the worker. It replies with one event: the light's index, and a file for each of `channels`."""
        return {
            "light": None if self.light is None else {"index": self.light.index, **self.light.placed.json()},
            "samples": self.samples,
            "seed": self.seed,
            "region": self.region.json() if isinstance(self.region, Share) else self.region and list(self.region),
            "channels": list(self.channels),
        }
