"""The pool of a view: surfels over the whole scene, many where the view's gather rays look, that are lit once per light and frame."""

from __future__ import annotations

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float, Float32, Float64, Int
from srbf.solve.splitting import split_clusters
from srbf.visibility.embree import EmbreeTriangles
from srbf.visibility.glossy_gather import Lobes
from srbf.visibility.hemisphere import cosine_directions
from srbf.visibility.patches import parted
from srbf.visibility.surface_cells import DARK, OFFSET, Cells, Fragments, grouped_cells, lit
from srbf.visibility.surfels import GAP, Surfels, cut_at_walls

MOST_POOL = 65_536  # indices of surfels are 16 bits
LOOKS, LOOK_RAYS = 16_384, 64  # points of the view, and rays of each, by which it is known what the view gathers
LOBE_RAYS, LOBE_WEIGHT = 16, 2.0  # of a specular lobe, and what they count beside cosine rays of as much light
AGAIN, AGAIN_RAYS = 16_384, 16  # of their hits, which gather as well
EVENLY = 0.1  # share of the pool that goes by area, whatever the view sees
NORMAL_WEIGHT, ALBEDO_WEIGHT = 0.04, 0.02  # of the scene's longest side, beside places
WITNESSES = 64  # free places by which it is known what light reaches, beside what the view gathers from, and what a wall parts


def pool_of(
    surfaces: Fragments,
    objects: Int[ndarray, " T"],
    occluders: EmbreeTriangles,
    free: Float64[ndarray, "F 3"],
    points: Float[ndarray, "P 3"],
    normals: Float[ndarray, "P 3"],
    count: int,
    seed: int = 0,
    lobes: Lobes | None = None,
    transmission: Float32[ndarray, "T 3"] | None = None,
    gloss: Float32[ndarray, "T 3"] | None = None,
    apart: Int[ndarray, " T"] | None = None,
) -> Surfels:
    """At most about `count` surfels of all surfaces that light reaches, small where cosine rays from the view's `points` end.

    Fragments are split by k-means on place, normal and albedo, each weighing as many rays as end on it [Hasan2005]; none straddles a wall.
    `surfaces`: opaque triangles of any side, `objects` of each its object's number. A second bounce counts as well, and rays of specular
    `lobes` do, by what these reflect. `transmission`: what the triangles let through diffusely;
    `gloss`: what theirs reflects for lobes alone. `apart`: a number of each triangle; no surfel holds two.
    """
    surfaces, source = cut_at_walls(surfaces, occluders, GAP * float(np.sqrt(surfaces.areas.sum() / count)))
    objects = objects[source]
    kinds = np.zeros(2 * len(source), np.int64) if apart is None else np.tile(apart[source], 2)
    both = surfaces.both_sides()
    passed = None if transmission is None else np.tile(transmission[source], (2, 1))
    shines = None if gloss is None or not (gloss > 0).any() else np.tile(gloss[source], (2, 1))
    color = both.albedo + sum(part for part in (passed, shines) if part is not None)
    able = np.flatnonzero((color.max(axis=1) >= DARK) & (both.areas > 0))
    seen = looked_at(surfaces, points, normals, seed)
    gathered = (seen if lobes is None else seen + mirrored(surfaces, lobes, float(len(points)), seed))[able]
    witnesses = lit(both.centers[able], both.normals[able], occluders, free[:WITNESSES])
    found = witnesses.any(axis=1) | (gathered > 0)
    kept, gathered, witnesses = able[found], gathered[found], witnesses[found]
    owners = np.full(len(both.corners), -1, np.int64)
    if not len(kept):
        none, dark = Cells.of_image(np.zeros((2, 0, 4), np.float32)), np.zeros((0, 3), np.float32)
        return Surfels(none, surfaces.corners, owners.reshape(2, -1), np.zeros(0, np.int64), dark, np.zeros(0, bool))
    sides = both.at(kept)
    weight = gathered / max(float(gathered.sum()), 1e-30) + EVENLY * sides.areas / sides.areas.sum()
    scale = float(np.ptp(sides.centers, axis=0).max())
    features = np.concatenate([sides.centers, NORMAL_WEIGHT * scale * sides.normals, ALBEDO_WEIGHT * scale * sides.albedo], axis=1)
    through = np.zeros(len(kept), np.int64) if passed is None else (passed[kept].max(axis=1) >= DARK).astype(np.int64)

    def groups(most: int) -> Int[ndarray, " N"]:
        found = parted_groups(split_clusters(features, most, weight), witnesses)
        if passed is None and apart is None:
            return found
        return np.unique(np.column_stack([found, through, kinds[kept]]), axis=0, return_inverse=True)[1].ravel()

    asked = count
    owner = groups(asked)
    while owner.max() >= count and asked > 1:  # walls part some
        asked = max(1, asked - int(1.1 * (owner.max() + 1 - count)) - 1)
        owner = groups(asked)
    owners[kept] = owner
    of_surfel = _of_most_area(owner, np.concatenate([objects, objects])[kept], sides.areas)
    dark = np.zeros((len(of_surfel), 3), np.float32)
    own, specular = (
        None if part is None else grouped_cells(Fragments(sides.corners, part[kept].astype(np.float32)), owner).albedo
        for part in (passed, shines)
    )
    unseen = np.zeros(len(of_surfel), bool)
    return Surfels(grouped_cells(sides, owner), surfaces.corners, owners.reshape(2, -1), of_surfel, dark, unseen, own, specular)


