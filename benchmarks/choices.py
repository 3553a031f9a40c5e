"""Loss of the automatic choices against the best ones by the test lights: `python benchmarks/choices.py [CAPTURE | FOLDER]…`.

Without arguments: nearly flat glossy boards under ring domes, test lights between the rings. A CAPTURE is tested on its holdout lights,
a FOLDER in the layout of SynthRTI (`…/Dome/dirs.lp` beside `…/Test/dirs.lp`) on its second list. The light functions of an eigen map by
`auto` beside the best single (spread, ridge) of a grid, and 25 and 35 maps beside theirs, dB. The table is Markdown.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from srbf.basis.gaussian import GaussianBasis, spread_of, weight
from srbf.capture import COVERED, Capture
from srbf.encode.light_function_fit import dense_centers, functions_through
from srbf.encode.model_selection import TexelSample
from srbf.encode.weighted_rows import LightSpace
from srbf.importing.photographs import LightListImport
from srbf.light_domain import Directions
from srbf.methods.relighting_map import RelightingMap
from srbf.receiver_images import MANIFEST
from srbf.solve.pca import principal_axes
from srbf.solve.ridge import RidgePath
from srbf.sphere import domain_of, mean_spacing, normalize

DOMES = {  # lights and elevation (degrees) of each ring
    "3 rings": ((20, 16, 12, 1), (20, 45, 68, 90)),
    "4 rings": ((18, 14, 10, 6, 1), (12, 33, 54, 74, 90)),
    "5 rings": ((18, 12, 10, 8, 1), (10, 30, 50, 70, 90)),
    "6 rings": ((12, 12, 10, 8, 5, 2), (10, 25, 40, 55, 70, 84)),
}
MATERIALS = {"four glosses": (0.1, 0.2, 0.35, 0.6), "two glosses": (0.12, 0.4), "satin": (0.3,), "shiny": (0.15,), "matte": (0.6,)}
COMPONENTS, TEXELS = 48, 2000
SPREADS = tuple(np.geomspace(0.5, 5, 12))  # light spacings, or mean distances of the centers
RIDGES = (1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1.0, 10.0)


@dataclass(frozen=True)
class Case:
    """images (L + T, n, 3), the fitted lights first, at unit directions; `peak` of the PSNR."""

    name: str
    images: np.ndarray
    directions: np.ndarray
    fitted: int
    peak: float

    def psnr(self, predicted: np.ndarray) -> float:
        true = np.maximum(self.images[self.fitted :], 0)
        rmse = np.sqrt(((np.maximum(predicted.reshape(true.shape), 0) - true) ** 2).mean(axis=(1, 2)))
        return float(np.mean(20 * np.log10(self.peak / np.maximum(rmse, 1e-9))))


def on_rings(counts: tuple[int, ...], elevations: tuple[float, ...]) -> np.ndarray:
    """Directions of a dome, every other ring turned by half a step."""
    rows = []
    for number, (count, elevation) in enumerate(zip(counts, np.radians(elevations), strict=True)):
        turn = 2 * np.pi * (np.arange(count) + 0.5 * (number % 2)) / count
        rows.append(np.stack([np.cos(turn) * np.cos(elevation), np.sin(turn) * np.cos(elevation), np.full(count, np.sin(elevation))], 1))
    return np.concatenate(rows)


def between_rings(elevations: tuple[float, ...], rng: np.random.Generator, count: int = 20) -> np.ndarray:
    """Directions half-way between the rings, at random azimuths."""
    edges = np.radians(elevations)
    elevation = ((edges[1:] + edges[:-1]) / 2)[np.arange(count) % (len(edges) - 1)]
    turn = rng.uniform(0, 2 * np.pi, count)
    return np.stack([np.cos(turn) * np.cos(elevation), np.sin(turn) * np.cos(elevation), np.sin(elevation)], 1)


def glossy_board(lights: np.ndarray, roughnesses: tuple[float, ...], rng: np.random.Generator, texels: int) -> np.ndarray:
    """Stored values (L, texels, 3) of a nearly flat board seen from above: Lambert and a Beckmann highlight, exposed, as bytes."""
    normal = normalize(np.concatenate([0.1 * rng.normal(size=(texels, 2)), np.ones((texels, 1))], axis=1))
    roughness = rng.choice(roughnesses, texels)
    albedo = rng.uniform(0.06, 0.6, (texels, 3))
    half = normalize(lights + [0, 0, 1])
    NoL = np.clip(lights @ normal.T, 0, 1)
    slope = np.tan(np.arccos(np.clip(half @ normal.T, 1e-3, 1)))
    highlight = 0.04 * NoL * np.exp(-((slope / roughness) ** 2)) / (np.pi * roughness**2)
    linear = albedo / np.pi * NoL[..., None] + highlight[..., None]
    exposed = np.clip(linear / np.quantile(linear, 0.995), 0, 1)
    return (np.round(exposed ** (1 / 2.2) * 255) / 255).astype(np.float32)


def boards(texels: int = 300) -> Iterator[Case]:
    """Every material under every dome."""
    for dome, (counts, elevations) in DOMES.items():
        for material, roughnesses in MATERIALS.items():
            rng = np.random.default_rng([len(counts), len(roughnesses), int(100 * roughnesses[0])])
            lights = on_rings(counts, elevations)
            directions = np.concatenate([lights, between_rings(elevations, rng)])
            yield Case(f"{dome}, {material}", glossy_board(directions, roughnesses, rng, texels), directions, len(lights), 1.0)


def case_of(name: str, capture: Capture, peak: float | None = None) -> Case:
    """A capture's train and holdout lights on a sample of its texels, without its validation lights."""
    capture = capture.combined()
    covered = np.flatnonzero(capture.coverage().ravel() >= COVERED)
    texels = covered if len(covered) <= TEXELS else np.sort(np.random.default_rng(0).choice(covered, TEXELS, replace=False))
    train, holdout = capture.indices("train"), capture.indices("holdout")
    images = capture.sample([*train, *holdout], texels).transpose(1, 0, 2)
    peak = peak or float(np.quantile(images[: len(train)], 0.999))
    return Case(name, images, capture.directions([*train, *holdout]), len(train), peak)


