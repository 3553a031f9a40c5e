"""One light of a capture: where it is, its role, and the image rendered or photographed under it alone."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from srbf.errors import InputError, ManifestError
from srbf.receiver_share import Share

LightKind = Literal["directional", "point", "named", "patch", "surfel", "pool"]
Role = Literal["train", "validation", "holdout"]
ROLES: tuple[Role, ...] = ("train", "validation", "holdout")
UNIT_TOLERANCE = 1e-3  # of a manifest's directions


NOWHERE = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class CapturedLight:
    """One illuminant of a capture and the image of the receivers' responses to it.

    `place` of a directional light, of unit irradiance, is the unit direction towards it; of a point light, of unit irradiance at 1 m and
    inverse-square fall-off, its position in meters; others have none, and 0 there. A named light is one of the scene's own, `name`, as
    the scene has it set: its `objects` shine. A patch is a part of the surfaces that reflects irradiance 1, by its number `patch`.
    `harmonics`, of a capture toward every viewer: the images of the radiance's spherical harmonics.
    `direct`, of an indirect capture, is the image of the direct diffuse light that `file` lacks. `region`: which receivers `file` holds,
    as the file of a mask or as flat indices (row by row from the top); None: all of them. `share`: its images are smaller, and have
    these texels alone; the others are interpolated. `column`: the texel of a cubemap that it is,
    whose image is made on request, and `file` its name alone. `noise`: about the relative RMSE that few samples leave in the
    image, where that was measured.
    """

    place: tuple[float, float, float]
    role: Role
    file: str
    direct: str | None = None
    kind: LightKind = "directional"
    region: str | tuple[int, ...] | None = None
    name: str | None = None
    objects: tuple[str, ...] = ()
    patch: int | None = None
    harmonics: tuple[str, ...] = ()
    column: int | None = None
    noise: float | None = None
    share: Share | None = None

    @staticmethod
    def of_manifest(entry: Mapping[str, Any], where: str) -> CapturedLight:
        """From a checked entry of capture.json; ManifestError, naming the light as `where`, for a direction of another length than 1."""
        kind: LightKind = entry["kind"]
        place = np.asarray(entry.get("direction" if kind == "directional" else "position", NOWHERE), np.float64)
        if kind == "directional":
            length = float(np.linalg.norm(place))
            if not abs(length - 1) <= UNIT_TOLERANCE:
                raise ManifestError(f"expected a unit direction of {where}, found length {length:.4g}; normalize it")
            place = place / length
        x, y, z = place.tolist()
        region = entry.get("region")
        share = Share.of_manifest(entry["share"], where) if "share" in entry else None
        if share is not None and (region is not None or "harmonics" in entry):
            raise ManifestError(f"expected {where} with a share of the texels, a region or harmonics, found two of them; keep one")
        return CapturedLight(
            (x, y, z),
            entry["role"],
            entry["file"],
            entry.get("direct"),
            kind,
            tuple(region) if isinstance(region, list) else region,
            entry.get("name"),
            tuple(entry.get("objects", ())),
            entry.get("patch"),
            tuple(entry.get("harmonics", ())),
            noise=entry.get("noise"),
            share=share,
        )

    @property
    def direction(self) -> tuple[float, float, float]:
        """Unit vector towards the light; InputError for a point light, which has none."""
        if self.kind != "directional":
            raise InputError(f"expected a directional light, found a {self.kind} light ({self.file}), which has no direction of its own")
        return self.place

    @property
    def position(self) -> tuple[float, float, float]:
        """Position of a point light, m; InputError for a directional one."""
        if self.kind != "point":
            raise InputError(f"expected a point light, found a {self.kind} one ({self.file}), which has no position")
        return self.place

    @property
    def files(self) -> tuple[str, ...]:
        """All files that the light names, relative to the capture's folder."""
        named = (self.file, self.direct, self.region if isinstance(self.region, str) else None, *self.harmonics)
        return tuple(name for name in named if name is not None)