def _of_most_area(owner: Int[ndarray, " N"], objects: Int[ndarray, " N"], areas: Float64[ndarray, " N"]) -> Int[ndarray, " S"]:
    """The object that has most of each surfel's area."""
    count = int(objects.max()) + 1
    pairs, number = np.unique(owner * count + objects, return_inverse=True)
    order = np.argsort(np.bincount(number.ravel(), areas), kind="stable")
    found = np.zeros(int(owner.max()) + 1, np.int64)
    found[pairs[order] // count] = pairs[order] % count  # the last has most
    return found


def looked_at(surfaces: Fragments, points: Float[ndarray, "P 3"], normals: Float[ndarray, "P 3"], seed: int = 0) -> Float64[ndarray, " U"]:
    """How many gather rays of the view end on each side, the fronts of all triangles before the backs; those of a second bounce, too."""
    rng = np.random.default_rng(seed)
    triangles, facing = EmbreeTriangles(surfaces.corners), surfaces.normals
    count = len(surfaces.corners)
    lift = OFFSET * float(np.ptp(surfaces.corners.reshape(-1, 3), axis=0).max(initial=0))
    found = np.zeros(2 * count)
    chosen = rng.permutation(len(points))[:LOOKS]
    starts, axes = np.asarray(points, np.float64)[chosen], np.asarray(normals, np.float64)[chosen]
    for rays in (LOOK_RAYS, AGAIN_RAYS):
        directions = cosine_directions(axes[:, None], rays, rng)[:, 0].reshape(-1, 3)
        origins = np.repeat(starts + lift * axes, rays, axis=0)
        triangle, distance, _ = triangles.first_hit(origins, directions)
        met = np.flatnonzero(triangle >= 0)
        back = np.einsum("nk,nk->n", facing[triangle[met]], directions[met]) > 0
        found += np.bincount(triangle[met] + count * back, minlength=2 * count)
        again = rng.permutation(len(met))[:AGAIN]
        hit = met[again]
        starts = origins[hit] + distance[hit, None] * directions[hit]
        axes = facing[triangle[hit]] * np.where(back[again], -1.0, 1.0)[:, None]
    return found


def mirrored(surfaces: Fragments, lobes: Lobes, pixels: float, seed: int = 0) -> Float64[ndarray, " U"]:
    """How much rays of specular lobes count on each side, as of `looked_at`, of a view of so many `pixels`."""
    rng = np.random.default_rng([seed, 1])
    chosen = rng.permutation(len(lobes.points))[:LOOKS]
    extent = float(np.ptp(surfaces.corners.reshape(-1, 3), axis=0).max(initial=0))
    origins, directions, shares = lobes.rays(chosen, LOBE_RAYS, rng, OFFSET * extent)
    strength = lobes.pixels.color[lobes.pixels.texels[chosen]].max(axis=1)
    weight = shares * strength[:, None] * LOOK_RAYS * min(LOOKS, pixels) * len(lobes.points) / pixels / max(1, len(chosen))
    triangle, _, _ = EmbreeTriangles(surfaces.corners).first_hit(origins.reshape(-1, 3), directions.reshape(-1, 3))
    met = np.flatnonzero(triangle >= 0)
    back = np.einsum("nk,nk->n", surfaces.normals[triangle[met]], directions.reshape(-1, 3)[met]) > 0
    count = len(surfaces.corners)
    return np.bincount(triangle[met] + count * back, LOBE_WEIGHT * weight.ravel()[met], minlength=2 * count)


def parted_groups(labels: Int[ndarray, " N"], seen: Bool[ndarray, "N F"]) -> Int[ndarray, " N"]:
    """Groups without parts that share no witness, as `parted`; groups that one witness sees whole stay as they are."""
    size = np.bincount(labels)
    whole = np.zeros(len(size), bool)
    for witness in seen.T:
        whole |= np.bincount(labels, witness, len(size)) == size
    whole |= np.bincount(labels, seen.any(axis=1), len(size)) == 0
    rest = np.flatnonzero(~whole[labels])
    if not len(rest):
        return labels
    result = np.unique(labels, return_inverse=True)[1].ravel().astype(np.int64)
    own = np.unique(labels[rest], return_inverse=True)[1].ravel()
    result[rest] = result.max() + 1 + parted(own, seen[rest])
    return np.unique(result, return_inverse=True)[1].ravel()
