"""`python benchmarks/transfer_frame.py ASSET`: CPU time per frame of a transfer asset's products, from light on surfels to functions.

What a frame asks of the CPU where an engine lays its lights on the surfels, whatever their number: the weights of the shapes, then those of
the components. Without the surfels' direct light, and without the pixels. Run it with OPENBLAS_NUM_THREADS=1 for the time of one core.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from srbf.asset import Asset
from srbf.compute.full_precision import by_channel, times_columns
from srbf.methods.surfel_tables import sizes_of, weights_of_shapes

FRAMES = 300


def milliseconds(work: Callable[[], object]) -> tuple[float, float]:
    """(wall, processor time) of a run, in the mean over FRAMES."""
    work()
    wall, busy = time.perf_counter(), time.process_time()
    for _ in range(FRAMES):
        work()
    return 1e3 * (time.perf_counter() - wall) / FRAMES, 1e3 * (time.process_time() - busy) / FRAMES


def main() -> None:
    """Print a row per product."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("asset", type=Path)
    asset = Asset.open(parser.parse_args().asset)
    rank, surfels = sizes_of(asset)
    light = np.random.default_rng(1).random((surfels, 3))
    weights = weights_of_shapes(asset, light).astype(np.float32)
    values = by_channel(asset.tables["light_values"])
    print(f"{'product':>10}{'from':>8}{'to':>8}{'wall, ms':>10}{'CPU, ms':>10}")
    for name, begin, end, work in (
        ("shapes", surfels, rank, lambda: weights_of_shapes(asset, light)),
        ("functions", rank, values.shape[1], lambda: times_columns(values[0], weights)),
    ):
        wall, busy = milliseconds(work)
        print(f"{name:>10}{begin:>8}{end:>8}{wall:>10.2f}{busy:>10.2f}", flush=True)


if __name__ == "__main__":
    main()
