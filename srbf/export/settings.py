"""Settings and results of a target."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from srbf.asset import Asset
from srbf.errors import InputError
from srbf.stored_layers import LayerEncoding


@dataclass(frozen=True)
class Settings:
    """`encoding` of the layers, by default the target's own; mip `levels`, the full size included, `auto`: as many as charts allow.

    `mesh`: a .glb whose lightmap UV set an engine is to use, for targets that write a mesh.
    """

    encoding: LayerEncoding | None = None
    levels: Literal["auto"] | int = "auto"
    mesh: Path | None = None


PLAIN = Settings()


@dataclass(frozen=True)
class Written:
    """Notes on a folder that a target has filled, one line each."""

    notes: tuple[str, ...] = ()


Target = Callable[[Asset, Path, Settings], Written]  # fills an existing empty folder


def no_levels(settings: Settings, where: str) -> None:
    """InputError on mip levels for files that hold none."""
    if settings.levels not in ("auto", 0, 1):
        raise InputError(f"expected no mip levels in {where}, found `levels={settings.levels}`; export dds or ktx2")
