"""The light set of a deep framebuffer: no train lights; what a view gathers is traced once the view is known."""

from __future__ import annotations

import functools
import hashlib
import json
import zipfile
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64, Int
from srbf.bake.light_sets import PLACES, PlacedLight
from srbf.bake.point_lights import Box, parse_box
from srbf.bake.surface_checks import warn_of_dark_view, warn_of_empty
from srbf.capture import Capture
from srbf.errors import InputError
from srbf.io import files
from srbf.io.ies import parse_ies
from srbf.light_linking import Objects
from srbf.visibility.behind import Behind, points_behind
from srbf.visibility.embree import EmbreeTriangles
from srbf.visibility.gather_operator import GATHER_FILE, POOL_FILE, GatherOperator, cluster_count, is_gathered
from srbf.visibility.gather_pool import MOST_POOL, pool_of
from srbf.visibility.gathered_samples import DEFAULT_CLUSTERS as SAMPLED_CLUSTERS
from srbf.visibility.gathered_samples import FEWEST, LINK_BYTES, RAYS, SAMPLE_BYTES, SAMPLES_FILE, GatheredSamples, is_sampled
from srbf.visibility.glossy_gather import Lobes
from srbf.visibility.pixel_points import PixelPoints
from srbf.visibility.receivers import LEAST_THROUGH, Receivers
from srbf.visibility.surface_cells import Fragments
from srbf.visibility.view_clusters import MOST_CLUSTERS, NEAREST

FEWER = 0.95  # surfels that are asked for again, where those behind translucent ones do not fit as well
POOL = 32_768  # surfels
FRAGMENTS = 1  # squares per surfel, of several triangles each, that the scene is asked for
LEAST_POOL = 16
TRACED_BY = 4  # counts changes of what is traced: links of former versions are made once more
SHOWN = 8  # names in a line
NO_NAMES = "[]"
NO_LIGHTS = '{"lights": [], "left_out": [], "sun_angle": null}'
SAMPLING = 5e-3  # CPU seconds for the rays and the samples of a cluster, measured at 120 of these
Progress = Callable[[int, int, str], None]


