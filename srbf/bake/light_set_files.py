"""What a bake keeps of its scene beside the images: places, patches, form factors of surfels, and where probes are."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from srbf.bake.cubemap_set import CubemapSet
from srbf.bake.gather_set import GatherSet
from srbf.bake.light_sets import LIGHT_SET_FILE, PATCHES_FILE, CloudSet
from srbf.bake.settings import BakeSettings
from srbf.bake.surface_checks import warn_of_receivers
from srbf.capture import COVERED, Capture
from srbf.io.image import write_image
from srbf.visibility.receivers import Receivers
from srbf.visibility.transfer_operator import TransferOperator, is_traced


def write_light_set(folder: Path, settings: BakeSettings, identity: dict[str, Any]) -> None:
    """What a cloud knows of the scene: for a fit, and for a bake that is resumed. Again where it is gone or damaged."""
    light_set = settings.light_set
    if not isinstance(light_set, (CloudSet, GatherSet, CubemapSet)):
        return
    assert light_set.is_known
    patches, path = folder / PATCHES_FILE, folder / LIGHT_SET_FILE
    key = light_set.key(identity["scene_sha256"], settings.validation + settings.holdout, settings.seed, settings.scene)
    if isinstance(light_set, CubemapSet):
        if not light_set.with_surfels(replace(light_set.surfels, found=None)).read(path, key).is_known:
            light_set.write(path, key)
        return
    if isinstance(light_set, GatherSet):
        if not replace(light_set, found=None).read(path, key).is_known:
            light_set.write(path, key)
        return
    assert light_set.found is not None
    if not (patches.is_file() and replace(light_set, found=None).read(path, key).is_known):
        write_image(patches, light_set.found.patches.cells.image(), "float")
        light_set.write(path, key)


def write_probes(folder: Path, settings: BakeSettings) -> None:
    """Where the probes of a capture are, and how far they see."""
    if settings.receiver.probes is not None:
        settings.receiver.probes.write(folder)


def trace_operator(
    receivers: Capture, settings: BakeSettings, progress: Callable[[int, int, str], None], say: Callable[[str], None] = lambda line: None
) -> dict[str, Any]:
    """Form factors of surfels by rays, into the folder of `receivers`, a capture without lights; nothing where they are there already.

    Of a cubemap all that it holds of its lights. Returns keys of capture.json that only the traced rays tell.

    `say` gets a line where receivers see no surface that light reaches; InputError where none of them does.
    """
    light_set = settings.light_set
    if isinstance(light_set, CubemapSet):
        return light_set.trace(receivers, (settings.validation, settings.holdout), settings.seed, progress, say, settings.gloss)
    if isinstance(light_set, GatherSet):
        light_set.trace(receivers, settings.seed, progress, say)
    if not isinstance(light_set, CloudSet) or light_set.found is None or light_set.found.surfels is None:
        return {}
    key = f"{light_set.found.checksum} {settings.width}x{settings.height} {settings.seed}"
    if is_traced(receivers.folder, key):
        return {}
    operator = TransferOperator.traced(
        light_set.found.surfels,
        Receivers.of(receivers),
        settings.receiver.kind == "lightmap",
        settings.seed,
        lambda done, total: progress(done, total, "form factors"),
    )
    warn_of_receivers(operator, receivers.coverage().ravel() >= COVERED, say)
    operator.write(receivers.folder, key)
    return {}
