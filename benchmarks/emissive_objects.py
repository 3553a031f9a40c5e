"""`python benchmarks/emissive_objects.py CAPTURE NAMED NAMED_AGAIN ASSETS`: objects that emit, by a transfer asset, against Cycles.

CAPTURE: of surfels. NAMED and NAMED_AGAIN: `srbf bake SCENE --light-set named --transport combined` of its receivers with two seeds, so
that the noise of the renders drops out: relative RMSE = sqrt(sum (a - r1)(a - r2) / sum r1 r2), of direct light and all bounces, over the
receivers that some free place sees: what is behind a picture on a wall is not looked at. For every emissive object the mean radiance of
what emits (1 where the capture's object does not), then the form factors uncompressed and each asset: error, without the worst 1 % of
receivers, ratio of energies; and the noise of one render.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from srbf.asset import Asset
from srbf.capture import COVERED, Capture
from srbf.lights import NamedLight
from srbf.methods import linear_response
from srbf.methods.surface_changes import emitted_by_objects
from srbf.visibility.cloud_lights import CloudLights
from srbf.visibility.surface_cells import lit
from srbf.visibility.transfer_basis import exchange_of
from srbf.visibility.transfer_operator import TransferOperator


def mean_radiance(operator: TransferOperator, object: int) -> np.ndarray:
    """(3,) over the surfels of an object that emit; 1 where none does."""
    own = (operator.objects == object) & operator.emission.any(axis=1)
    return np.average(operator.emission[own], axis=0, weights=operator.cells.areas[own]) if own.any() else np.ones(3)


def row(found: np.ndarray, first: np.ndarray, second: np.ndarray) -> str:
    """Of arrays (n, 3)."""
    products, power = ((found - first) * (found - second)).sum(axis=1), (first * second).sum(axis=1)
    kept = np.argsort(np.abs(products))[: int(0.99 * len(products))]
    trimmed = np.sqrt(max(products[kept].sum() / power[kept].sum(), 0))
    return f"{np.sqrt(max(products.sum() / power.sum(), 0)):8.3f}{trimmed:13.3f}{2 * found.sum() / (first.sum() + second.sum()):9.3f}"


def main() -> None:
    """Print a block per object."""
    parser = argparse.ArgumentParser(description=__doc__)
    for name in ("capture", "named", "again"):
        parser.add_argument(name, type=Path)
    parser.add_argument("assets", type=Path, nargs="*")
    asked = parser.parse_args()
    capture, named, again = (Capture.open(folder) for folder in (asked.capture, asked.named, asked.again))
    covered = capture.coverage() >= COVERED
    inside = CloudLights.of(capture)
    position, normal = (np.asarray(capture.geometry(name), np.float64)[covered] for name in ("position", "normal"))
    covered[covered] = lit(position, normal, inside.occluders, inside.free).any(axis=1)
    operator = TransferOperator.read(capture.folder)
    told = capture.manifest["surfels"]
    exchange, bounces = exchange_of(operator, told.get("bounces"))
    emitted, having = emitted_by_objects(operator).radiosity, np.unique(operator.objects)
    print(f"{'':32}{'error':>8}{'without 1 %':>13}{'energy':>9}")
    for index, light in enumerate(named.lights):
        if light.name not in told["objects"]:
            continue
        first, second = (one.image(index)[covered] for one in (named, again))
        number = told["objects"].index(light.name)
        radiance = mean_radiance(operator, number)
        noise = np.sqrt(((first - second) ** 2).sum() / 2 / (first * second).sum())
        print(f"{light.name}, radiance {', '.join(f'{one:.3g}' for one in radiance)}, noise of a render {noise:.3f}")
        own = (emitted[:, np.searchsorted(having, number)] * radiance).astype(np.float32)
        sent = [own[:, c] + bounces[c].radiosity((exchange @ own[:, c])[:, None])[:, 0] for c in range(3)]
        exact = (operator.receivers @ np.stack(sent, axis=1)).reshape(*covered.shape, 3)[covered]
        print(f"{'form factors':>32}{row(exact, first, second)}")
        for path in asked.assets:
            found = linear_response(Asset.open(path), [NamedLight(light.name, tuple(float(one) for one in radiance))])[covered]
            print(f"{path.name:>32}{row(found, first, second)}")


if __name__ == "__main__":
    main()
