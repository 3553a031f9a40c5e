"""Error of direct light by rays and by shadow maps: true indirect images plus computed direct light against combined images, held out.

python benchmarks/direct.py INDIRECT_CAPTURE...
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np

from srbf.capture import COVERED, Capture
from srbf.evaluation.errors_by_role import PEAK_QUANTILE, PeakHistogram, psnr
from srbf.light_domain import light_of
from srbf.relighting.direct_light import Added


def main(folders: list[str]) -> None:
    """Print a line per capture and way."""
    for folder in folders:
        capture = Capture.open(Path(folder))
        combined, covered = capture.combined(), capture.coverage() >= COVERED
        peaks = PeakHistogram()
        for _, block in combined.blocks(capture.indices("train")):
            peaks.add(block[:, covered.ravel()])
        peak = peaks.quantile(PEAK_QUANTILE)
        for way in ("ray", "shadow-map"):
            figures, seconds = [], []
            with Added(capture, way) as added:
                for index in capture.indices("holdout"):
                    started = time.perf_counter()
                    direct = added.response([light_of(capture.lights[index])])
                    seconds.append(time.perf_counter() - started)
                    relit = np.maximum(capture.image(index) + direct, 0)[covered]
                    difference = relit - np.maximum(combined.image(index), 0)[covered]
                    figures.append(psnr(peak, float(np.sqrt((difference**2).mean()))))
            print(f"{folder}: {way} {np.mean(figures):.1f} dB, worst {np.min(figures):.1f}, {np.median(seconds):.2f} s per light")


if __name__ == "__main__":
    main(sys.argv[1:])
