"""The scenes of the gallery: how each is baked and fitted, and what the page shows of it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal

from srbf.bake.point_lights import PointGrid
from srbf.bake.settings import BakeSettings, Receiver, captures_of
from srbf.demo.photographs import Dome
from srbf.receiver_images import Transport
from srbf.relighting.direct_light import Direct

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Fit:
    """One asset of a scene: its folder, its label in a picture, and the flags of `srbf fit`.

    `light`: `all` fits the combined response; `indirect` fits the indirect images, and rays add the direct light.
    """

    folder: str
    label: str
    method: str
    settings: dict[str, Any]
    light: Literal["all", "indirect"] = "all"

    @property
    def direct(self) -> Direct:
        return "ray" if self.light == "indirect" else "none"


@dataclass(frozen=True)
class Lantern:
    """A point light carried through a scene: corners of its closed path (m), its irradiance at 1 m, and a directional moon."""

    path: tuple[Vector, ...]
    color: Vector
    radius: float
    moon: Vector
    moon_color: Vector


@dataclass(frozen=True)
class Sun:
    """A directional light that orbits once while its elevation oscillates between `low` and `high` (degrees), `swings` times."""

    low: float
    high: float
    swings: int = 1
    second: Vector | None = None  # color of a second light that orbits in the opposite direction
    color: Vector = (1.0, 1.0, 1.0)


@dataclass(frozen=True)
class Scene:
    """The settings of one scene. `moving` are the folders of the fits in the clip; `tested` are directions (azimuth and elevation,
    degrees), and the strip shows the held-out lights nearest to them. Several `receivers`, all lightmaps, share one atlas."""

    name: str
    receivers: tuple[str, ...]
    size: tuple[int, int]
    fits: tuple[Fit, ...]
    clip: Sun | Lantern
    lights: int = 400
    samples: int = 2
    transport: Transport = "combined"
    soft_sun: bool = False
    validation: int = 8
    holdout: int = 20
    holdout_samples: int = 24
    dome: Dome | None = None
    tested: tuple[tuple[float, float], ...] = ((60, 65), (200, 40), (320, 18))
    moving: tuple[str, ...] = ("asset",)
    frames: int = 48
    clip_width: int = 480
    contest_texels: int = 4096

    @property
    def moved(self) -> tuple[Fit, ...]:
        """The fits of the clip; the lantern uses the first."""
        return tuple(next(fit for fit in self.fits if fit.folder == folder) for folder in self.moving)

    @property
    def receiver(self) -> Receiver:
        """The receiver, parsed as by `srbf bake --receiver`."""
        (receiver,) = captures_of([Receiver.parse(word) for word in self.receivers])
        return receiver

    def bake_settings(self) -> BakeSettings:
        """The settings of `srbf bake`; the caller adds a dome's light list."""
        receiver = self.receiver
        settings = BakeSettings(
            receiver,
            *self.size,
            lights=self.lights,
            samples=self.samples,
            validation=self.validation,
            holdout=self.holdout,
            holdout_samples=self.holdout_samples,
            quantity="radiance" if receiver.kind == "view" else "irradiance",
            transport=self.transport,
        )
        if self.dome is not None:
            return replace(settings, validation=0, holdout=0)
        return settings.with_matched_sun() if self.soft_sun else settings

    def point_light_settings(self, samples: int = 64) -> BakeSettings | None:
        """The settings of a bake of true point lights on the lantern's path, the reference of the relit lantern; None without a lantern."""
        if not isinstance(self.clip, Lantern):
            return None
        receiver = self.receiver
        grid = PointGrid(1.0, grid=self.clip.path)
        return BakeSettings(receiver, *self.size, samples=samples, validation=0, holdout=0, quantity="radiance", points=grid)

    def small(self) -> Scene:
        """The same scene with few lights and few texels, for the test; takes seconds."""
        largest = max(self.size)
        size = (max(24, 64 * self.size[0] // largest), max(24, 64 * self.size[1] // largest))
        dome = self.dome and replace(self.dome, point_lights=24, tests=4)
        return replace(
            self,
            size=size,
            lights=64,
            samples=1,
            validation=min(2, self.validation),
            holdout=6,
            holdout_samples=4,
            frames=6,
            clip_width=160,
            dome=dome,
            contest_texels=512,
        )


MAPS = Fit("asset-25-maps", "25 maps of combined light", "relighting-map", {"k": 25})
SMALL = Fit("asset", "best of 16 bytes", "auto", {"budget": 16})
MAPS_AND_RAYS = replace(MAPS, folder="asset-indirect-25-maps", label="25 maps + rays", light="indirect")
SMALL_ALL = replace(SMALL, folder="asset-all", label="best of 16 bytes, combined light")
COMPONENTS_AND_RAYS = Fit("asset", "16 components + rays", "eigen-map", {"components": 16, "encoding": "uint8"}, light="indirect")

STILL_LIFE = tuple(f"lightmap:{name}" for name in ("Table", "Tall Vase", "Egg", "Faceted Vase", "Mirrored Jar", "Sheared Bowl", "Ring"))

SCENES = (
    Scene(
        name="caustics",
        receivers=("lightmap:Table",),
        size=(512, 512),
        samples=4,
        holdout=24,
        soft_sun=True,
        fits=(MAPS, SMALL),
        clip=Sun(25, 60, 2),
    ),
    Scene(
        name="house",
        receivers=("view",),
        size=(384, 288),
        validation=0,
        transport="indirect",
        fits=(MAPS, MAPS_AND_RAYS, COMPONENTS_AND_RAYS),
        moving=("asset-indirect-25-maps",),
        clip=Lantern(
            ((-1.9, -1.6, 1.2), (-0.2, -1.7, 1.2), (1.1, -1.2, 1.2), (0.9, 0.6, 1.2), (0.5, 2.2, 1.2), (-1.2, 2.1, 1.2), (-1.8, 0.4, 1.2)),
            (2.6, 1.5, 0.62),
            0.05,
            (-0.62, -0.30, 0.72),
            (0.05, 0.075, 0.13),
        ),
    ),
    Scene(
        name="colored_room",
        receivers=("view",),
        size=(384, 288),
        soft_sun=True,
        fits=(MAPS, SMALL),
        clip=Sun(25, 65, 2, second=(0.22, 0.3, 0.5), color=(1.0, 0.92, 0.8)),
        moving=("asset-25-maps", "asset"),
        clip_width=800,
    ),
    Scene(
        name="lattice",
        receivers=("view",),
        size=(384, 288),
        transport="indirect",
        fits=(MAPS, SMALL_ALL, COMPONENTS_AND_RAYS),
        clip=Sun(25, 60, 2),
        moving=("asset-25-maps", "asset-all", "asset"),
        clip_width=900,
    ),
    Scene(
        name="coin",
        receivers=("view",),
        size=(384, 384),
        samples=16,
        fits=(MAPS, SMALL),
        dome=Dome(80, 20, 12),
        clip=Sun(15, 22, 2),
        tested=((60, 60), (200, 35), (320, 16)),
    ),
    Scene(
        name="still_life",
        receivers=STILL_LIFE,
        size=(288, 288),
        transport="indirect",
        fits=(MAPS, SMALL_ALL, COMPONENTS_AND_RAYS),
        clip=Sun(20, 60, 2),
        moving=("asset-25-maps", "asset"),
        clip_width=800,
    ),
)
