# SPDX-License-Identifier: GPL-3.0-or-later
"""The frame of a light's profile, as `srbf.light_profile.axes_of` has it: x, y and the direction of a light from a direction and a roll."""

from __future__ import annotations

import math

from mathutils import Matrix, Vector

VERTICAL = 1e-6  # sine of the angle to the world's z, up to which a direction is straight up or down


def rotation(direction: Vector, roll: float) -> Matrix:
    """4 x 4: of an object that shines along its local -z; y as near to the world's z as it can be, then turned about local z by `roll`."""
    behind = -direction.normalized()
    vertical = math.hypot(behind.x, behind.y) < VERTICAL
    x = Vector((0, 1, 0) if vertical else (0, 0, 1)).cross(behind).normalized()
    level = Matrix((x, behind.cross(x), behind)).transposed().to_4x4()
    return level @ Matrix.Rotation(roll, 4, "Z")


def roll_of(direction: Vector, matrix: Matrix) -> float:
    """The roll (rad) of an object that shines along `direction`."""
    level = rotation(direction, 0.0).to_3x3()
    x = matrix.to_3x3().col[0].normalized()
    return math.atan2(x.dot(level.col[1]), x.dot(level.col[0]))
