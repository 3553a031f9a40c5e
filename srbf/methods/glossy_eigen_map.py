"""The glossy eigen map: distant light on glossy surfaces, seen from anywhere, by an in-out factorization of their BRDF [Huang2010]."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, ClassVar, Literal

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64
from srbf.asset import Asset
from srbf.asset_reader import AssetReader
from srbf.brdf_factors import ANGLES, check_terms
from srbf.capture import COVERED, Capture
from srbf.cubemap_capture import CubemapCapture
from srbf.encode.clustered_components import clustered_components
from srbf.encode.cubemap_functions import functions_between
from srbf.encode.dilation import nearest_covered
from srbf.encode.light_values import light_values
from srbf.encode.model_selection import TexelSample
from srbf.encode.weighted_rows import LightSpace
from srbf.errors import InputError, ManifestError
from srbf.glossy_terms import GlossyTerms, groups_of
from srbf.io.image import Encoding
from srbf.light_domain import domain_of_asset, domain_of_capture
from srbf.lights import Light, PointLight
from srbf.methods.carried import carried_images, common_manifest
from srbf.methods.coefficient_maps import check_settings
from srbf.methods.component_maps import ComponentMaps, check_layers, components_of, read_cluster_index, stored_components
from srbf.methods.protocol import QUIET, FitRun, setting
from srbf.methods.seam_report import seam_report
from srbf.receiver_gloss import FactoredGloss, ReceiverGloss, describe, viewer_side

MOST_CLUSTERS = 256  # the index per texel is one byte
TEXELS_PER_CLUSTER = 96  # of the sample that clusters are made of


@dataclass(frozen=True)
class GlossyEigenMap(ComponentMaps):
    """Radiance toward any viewer under distant light, environments too [Huang2010, section 3; Liu2004; Wang2004].

    B(p, v) ~ T_0(p) L + sum_i g_i(p, v) T_i(p) L,  T_i(p, l) ~ w_{m,0,i}(l) + sum_j a_j(p) w_{m,j,i}(l), m the cluster of p

    T_0 is diffuse reflection with all bounces, by color; T_i = f_i V NoL, i = 1 … `terms`, where f_i and g_i are factors of the BRDF. All
    terms have the same components per texel, since they have the same visibility. The lights of a frame become one weight per function,
    term and color; per receiver, sums with these give 1 + `terms` colors, and their sum weighted by g_i toward the viewer is radiance.

    Parameters
    ----------
    clusters
        1 to 256: the index per texel is one byte.
    components
        How many numbers per texel.
    terms
        Of the factorization, 1 to 64; `auto`: as many as the bake was asked for.
    encoding
        Of the layers on disk: `half`, `float` or `uint8`.
    seed
        Of the clustering's random numbers.

    Raises
    ------
    InputError
        On a value out of range.

    Examples
    --------
    >>> GlossyEigenMap(terms=8).components
    12
    """

    name: ClassVar[str] = "glossy-eigen-map"
    order: ClassVar[int] = 9
    receivers: ClassVar[tuple[str, ...]] = ("lightmap", "vertices")
    implied_by: ClassVar[tuple[str, ...]] = ("terms",)
    has_shader: ClassVar[bool] = False
    exportable: ClassVar[bool] = False
    on_page: ClassVar[bool] = False
    has_report: ClassVar[bool] = False
    filterable: ClassVar[bool] = False
    tables: ClassVar[dict[str, str]] = {
        "light_coefficients": "light_coefficients.exr",
        "gloss": "gloss.exr",
        "cluster_index": "cluster_index.png",
    }

    clusters: int = setting(64, "How many clusters, at most 256.")
    components: int = setting(12, "How many numbers per texel.")
    terms: Literal["auto"] | int = setting("auto", "Of the BRDF's in-out factorization; auto: as the bake has them.", words=("auto",))
    encoding: Encoding = setting("uint8", "Of the layers on disk.")
    seed: int = 0

    def __post_init__(self) -> None:
        check_settings(self.components, "auto", "auto", self.encoding)
        if not 1 <= self.clusters <= MOST_CLUSTERS:
            raise InputError(f"expected 1 to {MOST_CLUSTERS} clusters, found {self.clusters}")
        if self.terms != "auto":
            check_terms(int(self.terms))

    def encode(self, capture: Capture, run: FitRun = QUIET) -> Asset:
        """Clusters and components from a quarter of the directions, then the functions of all of them by least squares.

        Parameters
        ----------
        capture
            Under a cubemap, with gloss.
        run
            `stitch` closes the seams of the terms.

        Returns
        -------
        Asset
            In memory.

        Raises
        ------
        InputError
            Where the capture has no gloss.

        Examples
        --------
        >>> GlossyEigenMap().encode(figure).manifest["gloss"]["terms"]  # doctest: +SKIP
        4
        """
        if not isinstance(capture, CubemapCapture) or capture.gloss_terms is None:
            raise InputError(f"expected the gloss of receivers under a cubemap in {capture.folder}, found none; bake with `gloss=4`")
        train, classes = capture.indices("train"), capture.receiver_gloss.classes()
        factors = FactoredGloss.of(capture.receiver_gloss, classes, capture.gloss_terms if self.terms == "auto" else int(self.terms))
        terms = GlossyTerms.of(capture, factors)
        coarse = terms.coarse()
        covered = int((capture.coverage() >= COVERED).sum())
        clusters = max(1, min(self.clusters, covered // (self.components + 1)))
        steps = len(train) + 2 * len(coarse.lights) + len(terms.lights)
        for first, block in capture.stream(train, run.on_image):  # the images as seen from above, for whoever watches
            run.progress(first + len(block), steps)
        done = len(train)
        sample = TexelSample.of(coarse, clusters * TEXELS_PER_CLUSTER, share=1.0)
        found = clustered_components(
            coarse,
            LightSpace.of(sample, "plain", coarse.angles),
            clusters,
            self.components,
            self.seed,
            run.stitch,
            QUIET.on_image,
            lambda images: run.progress(done + images, steps),
        )
        own = stored_components(capture, self.encoding, found.components, found, run.stitch)
        assert own.index is not None
        images = carried_images(capture, nearest_covered(capture.coverage()))
        domain = domain_of_capture(capture)
        manifest = common_manifest(capture, self.name, domain, images, asdict(self), {"terms": factors.terms})
        manifest |= own.entries(clusters)
        manifest["gloss"] = {"file": self.tables["gloss"], **describe(factors, classes)}
        asset = Asset(manifest, own.stored, own.scale, own.bias, {**own.tables(), "gloss": factors.table()[:, :, None]}, images)
        planes = components_of(asset.coefficients(), self.components).reshape(self.components, -1)
        done += 2 * len(coarse.lights)
        index = own.index.reshape(-1).astype(np.int64)
        values = light_values(terms, planes, index, clusters, lambda images: run.progress(done + images, steps))
        by_light = values.reshape(len(values), len(train), terms.groups, 3).transpose(1, 0, 2, 3).reshape(len(train), -1, 3)
        functions, fit = functions_between(capture.directions(train), by_light)
        manifest["source"]["fit"] |= fit
        manifest["light_basis"] = {"kind": "gaussian", "centers": functions.centers.tolist(), "spreads": functions.spreads.tolist()}
        manifest["light_coefficients"] = {"file": self.tables["light_coefficients"]}
        asset.tables["light_coefficients"] = functions.coefficients.astype(np.float16)
        if run.stitch is not None and own.unstitched is not None:
            manifest["seams"] = seam_report(asset, capture, run.stitch, own.unstitched, self.captured_responses, own.unstitched_index)
        return asset

    @classmethod
    def is_made_for(cls, capture: Capture) -> bool:
        return capture.gloss_terms is not None

    def __str__(self) -> str:
        terms = "" if self.terms == "auto" else f" of {self.terms} terms"
        return f"{self.clusters} clusters of {self.components} components{terms}{' as bytes' if self.encoding == 'uint8' else ''}"

    @classmethod
    def read_tables(cls, reader: AssetReader) -> dict[str, ndarray]:
        manifest = reader.manifest
        told, basis = manifest["gloss"], manifest["light_basis"]
        if any(len(one["orders"]) != told["terms"] for one in told["classes"]):
            raise ManifestError(f"expected {told['terms']} `orders` of every class of gloss in {reader.path}, found others")
        functions = check_layers(reader) * groups_of(told["terms"])
        reader.check_unit(basis["centers"])
        if len(basis["spreads"]) != functions:
            raise ManifestError(
                f"expected a spread for each of {functions} light functions in {reader.path}, found {len(basis['spreads'])}"
            )
        return {
            "light_coefficients": reader.stored_table("light_coefficients", (functions, len(basis["centers"])), 3),
            "gloss": reader.table("gloss", (2 * told["terms"] * len(told["classes"]), len(ANGLES)), 1),
            "cluster_index": read_cluster_index(reader),
        }

    @classmethod
    def projected_weights(cls, asset: Asset, lights: Sequence[Light]) -> Float64[ndarray, "F 3"]:
        """A row per function and term, (1 + terms) f + i, i = 0 the diffuse one's. InputError on lights at a place."""
        if any(isinstance(light, PointLight) for light in lights):
            raise InputError(
                "expected directional or environment lights for a glossy-eigen-map asset, found a light at a place; "
                "bake with `light_set=cloud` and `gloss=3`, and fit that"
            )
        terms, groups = cls._terms(asset), groups_of(cls._terms(asset))
        functions, count = asset.light_functions, asset.clusters * (asset.components + 1)
        weights = np.zeros((count, 1 + terms, 3))
        for coordinates, colors in domain_of_asset(asset.manifest).shared(lights):
            weights[:, 0] += functions.project(coordinates, colors).reshape(count, groups, 3)[:, 0]
            for c in range(3):
                own = functions.project(coordinates, np.repeat(colors[:, c, None], 3, axis=1)).reshape(count, groups, 3)
                weights[:, 1:, c] += own[:, 1:].reshape(count, -1)[:, :terms]
        return weights.reshape(-1, 3)

    @classmethod
    def terms_of(cls, asset: Asset, weights: Float64[ndarray, "F 3"]) -> Float32[ndarray, "k H W 3"]:
        """T_i L of all receivers, i = 0 … terms, from a frame's `projected_weights`."""
        return super().weighted(asset, np.ascontiguousarray(weights.reshape(-1, 1 + cls._terms(asset), 3).transpose(1, 0, 2)))

    @classmethod
    def viewer_factors(cls, asset: Asset, viewers: ndarray) -> Float32[ndarray, "k H W 3"]:
        """g_i of all receivers toward unit directions (H, W, 3), i = 0 … terms; g_0 is 1."""
        normals, glossy, lobe = (asset.images[name].reshape(-1, 3) for name in ("normal", "glossy", "lobe"))
        classes, orders = cls.classes(asset), [one["orders"] for one in asset.manifest["gloss"]["classes"]]
        factors = viewer_side(ReceiverGloss.of(glossy, lobe, normals), classes, orders, asset.tables["gloss"][:, :, 0])
        own = factors.of_viewers(np.asarray(viewers, np.float64).reshape(-1, 3)).transpose(1, 0, 2)
        return np.concatenate([np.ones_like(own[:1]), own]).reshape(-1, asset.height, asset.width, 3)

    @staticmethod
    def classes(asset: Asset) -> list[tuple[float, float, float]]:
        """As `ReceiverGloss.classes` of its capture."""
        return [(one["roughness"], one["along"], one["grazing"]) for one in asset.manifest["gloss"]["classes"]]

    @classmethod
    def weighted(cls, asset: Asset, weights: Float64[ndarray, "b F 3"]) -> Float32[ndarray, "b H W 3"]:
        """As seen from straight above every receiver."""
        seen = cls.viewer_factors(asset, asset.images["normal"])
        return np.stack([(seen * cls.terms_of(asset, one)).sum(axis=0) for one in weights])

    @classmethod
    def linear_response(cls, asset: Asset, lights: Sequence[Light]) -> Float32[ndarray, "H W 3"]:
        return cls.weighted(asset, cls.projected_weights(asset, lights)[None])[0]

    @classmethod
    def radiance_to(cls, asset: Asset, lights: Sequence[Light], viewer: tuple[float, float, float]) -> Float32[ndarray, "H W 3"]:
        if "position" not in asset.images:
            raise InputError("expected positions of the receivers in the asset for `viewer`, found none; fit again")
        ways = np.asarray(viewer, np.float64) - asset.images["position"]
        ways /= np.maximum(np.linalg.norm(ways, axis=2, keepdims=True), 1e-12)
        return (cls.viewer_factors(asset, ways) * cls.terms_of(asset, cls.projected_weights(asset, lights))).sum(axis=0)

    @classmethod
    def responses(cls, asset: Asset, coordinates: Float64[ndarray, "b d"]) -> Float32[ndarray, "b H W 3"]:
        """From above, g_i are the same for all lights: those of the terms are weights of the functions, before any sum over texels."""
        terms, groups = cls._terms(asset), groups_of(cls._terms(asset))
        values = asset.light_functions.evaluate(coordinates).reshape(len(coordinates), -1, groups, 3)
        diffuse = super().weighted(asset, np.ascontiguousarray(values[:, :, 0]))
        seen = cls.viewer_factors(asset, asset.images["normal"])[1:]
        for group in range(groups - 1):
            shown = super().weighted(asset, np.ascontiguousarray(values[:, :, 1 + group]))
            for k, factor in enumerate(seen[3 * group : min(3 * group + 3, terms)]):
                if factor.any():
                    diffuse += shown[..., k, None] * factor
        return diffuse

    @classmethod
    def local_lights(cls, lights: Sequence[Light]) -> list[PointLight]:
        return []

    @classmethod
    def describe(cls, asset: Asset) -> Mapping[str, Any]:
        told = asset.manifest["gloss"]
        gloss = [{key: one[key] for key in ("roughness", "along", "left_out")} for one in told["classes"]]
        return {
            **super().describe(asset),
            "light_basis": len(asset.manifest["light_basis"]["centers"]),
            "terms": told["terms"],
            "gloss": gloss,
        }

    @classmethod
    def summary(cls, asset: Asset) -> str:
        return f"{cls._terms(asset)} terms of gloss, {asset.clusters} clusters of {asset.components} components"

    @staticmethod
    def _terms(asset: Asset) -> int:
        return int(asset.manifest["gloss"]["terms"])


METHOD = GlossyEigenMap