@dataclass(frozen=True, eq=False)
class FoundSurfaces:
    """What a scene has for a view's gather: opaque triangles (T, 3, 3) with albedo and object, what casts shadows, free places, m.

    `random`: places of held-out lights. `bounces`: of diffuse light that the scene's settings allow. `transmission`: what the triangles
    let through diffusely, where any does. `gloss`: what their gloss reflects where lobes alone see it, of scenes without reflective
    caustics. `lights`: the scene's own as JSON, {lights, left_out, sun_angle}, see
    `blender_bake.scene_lights`. `names`: of the objects, by their numbers, as JSON.
    """

    corners: Float32[ndarray, "T 3 3"]
    albedo: Float32[ndarray, "T 3"]
    objects: Int[ndarray, " T"]
    occluders: Float32[ndarray, "O 3 3"]
    random: Float64[ndarray, "H 3"]
    free: Float64[ndarray, "F 3"]
    box: Float64[ndarray, " 6"]
    bounces: Int[ndarray, ""]
    transmission: Float32[ndarray, "T 3"] | None = None
    gloss: Float32[ndarray, "T 3"] | None = None
    lights: str = NO_LIGHTS
    names: str = NO_NAMES

    @functools.cached_property
    def checksum(self) -> str:
        """Of all arrays. The scene's own lights shine in no image."""
        digest = hashlib.sha256()
        for array in [array for name, array in self.arrays().items() if name != "lights"]:
            digest.update(np.ascontiguousarray(array).tobytes())
        return digest.hexdigest()

    def arrays(self) -> dict[str, ndarray]:
        """As a file holds them."""
        values = {entry.name: getattr(self, entry.name) for entry in fields(self)}
        return {name: np.asarray(value) for name, value in values.items() if value is not None}

    @staticmethod
    def of_arrays(stored: Mapping[str, ndarray]) -> FoundSurfaces:
        """From `arrays`."""
        known: dict[str, Any] = {entry.name: stored[entry.name] for entry in fields(FoundSurfaces) if entry.name in stored}
        texts = {"lights": str(known.get("lights", NO_LIGHTS)), "names": str(known["names"])}
        return FoundSurfaces(**(known | texts))

    @property
    def scene_lights(self) -> dict[str, Any]:
        """The scene's own lights: {lights, left_out, sun_angle}."""
        return json.loads(self.lights)

    @property
    def object_names(self) -> list[str]:
        """Of the objects, by their numbers."""
        return json.loads(self.names)

    @property
    def apart(self) -> Int[ndarray, " T"] | None:
        """A number of each triangle, the same of objects that the same of the scene's lights shine on; None where all shine on all."""
        chosen = [Objects.of_entry(one["light"]["receivers"]) for one in self.scene_lights["lights"] if "receivers" in one["light"]]
        if not chosen:
            return None
        lit = np.stack([choice.among(self.object_names) for choice in chosen], axis=1)
        return np.unique(lit, axis=0, return_inverse=True)[1].ravel()[self.objects]

    @staticmethod
    def of_facts(facts: dict[str, Any]) -> FoundSurfaces:
        """From the facts of a scene; InputError where no surface of it reflects light."""
        arrays, places = facts["arrays"], facts["places"]
        opaque = arrays["transparent"] < 0.5
        transmission = arrays["transmission"][opaque]
        passed = transmission if (transmission > LEAST_THROUGH).any() else None
        if passed is None and not (arrays["albedo"][opaque] > 0).any():
            raise InputError("expected opaque surfaces that reflect light, found none; make some diffuse")
        random, free = (np.array(places[key], np.float64).reshape(-1, 3) for key in ("random", "places"))
        return FoundSurfaces(
            arrays["corners"][opaque],
            arrays["albedo"][opaque],
            arrays["object"][opaque].astype(np.int64),
            arrays["occluders"],
            random,
            free,
            np.array(places["box"], np.float64),
            np.array(facts["bounces"]),
            passed,
            arrays["gloss"][opaque] if "gloss" in arrays and (arrays["gloss"] > 0).any() else None,
            json.dumps(readable(facts["scene_lights"])) if "scene_lights" in facts else NO_LIGHTS,
            json.dumps(facts.get("surface_objects", [])),
        )


