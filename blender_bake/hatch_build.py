# SPDX-License-Identifier: GPL-3.0-or-later
"""Build hook: the demo's and the gallery's scenes of ../data/scenes go into `blender_bake/scenes`; those of the tests stay out."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

SCENES = (
    "caustics.py",
    "coin.py",
    "colored_room.py",
    "house.py",
    "interior.py",
    "lattice.py",
    "lightmap_charts.py",
    "loft.py",
    "loft_furniture.py",
    "staging.py",
    "still_life.py",
)


class ScenesHook(BuildHookInterface):
    """An sdist holds the scenes as `scenes/`; a wheel takes them from there, or from the checkout."""

    PLUGIN_NAME = "custom"

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Add the scenes to what is built; FileNotFoundError from hatchling where one is neither here nor in the checkout."""
        root = Path(self.root)
        if version == "editable" or (root / "scenes").is_dir():
            return
        target = "scenes" if self.target_name == "sdist" else "blender_bake/scenes"
        for name in SCENES:
            build_data["force_include"][str(root.parent / "data" / "scenes" / name)] = f"{target}/{name}"
