# SPDX-License-Identifier: GPL-3.0-or-later
"""Which samples of Cycles' sequence a render takes: the first lies at the center of its texel or pixel, whatever the seed."""

from __future__ import annotations

import bpy


def take(scene: bpy.types.Scene, samples: int, seed: int, *, spread: bool) -> None:
    """Let the next render take `samples`: the first ones of the sequence, or, `spread`, as many after a power of two that holds them.

    Sample 0 lies at the center, every other one is jittered within the footprint (`integrator_init_from_bake`, `integrate_camera_sample`
    in Cycles), so without it passes of any size have one distribution and their mean is that of one long render. From a power of two on,
    so many samples are as well stratified as the first ones are.
    """
    cycles = scene.cycles
    offset = 1 << (samples - 1).bit_length() if spread else 0
    cycles.seed = seed
    cycles.sample_offset = offset
    if hasattr(cycles, "use_sample_subset"):
        cycles.use_sample_subset, cycles.sample_subset_length = spread, samples
        cycles.samples = offset + samples
    else:  # before 4.5 the offset alone
        cycles.samples = samples
