"""Light sets of a bake other than directions: the scene's own lights by name, a cloud of point lights, patches of the surfaces.

What a set holds of the scene (names, free places, patches) is unknown before `srbf.bake.scene_query.with_light_set`.
"""

from __future__ import annotations

import hashlib
import json
import zipfile
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
from numpy import ndarray

from srbf.arrays import Float64
from srbf.bake.point_lights import Box, parse_box
from srbf.captured_light import NOWHERE, LightKind
from srbf.errors import InputError
from srbf.io import files
from srbf.visibility.patches import Patches, cell_count
from srbf.visibility.surface_cells import Cells, Fragments
from srbf.visibility.surfels import Surfels
from srbf.visibility.transfer_operator import OPERATOR_FILE, SURFELS_FILE

PLACES = 1024  # random free places: where the components of a fit are made for, and what sees which patch
SURFEL_PLACES = 4096  # with surfels: shapes of light are made for most of them
LIGHT_SET_FILE = "light_set.npz"  # in the capture's folder: what was found of the scene, so that a resumed bake has the same
PATCHES_FILE = "patches.exr"
MOST_NAMES = 4096
MOST_LIGHTS = 20_000  # of a cloud, or patches
SURFELS = 5000  # of the transfer operator, about, unless a density is given; as many more, up to MOST_SURFELS, as this size asks for:
SURFEL_SIZE = 0.16  # m
MOST_SURFELS = 10_000


@dataclass(frozen=True)
class PlacedLight:
    """A light of a set: kind, position (m) where it has one, name and objects of a named one, number of a patch."""

    kind: LightKind
    place: tuple[float, float, float] = NOWHERE
    name: str | None = None
    objects: tuple[str, ...] = ()
    patch: int | None = None

    def json(self) -> dict[str, Any]:
        """For manifest and worker."""
        if self.kind == "named":
            return {"kind": self.kind, "name": self.name, "objects": list(self.objects)}
        if self.kind == "patch":
            return {"kind": self.kind, "patch": self.patch}
        return {"kind": self.kind, ("direction" if self.kind == "directional" else "position"): list(self.place)}


@dataclass(frozen=True)
class NamedSet:
    """Every light, emissive object and the world of the scene by itself; the lights of each of `groups`, names of collections, as one."""

    kind: ClassVar[str] = "named"
    groups: tuple[str, ...] = ()
    entries: tuple[tuple[str, tuple[str, ...]], ...] | None = None

    def train(self) -> list[PlacedLight]:
        """InputError where the names are not known yet."""
        if self.entries is None:
            raise InputError("expected named lights of a known scene, found none; call with_light_set first")
        return [PlacedLight("named", name=name, objects=objects) for name, objects in self.entries]

    def tested(self, count: int) -> list[PlacedLight]:
        """No lights are held out: every mix is a sum of the captured images."""
        return []

    def question(self, tested: int, seed: int) -> dict[str, Any]:
        """What the scene is asked."""
        return {"named": {"groups": list(self.groups)}}

    def record(self) -> dict[str, Any]:
        """JSON for the manifest."""
        return {"kind": self.kind, "groups": list(self.groups), "names": [name for name, _ in self.entries or ()]}

    def manifest(self) -> dict[str, Any]:
        """Keys of capture.json beside the lights."""
        return {}

    @property
    def is_known(self) -> bool:
        return self.entries is not None


