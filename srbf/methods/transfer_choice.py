"""How many surfels, shapes and components a transfer asset needs for an error, by lights that its fit does not see."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float32, Float64, Int
from srbf.asset import Asset
from srbf.capture import Capture
from srbf.compute.full_precision import by_channel
from srbf.encode.model_selection import sampled_texels
from srbf.lights import PointLight
from srbf.methods.component_maps import ComponentMaps
from srbf.methods.surfel_tables import weights_of_shapes
from srbf.solve.radiosity import Bounces
from srbf.visibility.received import ReceivedLight
from srbf.visibility.surface_cells import Cells
from srbf.visibility.transfer_basis import TransferBasis, grouped, placed_of
from srbf.visibility.transfer_operator import TransferOperator

LIGHTS = 24  # random ones, where the capture has no validation lights
TEXELS = 4096  # that errors are measured on
SHAPES_SHARE, SURFELS_SHARE = 0.5, 0.8  # of an error, that shapes may have, and shapes with surfels: the rest is for components
FEWEST_RANK, FEWEST_SURFELS = 16, 64
STEP = 2**0.5  # between numbers of shapes, and of surfels, that are tried


@dataclass(frozen=True, eq=False)
class Judges:
    """N lights that a fit does not see, on n texels.

    `irradiance` (S, N) on the fine surfels; `exact` (n, N, 3) what the form factors give, uncompressed; `images` (n, N, 3) of validation
    lights, None of random ones; `texels` (n,); `weight` (n, 1, 3) from irradiance to the capture's quantity.
    """

    irradiance: Float32[ndarray, "S N"]
    exact: Float32[ndarray, "n N 3"]
    images: Float32[ndarray, "n N 3"] | None
    texels: Int[ndarray, " n"]
    weight: Float32[ndarray, "n 1 3"]

    @staticmethod
    def of(
        capture: Capture, operator: TransferOperator, received: ReceivedLight, bounces: Sequence[Bounces], free: Float64[ndarray, "F 3"]
    ) -> Judges:
        """The capture's validation lights, or else point lights at free places, where there are enough those that no shape is made for.

        `received`: on cells of which the patches are the surfels.
        """
        validation = capture.indices("validation")
        unused = placed_of(len(operator.cells.places))  # by `training_light`, from here on
        places = capture.positions(validation) if validation else free[unused if len(free) > unused else 0 :][:LIGHTS]
        lights = [PointLight((x, y, z), falloff="inverse-square") for x, y, z in places.tolist()]
        irradiance = received.white_on_patches(lights)
        texels = sampled_texels(capture, TEXELS)
        factors = operator.receivers[texels]
        weight = np.ones((len(texels), 1, 3), np.float32)
        albedo = capture.geometry("albedo") if capture.quantity == "radiance" else None
        if albedo is not None:
            weight *= (albedo.reshape(-1, 1, 3)[texels] / np.pi).astype(np.float32)
        exact = weight * np.stack([factors @ one.radiosity(irradiance) for one in bounces], axis=2)
        images = capture.sample(validation, texels) if validation else None
        return Judges(irradiance, exact, images, texels, weight)

    @property
    def words(self) -> str:
        """What they are."""
        kind = "random lights, against uncompressed form factors" if self.images is None else "validation lights"
        return f"{self.irradiance.shape[1]} {kind}"

    def uncompressed(self) -> float:
        """Relative RMSE of the form factors themselves against the images; 0 without images."""
        return 0.0 if self.images is None else _relative(self.exact, self.images)

    def error(self, found: Float32[ndarray, "n N 3"]) -> float:
        """Relative RMSE of pictures against the images, or without them against the form factors."""
        return _relative(found, self.exact if self.images is None else self.images)

    def lost(self, found: Float32[ndarray, "n N 3"]) -> float:
        """Relative RMSE against the form factors."""
        return _relative(found, self.exact)

    def of_shapes(self, basis: TransferBasis, cells: Cells, measured: Bool[ndarray, " S"], rank: int) -> Float32[ndarray, "n N 3"]:
        """Pictures by `rank` shapes, light measured on the patches of `cells`, which are the fine surfels that are `measured`."""
        light = patch_light(cells, self.irradiance[measured])
        weights = [
            grouped(basis.transfer[:rank, measured, c], cells.patches, cells.patch_count) @ light for c in range(basis.transfer.shape[2])
        ]
        return self.weight * np.stack([basis.shapes[self.texels, :rank] @ own for own in weights], axis=2)

    def of_asset(self, method: type[ComponentMaps], asset: Asset, cells: Cells, measured: Bool[ndarray, " S"]) -> list[ndarray]:
        """Pictures (n, N, 3) by an asset with fewer and fewer components: all, then four fewer, and so on."""
        light = patch_light(cells, self.irradiance[measured])
        scale, values = np.float32(asset.manifest["light_values"]["scale"]), by_channel(asset.tables["light_values"])
        shapes = weights_of_shapes(asset, np.repeat(light[:, :, None], 3, axis=2).astype(np.float64)).astype(np.float32)
        weights = np.stack([values[c % len(values)] @ shapes[..., c] for c in range(3)], axis=2) * scale  # (F, N, 3)
        component = np.arange(len(weights)) % (asset.components + 1)
        found = []
        for count in range(asset.components, 0, -4):
            kept = np.where((component <= count)[:, None, None], weights, 0).transpose(1, 0, 2).astype(np.float64)
            images = [method.weighted(asset, one[None])[0].reshape(-1, 3)[self.texels] for one in kept]
            found.append(np.stack(images, axis=1))
        return found


@dataclass(frozen=True, eq=False)
class Sizes:
    """What a choice may take: `cells_of` at most so many patches of the surfels that are `measured`; numbers of patches and of shapes."""

    cells_of: Callable[[int], Cells]
    measured: Bool[ndarray, " S"]
    counts: list[int]
    ranks: list[int]

    @staticmethod
    def of(cells_of: Callable[[int], Cells], measured: Bool[ndarray, " S"], surfels: int | None, most: int, rank: int) -> Sizes:
        """`surfels`: the number that is asked for; None: up to `most`. `rank`: shapes at most."""
        least = min(most, int(measured.sum()))
        return Sizes(cells_of, measured, _steps(FEWEST_SURFELS, least) if surfels is None else [surfels], _steps(FEWEST_RANK, rank))

    def smallest(self, judges: Judges, basis: TransferBasis, allowed: float) -> tuple[Cells, int]:
        """(cells in the fewest patches, the fewest shapes) that lose no more than `allowed`, or as many as there are."""
        count = int(self.measured.sum())
        every = replace(self.cells_of(self.counts[0]), patches=np.arange(count))

        def lost(cells: Cells, rank: int) -> float:
            return judges.lost(judges.of_shapes(basis, cells, self.measured, rank))

        rank = next((r for r in self.ranks if lost(every, r) <= SHAPES_SHARE * allowed), self.ranks[-1])
        low, high = 0, len(self.counts) - 1
        found = {high: self.cells_of(self.counts[high])}
        while low < high:
            middle = (low + high) // 2
            found[middle] = self.cells_of(self.counts[middle])
            low, high = (low, middle) if lost(found[middle], rank) <= SURFELS_SHARE * allowed else (middle + 1, high)
        return found[high], rank


@dataclass(frozen=True, eq=False)
class Fitted:
    """An asset of some sizes, with its error as its components are taken away, four at a time, none of them first."""

    asset: Asset
    cells: Cells
    rank: int
    errors: list[float]


def fit_for_error(
    error: float,
    judges: Judges,
    sizes: Sizes,
    basis: TransferBasis,
    components: int,
    encode: Callable[[TransferBasis, Cells, int], Asset],
    method: type[ComponentMaps],
    say: Callable[[str], None],
) -> Fitted:
    """The fewest shapes, surfels and, four by four, components, `components` at most, of which the relative RMSE is no more than `error`.

    All there are where it is not reached, with a line. Where the form factors themselves are off by more on validation lights, the error is
    that against the form factors.
    """
    own = judges.uncompressed()
    known = own < error
    if not known:
        say(
            f"expected an error of {error:.2%} on {judges.words}, found {own:.2%} for uncompressed form factors, noise of the renders "
            "included; choosing by the error against the form factors"
        )
    allowed = float(np.sqrt(error**2 - own**2)) if known else error
    words = judges.words if known else f"{judges.irradiance.shape[1]} validation lights, against uncompressed form factors"

    def fitted(cells: Cells, rank: int, count: int) -> Fitted:
        asset = encode(truncated(basis, rank), cells, count)
        pictures = judges.of_asset(method, asset, cells, sizes.measured)
        return Fitted(asset, cells, rank, [(judges.error if known else judges.lost)(one) for one in pictures])

    best = fitted(*sizes.smallest(judges, basis, allowed), components)
    if best.errors[0] > error and (best.rank, best.cells.patch_count) != (sizes.ranks[-1], sizes.counts[-1]):
        largest = fitted(sizes.cells_of(sizes.counts[-1]), sizes.ranks[-1], components)
        best = largest if largest.errors[0] < best.errors[0] else best
    spare = max((i for i, found in enumerate(best.errors) if found <= error), default=0)
    while spare:
        fewer = fitted(best.cells, best.rank, components - 4 * spare)
        if fewer.errors[0] <= error:
            best = fewer
            break
        spare -= 1
    if best.errors[0] > error:
        say(
            f"expected an error of {error:.2%}, found {best.errors[0]:.2%} on {words} with all shapes and surfels that help; "
            "raise `components` or `clusters`, or the `budget`"
        )
    say(
        f"chose {best.cells.patch_count} surfels, {best.rank} shapes and {best.asset.components} components: relative RMSE "
        f"{best.errors[0]:.2%} on {words}"
    )
    told = {"asked": error, "error": best.errors[0], "on": words}
    best.asset.manifest["source"]["fit"]["choice"] = told if judges.images is None else {**told, "uncompressed": own}
    return best


def truncated(basis: TransferBasis, rank: int) -> TransferBasis:
    """Its leading shapes."""
    return replace(
        basis,
        shapes=basis.shapes[:, :rank],
        transfer=basis.transfer[:rank],
        gather=basis.gather[:rank],
        sent=basis.sent[:, :rank],
        feedback=basis.feedback[:rank, :rank],
    )


def patch_light(cells: Cells, irradiance: Float32[ndarray, "N V"]) -> Float32[ndarray, "K V"]:
    """The mean of V lights over every patch, by area."""
    areas = np.maximum(np.bincount(cells.patches, cells.areas, cells.patch_count), 1e-30)
    weighted = np.ascontiguousarray(irradiance.T) * cells.areas
    return (grouped(weighted.astype(np.float32), cells.patches, cells.patch_count) / areas).T.astype(np.float32)


def _steps(low: int, high: int) -> list[int]:
    """From `low` to `high`, each STEP times the one before."""
    count = 1 + int(np.log(max(high / low, 1)) / np.log(STEP))
    return [*(n for k in range(count) if (n := round(low * STEP**k)) < high), high]


def _relative(found: ndarray, truth: ndarray) -> float:
    return float(np.sqrt(((found - truth).astype(np.float64) ** 2).sum() / max(float((truth.astype(np.float64) ** 2).sum()), 1e-30)))
