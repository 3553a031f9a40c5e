"""Direct-to-indirect transfer: bounces of any light, by the direct light that it lays on surfels of the scene."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, Literal

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float32, Float64, Int
from srbf.asset import Asset
from srbf.asset_reader import AssetReader
from srbf.capture import Capture, InMemoryCapture
from srbf.captured_light import NOWHERE, CapturedLight
from srbf.compute.allocator import freed_memory_kept
from srbf.encode.table_steps import steps_by_cluster, steps_by_column
from srbf.errors import InputError
from srbf.io.image import Encoding
from srbf.io.packed_table import Packed
from srbf.lights import EnvironmentLight, Light, NamedLight
from srbf.methods import kept_visibility
from srbf.methods.environment_table import FILES as TABLE_FILES
from srbf.methods.environment_table import (
    add_environment_table,
    environment_columns,
    environment_weights,
    has_environment_table,
    read_environment_table,
)
from srbf.methods.kept_visibility import RECEIVER_VISIBILITY_HELP, VISIBILITY_HELP, check_visibility, light_on_patches
from srbf.methods.light_table_maps import check_table_settings, encode_table, pack_table
from srbf.methods.lights_inside_maps import LightsInsideMaps
from srbf.methods.protocol import QUIET, FitRun, check_error, setting
from srbf.methods.surface_changes import EMISSION_FILE, FILES, Surfaces, emitted_by_objects
from srbf.methods.surface_changes import KEY as SURFACES
from srbf.methods.surfel_tables import FILES as SURFEL_FILES
from srbf.methods.surfel_tables import add_surfel_tables, read_surfel_tables, sizes_of, weights_of_shapes, with_transfer
from srbf.methods.transfer_choice import Judges, Sizes, fit_for_error, truncated
from srbf.visibility.cloud_lights import CloudLights
from srbf.visibility.received import ReceivedLight
from srbf.visibility.surface_cells import DARK, Cells
from srbf.visibility.surfel_groups import SurfelEffects
from srbf.visibility.transfer_basis import MOST_RANK, RANK_ERROR, TransferBasis, exchange_of, grouped, training_light, transfer_basis
from srbf.visibility.transfer_operator import TransferOperator

PACKED: dict[str, Packed] = {"light_values": "rows", "position_basis": "columns"}
MOST_SURFELS = 8000
MERGED_ERROR = 0.003  # of pictures, rms over lights, that `auto` leaves out by fewer surfels
SHAPES_LEFT_OUT = 0.25  # of an error that is asked for, on the lights that shapes are made for
MOST_TRIED = 64  # components of a candidate
FEWEST_CLUSTERS, MOST_CLUSTERS = 16, 256
TEXELS_PER_CLUSTER = 24  # at least, of a candidate
MOST_BYTES = 3 << 30  # of the shapes in memory


@dataclass(frozen=True)
class Transfer(LightsInsideMaps):
    """Indirect light of any lights inside the scene, at the cost of one distant light per texel [Lehtinen2008].

    T(p) ~ w_{m,0} + sum_j a_j(p) w_{m,j},  w = Q R e, m the cluster of p

    e is the direct irradiance that the lights lay on S surfels; R (r, S) takes it, all bounces included, to weights of the r shapes that
    light makes on the receivers; Q are the functions of components and clusters for each shape. The capture's form factors give R, so that
    no light is rendered.

    Parameters
    ----------
    surfels
        How many parts of the surfaces a light is measured by, at most 8000; `auto`: as few as leave out 0.3 % of pictures.
    rank
        How many shapes; `auto`: as many as leave out 1.5 % of many lights' pictures, by norm, at most 640.
    clusters
        1 to 256: the index per texel is one byte.
    components
        How many numbers per texel.
    error
        Relative RMSE, 0 to 1, that is not to be exceeded on validation lights or, without these, on random lights against the uncompressed
        form factors: by the fewest shapes and surfels, where these are `auto`, and the fewest components, four by four. A line tells.
    editable
        Keep what changed albedo and emission of objects need.
    smooth
        Average components over neighbors on the surface that differ by no more than the noise of the rays.
    encoding
        Of the layers on disk: `half`, `float` or `uint8`.
    visibility
        `pca:COUNT`: keep what each surfel sees as so many coefficients, for light without rays [Nowrouzezahrai2007]; `none`.
    receiver_visibility
        Keep what each receiver sees as well, for direct light without shadow maps.
    seed
        Of random numbers.

    Raises
    ------
    InputError
        On a value out of range.

    Examples
    --------
    >>> Transfer(clusters=64).rank
    'auto'
    """

    name: ClassVar[str] = "transfer"
    order: ClassVar[int] = 8
    domains: ClassVar[tuple[str, ...]] = ("surfels",)
    takes_objects: ClassVar[bool] = True
    tables: ClassVar[dict[str, str]] = {
        **LightsInsideMaps.tables,
        **SURFEL_FILES,
        **FILES,
        **EMISSION_FILE,
        **TABLE_FILES,
    }

    surfels: Literal["auto"] | int = setting("auto", "Parts of the surfaces that lights are measured by.", words=("auto",))
    rank: Literal["auto"] | int = setting("auto", "Shapes of light on the receivers.", words=("auto",))
    clusters: int = setting(64, "How many clusters, at most 256.")
    components: int = setting(12, "How many numbers per texel.")
    error: float | None = None
    editable: bool = setting(False, "Keep what changed albedo and emission need, for `srbf relight --albedo` and `--emissive`.")
    smooth: bool = setting(False, "Take the noise of few rays out of the components.")
    encoding: Encoding = setting("uint8", "Of the layers on disk.")
    visibility: str = setting("none", VISIBILITY_HELP)
    receiver_visibility: bool = setting(False, RECEIVER_VISIBILITY_HELP)
    seed: int = 0

    def __post_init__(self) -> None:
        check_table_settings(self.components, self.clusters, self.encoding)
        check_visibility(self.visibility, self.receiver_visibility)
        if self.surfels != "auto" and not 1 <= self.surfels <= MOST_SURFELS:
            raise InputError(f"expected `surfels` auto or 1 to {MOST_SURFELS}, found {self.surfels}")
        check_error(self.error)
        if self.rank != "auto" and not self.rank >= 1:
            raise InputError(f"expected `rank` auto or 1 or more, found {self.rank}")

    @freed_memory_kept()
    def encode(self, capture: Capture, run: FitRun = QUIET) -> Asset:
        """Shapes from the capture's form factors, then components of the shapes in clusters.

        Parameters
        ----------
        capture
            Of surfels.
        run
            `stitch` closes the seams of the images.

        Returns
        -------
        Asset
            In memory.

        Raises
        ------
        InputError
            Where the capture lacks its scene, or no light reaches a receiver.
        ImageError
            Where its form factors cannot be read.

        Examples
        --------
        >>> Transfer().encode(inside).manifest["surfel_transfer"]["rank"]  # doctest: +SKIP
        137
        """
        inside = CloudLights.of(capture)
        operator = TransferOperator.read(capture.folder)
        if not operator.receivers.nnz:
            raise InputError(
                f"expected receivers in {capture.folder} that see lit surfaces, found none; choose others, or other `light_bounds`"
            )
        measured = np.full(len(operator.objects), True) if self.editable else operator.cells.albedo.max(axis=1) >= DARK
        cells = operator.cells.at(measured)

        told = capture.manifest["surfels"]
        parts = self._parts(inside, operator)
        received = ReceivedLight(parts, inside.occluders)
        lit = training_light(operator, received, inside.free, self.seed)
        most = max(1, min(MOST_RANK, MOST_BYTES // (12 * capture.width * capture.height)))
        asked = None if self.rank == "auto" else int(self.rank)
        emitted = emitted_by_objects(operator) if self.editable else None
        exchange, bounces = exchange_of(operator, told.get("bounces"))
        left_out = RANK_ERROR if self.error is None else min(RANK_ERROR, SHAPES_LEFT_OUT * self.error)
        basis = transfer_basis(operator, lit, (exchange, bounces), asked, self.seed, most, emitted, left_out)
        effects = SurfelEffects.of(cells, lit[measured], basis.at(measured), self.editable, self.seed)
        owners = operator.objects[measured] if self.editable else np.zeros(len(cells.places), np.int64)  # an object emits by itself

        def cells_of(count: int, merged: float = 0.0) -> Cells:
            return cells.with_patches(effects.groups(cells, owners, count, merged))

        silent = replace(run, on_image=QUIET.on_image)

        def encode(basis: TransferBasis, cells: Cells, components: int) -> Asset:
            return replace(self, components=components)._of_basis(capture, silent, basis, cells, measured, told.get("bounces"))

        if self.error is None:
            cells = cells_of(MOST_SURFELS, MERGED_ERROR) if self.surfels == "auto" else cells_of(int(self.surfels))
            asset = encode(basis, cells, self.components)
        else:
            judges = Judges.of(capture, operator, received, bounces, inside.free)
            surfels = None if self.surfels == "auto" else int(self.surfels)
            sizes = Sizes.of(cells_of, measured, surfels, MOST_SURFELS, basis.shapes.shape[1])
            found = fit_for_error(self.error, judges, sizes, basis, self.components, encode, Transfer, run.say)
            asset, cells, basis = found.asset, found.cells, truncated(basis, found.rank)
        if operator.environment is not None:
            columns = steps_by_column(environment_columns(basis.transfer, operator.environment), basis.sizes)
            add_environment_table(asset, columns, operator.environment)
        if self.editable:
            names = tuple(told.get("objects", ()))
            Surfaces.of_basis(basis, operator, cells.patches, names, told.get("bounces")).add_to(asset)
        inside = replace(inside, cells=_of_groups(parts, measured, cells.patches))
        asset.manifest["interpolation"] = {"kind": "surfels"}
        asset.manifest["source"]["fit"]["train_lights"] = lit.shape[1]
        self.add_places(asset, inside)
        for name, by in PACKED.items():
            pack_table(asset, name, by)
        self.add_visibility(asset, inside)
        return asset

    def _parts(self, inside: CloudLights, operator: TransferOperator) -> Cells:
        """Where light is measured, the surfel of each as its patch: several points of a surfel, or one where compressed depths are kept."""
        return inside.cells if self.visibility == kept_visibility.NONE else operator.cells

    def _of_basis(
        self, capture: Capture, run: FitRun, basis: TransferBasis, cells: Cells, measured: Bool[ndarray, " S"], bounces: int | None
    ) -> Asset:
        """Components of the shapes in clusters, and weights of the shapes from light on the patches of `cells`, the `measured` surfels."""
        rank = basis.shapes.shape[1]
        energy = (basis.shapes**2).sum(axis=1)
        asset = encode_table(self, _of_shapes(capture, basis), run, np.eye(rank), self.clusters, self.seed, energy=energy)
        if capture.quantity == "irradiance":  # shapes have no color
            asset.tables["light_values"] = asset.tables["light_values"][:, :, :1].copy()
            asset.manifest["light_values"]["channels"] = 1
        asset.tables["light_values"] = steps_by_cluster(asset.tables["light_values"], asset.clusters)
        gather, albedo = _gathered(basis.gather[:, measured], cells)
        add_surfel_tables(asset, gather, albedo, basis.series(bounces), basis.sizes)
        return asset

    @classmethod
    def candidates(cls, size: int, texels: int, numbers: int) -> Iterable[Transfer]:
        """Bytes, four to a layer, and one for the cluster; as many clusters as the texels fill."""
        components = min((size - 1) // 4 * 4, MOST_TRIED)
        if components >= 1:
            yield cls(clusters=int(np.clip(texels // TEXELS_PER_CLUSTER, FEWEST_CLUSTERS, MOST_CLUSTERS)), components=components)

    @classmethod
    def read_tables(cls, reader: AssetReader) -> dict[str, ndarray]:
        return {
            **super().read_tables(reader),
            **read_surfel_tables(reader),
            **Surfaces.read(reader),
            **read_environment_table(reader),
        }

    @classmethod
    def with_plain_tables(cls, asset: Asset) -> Asset:
        """With one matrix from irradiance on surfels to weights of shapes."""
        plain = with_transfer(super().with_plain_tables(asset))
        if SURFACES in asset.manifest:
            Surfaces.of(asset).add_to(plain)
        return plain

    @classmethod
    def needs_rays(cls, asset: Asset, light: Light) -> bool:
        """An environment map does not, where the asset knows the environment, nor does an object that emits."""
        return not (isinstance(light, NamedLight) or (isinstance(light, EnvironmentLight) and has_environment_table(asset)))

    @classmethod
    def column_weights(cls, asset: Asset, lights: Sequence[Light]) -> Float64[ndarray, "N 3"]:
        """A named light is an object whose surfaces emit radiance of its color."""
        rank, surfels = sizes_of(asset)
        received, emitted = np.zeros((surfels, 3)), np.zeros((rank, 3))
        surfaces = Surfaces.of(asset) if any(isinstance(light, NamedLight) for light in lights) else None
        for light in lights:
            if isinstance(light, NamedLight):
                assert surfaces is not None
                emitted += surfaces.emitted(light.name, np.array(light.color))
            elif isinstance(light, EnvironmentLight) and has_environment_table(asset):
                emitted += environment_weights(asset, light)
            else:
                received += light_on_patches(asset)(light)
        return weights_of_shapes(asset, received) + emitted

    @classmethod
    def summary(cls, asset: Asset) -> str:
        rank, surfels = sizes_of(asset)
        return f"{surfels} surfels, rank {rank}, {asset.clusters} clusters of {asset.components} components"


def _of_groups(parts: Cells, measured: Bool[ndarray, " S"], groups: Int[ndarray, " M"]) -> Cells:
    """Parts of the M `measured` surfels, in the group that each of these is in."""
    group = np.full(len(measured), -1, np.int64)
    group[measured] = groups
    return parts.with_patches(group[parts.patches]).at(measured[parts.patches])


def _gathered(gather: Float32[ndarray, "r S"], cells: Cells) -> tuple[Float32[ndarray, "r M"], Float32[ndarray, "M 3"]]:
    """(`gather`, the albedo) of the patches of `cells`: light is even over a patch, and each of its surfels reflects by its own albedo."""
    count, areas = cells.patch_count, cells.areas.astype(np.float64)
    whole = np.maximum(np.bincount(cells.patches, areas, count), 1e-30)
    albedo = np.stack([np.bincount(cells.patches, areas * cells.albedo[:, c], count) / whole for c in range(3)], axis=1)
    own, mean = cells.albedo.mean(axis=1), albedo.mean(axis=1)[cells.patches]
    share = np.divide(own, mean, out=np.ones_like(mean), where=mean > 0)
    return grouped(gather * share.astype(np.float32), cells.patches, count), albedo.astype(np.float32)


def _of_shapes(capture: Capture, basis: TransferBasis) -> Capture:
    """The capture with its shapes as images, in its quantity."""
    shapes = basis.shapes[:, :, None]
    if capture.quantity == "radiance":
        albedo = capture.geometry("albedo")
        if albedo is None:
            raise InputError(f"expected the albedo of the receivers in {capture.folder}, found none; bake again")
        responses = shapes * (albedo.reshape(-1, 1, 3) / np.float32(np.pi))
    else:
        responses = np.repeat(shapes, 3, axis=2)
    lights = tuple(CapturedLight(NOWHERE, "train", "", kind="patch", patch=i) for i in range(shapes.shape[1]))
    return InMemoryCapture(capture.folder, capture.manifest, lights, responses, capture.coverage())


METHOD = Transfer
