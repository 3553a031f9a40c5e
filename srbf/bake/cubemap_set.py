"""The light set of all-frequency transport: a distant light from every texel of a cubemap, traced once the receivers are known."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar, Literal, get_args

from srbf.bake.cubemap_trace import trace_cubemap
from srbf.bake.light_sets import CloudSet, PlacedLight
from srbf.bake.point_lights import Box, parse_box
from srbf.capture import Capture
from srbf.cubemap import Cubemap
from srbf.errors import InputError
from srbf.visibility.distant_bounces import Effort, light_on_surfels
from srbf.visibility.embree import EmbreeTriangles

Sampling = Literal["auto", "full", "neighbors", "l1"]
WORD = "cubemap:"
SURFELS = 3000  # about, between which light bounces
PROBES = 100  # directions whose rays are timed for an estimate


@dataclass(frozen=True)
class CubemapSet:
    """Every texel of a cubemap of `side` texels a side, in place of train lights; held-out lights are random directions, traced as well.

    sampling: `full`, every element of visibility by a ray; `neighbors` and `l1`, some of them, see `srbf.visibility.refined_visibility` and
    `srbf.visibility.sparse_transport`; `auto`, by the number of elements.
    """

    kind: ClassVar[str] = "cubemap"
    side: int
    sampling: Sampling = "auto"
    surfels: CloudSet = field(default_factory=lambda: CloudSet("surfels", SURFELS))

    def __post_init__(self) -> None:
        Cubemap(self.side)
        if self.sampling not in get_args(Sampling):
            raise InputError(f"expected a sampling of {', '.join(get_args(Sampling))}, found {self.sampling!r}")

    @staticmethod
    def parse(word: str, sparse: bool, full: bool, sparse_by: str | None, light_bounds: str | None) -> CubemapSet:
        """From the command line's cubemap:SIDE and flags; InputError on those that exclude each other."""
        text = word.removeprefix(WORD)
        if not text.isdecimal():
            raise InputError(f"expected `light_set` cubemap:SIDE, the texels a side, as in cubemap:32, found {word!r}")
        if full and (sparse or sparse_by):
            other = "`sparse`" if sparse else f"`sparse_by={sparse_by}`"
            raise InputError(f"expected `full` or {other}, found both; leave one of them out")
        sampling: Any = "full" if full else sparse_by or ("neighbors" if sparse else "auto")
        return CubemapSet(int(text), sampling, CloudSet("surfels", SURFELS, None, parse_box(light_bounds)))

    @property
    def is_known(self) -> bool:
        return self.surfels.is_known

    @property
    def box(self) -> Box | None:
        return self.surfels.box

    def train(self) -> list[PlacedLight]:
        """None that is rendered."""
        return []

    def tested(self, count: int) -> list[PlacedLight]:
        """None that is rendered."""
        return []

    def question(self, tested: int, seed: int) -> dict[str, Any]:
        """What the scene is asked: that of surfels, of which a flat or solid scene has some, too."""
        asked = self.surfels.question(0, seed)
        return {**asked, "places": {**asked["places"], "grows": True}}

    def with_surfels(self, surfels: CloudSet) -> CubemapSet:
        """With what was found of the scene."""
        return replace(self, surfels=surfels)

    def record(self) -> dict[str, Any]:
        """JSON for the manifest, with a checksum of what was found of the scene."""
        return {**self.surfels.record(), "kind": self.kind, "side": self.side, "sampling": self.sampling}

    def manifest(self) -> dict[str, Any]:
        """Keys of capture.json beside those that `trace` gives: none."""
        return {}

    def write(self, path: Path, key: str = "") -> None:
        """For a bake that is resumed: `key` tells the bake that it is of."""
        self.surfels.write(path, key)

    def key(self, scene_sha256: str, tested: int, seed: int, scene: str | None = None) -> str:
        """What the surfels found depend on; `scene`: which one of the .blend."""
        return self.surfels.key(scene_sha256, 0, seed, scene)

    def read(self, path: Path, key: str) -> CubemapSet:
        """With what a file holds that `write` wrote; unchanged where there is none, or one of another bake or damaged."""
        return self.with_surfels(self.surfels.read(path, key))

    def trace(
        self,
        receivers: Capture,
        roles: tuple[int, int],
        seed: int,
        progress: Callable[[int, int, str], None],
        say: Callable[[str], None],
        gloss: int | None = None,
    ) -> dict[str, Any]:
        """All that the capture holds of its lights, into the folder of `receivers`; stages that are there already are kept.

        `roles`: how many lights validate and are held out. `gloss`: terms of the receivers' gloss, if any. Returns keys of capture.json.
        """
        found = self.surfels.found
        if found is None or found.surfels is None:
            raise InputError("expected the surfels of a known scene, found none; call with_light_set first")
        return trace_cubemap(
            receivers, found.surfels, found.bounces, found.checksum, Cubemap(self.side), self.sampling, roles, seed, progress, say, gloss
        )


def seconds_of_rays(light_set: CubemapSet, receivers: int) -> float:
    """How long all rays of a `full` bake take, from those of a few directions at the surfels; `sparse` ones take less."""
    found = light_set.surfels.found
    assert found is not None and found.surfels is not None
    directions = Cubemap(light_set.side).directions
    began = time.perf_counter()
    _, traced = light_on_surfels(found.surfels, directions[:: max(1, len(directions) // PROBES)], EmbreeTriangles(found.surfels.corners))
    each = (time.perf_counter() - began) / max(1, traced)
    effort = Effort.full(receivers)
    bounced = receivers * effort.receiver_rays + found.surfels.count * effort.surfel_rays
    return each * (receivers * len(directions) / 2 + bounced)
