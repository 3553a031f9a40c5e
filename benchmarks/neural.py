"""Neural maps beside eigen maps and clusters of as many bytes: `python benchmarks/neural.py FOLDER… [--codes 9 12 16] [--steps 6000]`.

A FOLDER is a capture with held-out lights, or holds sets of `Dome/dirs.lp` and `Test/dirs.lp` anywhere below, values as stored, as SynthRTI
does. PSNR (dB) at the held-out lights, mean over images, of layers as bytes; by set and as means by top folder. Training takes
the processor time of `--steps`, never longer than `--time-limit` s a fit.
"""

from __future__ import annotations

import argparse
import sys
import time
import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from quality import MEMORY_BYTES, Method, head, imported, in_memory, light_lists, peak_of, row, scores_of

from srbf.capture import Capture
from srbf.captured_light import Role
from srbf.evaluation.rate_distortion import ALL, baselines, score_asset
from srbf.methods.clustered_eigen_map import ClusteredEigenMap
from srbf.methods.eigen_map import EigenMap
from srbf.methods.neural_map import NeuralMap
from srbf.receiver_images import MANIFEST

CLUSTERS = (16, 64, 256)


def sets_of(folder: Path) -> Iterator[tuple[str, str, Capture, float, Role]]:
    """(group, name, capture in memory, peak, role that is tested) of a capture, or of every set below a folder."""
    if (folder / MANIFEST).is_file():
        capture = Capture.open(folder)
        role: Role = "holdout" if capture.indices("holdout") else "validation"
        most = MEMORY_BYTES // (12 * len(capture.lights))
        yield folder.name, folder.name, in_memory(capture, most)[0], peak_of(capture), role
        return
    for dome in light_lists(folder)[0]:
        place = dome.parents[1].relative_to(folder)
        with imported(dome, dome.parents[1] / "Test" / "dirs.lp") as opened:
            sample, _ = in_memory(opened)
        yield place.parts[0] if place.parts else folder.name, place.as_posix(), sample, 1.0, "holdout"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sources", nargs="+", type=Path)
    parser.add_argument("--codes", nargs="+", type=int, default=[9, 12, 16], help="bytes per texel")
    parser.add_argument("--steps", type=int, default=NeuralMap.steps)
    parser.add_argument("--time-limit", type=float, default=NeuralMap.time_limit, help="seconds a training takes at most")
    wanted = parser.parse_args()
    found: dict[str, dict[str, list[float]]] = {}
    for source in wanted.sources:
        for group, name, capture, peak, role in sets_of(source):
            figures: dict[str, float] = {}
            for codes in wanted.codes:
                method = NeuralMap(codes=codes, steps=wanted.steps, time_limit=wanted.time_limit)
                started = time.perf_counter()
                asset = method.encode(capture)
                seconds = time.perf_counter() - started
                figures[f"neural map, {codes}"] = score_asset(asset, capture, role, peak).psnr
                steps = asset.manifest["source"]["fit"]["steps"]
                print(
                    f"{name}: {codes} codes, {steps} steps in {seconds:.0f} s, {figures[f'neural map, {codes}']:.2f} dB",
                    file=sys.stderr,
                    flush=True,
                )
                others: dict[str, Method] = {f"eigen map, {codes}": EigenMap(codes)}
                others |= {f"{c} clusters, {codes} with the index": ClusteredEigenMap(c, codes - 1) for c in CLUSTERS}
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    figures |= {title: scores_of(other, ("uint8",), capture, role, peak)[0].psnr for title, other in others.items()}
            figures |= {score.name: score.psnr for score in baselines(capture, role, peak) if score.name == ALL}
            print(f"{name}: " + ", ".join(f"{title} {value:.2f}" for title, value in figures.items()), file=sys.stderr, flush=True)
            for title, value in figures.items():
                found.setdefault(title, {}).setdefault(group, []).append(value)
    groups = list(dict.fromkeys(group for values in found.values() for group in values))
    head("method, bytes per texel", *(f"{group}, dB" for group in groups))
    for title, values in found.items():
        row(title, *(f"{np.mean(values[group]):.2f}" if group in values else "" for group in groups))
    return 0


if __name__ == "__main__":
    sys.exit(main())
