"""Light linking by triangles: which of a scene's a light shines on, and which shadow it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Int
from srbf.errors import InputError
from srbf.io.scene_glb import Triangles
from srbf.light_linking import Objects, choices_of


def lit_triangles(triangles: Triangles, light: object) -> Bool[ndarray, " T"] | None:
    """Which triangles a light shines on; None: on all. InputError where nobody knows their objects."""
    choice = choices_of(light).get("receivers")
    return None if choice is None else _chosen(triangles, choice)


def casting(triangles: Triangles, blockers: Objects | None) -> Triangles:
    """The triangles, of which those of the chosen objects alone cast shadows."""
    return triangles if blockers is None else replace(triangles, casts=triangles.casts & _chosen(triangles, blockers))


def lit_at(lit: Bool[ndarray, " T"] | None, triangle: Int[ndarray, " n"]) -> Bool[ndarray, " n"]:
    """Of points on some triangles, -1 of none, whether these are lit."""
    return np.ones(len(triangle), bool) if lit is None else lit[triangle] | (triangle < 0)


def _chosen(triangles: Triangles, choice: Objects) -> Bool[ndarray, " T"]:
    if triangles.objects is None:
        raise InputError("expected triangles of known objects for a light with `receivers` or `blockers`, found none; bake again")
    return choice.among(triangles.names)[triangles.objects]
