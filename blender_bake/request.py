# SPDX-License-Identifier: GPL-3.0-or-later
"""One request of the host: a light's images of the receiver."""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np

from blender_bake.ipc import WorkerError
from blender_bake.share import Share
from blender_bake.translucency import Switch


class Receiver(Protocol):
    """What is lit: a lightmap's texels, vertices, probes, or a view's pixels. Arrays are (H, W, C) float32, row 0 at the top."""

    kind: str
    renders: frozenset[str]  # which images of a light, see `RenderRequest.channels`

    def descriptions(self) -> list[dict[str, Any]]:
        """The manifest's entry of each object or camera."""

    def facts(self) -> dict[str, Any]:
        """What dry run and log say of it."""

    def sampling(self) -> dict[str, Any]:
        """How a texel samples the scene, for whoever adds its direct light by rays: `footprint` or `camera`."""

    def channels(self, names: list[str]) -> dict[str, np.ndarray]:
        """The channels and masks `names`, see `blender_bake.channels`; `seams` is left out where there are none."""

    def render(self, request: RenderRequest, switch: Switch | None) -> dict[str, np.ndarray]:
        """The images of the light that shines, by the names in `request.channels`. `switch` holds the translucent materials, if any."""


@runtime_checkable
class Divisible(Protocol):
    """A receiver of which a share of the texels can be rendered: of a lightmap and a view."""

    def part(self, share: Share) -> AbstractContextManager[None]:
        """Inside, `render` gives images of these texels alone; WorkerError where that cannot be."""


@dataclass(frozen=True)
class RenderRequest:
    """What `srbf.bake.request.RenderRequest` sends.

    light: {index, kind, direction | position}, or None for the scene's own light alone. region: the receivers to render, a share of them
    {step, offset} or flat indices; None for all. channels: `response`, all light; `direct`, its direct diffuse part, of the same seed;
    `denoised`, the response denoised; `toward`, (H, W, 3 S): the radiance toward each of the job's viewers.
    """

    light: dict[str, Any] | None
    samples: int
    seed: int
    region: dict[str, Any] | list[int] | None
    channels: tuple[str, ...]

    @staticmethod
    def of(message: dict[str, Any]) -> RenderRequest:
        """From the host's JSON; WorkerError for other keys."""
        expected = ("light", "samples", "seed", "region", "channels")
        if set(message) != set(expected):
            raise WorkerError(f"expected a request of {', '.join(expected)}, found {', '.join(sorted(message))}; use one srbf throughout")
        return RenderRequest(message["light"], message["samples"], message["seed"], message["region"], tuple(message["channels"]))

    def render(self, receiver: Receiver, switch: Switch | None = None) -> dict[str, np.ndarray]:
        """The images asked for and no others; WorkerError for a region or a channel that the receiver cannot render."""
        parted: AbstractContextManager[None] | None = nullcontext() if self.region is None else None
        if isinstance(self.region, dict) and isinstance(receiver, Divisible):
            parted = receiver.part(Share.of(self.region))
        if parted is None:
            what = "a share of it" if isinstance(self.region, dict) else f"a region of {len(self.region or ())}"
            raise WorkerError(f"expected a request for the whole receiver, found {what}: a {receiver.kind} is rendered whole")
        if unknown := [name for name in self.channels if name not in receiver.renders]:
            known = ", ".join(sorted(receiver.renders))
            raise WorkerError(f"expected images of a light among {known} from a {receiver.kind}, found a request for {', '.join(unknown)}")
        with parted:
            return receiver.render(self, switch)