@dataclass(frozen=True, eq=False)
class FoundPlaces:
    """What a scene has for a cloud: train lights (L, 3), held-out ones (H, 3) and free places (F, 3), m, and its patches."""

    train: Float64[ndarray, "L 3"]
    random: Float64[ndarray, "H 3"]
    free: Float64[ndarray, "F 3"]
    box: Box
    patches: Patches
    surfels: Surfels | None = None
    objects: tuple[str, ...] = ()
    bounces: int | None = None
    checksum: str = ""

    def __post_init__(self) -> None:
        digest = hashlib.sha256()
        for array in self.arrays().values():
            digest.update(np.ascontiguousarray(array).tobytes())
        object.__setattr__(self, "checksum", digest.hexdigest())

    def arrays(self) -> dict[str, ndarray]:
        """As a file holds them."""
        emits = self.patches.fragments
        return {
            "train": self.train,
            "random": self.random,
            "free": self.free,
            "box": np.array(self.box, np.float64),
            "cells": self.patches.cells.image(),
            "corners": emits.corners,
            "albedo": emits.albedo,
            "patch": self.patches.owners.astype(np.int32),
            **({} if self.surfels is None else self._surfel_arrays(self.surfels)),
        }

    def _surfel_arrays(self, surfels: Surfels) -> dict[str, ndarray]:
        return {
            "surfel_cells": surfels.cells.image(),
            "surfel_corners": surfels.corners,
            "surfel_owners": surfels.owners.astype(np.int32),
            "surfel_objects": surfels.objects.astype(np.int32),
            "surfel_albedo": surfels.cells.albedo,
            "surfel_emission": surfels.emission,
            "surfel_hidden": surfels.hidden,
            "object_names": np.array(json.dumps(list(self.objects))),
            "bounces": np.array(-1 if self.bounces is None else self.bounces),
        }

    @staticmethod
    def of_arrays(stored: Any) -> FoundPlaces:
        """From `arrays`."""
        x0, y0, z0, x1, y1, z1 = stored["box"].tolist()
        patches = Patches(Cells.of_image(stored["cells"]), Fragments(stored["corners"], stored["albedo"]), stored["patch"].astype(np.int64))
        found = FoundPlaces(stored["train"], stored["random"], stored["free"], (x0, y0, z0, x1, y1, z1), patches)
        if "surfel_owners" not in stored:
            return found
        cells = replace(Cells.of_image(stored["surfel_cells"]), albedo=stored["surfel_albedo"])
        owners, objects = (stored[f"surfel_{name}"].astype(np.int64) for name in ("owners", "objects"))
        surfels = Surfels(cells, stored["surfel_corners"], owners, objects, stored["surfel_emission"], stored["surfel_hidden"])
        bounces = int(stored["bounces"])
        names = tuple(json.loads(str(stored["object_names"])))
        return replace(found, surfels=surfels, objects=names, bounces=None if bounces < 0 else bounces)


@dataclass(frozen=True)
class CloudSet:
    """Lights inside the scene: `cloud` captures `count` point lights in its free space, blue noise or `spacing` meters apart; `patches`
    captures what `count` patches of its surfaces reflect; `surfels` traces what `count` surfels, or surfels `spacing` meters apart, send to
    receivers and to each other. Held-out lights are point lights in all of them.
    """

    kind: Literal["cloud", "patches", "surfels"]
    count: int
    spacing: float | None = None
    box: Box | None = None
    found: FoundPlaces | None = field(default=None, compare=False)

    def __post_init__(self) -> None:
        if not 1 <= self.count <= MOST_LIGHTS:
            raise InputError(f"expected 1 to {MOST_LIGHTS} {'lights' if self.kind == 'cloud' else self.kind}, found {self.count}")
        if self.spacing is not None and not (np.isfinite(self.spacing) and self.spacing > 0):
            raise InputError(f"expected a spacing of point lights above 0 m, found {self.spacing:g}")

    @property
    def is_known(self) -> bool:
        return self.found is not None

    @property
    def _known(self) -> FoundPlaces:
        if self.found is None:
            raise InputError("expected a cloud in a known scene, found none; call with_light_set first")
        return self.found

    def train(self) -> list[PlacedLight]:
        """InputError where the places are not known yet."""
        found = self._known
        if self.kind == "cloud":
            return [PlacedLight("point", tuple(place)) for place in found.train.tolist()]
        if self.kind == "surfels":
            return []
        cells = found.patches.cells
        area = np.maximum(np.bincount(cells.patches, cells.areas), 1e-30)
        middles = np.stack([np.bincount(cells.patches, cells.areas * cells.places[:, k]) / area for k in range(3)], axis=1)
        return [PlacedLight("patch", tuple(middle), patch=k) for k, middle in enumerate(middles.tolist())]

    def tested(self, count: int) -> list[PlacedLight]:
        """The first `count` random point lights."""
        return [PlacedLight("point", tuple(place)) for place in self._known.random[:count].tolist()]

    def question(self, tested: int, seed: int) -> dict[str, Any]:
        """What the scene is asked."""
        return {
            "places": {
                "box": self.box,
                "count": self.count if self.kind == "cloud" and self.spacing is None else 0,
                "spacing": self.spacing if self.kind == "cloud" else None,
                "random": tested,
                "places": SURFEL_PLACES if self.kind == "surfels" else PLACES,
                "seed": seed,
            },
            "surfaces": self._surfaces(),
        }

    def _surfaces(self) -> dict[str, Any]:
        if self.kind == "surfels":
            return {"cells": self.count, "spacing": self.spacing, "gloss": True}
        return {"cells": cell_count(self.patch_count)}

    @property
    def patch_count(self) -> int:
        """How many patches are asked for; surfels are in none."""
        return FINGERPRINT_PATCHES if self.kind == "cloud" else self.count

    def record(self) -> dict[str, Any]:
        """JSON for the manifest, with a checksum of what was found of the scene."""
        found = self._known
        return {"kind": self.kind, "count": self.count, "spacing": self.spacing, "box": list(found.box), "places": found.checksum}

    def manifest(self) -> dict[str, Any]:
        """Keys of capture.json beside the lights."""
        found = self._known
        return {
            "patches": {"count": found.patches.count, "file": PATCHES_FILE},
            **({} if found.surfels is None else _surfel_keys(found)),
            "free_places": [[round(value, 6) for value in place] for place in found.free.tolist()],
        }

    def write(self, path: Path, key: str = "") -> None:
        """What workers need of the patches, and a resumed bake of all of it: `key` tells the bake that it is of."""
        with files.atomic_path(path) as temporary, open(temporary, "wb") as file:
            np.savez(file, key=np.array(key), **self._known.arrays())

    def key(self, scene_sha256: str, tested: int, seed: int, scene: str | None = None) -> str:
        """What the places found depend on; `scene`: which one of the .blend."""
        return json.dumps([scene_sha256, scene, self.question(tested, seed)])

    def read(self, path: Path, key: str) -> CloudSet:
        """With the places of a file that `write` wrote; unchanged where there is none, or one of another bake or damaged."""
        with suppress(OSError, ValueError, KeyError, zipfile.BadZipFile), np.load(path) as stored:
            if str(stored["key"]) == key:
                return replace(self, found=FoundPlaces.of_arrays(stored))
        return self


