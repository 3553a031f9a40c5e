"""The light domain of deep framebuffers: lights anywhere, by the direct light that they lay on a pool of surfels [Hasan2005]."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from srbf.light_domain.cloud import Cloud


@dataclass(frozen=True)
class PoolLights(Cloud):
    """Lights anywhere in the free space of the scene, as of a cloud; coordinates are places of isotropic point lights, m."""

    kind: ClassVar[str] = "pool"
    captured_kinds: ClassVar[tuple[str, ...]] = ("point", "pool")
    is_traced: ClassVar[bool] = True
