"""Error, bytes, method: `python benchmarks/quality.py [CAPTURE | FOLDER]…`; without any, on smooth analytic scenes.

A CAPTURE with held-out lights gets the held-out PSNR of every method against its bytes per texel. A FOLDER of photographs or renders
with light lists, values as stored, gets one of two tables: if `…/Dome/dirs.lp` has a `…/Test/dirs.lp` beside it, as in SynthRTI, the
first is fitted and the second tested, and sets are averaged by their top folder; any other `dirs.lp`, as in RealRTI, is tested by
leave-one-out. Tables are Markdown. Exit status 1 if a target is missed.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import get_args

import numpy as np

from srbf.asset import Asset
from srbf.capture import COVERED, Capture
from srbf.captured_light import Role
from srbf.encode.quantization import quantize
from srbf.evaluation.errors_by_role import PEAK_QUANTILE, PeakHistogram
from srbf.evaluation.leave_one_out import leave_one_out
from srbf.evaluation.rate_distortion import ALL, NEAREST, Score, baselines, planes_bound, score_asset, spectrum
from srbf.importing.photographs import LightListImport
from srbf.io import files
from srbf.io.image import Encoding, write_image
from srbf.methods.clustered_eigen_map import TEXELS_PER_CLUSTER, ClusteredEigenMap
from srbf.methods.eigen_map import EigenMap
from srbf.methods.relighting_map import RelightingMap
from srbf.receiver_images import MANIFEST, Quantity
from srbf.sphere import domain_of, normalize, point_set
from srbf.stored_layers import layer_entries

Method = RelightingMap | EigenMap | ClusteredEigenMap

ENCODINGS: tuple[Encoding, ...] = ("float", "half", "uint8")
MEMORY_BYTES = 2 << 30  # of responses; larger captures use a random sample of texels
BYTE_LOSS = 0.3  # dB that planes of bytes may lose against float ones
MEAN_SPREAD = "relighting map, k = 25, Hammersley, spread mean"
SMALL, BELOW_ALL = 20, 0.2  # bytes per texel that must come within so many dB of all images interpolated, under a hard sun
HARD_SUN_MAPS = 21.0  # dB of the relighting map, k = 25, under a hard sun
ABOVE_MEAN = 8.0  # dB of 28 components above Hammersley centers and the `mean` spread, on the smooth scene
WORSE = 0.1  # dB that more components may lose in leave-one-out
SIX = {f"{kind}/Object{i + 1}/material{3 * i + 1 + (kind == 'Multi')}" for kind in ("Single", "Multi") for i in range(3)}

PAPER = {f"relighting map, k = {k}": RelightingMap(k) for k in (25, 35)}
PTM = {"PTM": RelightingMap(6, basis="ptm")}
HSH = {f"hemispherical harmonics, order {n}": RelightingMap((n + 1) ** 2, basis="hemispherical-harmonics") for n in (2, 3)}
SH = {f"spherical harmonics, order {n}": RelightingMap((n + 1) ** 2, basis="spherical-harmonics") for n in (2, 3)}
CLUSTERED = {f"clustered eigen map, {c} × {s}": ClusteredEigenMap(c, s) for c, s in ((64, 8), (128, 12), (256, 16))}


def eigen(*counts: int) -> dict[str, Method]:
    """Eigen maps by name."""
    return {f"eigen map, {count} components": EigenMap(count) for count in counts}


LIGHT_LIST_METHODS: dict[str, Method] = {**eigen(9, 27, 48), **PAPER, **PTM, **HSH}
LEFT_OUT_METHODS: dict[str, Method] = {**eigen(9, 27, 48), **PAPER}
BARS: dict[str, dict[str, tuple[float, float]]] = {  # dB of single- and of multi-material sets
    "six": dict(zip(LIGHT_LIST_METHODS, ((36.6, 29.2), (37.9, 31.0), (38.1, 31.3), (37.3, 31.1), (37.8, 31.4)), strict=False)),
    "all": dict(zip(LIGHT_LIST_METHODS, ((33.1, 25.9), (34.7, 28.1), (35.0, 28.5), (33.6, 27.6), (34.6, 28.5)), strict=False)),
}
LEFT_OUT_ITEMS, LEFT_OUT_MAPS, LEFT_OUT_BEST = 12, 32.1, 32.6  # the mean of so many photographed items: k = 25, the best method


@dataclass
class Bars:
    """The targets, and whether they were reached."""

    missed: int = 0

    def at_least(self, found: float, bar: float) -> str:
        """The verdict for a cell."""
        reached = round(found, 2) >= round(bar, 2)
        self.missed += not reached
        return f"≥ {bar:.1f} {'pass' if reached else 'MISS'}"

    def loss(self, lost: float) -> str:
        """A byte encoding's loss (dB), and whether it is within BYTE_LOSS."""
        reached = round(lost, 2) <= BYTE_LOSS
        self.missed += not reached
        return f"{lost:.2f}{'' if reached else ' MISS'}"


