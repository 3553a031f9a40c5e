# SPDX-License-Identifier: GPL-3.0-or-later
"""Which samples of Cycles' sequence a render takes: the first is at the center of its texel or pixel, for any seed."""

from __future__ import annotations

import bpy


def take(scene: bpy.types.Scene, samples: int, seed: int, *, spread: bool) -> None:
    """Let the next render use `samples` samples: the first of the sequence, or with `spread` those from the next power of two on.

    Sample 0 is at the center, every other one is jittered within the footprint (`integrator_init_from_bake`, `integrate_camera_sample`
    in Cycles). Without sample 0, passes of any size have the same distribution, and their mean is that of one long render. From a power
    of two on, that many samples are as well stratified as the first ones.
    """
    cycles = scene.cycles
    offset = 1 << (samples - 1).bit_length() if spread else 0
    cycles.seed = seed
    cycles.sample_offset = offset
    if hasattr(cycles, "use_sample_subset"):
        cycles.use_sample_subset, cycles.sample_subset_length = spread, samples
        cycles.samples = offset + samples
    else:  # before 4.5 there is only the offset
        cycles.samples = samples