@dataclass(frozen=True)
class GatherSet:
    """Links from `clusters` parts of a view (None: by its size) to a pool of `count` surfels; held-out lights are point lights.

    `gather`: in place of links, so many samples of each part, one bounce [Hasan2005]; None: links.
    """

    kind: ClassVar[str] = "gather"
    count: int = POOL
    clusters: int | None = None
    box: Box | None = None
    gather: int | None = None
    found: FoundSurfaces | None = field(default=None, compare=False)

    def __post_init__(self) -> None:
        if not LEAST_POOL <= self.count <= MOST_POOL:
            raise InputError(f"expected a `pool` of {LEAST_POOL} to {MOST_POOL} surfels, found {self.count}")
        if self.clusters is not None and not 1 <= self.clusters <= MOST_CLUSTERS:
            raise InputError(f"expected `view_clusters` auto or 1 to {MOST_CLUSTERS}, found {self.clusters}")
        if self.gather is not None and not FEWEST <= self.gather <= RAYS:
            raise InputError(f"expected {FEWEST} to {RAYS} samples of a cluster with `gather`, found {self.gather}")

    @staticmethod
    def parse(pool: int | None, clusters: int | str | None, light_bounds: str | None, gather: int | None = None) -> GatherSet:
        """From the command line's flags; InputError where they exclude each other."""
        if pool is not None and gather is not None:
            raise InputError("expected `gather` without `pool`, found both: gather samples need no surfels; leave one out")
        return GatherSet(POOL if pool is None else pool, clusters if isinstance(clusters, int) else None, parse_box(light_bounds), gather)

    def cost(self, pixels: int) -> tuple[int, float] | None:
        """About how many bytes the samples of a view take, and CPU seconds; None of links, which are not estimated."""
        if self.gather is None:
            return None
        clusters = cluster_count(self.clusters, pixels, SAMPLED_CLUSTERS)
        return clusters * self.gather * SAMPLE_BYTES + LINK_BYTES * NEAREST * pixels, SAMPLING * clusters

    @property
    def is_known(self) -> bool:
        return self.found is not None

    @property
    def _known(self) -> FoundSurfaces:
        if self.found is None:
            raise InputError("expected the surfaces of a known scene, found none; call with_light_set first")
        return self.found

    def train(self) -> list[PlacedLight]:
        """None."""
        return []

    def tested(self, count: int) -> list[PlacedLight]:
        """The first `count` random point lights."""
        return [PlacedLight("point", tuple(place)) for place in self._known.random[:count].tolist()]

    def question(self, tested: int, seed: int) -> dict[str, Any]:
        """What the scene is asked."""
        return {
            "places": {"box": self.box, "count": 0, "spacing": None, "random": tested, "places": PLACES, "seed": seed},
            "scene_lights": True,
            "surfaces": {"cells": FRAGMENTS * self.count, "spacing": None, "gloss": "caustics"},
        }

    def with_facts(self, facts: dict[str, Any], say: Callable[[str], None]) -> GatherSet:
        """The set with the facts of the scene."""
        found = FoundSurfaces.of_facts(facts)
        warn_of_empty(Fragments(found.corners, found.albedo), say)
        x0, y0, z0, x1, y1, z1 = found.box.tolist()
        say(f"{len(found.corners)} fragments of surfaces; lights in the box {x0:.4g},{y0:.4g},{z0:.4g} to {x1:.4g},{y1:.4g},{z1:.4g} m")
        for line in _lines_of(found.scene_lights):
            say(line)
        return replace(self, found=found)

    def record(self) -> dict[str, Any]:
        """JSON for the manifest, with a checksum of what was found of the scene."""
        found = self._known
        record = {
            "kind": self.kind,
            "pool": self.count,
            "view_clusters": self.clusters,
            "box": found.box.tolist(),
            "places": found.checksum,
        }
        return record if self.gather is None else {**record, "gather": self.gather}

    def manifest(self) -> dict[str, Any]:
        """Keys of capture.json beside the lights."""
        found = self._known
        names = {"objects": found.object_names} if found.object_names else {}
        links = {"pool": POOL_FILE, "links": GATHER_FILE, "bounces": int(found.bounces), **names}
        samples = {"samples": SAMPLES_FILE, "bounces": min(1, int(found.bounces))}
        return {
            "gather": links if self.gather is None else samples,
            "free_places": [[round(value, 6) for value in place] for place in found.free.tolist()],
            "scene_lights": found.scene_lights["lights"],
            **({"scene_profiles": found.scene_lights["profiles"]} if found.scene_lights.get("profiles") else {}),
            **({"scene_lights_left_out": found.scene_lights["left_out"]} if found.scene_lights["left_out"] else {}),
        }

    @property
    def sun_angle(self) -> float | None:
        """Angular diameter of the scene's brightest sun, rad; None where it has none."""
        return self._known.scene_lights["sun_angle"]

    def key(self, scene_sha256: str, tested: int, seed: int, scene: str | None = None) -> str:
        """What the surfaces and places found depend on; `scene`: which one of the .blend."""
        return json.dumps([scene_sha256, scene, self.question(tested, seed)])

    def write(self, path: Path, key: str = "") -> None:
        """For a bake that is resumed: `key` tells the bake that it is of."""
        with files.atomic_path(path) as temporary, open(temporary, "wb") as file:
            np.savez(file, key=np.array(key), **self._known.arrays())

    def read(self, path: Path, key: str) -> GatherSet:
        """With what a file holds that `write` wrote; unchanged where there is none, or one of another bake or damaged."""
        with suppress(OSError, ValueError, KeyError, zipfile.BadZipFile), np.load(path) as stored:
            if str(stored["key"]) == key and "names" in stored:
                return replace(self, found=FoundSurfaces.of_arrays(stored))
        return self

    def trace(self, receivers: Capture, seed: int, progress: Progress, say: Callable[[str], None] = lambda line: None) -> None:
        """Pool and links into the folder of `receivers`, a capture without lights; nothing where they are there already.

        `say` gets a line where light reaches almost nothing that the view shows. InputError where it shows no surface, or no surface that
        it gathers from reflects light.
        """
        found = self._known
        apart = found.apart
        parted = "" if apart is None else f" {hashlib.sha256(apart.tobytes()).hexdigest()}"
        key = f"{TRACED_BY} {found.checksum} {receivers.width}x{receivers.height} {self.count} {self.clusters} {seed}{parted}"
        if self.gather is not None:
            self._sample(receivers, f"{key} {self.gather} samples", seed, progress, say)
            return
        if is_gathered(receivers.folder, key):
            return
        progress(0, 1, "surfels")
        occluders = EmbreeTriangles(found.occluders)
        view = Receivers.of(receivers)
        pixels, lobes = PixelPoints.of_view(view), Lobes.of(view)
        _require_pixels(pixels)
        surfaces = Fragments(found.corners, found.albedo)
        warn_of_dark_view(pixels.points, pixels.normals, surfaces, occluders, found.free, seed, say)
        backs = None if found.transmission is None else points_behind(view)
        looks = [pixels] if backs is None else [pixels, backs]
        points, normals = np.concatenate([own.points for own in looks]), np.concatenate([own.normals for own in looks])
        asked = self.count
        while True:
            pool = pool_of(
                surfaces,
                found.objects,
                occluders,
                found.free,
                points,
                normals,
                asked,
                seed,
                lobes,
                found.transmission,
                found.gloss,
                apart,
            )
            total = pool.count + len(Behind.of(pool).surfels)
            if total <= MOST_POOL:
                break
            asked = int(FEWER * asked * MOST_POOL / total)
        if not pool.count:
            raise InputError("expected surfaces that light in free space can reach, found none; choose another `light_bounds`")
        clusters = cluster_count(self.clusters, len(np.unique(pixels.pixels)))
        operator = GatherOperator.traced(
            pool, pixels, occluders, clusters, seed, lambda n, total: progress(n, total, "gather rays"), lobes, backs
        )
        operator.write(receivers.folder, key)

    def _sample(self, receivers: Capture, key: str, seed: int, progress: Progress, say: Callable[[str], None]) -> None:
        """Gather samples in place of pool and links."""
        if is_sampled(receivers.folder, key):
            return
        assert self.gather is not None
        found, view = self._known, Receivers.of(receivers)
        pixels, surfaces = PixelPoints.of_centers(view), Fragments(found.corners, found.albedo)
        _require_pixels(pixels)
        progress(0, 1, "view clusters")
        warn_of_dark_view(pixels.points, pixels.normals, surfaces, EmbreeTriangles(found.occluders), found.free, seed, say)
        clusters = cluster_count(self.clusters, len(pixels.points), SAMPLED_CLUSTERS)
        samples = GatheredSamples.traced(
            surfaces, view, clusters, self.gather, seed, lambda done, total: progress(done, total, "gather samples")
        )
        samples.write(receivers.folder, key)


