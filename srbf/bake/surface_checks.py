"""What a bake of rays says of surfaces and receivers that suit it badly: without area, too many, black throughout, unseen, twice there."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float32, Float64
from srbf.errors import InputError
from srbf.visibility.embree import EmbreeTriangles
from srbf.visibility.hemisphere import cosine_directions
from srbf.visibility.surface_cells import DARK, OFFSET, Fragments, lit
from srbf.visibility.surfels import Surfels
from srbf.visibility.transfer_operator import TransferOperator

MANY = 500_000  # triangles, from which on surfels take minutes
MOST_SURFELS = 16_000  # form factors between them are kept as 16-bit numbers, and solved as a dense matrix
VIEWED, VIEW_RAYS = 512, 16  # points of a view that are looked at, and rays from each
WITNESSES = 64  # free places by which it is known what light reaches of what these rays meet
DARK_VIEW = 0.8  # share of these points without light, from which on it is said
BLIND = 0.2  # share of the receivers that see no surfel, from which on it is said


def warn_of_empty(surfaces: Fragments, say: Callable[[str], None]) -> None:
    """A line for triangles without area."""
    empty = int((surfaces.areas <= 0).sum())
    if empty:
        say(f"{empty} of {len(surfaces.corners)} triangles of the surfaces have no area and are left out")


def warn_of_surfaces(surfaces: Fragments, say: Callable[[str], None]) -> None:
    """A line for triangles without area, and one for a great many."""
    warn_of_empty(surfaces, say)
    if len(surfaces.corners) > MANY:
        say(
            f"the surfaces have {len(surfaces.corners):,} triangles: surfels of more than {MANY:,} take minutes and gigabytes of memory; "
            "hide from renders, or simplify, what is dense"
        )


def require_surfels(surfels: Surfels) -> None:
    """InputError where none reflects or emits, and where they are too many to exchange light."""
    cells = surfels.cells
    if not ((cells.albedo >= DARK).any() or surfels.emission.any()):
        raise InputError(
            "expected surfaces that reflect light around the free places, found none; choose another `light_bounds`, or make them diffuse"
        )
    if surfels.count > MOST_SURFELS:
        raise InputError(
            f"expected at most {MOST_SURFELS} surfels, found {surfels.count}: the surfaces are of very many small pieces; hide them from "
            "renders or join them, or bake `light_set=patches`"
        )


def warn_of_fewer(surfels: Surfels, spacing: float, most: int, say: Callable[[str], None]) -> None:
    """A line where surfels `spacing` meters apart would be more than `most`."""
    area = float(surfels.cells.areas.sum())
    if area / spacing**2 > most:
        say(
            f"`surfels_per_m2={spacing**-2:.6g}` asks for about {area / spacing**2:,.0f} surfels, more than the {most:,} that are made "
            f"at most: there are {surfels.count / area:.3g} per square meter"
        )


def warn_of_receivers(operator: TransferOperator, covered: Bool[ndarray, " P"], say: Callable[[str], None]) -> None:
    """A line where many of the `covered` receivers see no surfel; InputError where none sees one."""
    blind = covered & (np.diff(operator.receivers.indptr) == 0)
    share = float(blind.sum() / max(1, int(covered.sum())))
    advice = "are their normals turned inside out, or do they look out of the scene alone?"
    if share == 1:
        raise InputError(f"expected receivers that see surfaces which light reaches, found none; {advice}")
    if share > BLIND:
        say(f"{share:.0%} of the receivers see no surface that light reaches and stay black; {advice}")


def warn_of_dark_view(
    points: Float64[ndarray, "P 3"],
    normals: Float64[ndarray, "P 3"],
    surfaces: Fragments,
    occluders: EmbreeTriangles,
    free: Float64[ndarray, "F 3"],
    seed: int,
    say: Callable[[str], None],
) -> None:
    """A line where lights at free places reach almost none of a view's points, nor of what these see."""
    rng = np.random.default_rng(seed)
    chosen = rng.permutation(len(points))[:VIEWED]
    dark = chosen[~lit(points[chosen], normals[chosen], occluders, free).any(axis=1)]
    if len(dark) <= DARK_VIEW * len(chosen):
        return
    lift = OFFSET * float(np.ptp(surfaces.corners.reshape(-1, 3), axis=0).max(initial=0))
    directions = cosine_directions(normals[dark][:, None], VIEW_RAYS, rng)[:, 0].reshape(-1, 3)
    origins = np.repeat(points[dark] + lift * normals[dark], VIEW_RAYS, axis=0)
    triangle, distance, _ = EmbreeTriangles(surfaces.corners).first_hit(origins, directions)
    met = np.flatnonzero(triangle >= 0)
    facing = surfaces.normals[triangle[met]]
    facing = facing * np.where(np.einsum("nk,nk->n", facing, directions[met]) > 0, -1.0, 1.0)[:, None]
    hits = origins[met] + distance[met, None] * directions[met]
    reached = np.zeros(len(origins), bool)
    reached[met] = lit(hits, facing, occluders, free[:WITNESSES]).any(axis=1)
    if (~reached.reshape(-1, VIEW_RAYS).any(axis=1)).sum() > DARK_VIEW * len(chosen):
        say("the camera of the view sees almost nothing that light reaches: is it inside an object?")


def warn_of_unlit(is_lit: Bool[ndarray, " R"], what: str, say: Callable[[str], None]) -> None:
    """A line for receivers that no light reaches under any direction."""
    dark = int((~is_lit).sum())
    if dark:
        say(
            f"{dark} of {len(is_lit)} receivers of {what} see nothing and stay black: they lie inside geometry or touch it, or their "
            "normals point into it"
        )


def warn_of_duplicates(places: Float32[ndarray, "R 3"], normals: Float32[ndarray, "R 3"], what: str, say: Callable[[str], None]) -> None:
    """A line for vertices that are where another is, and face as it does."""
    count = len(places)
    twice = count - len(np.unique(np.concatenate([places, normals], axis=1), axis=0))
    if twice:
        say(f"{twice} of {count} receivers of {what} are where another is, with its normal: merge vertices by distance to trace each once")
