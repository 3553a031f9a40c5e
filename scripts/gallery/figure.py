"""The figure of error by bytes: held-out PSNR of methods and of the gallery's assets against bytes per texel, one panel per scene."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from scripts.gallery.making import read_scores
from scripts.gallery.paths import ScenePaths
from scripts.gallery.steps import Steps
from srbf.asset import Asset
from srbf.evaluation.rate_distortion import ALL, NEAREST, texel_bytes
from srbf.io import files

INK, SOFT, RULE = "#1f2328", "#63686e", "#dcdfe3"  # of a report's page
COLORS = {
    "relighting map": "#0072b2",
    "eigen map": "#00805c",
    "clustered eigen map": "#9a4f86",
    "spherical harmonics": "#1f2328",
    "ptm": "#8a929b",
}
RED = "#c8501e"
MARKS = {"all": ("s", "shown here, on all texels"), "indirect": ("*", "shown here, direct light by rays")}  # of this page's assets
BASELINES = {ALL: "--", NEAREST: ":"}
TICKS = (2, 4, 8, 16, 32, 64, 128, 256, 512)
COLUMNS = 3
DPI = 140


def draw(made: Sequence[ScenePaths], path: Path) -> None:
    """Write the figure of all scenes that are done."""
    across = min(COLUMNS, len(made))
    down = -(-len(made) // across)
    figure = Figure(figsize=(0.6 + 3.7 * across, 0.9 + 2.9 * down), dpi=DPI, facecolor="white", layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(down, across, squeeze=False)
    for axes in panels.ravel()[len(made) :]:
        axes.set_axis_off()
    for axes, paths in zip(panels.ravel(), made, strict=False):
        _panel(axes, paths)
    for axes in panels[-1]:
        axes.set_xlabel("bytes per texel (log scale)", color=SOFT, fontsize=9)
    for row in panels:
        row[0].set_ylabel("held-out PSNR, dB", color=SOFT, fontsize=9)
    handles = {name: handle for axes in panels.ravel() for handle, name in zip(*axes.get_legend_handles_labels(), strict=True)}
    legend = figure.legend(
        handles.values(), handles.keys(), loc="outside lower center", ncols=min(4, 2 * across), frameon=False, fontsize=9, labelcolor=INK
    )
    legend.set_in_layout(True)
    with files.atomic_path(path) as temporary:
        figure.savefig(temporary, format="webp", pil_kwargs={"lossless": True})


def made_from(made: Sequence[ScenePaths], steps: Steps) -> Any:
    """The inputs of the figure: its source and the digests of the steps."""
    text = hashlib.sha256(Path(__file__).read_bytes()).hexdigest()
    parts = {f"{p.scene.name}/{part}" for p in made for part in ("compare methods", *(f"evaluate {fit.folder}" for fit in p.scene.fits))}
    return [text, *((part, steps.made(part).digest) for part in sorted(parts))]


def _panel(axes: Any, paths: ScenePaths) -> None:
    scores = read_scores(paths)
    axes.set_title(paths.scene.name.replace("_", " "), fontsize=11, color=INK, loc="left")
    axes.set_xscale("log", base=2)
    axes.grid(color=RULE, lw=0.6)
    axes.set_axisbelow(True)
    axes.tick_params(labelsize=8, colors=SOFT, length=0)
    for spine in axes.spines.values():
        spine.set_visible(False)
    for family, color in COLORS.items():
        curve = sorted((s for s in scores if s.family == family), key=lambda s: s.bytes_per_texel)
        if curve:
            x, y = [s.bytes_per_texel for s in curve], [s.psnr for s in curve]
            axes.plot(x, y, color=color, lw=1.6, marker="o", ms=4, label=family.replace("ptm", "polynomial texture map"))
    for score in scores:
        if score.family in BASELINES:
            axes.axhline(score.psnr, color="#8a929b", lw=1.1, ls=BASELINES[score.family], label=score.family)
    for fit in paths.scene.fits:
        mark, name = MARKS[fit.light]
        bytes_per_texel, reached = own_point(paths, fit.folder)
        axes.plot(
            bytes_per_texel,
            reached,
            mark,
            mfc=RED if fit.light == "indirect" else "none",
            mec=RED,
            mew=1.2,
            ms=9,
            label=name,
            ls="none",
            zorder=5,
        )
    axes.set_xticks([t for t in TICKS if axes.get_xlim()[0] <= t <= axes.get_xlim()[1]])
    axes.xaxis.set_major_formatter("{x:g}")
    axes.minorticks_off()


def own_point(paths: ScenePaths, folder: str) -> tuple[float, float]:
    """(bytes per texel, held-out PSNR in dB) of an asset, evaluated on all texels."""
    fit = next(fit for fit in paths.scene.fits if fit.folder == folder)
    return float(texel_bytes(Asset.open(paths.asset(fit)))), files.read_json(paths.errors(fit))["holdout"]["psnr"]