def _require_pixels(pixels: PixelPoints) -> None:
    if not len(pixels.points):
        raise InputError("expected surfaces in view, found none: every pixel is empty; turn the camera")


def readable(told: dict[str, Any]) -> dict[str, Any]:
    """The scene's own lights without those whose IES file is not read, which are left out with the reason."""
    profiles, faults = dict(told.get("profiles", {})), {}
    for name, text in told.get("profiles", {}).items():
        try:
            parse_ies(text.encode(), name)
        except InputError as error:
            faults[name] = str(error)
            del profiles[name]
    kept = [one for one in told["lights"] if one["light"].get("profile") not in faults]
    left = [{"name": one["name"], "reason": faults[one["light"]["profile"]]} for one in told["lights"] if one not in kept]
    return {**told, "lights": kept, "left_out": told["left_out"] + left, "profiles": profiles}


def _lines_of(told: dict[str, Any]) -> list[str]:
    """What is said of the scene's own lights: their names, and which of them are left out."""
    names = [repr(one["name"]) for one in told["lights"]]
    lines = [f"{len(names)} lights of the scene's own: {', '.join(names[:SHOWN])}{', …' if len(names) > SHOWN else ''}"] if names else []
    lines += [f"light {one['name']!r}: {one['note']}" for one in told["lights"] if "note" in one]
    return lines + [f"light {one['name']!r} is left out of the scene's lights: {one['reason']}" for one in told["left_out"]]
