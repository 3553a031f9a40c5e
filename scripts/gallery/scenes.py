"""The scenes of the gallery: what of each is baked, how it is fitted, and what is shown of it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal

from srbf.bake.point_lights import PointGrid
from srbf.bake.settings import BakeSettings, Receiver, captures_of
from srbf.capture import Transport
from srbf.relighting.direct_light import Direct

Place = tuple[float, float, float]


@dataclass(frozen=True)
class Fit:
    """One asset of a scene: its folder, what it is called in a picture, and the flags of `srbf fit`.

    `light`: `all` fits the combined answer, `indirect` what an indirect bake leaves after the direct light, which rays then add.
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
class Dome:
    """A photographer's dome: so many lamps above an elevation (degrees), every one photographed, some only to test by."""

    point_lights: int
    tests: int
    lowest: float


@dataclass(frozen=True)
class Lantern:
    """A lamp carried through a scene: corners of its closed path (m), its irradiance at 1 m, and the moon beside it."""

    path: tuple[Place, ...]
    color: Place
    radius: float
    moon: Place
    moon_color: Place


@dataclass(frozen=True)
class Sun:
    """A directional light that goes round once, its elevation swinging between two (degrees), `swings` times."""

    low: float
    high: float
    swings: int = 1
    second: Place | None = None  # color of another one that goes the other way
    color: Place = (1.0, 1.0, 1.0)


@dataclass(frozen=True)
class Scene:
    """All that is decided of one scene. `moving` are the folders of the fits in the clip, `tested` directions (azimuth and elevation,
    degrees) near which the strip's held-out lights are taken. Of several `receivers`, all lightmaps, one atlas is baked."""

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
        """The fits of the clip; the first carries the lantern."""
        return tuple(next(fit for fit in self.fits if fit.folder == folder) for folder in self.moving)

    @property
    def receiver(self) -> Receiver:
        """What is baked, as `srbf bake` takes its --receiver words."""
        (receiver,) = captures_of([Receiver.parse(word) for word in self.receivers])
        return receiver

    def bake_settings(self) -> BakeSettings:
        """As `srbf bake` takes them; a dome's light list is added by who writes it."""
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
        """A bake of true lamps on the lantern's path, by which the relit lantern is measured."""
        if not isinstance(self.clip, Lantern):
            return None
        receiver = self.receiver
        grid = PointGrid(1.0, grid=self.clip.path)
        return BakeSettings(receiver, *self.size, samples=samples, validation=0, holdout=0, quantity="radiance", points=grid)

    def small(self) -> Scene:
        """The same with few lights on few texels, in seconds: for the test."""
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


MAPS = Fit("asset-25-maps", "25 maps of all light", "relighting-map", {"k": 25})
SMALL = Fit("asset", "best of 16 bytes", "auto", {"budget": 16})
MAPS_AND_RAYS = replace(MAPS, folder="asset-indirect-25-maps", label="25 maps + rays", light="indirect")
SMALL_ALL = replace(SMALL, folder="asset-all", label="best of 16 bytes, all light")
SCALARS_AND_RAYS = Fit("asset", "16 scalars + rays", "eigen-map", {"components": 16, "encoding": "uint8"}, light="indirect")

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
        fits=(MAPS, MAPS_AND_RAYS, SCALARS_AND_RAYS),
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
        fits=(MAPS, SMALL_ALL, SCALARS_AND_RAYS),
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
        fits=(MAPS, SMALL_ALL, SCALARS_AND_RAYS),
        clip=Sun(20, 60, 2),
        moving=("asset-25-maps", "asset"),
        clip_width=800,
    ),
)