def given(path: Path) -> Iterator[Case]:
    """The cases of an argument."""
    if (path / MANIFEST).is_file():
        yield case_of(path.name, Capture.open(path))
        return
    for dome in sorted(path.rglob("Dome/dirs.lp")):
        with tempfile.TemporaryDirectory() as folder:
            LightListImport(dome, "linear", dome.parents[1] / "Test" / "dirs.lp").write(Path(folder) / "capture")
            yield case_of(dome.parents[1].relative_to(path).as_posix(), Capture.open(Path(folder) / "capture"), 1.0)


def light_functions(case: Case) -> tuple[float, float]:
    """(`auto`, the best of the grid) of an eigen map's light functions."""
    lights, asked = case.directions[: case.fitted], case.directions[case.fitted :]
    domain = Directions(domain_of(lights))
    sample = TexelSample(
        np.arange(case.images.shape[1]), np.ascontiguousarray(case.images[: case.fitted].transpose(1, 0, 2)), lights, case.fitted, domain
    )
    space = LightSpace.of(sample, "plain")
    axes, _ = principal_axes(space.centered, min(COMPONENTS, 3 * case.fitted))
    planes = np.einsum("slc,nlc->sn", space.weights(axes), sample.responses) - space.offsets(axes)[:, None]
    ones = np.concatenate([np.ones((1, planes.shape[1])), planes])
    values = space.functions(axes)

    def reached(functions: np.ndarray) -> float:
        return case.psnr(np.einsum("fn,lfc->lnc", ones, functions))

    chosen, _ = functions_through(sample, values, domain)
    centers = dense_centers(lights, domain)
    best = -np.inf
    for spread in {min(1.0, float(factor * mean_spacing(lights))) for factor in SPREADS}:
        basis, towards = weight(lights @ centers.T, spread), weight(asked @ centers.T, spread)
        path = RidgePath(basis)
        for ridge in RIDGES:
            best = max(best, reached(np.tensordot(towards @ path.operator(ridge), values, 1)))
    return reached(chosen.evaluate(asked)), best


def maps(case: Case, k: int) -> tuple[float, float]:
    """(`auto`, the best of the grid, a ridge of 0 included) of k relighting maps."""
    lights, asked = case.directions[: case.fitted], case.directions[case.fitted :]
    domain = Directions(domain_of(lights))
    centers = domain.centers(k, "fibonacci")
    flat = case.images[: case.fitted].reshape(case.fitted, -1).astype(np.float64)

    def reached(spread: float, ridge: float) -> float:
        operator = RidgePath(weight(lights @ centers.T, spread)).operator(ridge)
        return case.psnr(weight(asked @ centers.T, spread) @ (operator @ flat))

    sample = TexelSample(
        np.arange(case.images.shape[1]), np.ascontiguousarray(case.images[: case.fitted].transpose(1, 0, 2)), lights, case.fitted, domain
    )
    basis, ridge, _ = RelightingMap(k, encoding="float").model(lambda: sample, domain)
    assert isinstance(basis, GaussianBasis)
    mean = spread_of(centers, "mean")
    best = max(reached(min(1.0, float(factor * mean)), r) for factor in (0.6, 0.7, 0.8, 0.9, 1, 1.2, 1.5, 2) for r in (0.0, *RIDGES))
    return reached(basis.spread, ridge), best


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("sources", nargs="*", type=Path, help="captures, or folders of dome and test lights; none: glossy boards")
    sources = parser.parse_args().sources
    print("| case | light functions, dB | best pair | loss | 25 maps | best pair | loss | 35 maps | best pair | loss |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    losses = []
    for case in (case for source in sources for case in given(source)) if sources else boards():
        found = [light_functions(case), maps(case, 25), maps(case, 35)]
        losses.append([best - chosen for chosen, best in found])
        cells = (f"{chosen:.2f} | {best:.2f} | {best - chosen:.2f}" for chosen, best in found)
        print(f"| {case.name} | {' | '.join(cells)} |", flush=True)
    mean, worst = np.mean(losses, axis=0), np.max(losses, axis=0)
    print(f"| mean, worst loss | | | {' | | | '.join(f'{m:.2f}, {w:.2f}' for m, w in zip(mean, worst, strict=True))} |")
    return 0


if __name__ == "__main__":
    sys.exit(main())
