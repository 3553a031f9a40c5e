"""The settings of a bake, and its lights."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from srbf.bake.cubemap_set import CubemapSet
from srbf.bake.gather_set import GatherSet
from srbf.bake.light_sets import CloudSet, NamedSet, PlacedLight
from srbf.bake.planned_lights import PlannedLight, Rendered, noise_seed
from srbf.bake.point_lights import PointGrid
from srbf.basis.exitant_harmonics import MAX_ORDER
from srbf.brdf_factors import check_terms
from srbf.captured_light import ROLES, Role
from srbf.errors import InputError
from srbf.importing.light_list import read_light_list
from srbf.probe_grid import ProbeGrid
from srbf.receiver_images import Quantity, Transport
from srbf.receiver_share import MOST_STEPS, Share, share_word, shares_in_turn
from srbf.sphere import Domain, domain_of, mean_spacing, point_set, random_directions

Kind = Literal["lightmap", "vertices", "view", "probes"]
Unwrap = Literal["smart", "lightmap-pack", "keep"]
LARGEST_SIDE = 16384
LightSet = NamedSet | CloudSet | GatherSet | CubemapSet


@dataclass(frozen=True)
class Receiver:
    """What receives the light: a lightmap, a mesh's vertices, a camera's view, or probes in free space.

    Parameters
    ----------
    kind
        `lightmap`, `vertices`, `view` or `probes`.
    name
        Of the object, or of a view's camera; None: the scene's own camera.
    uv_layer
        Of a lightmap; None: one that fits.
    also
        Further objects whose texels share the lightmap.
    unwrap
        How a UV layer is made where none fits: `smart`, `lightmap-pack` or `keep`.
    spacing
        Of probes, m; None: by the size of the scene.
    probes
        Where they are, known once `srbf.bake.scene_query.with_size` has asked the scene.

    Examples
    --------
    >>> from srbf.bake.settings import Receiver
    >>> Receiver.parse("lightmap:Table") == Receiver("lightmap", "Table")
    True
    """

    kind: Kind
    name: str | None = None
    uv_layer: str | None = None
    also: tuple[str, ...] = ()
    unwrap: Unwrap = "smart"
    spacing: float | None = None
    probes: ProbeGrid | None = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        if self.spacing is not None and not (np.isfinite(self.spacing) and self.spacing > 0):
            raise InputError(f"expected a spacing of probes above 0 m, found {self.spacing:g}")

    @staticmethod
    def parse(text: str, uv_layer: str | None = None, unwrap: Unwrap = "smart") -> Receiver:
        """From the command line's `lightmap:OBJECT`, `vertices:OBJECT`, `view[:CAMERA]` or `probes[:SPACING]`.

        Parameters
        ----------
        text
            What the user wrote.
        uv_layer, unwrap
            Of a lightmap.

        Returns
        -------
        Receiver
            Of the first object alone: `captures_of` joins several in one lightmap.

        Raises
        ------
        InputError
            On other words, on a spacing that is no length, and on a `uv_layer` of another receiver than a lightmap.

        Examples
        --------
        >>> from srbf.bake.settings import Receiver
        >>> Receiver.parse("view:Camera.001").name
        'Camera.001'
        >>> Receiver.parse("lightmap:")
        Traceback (most recent call last):
        srbf.errors.InputError: expected a receiver lightmap:OBJECT, vertices:OBJECT, view[:CAMERA] or probes[:SPACING], found 'lightmap:'
        """
        kind, _, name = text.partition(":")
        if kind == "lightmap" and name:
            return Receiver("lightmap", name, uv_layer, unwrap=unwrap)
        if (kind == "vertices" and name) or kind in ("view", "probes"):
            if uv_layer is not None:
                raise InputError(f"expected `uv_layer` with a lightmap receiver, found it with {'a view' if kind == 'view' else kind}")
            if kind == "probes":
                return Receiver("probes", spacing=_spacing(name) if text != kind else None)
            return Receiver("view" if kind == "view" else "vertices", name or None)
        raise InputError(f"expected a receiver lightmap:OBJECT, vertices:OBJECT, view[:CAMERA] or probes[:SPACING], found {text!r}")

    @staticmethod
    def of_manifest(described: Sequence[dict[str, Any]]) -> Receiver:
        """From a capture's `receiver`, or `receivers` in one atlas; with a UV layer only where all have the same."""
        first = described[0]
        layers = {one.get("uv_layer") for one in described}
        names = [one.get("object") or one.get("camera") for one in described]
        return Receiver(first["kind"], names[0], layers.pop() if len(layers) == 1 else None, tuple(str(name) for name in names[1:]))

    @property
    def place(self) -> str:
        """Its name in messages."""
        return f"{self.kind} {self.name!r}" if self.name else f"the {self.kind}"

    def job(self) -> dict[str, Any]:
        """As JSON for the worker; of probes what a question to the scene needs, see `srbf.bake.probes.write_job` for the rest."""
        if self.kind == "probes":
            return {"kind": self.kind, "spacing": self.spacing}
        if self.kind == "view":
            return {"kind": self.kind, "camera": self.name}
        return {
            "kind": self.kind,
            "object": self.name,
            "objects": [self.name, *self.also],
            "uv_layer": self.uv_layer,
            "unwrap": self.unwrap,
        }

    def record(self) -> dict[str, Any]:
        """JSON for the manifest; defaults of settings that older captures do not have are left out."""
        record: dict[str, Any] = {"kind": self.kind, "name": self.name, "uv_layer": self.uv_layer}
        if self.also:
            record["also"] = list(self.also)
        if self.unwrap != "smart":
            record["unwrap"] = self.unwrap
        if self.kind == "probes":
            record["spacing"] = self.spacing
        return record

    @property
    def word(self) -> str:
        """What `parse` makes it of, its further objects left out."""
        if self.kind == "probes":
            return self.kind if self.spacing is None else f"{self.kind}:{self.spacing!r}"
        return f"{self.kind}:{self.name}" if self.name else self.kind


