"""The light domain of transfer: lights inside the scene, by the direct light that they lay on its surfels [Lehtinen2008]."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from srbf.light_domain.cloud import Cloud


@dataclass(frozen=True)
class SurfelLights(Cloud):
    """Lights anywhere in the free space of the scene, as of a cloud; coordinates are places of isotropic point lights, m."""

    kind: ClassVar[str] = "surfels"
    captured_kinds: ClassVar[tuple[str, ...]] = ("point", "surfel")
    is_traced: ClassVar[bool] = True
