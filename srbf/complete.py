"""Whole images of a capture whose lights have some texels only: what `srbf complete` writes."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32
from srbf.capture import Capture
from srbf.errors import InputError
from srbf.io import files
from srbf.io.image import HALF_MAX, write_image
from srbf.receiver_images import MANIFEST
from srbf.texel_interpolation import interpolation

LEFT_OUT = ("accumulation", "bake.json", "bake.log", ".scratch", ".lock", ".holder.json")  # a bake's own, which could no longer resume it


def complete(
    capture: Capture, folder: Path, force: bool = False, progress: Callable[[int, int, str], None] = lambda done, total, what: None
) -> int:
    """Write the capture with whole images: each texel that an image lacks is interpolated from those it has.

    Parameters
    ----------
    capture
        With lights that have a share of the texels, or a region of them.
    folder
        Becomes the whole capture; other files are copied.
    force
        Replace a capture that is there.
    progress
        Gets (lights done, all that lack texels, what).

    Returns
    -------
    int
        How many lights lacked texels.

    Raises
    ------
    InputError
        Where every image is whole, or `folder` is the capture's own.
    OutputExistsError
        Where the folder holds something, without `force`.
    ImageError
        On damaged images.

    Examples
    --------
    >>> from srbf.complete import complete
    >>> complete(capture, folder / "whole")
    Traceback (most recent call last):
    srbf.errors.InputError: expected lights with a share of the texels in ..., found none: it is whole already
    """
    parted = [i for i, light in enumerate(capture.lights) if light.share is not None or light.region is not None]
    if not parted:
        raise InputError(f"expected lights with a share of the texels in {capture.folder}, found none: it is whole already")
    if folder.resolve() == capture.folder.resolve():
        raise InputError(f"expected another folder than the capture's own, found {folder}; choose another `output`")
    own = {name for i in parted for name in capture.lights[i].files}
    with files.atomic_folder(folder, force, MANIFEST) as temporary:
        for path in sorted(capture.folder.rglob("*")):
            name = path.relative_to(capture.folder)
            if path.is_file() and name.as_posix() not in {*own, MANIFEST} and not set(name.parts) & set(LEFT_OUT):
                (temporary / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(path, temporary / name)
        for done, i in enumerate(parted):
            progress(done, len(parted), "lights")
            for file, image in _whole(capture, i).items():
                (temporary / file).parent.mkdir(parents=True, exist_ok=True)
                write_image(temporary / file, np.clip(image, -HALF_MAX, HALF_MAX), "half")
        progress(len(parted), len(parted), "lights")
        files.write_json(temporary / MANIFEST, _manifest(capture))
    return len(parted)


def _whole(capture: Capture, index: int) -> dict[str, Float32[ndarray, "H W 3"]]:
    """The images of a light by file, with all texels."""
    light = capture.lights[index]
    names = [name for name in (light.file, light.direct) if name is not None]
    if light.share is not None:
        one = replace(capture, lights=tuple(replace(light, file=name, direct=None) for name in names))
        return {name: one.image(i) for i, name in enumerate(names)}
    known = capture.region(index)
    assert known is not None
    to_all = interpolation(known, capture.coverage(), capture.channel("position"), capture.channel("normal"))
    parts = {}
    for name in names:
        part = replace(capture, lights=(replace(light, file=name, direct=None),)).partial_image(0)[0]
        parts[name] = (to_all @ part[known]).reshape(capture.height, capture.width, 3)
    return parts


def _manifest(capture: Capture) -> dict[str, Any]:
    entries = [{key: value for key, value in entry.items() if key not in ("share", "region")} for entry in capture.manifest["lights"]]
    return {**capture.manifest, "lights": entries}