def _spacing(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise InputError(f"expected a spacing of probes in meters, as in probes:0.5, found {text!r}") from None


def captures_of(receivers: Sequence[Receiver], separate: bool = False) -> list[Receiver]:
    """One receiver per capture: all lightmaps share one atlas, unless `separate`; each view and vertex list has its own.

    InputError where one is named twice.
    """
    named = [(receiver.kind, receiver.name) for receiver in receivers]
    for one, receiver in zip(named, receivers, strict=True):
        if named.count(one) > 1:
            raise InputError(f"expected each receiver once, found {receiver.word} {named.count(one)} times")
    lightmaps = [receiver for receiver in receivers if receiver.kind == "lightmap"]
    if separate or len(lightmaps) < 2:
        return list(receivers)
    atlas = replace(lightmaps[0], also=tuple(str(receiver.name) for receiver in lightmaps[1:]))
    return [atlas, *(receiver for receiver in receivers if receiver.kind != "lightmap")]


def folder_names(receivers: Sequence[Receiver]) -> list[str]:
    """A folder name for each of several captures: the object's or camera's, valid on any file system, numbered where equal."""
    names: list[str] = []
    for receiver in receivers:
        stem = re.sub(r"[^\w. -]", "_", receiver.name or receiver.kind).strip(". ") or receiver.kind
        equal = sum(1 for name in names if name.lower().rpartition("~")[0] == stem.lower() or name.lower() == stem.lower())
        names.append(f"{stem}~{equal + 1}" if equal else stem)
    return names


@dataclass(frozen=True)
class BakeSettings:
    """All settings that affect a capture's pixels, besides the scene and Blender's version.

    Parameters
    ----------
    receiver
        What receives the light.
    width, height
        Texels, 1 to 16384.
    lights
        How many train lights, on the Hammersley points of `domain`.
    domain
        `hemisphere` or `sphere`.
    samples
        Per texel and train light, 1 or more; `auto`: doubled until the error on the validation lights stops improving.
    validation, holdout
        How many random lights of either role, 0 or more.
    holdout_samples
        Per texel of validation and holdout lights.
    quantity
        `irradiance` or `radiance`.
    seed
        Of the random lights and of Cycles' noise.
    sun_angle
        Angular diameter of the light, rad, 0 to pi.
    keep_scene_lights
        Leave the scene's own lights on.
    light_list
        A .lp file of the train directions, in place of `lights` and `domain`.
    transport
        `combined`, or `indirect`: direct light is kept apart.
    points
        Point lights instead of directional ones.
    light_set
        The scene's own lights by name, or lights inside the scene, instead of directional ones.
    no_shadow
        Names of objects that cast no shadow.
    denoise
        Denoise a view's train images.
    scene
        One of the .blend's scenes; None: the active one.
    gloss
        The radiance toward every viewer, too: of a cloud the order of its spherical harmonics, 1 to 4; under a cubemap the terms of the
        BRDF's in-out factorization, 1 to 64. None: the radiance toward one alone.
    step
        Of a train light's share: every n-th texel across and down, another set for the next light; 1 to 8, 1: all texels.

    Raises
    ------
    InputError
        On a value out of range, and on settings that exclude each other.

    Examples
    --------
    >>> from srbf.bake.settings import BakeSettings, Receiver, plan_lights
    >>> settings = BakeSettings(Receiver.parse("lightmap:Table"), lights=100, holdout=8)
    >>> [light.role for light in plan_lights(settings)].count("train")
    100
    >>> BakeSettings(Receiver.parse("view"), sun_angle=4.0)
    Traceback (most recent call last):
    srbf.errors.InputError: expected a sun angle of at most pi rad, found 4
    """

    receiver: Receiver
    width: int = 256
    height: int = 256
    lights: int = 400
    domain: Domain = "hemisphere"
    samples: int | Literal["auto"] = 2
    validation: int = 16
    holdout: int = 32
    holdout_samples: int = 64
    quantity: Quantity = "irradiance"
    seed: int = 0
    sun_angle: float = 0.0  # angular diameter of the light
    keep_scene_lights: bool = False
    light_list: Path | None = None
    transport: Transport = "combined"
    points: PointGrid | None = None  # point lights instead of directional ones
    light_set: LightSet | None = None  # named lights, or lights inside the scene
    no_shadow: tuple[str, ...] = ()  # objects that cast no shadow
    denoise: bool = False  # of a view's train images
    scene: str | None = None  # of the .blend's scenes; None: the active one
    gloss: int | None = None  # order of the harmonics of the viewer's direction, or terms of an in-out factorization
    step: int = 1  # texels from one to the next of a train light's share

    def __post_init__(self) -> None:
        for name in ("width", "height", "lights", "samples", "holdout_samples"):
            if getattr(self, name) != "auto" and getattr(self, name) < 1:
                raise InputError(f"expected {name.replace('_', ' ')} of 1 or more, found {getattr(self, name)}")
        for name in ("validation", "holdout", "seed", "sun_angle"):
            if not getattr(self, name) >= 0:
                raise InputError(f"expected {name.replace('_', ' ')} of 0 or more, found {getattr(self, name)}")
        if self.samples == "auto" and (self.validation < 1 or self.holdout_samples < 2):
            raise InputError(
                "expected validation lights of 2 samples or more with `samples=auto`, which needs them, found none; leave `validation` out"
            )
        if self.denoise and (self.samples == "auto" or self.receiver.kind != "view" or self.transport != "combined"):
            raise InputError(
                "expected a view of combined transport and a fixed number of `samples` with `denoise`, found another; leave `denoise` out"
            )
        if max(self.width, self.height) > LARGEST_SIDE:
            raise InputError(f"expected a size of at most {LARGEST_SIDE} texels per side, found {self.width}x{self.height}")
        if self.sun_angle > np.pi:
            raise InputError(f"expected a sun angle of at most pi rad, found {self.sun_angle:g}")
        if self.transport == "indirect" and self.receiver.kind in ("vertices", "probes") and self.light_set is None:
            raise InputError(
                f"expected {self.receiver.kind} with transport combined, found indirect: rays have no footprint to spread over at a point"
            )
        if self.receiver.kind == "probes" and self.quantity != "irradiance":
            raise InputError(f"expected `quantity=irradiance` with probes, found {self.quantity}: they have no surface that reflects")
        if self.light_set is not None:
            self._check_light_set(self.light_set)
        if self.gloss is not None:
            self._check_gloss(self.gloss)
        if self.step != 1:
            self._check_share()
        if self.points is not None:
            if self.light_list is not None or self.sun_angle > 0:
                raise InputError("expected point lights without `light_list` and `sun_angle`, which belong to directional ones")
            if self.samples == "auto":
                raise InputError("expected a number of `samples` with point lights, found auto, which measures by fits of directional ones")
            if self.transport != "combined":
                raise InputError(
                    "expected `transport=combined` with point lights, found indirect: only a sun's direct light can be left out"
                )

    def _check_light_set(self, light_set: LightSet) -> None:
        what = f"`light_set={light_set.kind}`"
        if self.points is not None or self.light_list is not None or self.sun_angle > 0:
            raise InputError(f"expected {what} without `light_list` and `sun_angle`, which belong to directional lights")
        if self.samples == "auto":
            raise InputError(f"expected a number of `samples` with {what}, found auto, which measures by fits of directional lights")
        if self.denoise:
            raise InputError(f"expected {what} without `denoise`, which belongs to directional lights")
        if light_set.kind == "named" and self.keep_scene_lights:
            raise InputError(f"expected {what} without `keep_scene_lights`: the scene's lights are what is captured")
        if light_set.kind == "gather" and (self.receiver.kind != "view" or self.quantity != "radiance"):
            found = self.receiver.kind if self.receiver.kind != "view" else self.quantity
            raise InputError(f"expected the radiance of a view with {what}, found {found}; use `light_set=surfels`")
        if light_set.kind == "cubemap" and self.receiver.kind not in ("lightmap", "vertices"):
            raise InputError(f"expected a receiver lightmap:OBJECT or vertices:OBJECT with {what}, found {self.receiver.kind}")
        if light_set.kind in ("patches", "surfels", "gather") and self.transport != "indirect":
            raise InputError(f"expected `transport=indirect` with {what}, found combined: what surfaces reflect is indirect light")

    def _check_share(self) -> None:
        if not 1 <= self.step <= MOST_STEPS:
            raise InputError(f"expected a share of every 1st to {MOST_STEPS}th texel each way, found {self.step}")
        what = f"`share={share_word(self.step)}`"
        if self.receiver.kind not in ("lightmap", "view"):
            raise InputError(f"expected a lightmap or a view with {what}, found {self.receiver.kind}; leave `share` out")
        if self.light_set is not None or self.points is not None:
            found = "point lights" if self.light_set is None else f"`light_set={self.light_set.kind}`"
            raise InputError(
                f"expected directional lights with {what}, found {found}: neighbors fill what a light lacks; leave `share` out"
            )
        if self.denoise or self.samples == "auto":
            found = "`denoise`" if self.denoise else "`samples=auto`"
            raise InputError(f"expected a fixed number of `samples` and no `denoise` with {what}, found {found}; leave one of them out")
        if self.receiver.kind == "view" and (self.width % self.step or self.height % self.step):
            up = "x".join(str(-(-side // self.step) * self.step) for side in (self.width, self.height))
            raise InputError(
                f"expected a view's size to be a multiple of {self.step} with {what}, found {self.width}x{self.height}; "
                f"`size={up}` is the next"
            )
        if min(self.width, self.height) < self.step:
            raise InputError(f"expected {self.step} texels or more each way with {what}, found {self.width}x{self.height}")

    def _check_gloss(self, gloss: int) -> None:
        kind = None if self.light_set is None else self.light_set.kind
        if kind not in ("cloud", "cubemap"):
            raise InputError(f"expected `light_set=cloud` or cubemap:SIDE with `gloss`, found {kind or 'others'}; leave `gloss` out")
        if kind == "cubemap":
            check_terms(gloss)
        elif not 1 <= gloss <= MAX_ORDER:
            raise InputError(f"expected `gloss` of order 1 to {MAX_ORDER}, found {gloss}")
        if kind == "cubemap" and self.transport != "combined":
            raise InputError("expected `transport=combined` with `gloss` under a cubemap, found indirect; leave `transport` out")
        if self.receiver.kind == "view" or self.quantity != "radiance":
            found = "a view, which has one viewer" if self.receiver.kind == "view" else "irradiance, which no viewer changes"
            raise InputError(f"expected the radiance of a lightmap or of vertices with `gloss`, found {found}")

    @property
    def harmonics(self) -> int | None:
        """Order of the spherical harmonics of the viewer's direction that lights are rendered toward; None without."""
        return self.gloss if self.light_set is not None and self.light_set.kind == "cloud" else None

    def with_matched_sun(self) -> BakeSettings:
        """The settings with a sun angle of the train lights' mean spacing: penumbrae as soft as that many lights can resolve.

        Returns
        -------
        BakeSettings
            Of a `sun_angle` in rad, at most pi.

        Raises
        ------
        InputError
            With point lights.

        Examples
        --------
        >>> from srbf.bake.settings import BakeSettings, Receiver
        >>> few, many = (BakeSettings(Receiver.parse("view"), lights=n).with_matched_sun().sun_angle for n in (50, 200))
        >>> few > many > 0
        True
        """
        if self.points is not None or self.light_set is not None:
            found = "point lights" if self.points is not None else "others"
            raise InputError(f"expected directional lights for a matched sun, found {found}; leave `sun_angle` out")
        train = [light.place for light in plan_lights(self) if light.role == "train"]
        return replace(self, sun_angle=min(mean_spacing(np.array(train)), float(np.pi)))

    def record(self) -> dict[str, Any]:
        """JSON for the manifest; a light list by its checksum, since its path may differ from machine to machine."""
        record: dict[str, Any] = {entry.name: getattr(self, entry.name) for entry in fields(self)}
        record["receiver"] = self.receiver.record()
        record["no_shadow"] = list(self.no_shadow)
        for name, old in (("transport", "combined"), ("no_shadow", []), ("denoise", False), ("scene", None), ("gloss", None), ("step", 1)):
            if record[name] == old:
                del record[name]  # as in captures older than these settings
        del record["points"], record["light_set"]
        if self.points is not None or self.light_set is not None:
            for directional in ("lights", "domain", "sun_angle", "light_list"):
                del record[directional]
        if self.light_set is not None:
            record["light_set"] = self.light_set.record()
        elif self.points is not None:
            record["points"] = self.points.record()
        elif self.light_list is not None:
            read_light_list(self.light_list)
            record["light_list"] = hashlib.sha256(self.light_list.read_bytes()).hexdigest()
        return record


def plan_lights(settings: BakeSettings) -> list[PlannedLight]:
    """Train lights (Hammersley, the light list's, a grid of point lights, or those of a set), then validation and holdout: random ones."""
    apart = settings.transport == "indirect"
    parts: dict[Role, tuple[Rendered, ...]] = dict.fromkeys(ROLES, ("response", "direct") if apart else ("response",))
    if settings.light_set is not None:
        train = settings.light_set.train()
        tested = settings.light_set.tested(settings.validation + settings.holdout)
        validation, holdout = tested[: settings.validation], tested[settings.validation :]
        # The direct light of train lights is of no use; that of a patch is part of what it reflects.
        parts["train"] = ("indirect",) if apart and settings.light_set.kind != "patches" else ("response",)
    elif settings.points is not None:
        places = settings.points.places(settings.validation, settings.holdout)
        train, validation, holdout = ([PlacedLight("point", tuple(place)) for place in group.tolist()] for group in places)
    else:
        if settings.light_list is not None:
            directions = np.array([entry.place for entry in read_light_list(settings.light_list)])
            domain = domain_of(directions)
        else:
            domain = settings.domain
            directions = point_set("hammersley", settings.lights, domain)
        rng = np.random.default_rng(settings.seed)
        random = (random_directions(count, domain, rng) for count in (settings.validation, settings.holdout))
        groups = (directions, *random)
        train, validation, holdout = ([PlacedLight("directional", tuple(place)) for place in group.tolist()] for group in groups)
    if settings.harmonics is not None:
        parts = {role: (*own, "toward") for role, own in parts.items()}
    shares: list[Share | None] = [None] * len(train) if settings.step == 1 else [*shares_in_turn(len(train), settings.step)]
    planned: list[PlannedLight] = []
    roles: list[tuple[Role, list[PlacedLight], int]] = [
        ("train", train, 1 if settings.samples == "auto" else settings.samples),
        ("validation", validation, settings.holdout_samples),
        ("holdout", holdout, settings.holdout_samples),
    ]
    for role, lights, samples in roles:
        for light in lights:
            index = len(planned)
            share = shares[index] if role == "train" else None
            seed = noise_seed(settings.seed, index)
            planned.append(PlannedLight(index, light, role, samples, seed, parts[role], settings.harmonics, share))
    return planned
