"""Surfaces that change after the bake: other albedo, and emission, of a transfer asset's objects.

With gather M (r, S), from radiosity of surfels to weights of shapes, and sent A (S, r), what the shapes lay on the surfels, light that is
exchanged k times has the weights (M rho A)^k M b. So other albedo is another product of small matrices. See `surfel_tables`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64, Int
from srbf.asset import Asset
from srbf.asset_reader import AssetReader
from srbf.encode.table_steps import steps_by_column
from srbf.errors import InputError
from srbf.methods.environment_table import without_environment_table
from srbf.methods.surfel_tables import albedo_of, gather_of, has_series, set_albedo, set_series
from srbf.solve.radiosity import MOST_REFLECTED, series_by_channel, summed_series
from srbf.visibility.transfer_basis import Emitted, TransferBasis, grouped
from srbf.visibility.transfer_operator import TransferOperator

KEY = "surfaces"
FILES = {
    "surface_gather": "surface_gather.exr",
    "surface_sent": "surface_sent.exr",
    "surface_feedback": "surface_feedback.exr",
    "surface_objects": "surface_objects.exr",
    "surface_albedo": "surface_albedo.exr",
}
OF_SURFELS = ("surface_gather", "surface_albedo")  # of assets without matrices of their own for these
EMISSION = "surface_emission"  # which older assets lack
FEEDBACK_ERROR = 0.0025  # of what a shape's light is after one reflection, rms: all reflections are summed by it
SHINING, MAY_SHINE = 16.0, 4.0  # lights that an object counts as among those that shapes are made for
EMISSION_FILE = {EMISSION: "surface_emission.exr"}


@dataclass(frozen=True, eq=False)
class Surfaces:
    """What changes need: `gather` (r, S), `sent` (r, S) and `feedback` (r, r, 3), which is gather rho sent.

    `shares` (O, S): what part of a surfel's area each object has; `albedo` (S, 3); `bounces`: how often light is exchanged, None: always.
    `emission` (r, O, 3): weights of objects that emit a mean radiance of 1, in the pattern of their own emission, without bounces.
    """

    gather: Float32[ndarray, "r S"]
    sent: Float32[ndarray, "r S"]
    feedback: Float32[ndarray, "r r 3"]
    shares: Float32[ndarray, "O S"]
    albedo: Float32[ndarray, "S 3"]
    names: tuple[str, ...]
    bounces: int | None
    emission: Float32[ndarray, "r O 3"]

    @staticmethod
    def of_basis(
        basis: TransferBasis, operator: TransferOperator, groups: Int[ndarray, " F"], names: tuple[str, ...], bounces: int | None
    ) -> Surfaces:
        """Of an operator's fine surfels, each in a group: sums and means over the groups; of objects that have surfels."""
        cells, objects = operator.cells, operator.objects
        having = np.unique(objects)
        count = int(groups.max()) + 1
        area = np.maximum(np.bincount(groups, cells.areas, count), 1e-30).astype(np.float32)
        sent = grouped(np.ascontiguousarray(basis.sent.T) * cells.areas, groups, count) / area
        owned = (objects == having[:, None]) * cells.areas
        albedo = grouped(np.ascontiguousarray(cells.albedo.T) * cells.areas, groups, count) / area
        shares = grouped(owned.astype(np.float32), groups, count) / area
        feedback = basis.feedback.astype(np.float32)
        radiosity = emitted_by_objects(operator).radiosity
        emission = np.stack([basis.gather @ np.ascontiguousarray(radiosity[:, :, c]) for c in range(3)], axis=2)
        gather = grouped(basis.gather, groups, count)
        return Surfaces(
            steps_by_column(gather[:, :, None], basis.sizes)[:, :, 0],
            steps_by_column(sent[:, :, None], np.ones(len(sent), np.float32))[:, :, 0],  # weights have an rms of 1
            steps_by_column(feedback, basis.sizes, FEEDBACK_ERROR),
            shares,
            np.ascontiguousarray(albedo.T),
            tuple(names[i] for i in having),
            bounces,
            emission,
        )

    @staticmethod
    def of(asset: Asset) -> Surfaces:
        """InputError where the asset has none."""
        if KEY not in asset.manifest:
            raise InputError(f"expected an asset whose surfaces can change, found a {asset.method} one without; fit with `editable`")
        return Surfaces.of_tables(asset.manifest, asset.tables, *((gather_of(asset), albedo_of(asset)) if has_series(asset) else ()))

    @staticmethod
    def of_tables(
        manifest: dict[str, Any],
        tables: Mapping[str, ndarray],
        gather: Float32[ndarray, "r S"] | None = None,
        albedo: Float32[ndarray, "S 3"] | None = None,
    ) -> Surfaces:
        """From the manifest and the tables of an asset that has them, `gather` and `albedo` among them where they are not given."""
        told = manifest[KEY]
        found = {name: tables[name].astype(np.float32) * np.float32(scale) for name, scale in told["scales"].items()}
        gather = found["surface_gather"][..., 0] if gather is None else gather
        albedo = found["surface_albedo"][0] if albedo is None else albedo
        shares = found["surface_objects"][..., 0]
        even = np.float32(np.pi) * gather @ shares.T
        emission = found[EMISSION] if EMISSION in found else np.repeat(even[:, :, None], 3, axis=2)
        sent, feedback = found["surface_sent"][..., 0], found["surface_feedback"]
        return Surfaces(gather, sent, feedback, shares, albedo, tuple(told["objects"]), told.get("bounces"), emission)

    def add_to(self, asset: Asset) -> None:
        """Its tables and keys: what the asset has in `surfel_tables` is not repeated."""
        tables, keys = self.stored()
        for name in OF_SURFELS if has_series(asset) else ():
            del tables[name], keys[name], keys[KEY]["scales"][name]
        asset.tables |= tables
        asset.manifest |= keys

    def stored(self) -> tuple[dict[str, ndarray], dict[str, Any]]:
        """(tables, keys of the manifest) as an asset has them."""
        tables = (self.gather[..., None], self.sent[..., None], self.feedback, self.shares[..., None], self.albedo[None], self.emission)
        stored, scales, keys = {}, {}, {}
        for (name, file), table in zip((FILES | EMISSION_FILE).items(), tables, strict=True):
            scales[name] = float(2.0 ** np.ceil(np.log2(max(float(np.abs(table).max(initial=0)), 1e-30))))
            stored[name] = (table / np.float32(scales[name])).astype(np.float16)
            keys[name] = {"file": file}
        entry: dict[str, Any] = {"objects": list(self.names), "scales": scales}
        return stored, {**keys, KEY: entry if self.bounces is None else {**entry, "bounces": self.bounces}}

    @staticmethod
    def read(reader: AssetReader) -> dict[str, ndarray]:
        """The tables of an asset on disk; none where it has none."""
        if KEY not in reader.manifest:
            return {}
        told = reader.manifest["surfel_transfer"]
        rank, count, objects = int(told["rank"]), int(told["surfels"]), len(reader.manifest[KEY]["objects"])
        shapes = ((rank, count, 1), (rank, count, 1), (rank, rank, 3), (objects, count, 1), (1, count, 3))
        files = {name: shape for name, shape in zip(FILES, shapes, strict=True) if name in reader.manifest}
        found = {name: reader.table(name, shape[:2], shape[2]).astype(np.float16) for name, shape in files.items()}
        return found | {
            name: reader.table(name, (rank, objects), 3).astype(np.float16) for name in EMISSION_FILE if name in reader.manifest
        }

    def emitted(self, name: str, radiance: Float64[ndarray, " 3"]) -> Float64[ndarray, "r 3"]:
        """Weights of the shapes under an object that emits diffusely: of what it lays on receivers itself, and of all bounces.

        `radiance`: the mean over what emits of the object, in the pattern that it emits in; over all of it where it emits nothing.
        """
        self._share_of(name)
        first = self.emission[:, self.names.index(name)] * radiance.astype(np.float32)  # (r, 3)
        more = None if self.bounces is None else self.bounces + 1
        columns = [summed_series(self.feedback[:, :, c], first[:, c : c + 1], more)[:, 0] for c in range(3)]
        return np.stack(columns, axis=1).astype(np.float64)

    def painted(self, albedo: Mapping[str, tuple[float, float, float]]) -> Surfaces:
        """The same with objects of another albedo."""
        change = np.zeros_like(self.albedo)
        for name, color in albedo.items():
            share = self._share_of(name)[:, None]
            change += share * (np.clip(np.array(color, np.float32), 0, MOST_REFLECTED) - self.albedo)
        painted = np.clip(self.albedo + change, 0, MOST_REFLECTED)
        added = [(self.gather * (painted - self.albedo)[:, c]) @ self.sent.T for c in range(3)]
        return replace(self, albedo=painted, feedback=self.feedback + np.stack(added, axis=2))

    def transfer(self) -> Float32[ndarray, "r S 3"]:
        """From irradiance on the surfels to weights of the shapes."""
        columns = [summed_series(self.feedback[:, :, c], self.gather * self.albedo[:, c], self.bounces) for c in range(3)]
        return np.stack(columns, axis=2)

    def repainted(self, albedo: Mapping[str, tuple[float, float, float]]) -> tuple[Surfaces, Float32[ndarray, "r S 3"]]:
        """(the same with objects of another albedo, what that adds to the weights of shapes from irradiance on surfels)."""
        painted = self.painted(albedo)
        return painted, painted.transfer() - self.transfer()

    def series(self) -> Float32[ndarray, "r r 3"]:
        """Sum over k of feedback^k, all exchanges of light: what a change of albedo replaces."""
        return series_by_channel(self.feedback, self.bounces)

    def _share_of(self, name: str) -> Float32[ndarray, " S"]:
        if name not in self.names:
            known = ", ".join(self.names[:8]) + (", …" if len(self.names) > 8 else "")
            raise InputError(f"expected an object of the asset ({known}), found {name!r}")
        return self.shares[self.names.index(name)]


