"""The stages of a bake under a cubemap, each a file that a resumed bake keeps: visibility, bounces, images of the lights that test them."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64, Int
from srbf.bake.surface_checks import warn_of_duplicates, warn_of_unlit
from srbf.capture import Capture
from srbf.channels import GLOSS
from srbf.compute.allocator import freed_memory_kept
from srbf.compute.full_precision import channel_products
from srbf.cubemap import Cubemap
from srbf.cubemap_transport import BOUNCES_FILE, TESTED_FILE, VISIBILITY_FILE, stored_arrays, write_arrays
from srbf.errors import InputError
from srbf.io import files
from srbf.io.image import write_image
from srbf.receiver_gloss import LEAST, ReceiverGloss
from srbf.receiver_images import MANIFEST
from srbf.sphere import random_directions
from srbf.visibility.distant_bounces import DistantBounces, Effort, Mixture, light_on_surfels, traced
from srbf.visibility.element_tracer import ElementTracer
from srbf.visibility.embree import EmbreeTriangles
from srbf.visibility.form_factors import RayOrigins
from srbf.visibility.lightmap_points import LightmapPoints
from srbf.visibility.receivers import Receivers
from srbf.visibility.refined_visibility import SampledVisibility, refined
from srbf.visibility.shadow_rays import RAY_OFFSET
from srbf.visibility.sparse_transport import sparsely_sampled
from srbf.visibility.surfels import Surfels

WORTHWHILE = 1 << 24  # elements, from which on `auto` samples a part of them
BLACK = 1e-4  # rms irradiance of bounces: less comes through the edges of closed meshes, by single rays
Progress = Callable[[int, int, str], None]


@dataclass(frozen=True, eq=False)
class Points:
    """R receivers of a capture: flat indices of their texels, where rays start (m), unit normals."""

    texels: Int[ndarray, " R"]
    starts: Float32[ndarray, "R 3"]
    normals: Float32[ndarray, "R 3"]

    @staticmethod
    def of(receivers: Receivers, is_lightmap: bool) -> Points:
        """Covered texels: their middles on the surface, or the vertices that they list. InputError where nothing is covered."""
        coverage = receivers.images["coverage"].ravel()
        texels = np.flatnonzero(coverage > 0)
        if not len(texels):
            raise InputError(
                "expected receivers, found none: no texel of the lightmap is covered; give the object a UV layer that has an area"
            )
        if is_lightmap:
            found = LightmapPoints(receivers, EmbreeTriangles(receivers.triangles.corners).first_hit).at(
                texels, np.full((len(texels), 2), 0.5)
            )
            places, normals = found.point + found.lift, found.normal
        else:
            places, normals = (receivers.images[name].reshape(-1, 3)[texels] for name in ("position", "normal"))
        unit = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
        offset = RAY_OFFSET * (1 + np.abs(places).max(axis=1, keepdims=True))
        return Points(texels, (places + offset * unit).astype(np.float32), unit.astype(np.float32))


@dataclass(eq=False)
class _Stages:
    """One run of the stages, in the folder of a capture without lights."""

    capture: Capture
    surfels: Surfels
    bounces: int | None
    cubemap: Cubemap
    sampling: str
    seed: int
    key: str
    progress: Progress
    say: Callable[[str], None]
    gloss: int | None

    @cached_property
    def receivers(self) -> Receivers:
        return Receivers.of(self.capture)

    @cached_property
    def points(self) -> Points:
        return Points.of(self.receivers, self.is_lightmap)

    @property
    def described(self) -> list[dict[str, Any]]:
        """Of each receiver what the manifest has."""
        described = [self.capture.manifest.get("receiver"), *self.capture.manifest.get("receivers", [])]
        return [one for one in described if one is not None]

    @property
    def is_lightmap(self) -> bool:
        return any(one["kind"] == "lightmap" for one in self.described)

    def warn(self, visibility: dict[str, ndarray], bounces: dict[str, ndarray]) -> None:
        """Lines for receivers that suit the bake badly."""
        reflected = np.linalg.norm(bounces["shapes"].astype(np.float32), axis=1)  # rms over the directions: weights have a mean square of 1
        is_lit = visibility["bits"].any(axis=1) | (reflected > BLACK)
        names = [repr(one["object"]) for one in self.described]
        what = names[0] if len(names) == 1 else f"{len(names)} objects"
        warn_of_unlit(is_lit, what, self.say)
        if self.gloss is not None and not (self.lobes.strength > LEAST).any():
            self.say(f"nothing of {what} is glossy: it looks the same from everywhere")
        if not self.is_lightmap:
            warn_of_duplicates(self.points.starts, self.points.normals, what, self.say)

    @cached_property
    def occluders(self) -> EmbreeTriangles:
        triangles = self.receivers.triangles
        if triangles.filters.any():
            self.say("translucent materials let all distant light through here: an element of a cubemap's visibility is seen or not")
        return EmbreeTriangles(triangles.corners[triangles.occluders])

    def tracer(self, directions: Float64[ndarray, "n 3"]) -> ElementTracer:
        return ElementTracer(self.points.starts, self.points.normals, directions.astype(np.float32), self.occluders)

    def visibility(self) -> dict[str, ndarray]:
        """Bits of all elements, and how many rays and seconds they took."""
        path = self.capture.folder / VISIBILITY_FILE
        if (stored := stored_arrays(path, self.key)) is not None:
            return stored
        began = time.process_time()
        tracer = self.tracer(self.cubemap.directions)
        elements = tracer.count * self.cubemap.count
        sampling = self.sampling if self.sampling != "auto" else "neighbors" if elements >= WORTHWHILE else "full"
        told = f"visibility, {elements / 1e6:.1f} million elements"

        def report(done: int, total: int) -> None:
            self.progress(done, total, told)

        if sampling == "full":
            found = SampledVisibility(tracer.all_seen(report), elements, 0.0)
        elif sampling == "neighbors":
            found = refined(tracer, self.cubemap, self.seed, report)
        else:
            found = sparsely_sampled(tracer, self.cubemap, self.seed, report, self.say)
        arrays: dict[str, ndarray] = {
            "bits": found.bits,
            "receivers": self.points.texels.astype(np.int32),
            "normals": self.points.normals,
            "rays": np.array(tracer.rays),
            "sampled": np.array(found.asked / elements),
            "error": np.array(found.error),
            "sampling": np.array(sampling),
            "cpu_seconds": np.array(time.process_time() - began),
        }
        write_arrays(path, self.key, **arrays)
        return arrays

    def reflected(self, sampling: str) -> dict[str, ndarray]:
        """Shapes and weights of the bounces, and how many rays and seconds they took."""
        path = self.capture.folder / BOUNCES_FILE
        if (stored := stored_arrays(path, self.key)) is not None:
            return stored
        began = time.process_time()
        count = len(self.points.texels)
        if self.bounces == 0 or not self.surfels.cells.albedo.any():
            bounces, mixture = DistantBounces.none(count, self.cubemap.count), Mixture.none(self.surfels.count)
        else:
            origins = RayOrigins.even(self.points.starts[:, None], self.points.normals[:, None])
            effort = Effort.full(count) if sampling == "full" else Effort.sparse()
            bounces, mixture = traced(
                self.surfels,
                origins,
                self.cubemap,
                self.occluders,
                self.bounces,
                effort,
                self.seed,
                lambda done, total: self.progress(done, total, "bounces"),
                self.gloss is not None,
            )
        arrays: dict[str, ndarray] = {
            "shapes": bounces.shapes.astype(np.float16),
            "weights": bounces.weights.astype(np.float16),
            "from_surfels": mixture.transfer.astype(np.float16),
            **({} if bounces.harmonics is None else {"harmonics": bounces.harmonics.astype(np.float16)}),
            "rays": np.array(bounces.rays),
            "cpu_seconds": np.array(time.process_time() - began),
        }
        write_arrays(path, self.key, **arrays)
        return arrays

    def tested(self, roles: tuple[int, int], bounces: dict[str, ndarray]) -> list[dict[str, Any]]:
        """Images of random distant lights by a ray from every receiver; the entries of the manifest."""
        directions = random_directions(sum(roles), "sphere", np.random.default_rng(self.seed))
        entries = [
            {
                "kind": "directional",
                "direction": direction,
                "role": "validation" if i < roles[0] else "holdout",
                "file": f"lights/{i:04d}.exr",
                **({"direct": f"direct/{i:04d}.exr"} if self.capture.transport == "indirect" else {}),
            }
            for i, direction in enumerate(directions.tolist())
        ]
        missing = [
            i
            for i, entry in enumerate(entries)
            if not all((self.capture.folder / entry[k]).is_file() for k in ("file", "direct") if k in entry)
        ]
        unknown = self.gloss is not None and stored_arrays(self.capture.folder / TESTED_FILE, self.key) is None
        if unknown:
            missing = list(range(len(entries)))
        if missing:
            tracer = self.tracer(directions[missing])
            bits = tracer.all_seen()
            seen = np.unpackbits(bits, axis=1, count=len(missing))
            direct = seen * np.maximum(tracer.normals @ tracer.directions.T, 0)
            lit = light_on_surfels(self.surfels, directions[missing], self.occluders)[0]
            weights = channel_products(bounces["from_surfels"].astype(np.float32), np.broadcast_to(lit[:, :, None], (*lit.shape, 3)))
            shapes = bounces["shapes"].astype(np.float32)
            if unknown:
                write_arrays(self.capture.folder / TESTED_FILE, self.key, bits=bits, weights=weights.transpose(1, 0, 2))
            straight_up = None
            if self.gloss is not None and "harmonics" in bounces:
                straight_up = self.lobes.of_bounces(self.points.normals)  # (R, K, 3)
            for number, i in enumerate(missing):
                gloss = 0.0
                if straight_up is not None:
                    gloss = np.einsum(
                        "krj,jc,rkc->rc", bounces["harmonics"].astype(np.float32), weights[:, number], straight_up, optimize=True
                    )
                self._write_tested(entries[i], direct[:, number], shapes @ weights[:, number], gloss)
                self.progress(number + 1, len(missing), "lights that test")
        return entries

    def _write_tested(
        self, entry: dict[str, Any], direct: Float32[ndarray, " R"], reflected: Float32[ndarray, "R 3"], gloss: ndarray | float
    ) -> None:
        """`gloss`: radiance of what lobes reflect of bounces."""
        white = np.repeat(direct[:, None], 3, axis=1).astype(np.float32)
        if "direct" in entry:
            write_image(self.capture.folder / entry["direct"], self._image(white), "half")
        else:
            reflected = reflected + white
        image = self._image(reflected)
        if self.gloss is not None:
            lit = np.flatnonzero(direct > 0)
            image.reshape(-1, 3)[self.points.texels] += gloss
            image.reshape(-1, 3)[self.points.texels[lit]] += self.lobes.from_above(lit, direct[lit].astype(np.float64))
        write_image(self.capture.folder / entry["file"], image, "half")

    @cached_property
    def lobes(self) -> ReceiverGloss:
        """Of the points."""
        glossy, lobe = (self.receivers.images[name].reshape(-1, 3)[self.points.texels] for name in GLOSS)
        return ReceiverGloss.of(glossy, lobe, self.points.normals)

    def _image(self, irradiance: Float32[ndarray, "R 3"]) -> Float32[ndarray, "H W 3"]:
        """In the capture's quantity; 0 where there is no receiver."""
        image = np.zeros((self.capture.height * self.capture.width, 3), np.float32)
        image[self.points.texels] = irradiance
        return image.reshape(self.capture.height, self.capture.width, 3) * self.receivers.reflectance()


