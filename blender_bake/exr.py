# SPDX-License-Identifier: GPL-3.0-or-later
"""Reading the multilayer EXR of a render: the Render Result itself has no pixels in Python."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from blender_bake.ipc import WorkerError


def read_passes(path: Path, names: tuple[str, ...]) -> dict[str, np.ndarray]:
    """The passes `names` as (H, W, 3 or 4) float32, row 0 at the top.

    Blender 4 writes one part with channels `ViewLayer.DiffCol.R`, Blender 5 one part per pass; both are read the same way.
    """
    try:
        import OpenImageIO as oiio  # comes with Blender
    except ImportError as error:
        raise WorkerError("reading Blender's renders needs OpenImageIO in Blender's Python: pip install OpenImageIO there") from error
    source = oiio.ImageInput.open(str(path))
    if source is None:
        raise WorkerError(f"expected Blender's render as an EXR, found {oiio.geterror()}")
    planes: dict[str, dict[str, np.ndarray]] = {}
    part = 0
    while source.seek_subimage(part, 0):
        spec = source.spec()
        pixels = np.asarray(source.read_image(part, 0, 0, spec.nchannels, oiio.FLOAT), np.float32)
        prefix = spec.get_string_attribute("oiio:subimagename")
        for i, channel in enumerate(spec.channelnames):
            words = (channel if "." in channel else f"{prefix}.{channel}").split(".")
            if len(words) >= 2:
                planes.setdefault(words[-2], {})[words[-1]] = pixels[:, :, i]
        part += 1
    source.close()
    passes = {}
    for name in names:
        found = planes.get(name) or planes.get(SHORT_NAMES.get(name, name))
        if found is None:
            raise WorkerError(f"expected the pass {name!r} in Blender's render, found {', '.join(sorted(planes))}")
        letters = "RGBA" if "R" in found else "XYZ"
        passes[name] = np.stack([found[letter] for letter in letters if letter in found], axis=2)
    return passes


SHORT_NAMES = {  # Blender 4
    "Diffuse Color": "DiffCol",
    "Diffuse Direct": "DiffDir",
    "Diffuse Indirect": "DiffInd",
    "Glossy Color": "GlossCol",
    "Glossy Direct": "GlossDir",
}