@dataclass
class Means:
    """Figures of many sets, by method and encoding, to be averaged."""

    values: dict[tuple[str, str], list[float]] = field(default_factory=dict)

    def add(self, name: str, encoding: str, value: float) -> None:
        self.values.setdefault((name, encoding), []).append(value)

    def of(self, name: str, encoding: str) -> float:
        return float(np.mean(self.values[name, encoding]))


def scores_of(method: Method, encodings: Sequence[Encoding], capture: Capture, role: Role, peak: float) -> list[Score]:
    """A score per encoding. Planes are fitted once and rounded; relighting maps, whose ridge depends on the rounding, once per encoding."""
    scores: list[Score] = []
    asset: Asset | None = None
    for encoding in encodings:
        started = time.perf_counter()
        if asset is None or isinstance(method, RelightingMap):
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                asset = replace(method, encoding=encoding if isinstance(method, RelightingMap) else "float").encode(capture)
            seconds = time.perf_counter() - started
        if asset.encoding == encoding:
            shown = asset
        else:
            stored, scale, bias = quantize(asset.coefficients(slice(None)), encoding)
            manifest = {**asset.manifest, "planes": layer_entries("plane", encoding, scale, bias)}
            shown = replace(asset, manifest=manifest, stored=stored, scale=scale, bias=bias)
        scores.append(score_asset(shown, capture, role, peak, seconds))
    return scores


def components_of(method: Method) -> int:
    """Numbers per texel."""
    return 3 * method.k if isinstance(method, RelightingMap) else method.components


def row(*cells: object) -> None:
    print("| " + " | ".join(str(cell) for cell in cells) + " |", flush=True)


def head(*cells: str) -> None:
    print()
    row(*cells)
    row(*("---" for _ in cells))


def note(line: str) -> None:
    print(line, file=sys.stderr, flush=True)