@freed_memory_kept()
def trace_cubemap(
    capture: Capture,
    surfels: Surfels,
    bounces: int | None,
    checksum: str,
    cubemap: Cubemap,
    sampling: str,
    roles: tuple[int, int],
    seed: int,
    progress: Progress,
    say: Callable[[str], None],
    gloss: int | None = None,
) -> dict[str, Any]:
    """The files of a capture under `cubemap` into the folder of `capture`, which has no lights; the keys of its manifest.

    `checksum`: of what is known of the scene. `roles`: how many lights validate and are held out. `gloss`: how many terms its receivers'
    gloss shall have; they cost no ray.
    """
    key = f"{checksum} {capture.width}x{capture.height} {cubemap.side} {sampling} {seed}{'' if gloss is None else ' gloss'}"
    stages = _Stages(capture, surfels, bounces, cubemap, sampling, seed, key, progress, say, gloss)
    visibility = stages.visibility()
    chosen = str(visibility["sampling"])
    reflected = stages.reflected(chosen)
    stages.warn(visibility, reflected)
    entries = stages.tested(roles, reflected)
    rays, sampled, error = int(visibility["rays"]) + int(reflected["rays"]), float(visibility["sampled"]), float(visibility["error"])
    predicted = "" if chosen == "full" else f"; predicted error of direct light under suns {error:.2%}"
    millions = len(stages.points.texels) * cubemap.count / 1e6
    say(f"{chosen}: {sampled:.1%} of {millions:.1f} million elements, {rays / 1e6:.1f} million rays{predicted}")
    told = {
        "side": cubemap.side,
        "visibility": VISIBILITY_FILE,
        "bounces": BOUNCES_FILE,
        "sampling": chosen,
        "rays": rays,
        "sampled": sampled,
    }
    if chosen != "full":
        told["predicted_error"] = error
    if gloss is not None:
        told |= {"gloss": {"terms": gloss}, **({"tested": TESTED_FILE} if entries else {})}
    return {"cubemap": told, "lights": entries}


def totals(folders: Sequence[Path]) -> dict[str, Any] | None:
    """{rays, cpu_seconds, sampled} of captures under a cubemap together, over all runs of their bakes; None where none is one that is done.

    `sampled`: the share of all elements of their visibility that was asked for.
    """
    parts = [part for part in map(_totals, folders) if part is not None]
    if not parts:
        return None
    receivers, rays, seconds, sampled = (np.array(column) for column in zip(*parts, strict=True))
    share = float((receivers * sampled).sum() / receivers.sum())
    return {"rays": int(rays.sum()), "cpu_seconds": round(float(seconds.sum()), 2), "sampled": share}


def _totals(folder: Path) -> tuple[int, int, float, float] | None:
    """(receivers, rays, seconds, share sampled) of one capture."""
    if not (folder / MANIFEST).is_file():
        return None
    told = files.read_json(folder / MANIFEST).get("cubemap")
    visibility, bounces = (stored_arrays(folder / name) for name in (VISIBILITY_FILE, BOUNCES_FILE))
    if told is None or visibility is None or bounces is None:
        return None
    seconds = float(visibility["cpu_seconds"]) + float(bounces["cpu_seconds"])
    return len(visibility["receivers"]), int(told["rays"]), seconds, float(told["sampled"])
