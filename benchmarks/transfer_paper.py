"""`python benchmarks/transfer_paper.py CAPTURE ASSET [--scene SCENE.blend]`: patch-to-patch transfer at its paper's size, and `transfer`.

A capture of surfels gives scene and receivers; its surfaces are cut into about `--surfels` surfels, and form factors are traced between
these. ASSET is a `transfer` one of the same capture. Lights at random free places: relative RMSE of indirect light on the covered texels,
median / 90th percentile over lights, against the form factors of all those surfels, uncompressed; with `--scene` also against Cycles,
rendered twice so that its noise drops out. The columns `surfels` compare light on the surfels themselves, before splats.
Files: what a transfer needs beside the receivers' images and the scene. CPU: of one core; a frame is one light without its shadow rays.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from lights_inside import placed
from numpy import ndarray
from references import rendered, settings_of

from srbf.asset import Asset
from srbf.bake.light_sets import LIGHT_SET_FILE, FoundPlaces
from srbf.capture import COVERED, Capture
from srbf.compute.full_precision import by_channel
from srbf.lights import Light
from srbf.methods import linear_response
from srbf.methods.transfer_paper import TransferPaper, light_on_surfels, on_receivers
from srbf.visibility import transfer_operator
from srbf.visibility.cloud_lights import CloudLights
from srbf.visibility.patch_transfer import Exchange, PatchTransfer
from srbf.visibility.received import ReceivedLight
from srbf.visibility.receivers import Receivers
from srbf.visibility.surface_cells import Cells, Fragments
from srbf.visibility.surfels import Surfels, surfels_of
from srbf.visibility.transfer_operator import TransferOperator

KINDS = ("point", "wall", "spot", "area")
FRAMES = 20
LEFT_OUT = ("position.exr", "normal.exr", "coverage.exr", "albedo.exr", "ambient.exr", "scene.glb", "asset.json")


def fine_surfels(capture: Capture, inside: CloudLights, count: int) -> Surfels:
    """The capture's surfaces, their triangles cut in four until surfels can be as small as is asked for."""
    with np.load(capture.folder / LIGHT_SET_FILE) as stored:
        found = FoundPlaces.of_arrays(stored)
    coarse = found.surfels
    assert coarse is not None
    owner = np.where(coarse.owners[0] >= 0, coarse.owners[0], coarse.owners[1])
    kept = owner >= 0
    corners, owner = coarse.corners[kept], owner[kept]
    size = float(np.sqrt(coarse.cells.areas.sum() / count))
    whole = []
    while len(corners):
        longest = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).max(axis=1)
        small = longest <= size
        whole.append((corners[small], owner[small]))
        corners, owner = corners[~small], np.tile(owner[~small], 4)
        a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        corners = np.concatenate([np.stack(parts, axis=1) for parts in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
    corners, owner = (np.concatenate(parts) for parts in zip(*whole, strict=True))
    surfaces = Fragments(np.ascontiguousarray(corners, np.float32), coarse.cells.albedo[owner])
    return surfels_of(surfaces, coarse.objects[owner], inside.occluders, inside.free, None, count)


def first_coefficients(found: PatchTransfer, count: int) -> PatchTransfer:
    """Fewer coefficients per cluster: axes are ordered."""
    whole, clusters = len(found.bases), len(found.sizes)
    kept = (np.arange(clusters)[:, None] * whole + np.arange(count)).ravel()
    return PatchTransfer(found.sizes, found.bases[:count], found.matrices[kept], found.strengths[kept], found.examples)


def files_of(asset: Asset) -> int:
    """Bytes on disk."""
    with tempfile.TemporaryDirectory(prefix="srbf-") as folder:
        asset.save(Path(folder) / "asset")
        return sum(path.stat().st_size for path in (Path(folder) / "asset").iterdir() if path.name not in LEFT_OUT)


def timed(work: Callable[[], object]) -> float:
    """CPU ms of one call, the least of some."""
    spent = []
    for _ in range(FRAMES):
        start = time.process_time()
        work()
        spent.append(time.process_time() - start)
    return 1e3 * min(spent)


def frame_of(asset: Asset) -> ndarray:
    """What a frame of `transfer` takes beside the light on surfels: weights of the shapes, and of the functions of all clusters."""
    received = np.ones((asset.manifest["surfel_transfer"]["surfels"], 3), np.float32)
    weights = [table @ received[:, c] for c, table in enumerate(by_channel(asset.tables["surfel_transfer"]))]
    values = by_channel(asset.tables["light_values"])
    return np.stack([values[min(c, len(values) - 1)] @ weights[c] for c in range(3)])


def rows_of(cells: Cells, among: Cells) -> ndarray:
    """The number of each cell in another order of the same ones."""
    first, second = (np.lexsort(np.concatenate([own.places, own.normals], axis=1).T) for own in (cells, among))
    result = np.empty(len(first), np.int64)
    result[first] = second
    return result


def error(found: ndarray, truth: ndarray, again: ndarray | None = None) -> str:
    """Of (N, n, 3) against `truth`, or two renders of it."""
    other = truth if again is None else again
    squares = ((found - truth) * (found - other)).sum(axis=(1, 2)) / np.maximum((truth * other).sum(axis=(1, 2)), 1e-30)
    by_light = 100 * np.sqrt(np.maximum(squares, 0))
    return f"{np.median(by_light):6.1f}/{np.quantile(by_light, 0.9):5.1f}"


def main() -> None:
    """Print a row per number of coefficients, of the uncompressed form factors, and of the asset."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("capture", type=Path)
    parser.add_argument("asset", type=Path)
    parser.add_argument("--scene", type=Path)
    parser.add_argument("--surfels", type=int, default=45_000)
    parser.add_argument("--rays", type=int, default=256, help="of a surfel")
    parser.add_argument("--d2", default="5,10,20")
    parser.add_argument("--lights", type=int, default=12)
    parser.add_argument("--samples", type=int, default=64)
    asked = parser.parse_args()
    capture, ours = Capture.open(asked.capture), Asset.open(asked.asset)
    covered = capture.coverage() >= COVERED
    coarse = CloudLights.of(capture)
    counts = sorted(map(int, asked.d2.split(",")))
    start = time.process_time()
    surfels = fine_surfels(capture, coarse, asked.surfels)
    transfer_operator.SURFEL_RAYS = asked.rays
    operator = TransferOperator.traced(surfels, Receivers.of(capture), ours.receiver_kind == "lightmap")
    traced = time.process_time()
    inside, whole = TransferPaper(d2=counts[-1]).transfer(capture, operator)
    solved = time.process_time()
    print(
        f"{surfels.count} surfels in {len(whole.sizes)} clusters, {operator.exchange.nnz / 1e6:.0f} million form factors; CPU s: "
        f"surfels and form factors {traced - start:.0f}, bases and {counts[-1]} coefficients {solved - traced:.0f}",
        flush=True,
    )
    lights = {kind: placed(capture, kind, asked.lights, np.random.default_rng([3, len(kind)])) for kind in KINDS}
    places = rows_of(inside.cells, operator.cells)
    received = ReceivedLight(inside.cells, inside.occluders)
    exchange = Exchange(operator.exchange[places][:, places], inside.cells, capture.manifest["surfels"].get("bounces"))
    receivers = operator.receivers[np.flatnonzero(covered.ravel())][:, places]
    direct = {kind: np.stack([received.irradiance(light) for light in own]) for kind, own in lights.items()}
    on_surfels, on_texels = {}, {}
    for kind, irradiance in direct.items():
        columns = irradiance[:, :, 0].T.astype(np.float32)  # the lights are white
        bounced = np.stack([exchange.indirect(c, columns) for c in range(3)], axis=2)  # (S, N, 3)
        reflected = (bounced + columns[:, :, None]) * inside.cells.albedo[:, None]
        on_texels[kind] = np.stack([(receivers @ reflected[:, :, c]).T for c in range(3)], axis=2)
        on_surfels[kind] = bounced.transpose(1, 0, 2)
    cycles: dict[str, ndarray] = {}
    if asked.scene is not None:
        for kind, own in lights.items():
            cycles[kind] = rendered(asked.scene, settings_of(capture), own, asked.samples)["indirect"][:, :, covered]
    against = [f"{kind} surfels" for kind in KINDS] + list(KINDS) + [f"{kind} Cycles" for kind in cycles]
    print(f"{'':>26}" + "".join(f"{name:>15}" for name in against) + f"{'kept':>7}{'files MB':>10}{'frame ms':>10}")

    def relit(asset: Asset, own: list[Light]) -> ndarray:
        return np.stack([linear_response(asset, [light])[covered] for light in own])

    def row(name: str, shown: dict[str, ndarray], of_surfels: dict[str, ndarray] | None, rest: str) -> None:
        cells = [f"{'':>15}" if of_surfels is None else f"{error(of_surfels[kind], on_surfels[kind]):>15}" for kind in KINDS]
        cells += [f"{error(shown[kind], on_texels[kind]):>15}" for kind in KINDS]
        cells += [f"{error(shown[kind], *renders):>15}" for kind, renders in cycles.items()]
        print(f"{name:>26}" + "".join(cells) + rest, flush=True)

    for count in counts:
        asset = TransferPaper(d2=count).of_transfer(capture, inside, first_coefficients(whole, count))
        own_surfels = {kind: np.stack([light_on_surfels(asset, one) for one in direct[kind]]) for kind in KINDS}
        shown = {kind: relit(asset, lights[kind]) for kind in KINDS}
        kept = asset.tables["patch_matrices"].any(axis=2).mean()
        frame = timed(partial(light_on_surfels, asset, direct["point"][0]))
        row(f"d2 {count}", shown, own_surfels, f"{kept:7.0%}{files_of(asset) / 1e6:10.1f}{frame:10.1f}")
    splats = {kind: np.stack([on_receivers(asset, light)[covered] for light in on_surfels[kind]]) for kind in KINDS}
    row("splats, uncompressed", splats, on_surfels, "")
    row("uncompressed", on_texels, None, "")
    shown = {kind: relit(ours, lights[kind]) for kind in KINDS}
    frame = timed(lambda: frame_of(ours))
    row(f"transfer, {ours.bytes_per_texel()['directional']} B", shown, None, f"{'':>7}{files_of(ours) / 1e6:10.1f}{frame:10.1f}")


if __name__ == "__main__":
    main()