def _surfel_keys(found: FoundPlaces) -> dict[str, Any]:
    told = {"count": found.patches.count, "file": SURFELS_FILE, "operator": OPERATOR_FILE, "objects": list(found.objects)}
    return {"surfels": told if found.bounces is None else {**told, "bounces": found.bounces}}


FINGERPRINT_PATCHES = 1024  # which see the lights of a cloud differently

Operator = Literal["rays", "cycles"]


def parse_light_set(
    word: str,
    groups: Sequence[str],
    lights: int,
    patches: int | None,
    spacing: float | None,
    light_bounds: str | None,
    surfels_per_m2: float | None = None,
    operator: Operator = "rays",
) -> NamedSet | CloudSet:
    """From the command line's flags; InputError on words and combinations that mean nothing.

    The operator of surfels by Cycles: what each of the patches that surfels make sends to the receivers, rendered.
    """
    if operator == "cycles":
        if word != "surfels" or surfels_per_m2 is not None:
            found = word if surfels_per_m2 is None else "`surfels_per_m2`"
            raise InputError(f"expected `operator=cycles` with `light_set=surfels` and a count of `patches`, found it with {found}")
        word = "patches"
    if surfels_per_m2 is not None and word != "surfels":
        raise InputError(f"expected `surfels_per_m2` with `light_set=surfels`, found it with {word}")
    if word == "named":
        if patches is not None or spacing is not None or light_bounds is not None:
            raise InputError("expected `light_set=named` without `patches`, `grid` and `light_bounds`, found them; leave them out")
        return NamedSet(tuple(groups))
    if groups:
        raise InputError(f"expected `light_group` with `light_set=named`, found it with {word}")
    if word == "cloud":
        if patches is not None:
            raise InputError("expected `patches` with `light_set=patches`, found it with cloud")
        return CloudSet("cloud", lights, spacing, parse_box(light_bounds))
    if word == "patches":
        if spacing is not None:
            raise InputError("expected `grid` with `light_set=cloud`, found it with patches")
        return CloudSet("patches", 512 if patches is None else patches, None, parse_box(light_bounds))
    if word == "surfels":
        if patches is not None or spacing is not None:
            raise InputError("expected `light_set=surfels` without `patches` and `grid`, found them; leave them out")
        apart = None if surfels_per_m2 is None else surfels_per_m2**-0.5
        return CloudSet("surfels", SURFELS if apart is None else MOST_SURFELS, apart, parse_box(light_bounds))
    raise InputError(f"expected `light_set` named, cloud, patches, surfels, gather or point:SPACING, found {word!r}")
