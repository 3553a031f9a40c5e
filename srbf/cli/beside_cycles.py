"""A relit picture beside a render by Cycles under the same lights: `srbf relight --reference`."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32
from srbf.asset import Asset
from srbf.bake.given_reference import changed_line, render_given
from srbf.cli.terminal import note, progress_bar
from srbf.errors import MissingLibraryError
from srbf.evaluation.errors_by_role import psnr
from srbf.evaluation.flip import Flip
from srbf.io.image import write_image
from srbf.light_entries import entry_with_file
from srbf.lights import Light

PEAK = 0.999  # quantile of the reference


def path_beside(output: Path) -> Path:
    """Where the render goes: OUT_cycles.exr."""
    return output.with_name(f"{output.stem}_cycles.exr")


def compare(
    asset: Asset,
    image: Float32[ndarray, "H W 3"],
    lights: Sequence[Light],
    scene: Path,
    samples: int,
    output: Path,
    blender: Path | None,
    exposure: float,
) -> None:
    """Render `lights` by Cycles, write that beside `output`, and tell the error of `image` over covered texels."""
    if (line := changed_line(asset, scene)) is not None:
        note(line)
    with progress_bar("Cycles") as update, tempfile.TemporaryDirectory(prefix="srbf-") as folder:
        entries = [entry_with_file(light, Path(folder), f"{number}") for number, light in enumerate(lights)]
        made = render_given(asset, scene, entries, samples, update, lambda line: None, blender, profiles=Path(folder))
    covered = asset.covered
    relit, reference = image[covered].astype(np.float64), made.image[covered].astype(np.float64)
    mean, power = ((relit - reference) ** 2).mean(), max((reference**2).mean(), 1e-30)
    ratio = psnr(float(np.quantile(reference, PEAK)), float(np.sqrt(mean)))
    try:
        flip = f", FLIP {Flip(exposure).error_map(made.image, image, covered)[covered].mean():.4f}"
    except MissingLibraryError:
        flip = ""
    write_image(path_beside(output), made.image, "float")
    note(f"wrote {path_beside(output)}: {samples} samples in {made.render_seconds:.1f} s, {made.seconds:.1f} s with opening the scene")
    note(f"relative rmse {np.sqrt(mean / power):.2%}, psnr {ratio:.2f} dB{flip}")
