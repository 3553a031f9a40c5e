"""Point sets on the sphere of directions: Hammersley, Fibonacci, their hemispheres by rejection, uniform random.

A direction is a unit vector (x, y, z) in Blender's world frame: right-handed, z up. Point sets are float64 `(n, 3)`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal, get_args

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float64
from srbf.errors import InputError

PointSet = Literal["hammersley", "hammersley3", "fibonacci"]
Domain = Literal["sphere", "hemisphere"]


def normalize(vectors: Float[ndarray, "*shape 3"]) -> Float64[ndarray, "*shape 3"]:
    """Unit vectors of `vectors`; InputError on one that is zero or not finite."""
    v = np.asarray(vectors, np.float64)
    with np.errstate(invalid="ignore"):  # an infinite one becomes NaN, and is refused
        v = v / np.maximum(np.abs(v).max(axis=-1, keepdims=True), 1e-300)  # so that no square over- or underflows
    length = np.linalg.norm(v, axis=-1, keepdims=True)
    if not np.isfinite(length).all() or (length < 1e-12).any():
        raise InputError(f"expected a direction of non-zero, finite length, found {np.asarray(vectors).tolist()}; give x,y,z not all zero")
    return v / length


def van_der_corput(n: int, base: int) -> Float64[ndarray, " n"]:
    """Radical inverses of 0 … n-1 in `base`: the digits mirrored about the point [Wong1997b, eq. 1-2]."""
    i = np.arange(n)
    value, digit_weight = np.zeros(n), 1.0 / base
    while i.any():
        value += (i % base) * digit_weight
        i //= base
        digit_weight /= base
    return value


def hammersley(n: int, base: int = 2) -> Float64[ndarray, "n 3"]:
    """n Hammersley points on the sphere: z = 2 vdC(i) - 1, azimuth = 2 pi (i + 1/2) / n.

    Base 2 is [Wong1997b]; the code that its authors released with [Wong2005] uses base 3.
    """
    return _from_z_and_azimuth(2 * van_der_corput(n, base) - 1, 2 * np.pi * (np.arange(n) + 0.5) / n)


def fibonacci(n: int) -> Float64[ndarray, "n 3"]:
    """n points of the spherical Fibonacci lattice: z from the top down, azimuth by the golden angle [Gonzalez2010]."""
    i = np.arange(n)
    golden_angle = np.pi * (3 - np.sqrt(5))
    return _from_z_and_azimuth(1 - (2 * i + 1) / n, golden_angle * i)


def all_around(domain: Domain, density: int = 2048) -> Float64[ndarray, "n 3"]:
    """Evenly spread directions of a domain, for integrals or errors over it: `density` Fibonacci points on a sphere."""
    points = fibonacci(density)
    return points if domain == "sphere" else points[points[:, 2] > 0]


POINT_SETS: dict[str, Callable[[int], np.ndarray]] = {
    "hammersley": lambda n: hammersley(n, base=2),
    "hammersley3": lambda n: hammersley(n, base=3),
    "fibonacci": fibonacci,
}


def point_set(kind: PointSet, k: int, domain: Domain) -> Float64[ndarray, "k 3"]:
    """Exactly k points of the set `kind` on the sphere or on the open hemisphere z > 0.

    The hemisphere is the rejection of [Wong2005]'s released code: the smallest n of the sphere set that leaves exactly k.
    """
    if kind not in POINT_SETS:
        raise InputError(f"expected a point set of {', '.join(POINT_SETS)}, found {kind!r}")
    if domain not in get_args(Domain):
        raise InputError(f"expected a domain of sphere, hemisphere, found {domain!r}")
    if k < 1:
        raise InputError(f"expected at least 1 direction, found {k}")
    generate = POINT_SETS[kind]
    if domain == "sphere":
        return generate(k)
    for n in range(k, 4 * k + 16):
        points = generate(n)
        above = points[points[:, 2] > 0]
        if len(above) == k:
            return above
    raise InputError(f"no {kind} set of the sphere leaves exactly {k} points above the horizon; choose another count")


def random_directions(n: int, domain: Domain, rng: np.random.Generator) -> Float64[ndarray, "n 3"]:
    """n directions, uniform in solid angle on the domain (z > 0 strictly on the hemisphere)."""
    u = 1 - rng.random(n)  # (0, 1]
    z = u if domain == "hemisphere" else 2 * u - 1
    return _from_z_and_azimuth(z, 2 * np.pi * rng.random(n))


def farthest_points(points: Float[ndarray, "n d"], count: int) -> list[int]:
    """At most `count` indices of points in any space, each the farthest from the previous ones; starts at the largest last coordinate.

    Every prefix covers the set within twice the optimal radius [Gonzalez1985]. Cost: n x count.
    """
    taken: list[int] = []
    distance = np.full(len(points), np.inf)
    chosen = int(np.argmax(points[:, -1])) if len(points) else 0
    while len(taken) < min(count, len(points)):
        taken.append(chosen)
        distance = np.minimum(distance, np.linalg.norm(points - points[chosen], axis=1))
        distance[taken] = -1  # below all others, equal ones too
        chosen = int(np.argmax(distance))
    return taken


def domain_of(directions: Float[ndarray, "n 3"]) -> Domain:
    """`hemisphere` if every direction has z > 0, else `sphere`."""
    return "hemisphere" if bool((np.asarray(directions)[:, 2] > 0).all()) else "sphere"


def nearest_neighbor_angles(points: Float[ndarray, "n 3"]) -> Float64[ndarray, " n"]:
    """Geodesic distance (rad) of every point to its nearest other point; pi for a single point. Cost: n x n."""
    points = np.asarray(points, np.float64)
    if len(points) < 2:
        return np.full(len(points), np.pi)
    cosines = points @ points.T
    np.fill_diagonal(cosines, -1)
    nearest = points[cosines.argmax(axis=1)]
    # The chord is accurate where acos of a cosine near 1 is not.
    return 2 * np.arcsin(np.clip(np.linalg.norm(points - nearest, axis=1) / 2, 0, 1))


def mean_spacing(points: Float[ndarray, "n 3"]) -> float:
    """Mean spacing (rad) of a point set: the mean geodesic distance of each point to its four nearest others.

    The pitch of a square lattice, and within 5 % of sqrt(area / n) for Hammersley and Fibonacci sets of some hundred points: 10.3
    degrees for 400 on the sphere, 7.4 on the hemisphere. It needs no area, so it also holds for a set on part of the sphere. pi for a
    single point. Cost: n x n.
    """
    points = np.asarray(points, np.float64)
    others = min(4, len(points) - 1)
    if others < 1:
        return float(np.pi)
    cosines = points @ points.T
    np.fill_diagonal(cosines, -np.inf)
    nearest = np.argpartition(-cosines, others - 1, axis=1)[:, :others]  # (n, 4)
    chords = np.linalg.norm(points[:, None] - points[nearest], axis=-1)
    return float((2 * np.arcsin(np.clip(chords / 2, 0, 1))).mean())


def octahedral_decode(u: Float[ndarray, "*shape"], v: Float[ndarray, "*shape"]) -> Float64[ndarray, "*shape 3"]:
    """Unit direction of octahedral coordinates in [-1, 1]: z > 0 inside the diamond |u| + |v| < 1 [Cigolle2014]."""
    x, y = np.asarray(u, np.float64), np.asarray(v, np.float64)
    z = 1 - np.abs(x) - np.abs(y)
    projected_x, projected_y = (1 - np.abs(y)) * _sign(x), (1 - np.abs(x)) * _sign(y)
    return normalize(np.stack([np.where(z < 0, projected_x, x), np.where(z < 0, projected_y, y), z], axis=-1))


def octahedral_encode(directions: Float[ndarray, "*shape 3"]) -> tuple[Float64[ndarray, "*shape"], Float64[ndarray, "*shape"]]:
    """Octahedral coordinates (u, v) of directions of any length but 0; (0, 0) for a zero vector."""
    d = np.asarray(directions, np.float64)
    d = d / np.maximum(np.abs(d).sum(axis=-1, keepdims=True), 1e-30)
    x, y, z = d[..., 0], d[..., 1], d[..., 2]
    return np.where(z < 0, (1 - np.abs(y)) * _sign(x), x), np.where(z < 0, (1 - np.abs(x)) * _sign(y), y)


def _sign(value: np.ndarray) -> np.ndarray:
    """+1 for zero, too, so that a fold has two sides only."""
    return np.where(value < 0, -1.0, 1.0)


def _from_z_and_azimuth(z: np.ndarray, azimuth: np.ndarray) -> np.ndarray:
    r = np.sqrt(np.maximum(0, 1 - z**2))
    return np.stack([r * np.cos(azimuth), r * np.sin(azimuth), z], axis=1)