def with_albedo(asset: Asset, albedo: Mapping[str, tuple[float, float, float]]) -> Asset:
    """A transfer asset whose objects have another diffuse color: bounces off them change, everywhere.

    Parameters
    ----------
    asset
        Of the method transfer, fitted with `editable`, of irradiance.
    albedo
        Linear RGB from 0 to 1, by name of object.

    Returns
    -------
    Asset
        In memory. Its table of places, for engines without rays, is that of before. It has none of environments, which are
        measured by rays.

    Raises
    ------
    InputError
        On an object that the asset does not know, on a color out of range, and on an asset that cannot change.

    Examples
    --------
    >>> from srbf.methods.surface_changes import with_albedo
    >>> with_albedo(asset, {"Wall": (0.8, 0.1, 0.1)})  # doctest: +SKIP
    """
    surfaces = Surfaces.of(asset)
    for name, color in albedo.items():
        if not all(0 <= value <= 1 for value in color):
            raise InputError(f"expected an `albedo` of 0 to 1 for {name!r}, found {', '.join(f'{value:g}' for value in color)}")
    if asset.quantity != "irradiance":
        raise InputError(
            "expected an asset of irradiance to change the albedo of, found radiance, which has the albedo in it; bake irradiance"
        )
    if has_series(asset):
        painted = surfaces.painted(albedo)
        changed = replace(asset, manifest=dict(asset.manifest), tables=dict(asset.tables))
        set_albedo(changed, painted.albedo)
        set_series(changed, painted.series())
        painted.add_to(changed)
        return without_environment_table(changed)
    painted, added = surfaces.repainted(albedo)
    scale = float(asset.manifest["surfel_transfer"]["scale"])
    table = asset.tables["surfel_transfer"].astype(np.float32) * np.float32(scale) + added
    largest = float(2.0 ** np.ceil(np.log2(max(float(np.abs(table).max()) / 4096.0, 1e-30))))
    manifest = {**asset.manifest, "surfel_transfer": {**asset.manifest["surfel_transfer"], "scale": largest}}
    changed = replace(
        asset, manifest=manifest, tables={**asset.tables, "surfel_transfer": (table / np.float32(largest)).astype(np.float16)}
    )
    painted.add_to(changed)
    return without_environment_table(changed)


def emitted_by_objects(operator: TransferOperator) -> Emitted:
    """What each object that has surfels, in order of number, emits by itself: a mean radiance of 1.

    The mean is over its surfels that emit, of each color; an object that emits nothing, or nothing of a color, emits evenly. Those that
    emit in the scene count as more lights.
    """
    having, owner = np.unique(operator.objects, return_inverse=True)
    owner, areas = owner.ravel(), operator.cells.areas.astype(np.float64)
    result = np.zeros((len(owner), len(having), 3), np.float32)
    shines = operator.emission.any(axis=1)
    some = np.bincount(owner, areas * shines, len(having)) > 0
    shines |= ~some[owner]
    whole = np.bincount(owner, areas * shines, len(having))
    for c in range(3):
        mean = np.bincount(owner, areas * operator.emission[:, c], len(having)) / np.maximum(whole, 1e-30)
        lit = mean[owner] > 0
        pattern = np.where(lit, operator.emission[:, c] / np.maximum(mean[owner], 1e-30), shines)
        result[np.arange(len(owner)), owner, c] = np.pi * pattern
    return Emitted(result, np.where(some, SHINING, MAY_SHINE))
