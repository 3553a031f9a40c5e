"""One more pass of a light, added to a capture: its mean is published, then the running sum is written."""

from __future__ import annotations

from numpy import ndarray

from srbf.arrays import Float32
from srbf.bake.accumulation import NOTHING, Accumulation
from srbf.bake.images import CaptureImages
from srbf.bake.worker_pool import Response, Task


def add_pass(images: CaptureImages, accumulation: Accumulation, task: Task, response: Response) -> Float32[ndarray, "H W 3"] | None:
    """Add `response` to the light of `task`; returns the image that the capture then holds, before rounding.

    None where the light is not at the pass that `task` adds to: it is then rendered from where it is. BakeError for NaN or another size.
    """
    light = task.light
    if accumulation.passes(light) != task.before:
        return None
    total = accumulation.read(light) if task.before else NOTHING
    if total.passes != task.before:  # damaged since it was counted
        accumulation.forget(light)
        return None
    for image in (response.whole, response.direct):
        if image is not None:
            images.require_size(light, image)
    harmonics = None if response.toward is None else images.harmonics(light, response.toward)
    total = total.with_pass(task.samples, response.whole, response.direct, task.squares, harmonics)
    own = images.own_light(light, total.mean)
    images.publish(light, own, total.direct_mean, total.harmonics_mean)
    accumulation.write(light, total, task.keep, images.checksum(light))
    return own