def in_memory(capture: Capture, most: int | None = None) -> tuple[Capture, str]:
    """The covered texels of a capture, or as many as memory or `most` allows, and a text about them."""
    covered = np.flatnonzero(capture.coverage().ravel() >= COVERED)
    most = min(most or len(covered), max(1, MEMORY_BYTES // (12 * len(capture.lights))))
    if len(covered) <= most:
        return capture.load(covered), f"{len(covered)} texels"
    chosen = np.sort(np.random.default_rng(0).choice(covered, most, replace=False))
    return capture.load(chosen), f"{most} of {len(covered)} texels"


def peak_of(capture: Capture) -> float:
    """As in `srbf evaluate`: 1 for bytes, else the quantile of the combined train responses."""
    if capture.source_bits == 8:
        return 1.0
    combined = capture.combined()
    covered = combined.coverage().ravel() >= COVERED
    peaks = PeakHistogram()
    for _, block in combined.blocks(combined.indices("train")):
        peaks.add(block[:, covered])
    return peaks.quantile(PEAK_QUANTILE)


def methods_for(capture: Capture, texels: int) -> dict[str, Method]:
    """The methods of a capture's table: clusters if there are enough texels, hemispherical functions if all lights are above."""
    clustered = {name: method for name, method in CLUSTERED.items() if method.clusters * TEXELS_PER_CLUSTER <= texels}
    above = {**HSH, **PTM} if domain_of(capture.directions(capture.indices("train"))) == "hemisphere" else {}
    return {**PAPER, **eigen(9, 16, 28, 48), **clustered, **SH, **above}


def capture_table(capture: Capture, title: str, bars: Bars, smooth: bool = False) -> None:
    """Every method at float, half and byte planes, and the images themselves, at the lights of the last role."""
    role: Role = "holdout" if capture.indices("holdout") else "validation"
    if not capture.indices(role):
        left_out_table([(title, capture)], None, bars)
        return
    peak = peak_of(capture)
    sample, texels = in_memory(capture)
    train, unseen = len(sample.indices("train")), len(sample.indices(role))
    print(f"\n{title}: {train} lights fitted, {unseen} {role} lights tested, {texels}, peak {peak:.4g}")
    head(
        "method",
        "components per texel",
        "float, dB",
        "bytes as half",
        "half, dB",
        "bytes as uint8",
        "uint8, dB",
        "loss, dB",
        "seconds",
        "bar",
    )
    images = {score.name: score for score in baselines(sample, role, peak)}
    hard = _hard_sun(capture)
    small: list[tuple[float, float, str]] = []
    found: dict[str, float] = {}
    methods = methods_for(capture, sample.width)
    if smooth:
        methods[MEAN_SPREAD] = RelightingMap(25, centers="hammersley", spread="mean")
    for name, method in methods.items():
        scores = scores_of(method, ENCODINGS, sample, role, peak)
        exact, half, byte = scores
        found[name] = exact.psnr
        small += [(s.psnr, s.bytes_per_texel, f"{name}, {e}") for e, s in zip(ENCODINGS, scores, strict=True) if s.bytes_per_texel <= SMALL]
        bar = bars.at_least(half.psnr, HARD_SUN_MAPS) if hard and name == "relighting map, k = 25" else ""
        figures = (f"{half.bytes_per_texel:.0f}", f"{half.psnr:.2f}", f"{byte.bytes_per_texel:.0f}", f"{byte.psnr:.2f}")
        loss = bars.loss(exact.psnr - byte.psnr)
        row(name, components_of(method), f"{exact.psnr:.2f}", *figures, loss, f"{half.seconds:.1f}", bar)
    for name in (NEAREST, ALL):
        size = f"{images[name].bytes_per_texel:.0f}"
        row(name, 3 * train, f"{images[name].psnr:.2f}", size, "", "", "", "", "", "")
    if small:
        best, bytes_of_best, name = max(small)
        verdict = f": {bars.at_least(best, images[ALL].psnr - BELOW_ALL)}" if hard else ""
        print(f"\nAt most {SMALL} bytes per texel: {name}, {bytes_of_best:.0f} bytes, {best:.2f} dB{verdict}")
    if smooth:
        above = found["eigen map, 28 components"] - found[MEAN_SPREAD]
        bound = float(planes_bound(spectrum(sample), 3 * train * sample.width, peak)[28])
        print(f"\n28 components above {MEAN_SPREAD}: {above:.2f} dB, {bars.at_least(above, ABOVE_MEAN)}")
        print(f"The best 28 components of the train responses themselves: {bound:.2f} dB")


def _hard_sun(capture: Capture) -> bool:
    """Whether a lightmap was baked under a hard sun, for which there are bars."""
    settings = capture.manifest.get("source", {}).get("settings", {})
    lightmap = capture.manifest.get("receiver", {}).get("kind") == "lightmap"
    return lightmap and settings.get("sun_angle") == 0 and len(capture.indices("train")) >= 400 and capture.transport == "combined"


def dome_table(root: Path, domes: Sequence[Path], bars: Bars) -> None:
    """Sets of dome and test lights, averaged by their top folder."""
    groups: dict[str, Means] = {}
    names = set()
    counts: dict[str, int] = {}
    lights: set[tuple[int, int]] = set()
    for dome in domes:
        place_of_set = dome.parents[1].relative_to(root)
        group = place_of_set.parts[0] if place_of_set.parts else root.name
        names.add(place_of_set.as_posix())
        counts[group] = counts.get(group, 0) + 1
        means = groups.setdefault(group, Means())
        with imported(dome, dome.parents[1] / "Test" / "dirs.lp") as capture:
            sample, _ = in_memory(capture)
        lights.add((len(sample.indices("train")), len(sample.indices("holdout"))))
        for method_name, method in LIGHT_LIST_METHODS.items():
            exact, byte = scores_of(method, ("float", "uint8"), sample, "holdout", 1.0)
            means.add(method_name, "float", exact.psnr)
            means.add(method_name, "uint8", byte.psnr)
        for score in baselines(sample, "holdout", 1.0):
            means.add(score.name, "float", score.psnr)
        line = ", ".join(f"{n} {means.values[n, 'float'][-1]:.2f}" for n in (*LIGHT_LIST_METHODS, NEAREST, ALL))
        note(f"{place_of_set}: {line}")
    wanted = BARS["six"] if names == SIX else BARS["all"] if (counts.get("Single"), counts.get("Multi")) == (24, 27) else {}
    order = sorted(groups, reverse=True)  # Single before Multi, as their bars are
    sets = ", ".join(f"{counts[group]} of {group}" for group in order)
    print(f"\n{len(domes)} sets ({sets}); lights fitted and tested: {', '.join(f'{a} and {b}' for a, b in sorted(lights))}")
    columns = [text for group in order for text in (f"{group}, dB", "bytes, dB", "loss, dB", "bar")]
    head("method", "components per pixel", *columns)
    for name, method in LIGHT_LIST_METHODS.items():
        cells = []
        for place, group in enumerate(order):
            mean, rounded = groups[group].of(name, "float"), groups[group].of(name, "uint8")
            bar = bars.at_least(mean, wanted[name][place]) if name in wanted else ""
            cells += [f"{mean:.2f}", f"{rounded:.2f}", bars.loss(mean - rounded), bar]
        row(name, components_of(method), *cells)
    for name in (NEAREST, ALL):
        cells = [text for group in order for text in (f"{groups[group].of(name, 'float'):.2f}", "", "", "")]
        row(name, "/".join(str(3 * a) for a, _ in sorted(lights)), *cells)


def left_out_table(items: Sequence[tuple[str, Capture | Path]], most: int | None, bars: Bars) -> None:
    """Leave-one-out over the lights of each capture; `most` texels of each."""
    means = Means()
    titles, said = [], []
    for title, source in items:
        if isinstance(source, Capture):
            sample, texels = in_memory(source, most)
        else:
            with imported(source) as capture:
                sample, texels = in_memory(capture, most)
        titles.append(title)
        said.append(f"{title}: {len(sample.indices('train'))} lights, {texels}")
        for name, method in LEFT_OUT_METHODS.items():
            for encoding in ("float", "uint8"):
                fit = replace(method, encoding=encoding)
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    means.add(name, encoding, leave_one_out(sample, fit.encode)["leave_one_out"]["psnr"])
            note(f"{title}, {name}: {means.values[name, 'float'][-1]:.2f}, as bytes {means.values[name, 'uint8'][-1]:.2f}")
    print(f"\nEvery light left out once. {'; '.join(said)}")
    head("method", "components per pixel", *(f"{title}, dB" for title in titles), "mean, dB", "bytes, mean, dB", "loss, dB", "bar")
    whole = len(items) == LEFT_OUT_ITEMS
    for name, method in LEFT_OUT_METHODS.items():
        exact, byte = means.of(name, "float"), means.of(name, "uint8")
        bar = bars.at_least(exact, LEFT_OUT_MAPS) if whole and name == "relighting map, k = 25" else ""
        each = (f"{value:.2f}" for value in means.values[name, "float"])
        row(name, components_of(method), *each, f"{exact:.2f}", f"{byte:.2f}", bars.loss(exact - byte), bar)
    if whole:
        print(f"\nBest: {bars.at_least(max(means.of(name, 'float') for name in LEFT_OUT_METHODS), LEFT_OUT_BEST)}")
    for names in (list(eigen(9, 27, 48)), list(PAPER)):
        falls = np.diff([means.values[name, "float"] for name in names], axis=0)  # (steps, items)
        reached = float(falls.min()) >= -WORSE
        bars.missed += not reached
        print(
            f"\nMore of {names[0].split(',')[0]}, least gain of an item: {falls.min():+.2f} dB, ≥ -{WORSE} {'pass' if reached else 'MISS'}"
        )


class imported:
    """A light list, and one of held-out lights, as a capture in a temporary folder; values as stored."""

    def __init__(self, lights: Path, unseen: Path | None = None) -> None:
        self._settings = LightListImport(lights, "linear", unseen)

    def __enter__(self) -> Capture:
        self._folder = tempfile.TemporaryDirectory()
        folder = Path(self._folder.name) / "capture"
        self._settings.write(folder)
        return Capture.open(folder)

    def __exit__(self, *error: object) -> None:
        self._folder.cleanup()


def smooth_capture(folder: Path, quantity: Quantity, lights: int = 300, unseen: int = 60, side: int = 96) -> Capture:
    """A bumpy floor under three balls whose shadows have penumbrae of half a radian; held-out lights uniform on the hemisphere.

    Its colors vary from texel to texel. They are in its radiance, which needs more joint-color components, not in its irradiance.
    """
    (folder / "lights").mkdir(parents=True)
    rng = np.random.default_rng(0)
    z, turn = rng.random(unseen), 2 * np.pi * rng.random(unseen)
    random = np.stack([np.sqrt(1 - z**2) * np.cos(turn), np.sqrt(1 - z**2) * np.sin(turn), z], axis=1)
    y, x = np.mgrid[1 : -1 : side * 1j, -1 : 1 : side * 1j]
    heights = 0.05 * np.sin(7 * x) * np.cos(5 * y)
    slope_y, slope_x = np.gradient(heights, -2 / side, 2 / side)
    normals = normalize(np.stack([-slope_x, -slope_y, np.ones_like(x)], axis=2))
    albedo = np.stack([0.5 + 0.3 * np.sin(9 * x), 0.5 + 0.3 * np.sin(8 * y), 0.5 + 0.2 * np.cos(6 * x * y)], axis=2)
    if quantity == "irradiance":
        albedo = np.ones_like(albedo)
    balls = [_seen_ball(x, y, heights, np.array(at), radius) for at, radius in _BALLS]
    entries = []
    for i, direction in enumerate(np.concatenate([point_set("hammersley", lights, "hemisphere"), random])):
        lit = np.maximum(normals @ direction, 0)
        for towards, size in balls:
            t = np.clip((np.arccos(np.clip(towards @ direction, -1, 1)) - size) / 0.5 + 0.5, 0, 1)
            lit = lit * t**2 * (3 - 2 * t)
        file = f"lights/{i:04d}.exr"
        write_image(folder / file, (lit[:, :, None] * albedo).astype(np.float32), "half")
        entries.append({"kind": "directional", "direction": direction.tolist(), "role": "train" if i < lights else "holdout", "file": file})
    manifest = {"format": "srbf-capture", "version": 1, "quantity": quantity, "width": side, "height": side, "lights": entries}
    files.write_json(folder / MANIFEST, manifest)
    return Capture.open(folder)


_BALLS = (((0.3, 0.2, 0.5), 0.2), ((-0.4, 0.3, 0.4), 0.15), ((0.0, -0.5, 0.6), 0.25))


def _seen_ball(x: np.ndarray, y: np.ndarray, z: np.ndarray, center: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Unit vectors from points to a ball, and its angular radius (rad) from there."""
    towards = np.stack([center[0] - x, center[1] - y, center[2] - z], axis=2)
    distance = np.linalg.norm(towards, axis=2)
    return towards / distance[:, :, None], np.arcsin(np.clip(radius / distance, 0, 1))


def light_lists(root: Path) -> tuple[list[Path], list[Path]]:
    """(lists of domes with a test beside them, all others), sorted."""
    lists = sorted(root.rglob("dirs.lp"))
    domes = [path for path in lists if path.parent.name == "Dome" and (path.parents[1] / "Test" / "dirs.lp").is_file()]
    tests = {path.parents[1] / "Test" / "dirs.lp" for path in domes}
    return domes, [path for path in lists if path not in tests and path not in domes]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sources", nargs="*", type=Path, help="captures, and folders with light lists anywhere below")
    parser.add_argument("--texels", type=int, default=4096, help="of an item whose lights are left out one by one, at random")
    wanted = parser.parse_args()
    bars = Bars()
    if not wanted.sources:
        with tempfile.TemporaryDirectory() as name:
            for quantity in get_args(Quantity):
                capture_table(smooth_capture(Path(name) / quantity, quantity), f"smooth scene, {quantity}", bars, smooth=True)
    for source in wanted.sources:
        if (source / MANIFEST).is_file():
            capture_table(Capture.open(source), source.name, bars)
            continue
        domes, others = light_lists(source)
        if not domes and not others:
            sys.exit(f"expected a capture, or light lists named dirs.lp, in {source}, found neither")
        if domes:
            dome_table(source, domes, bars)
        if others:
            left_out_table([(path.parent.name, path) for path in others], wanted.texels, bars)
    print(f"\n{bars.missed} bars missed" if bars.missed else "\nNo bar missed")
    return int(bars.missed > 0)


if __name__ == "__main__":
    sys.exit(main())
