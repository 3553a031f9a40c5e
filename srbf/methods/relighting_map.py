"""The relighting map: per texel, reflected light as a sum of k spherical Gaussians of one spread [Wong2005]."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal, get_args

import numpy as np
from numpy import ndarray

import srbf
from srbf.arrays import Float32, Float64
from srbf.asset import GEOMETRY, SCENE_FILE, Asset
from srbf.basis.gaussian import GaussianBasis, SpreadRule, lookup, r_table, spread_of
from srbf.capture import Capture
from srbf.dilation import dilate, nearest_covered
from srbf.errors import InputError
from srbf.image import HALF_MAX, Encoding
from srbf.lights import (
    DirectionalLight,
    EnvironmentLight,
    Light,
    PointLight,
    SpotLight,
    attenuation,
    environment_samples,
    moved,
    spot_cone,
)
from srbf.solve.least_squares import StreamedLeastSquares
from srbf.sphere import Domain, PointSet, domain_of, normalize, point_set

HALF_DIM = 2.0**-6  # below it a hundredth of a map's largest value is already a subnormal half
CHUNK = 1 << 16  # receivers, or environment texels, weighed at a time: (CHUNK, K) float64 stays in cache-sized memory


@dataclass(frozen=True)
class RelightingMap:
    """Per-texel least-squares fit of reflected light by spherical RBFs that share one spread.

    T(p, L) ~ sum_i c_i(p) exp(-acos(L . Q_i)^2 / (2 spread^2))            [Wong2005, eq. 1-2]

    k maps, centers Q_i of a point set on the domain (`auto`: the hemisphere where all lights are above it), spread by rule or in
    rad, `ridge` added to the normal equations' diagonal, and the encoding of the maps on disk.
    """

    k: int = 25
    centers: PointSet = "fibonacci"
    domain: Literal["auto"] | Domain = "auto"
    spread: SpreadRule | float = "mean"
    ridge: float = 0.0
    encoding: Encoding = "half"

    def __post_init__(self) -> None:
        if not 1 <= self.k <= 2048:
            raise InputError(f"expected 1 to 2048 maps (the layers of a texture array), found -k {self.k}")
        if not (np.isfinite(self.ridge) and self.ridge >= 0):
            raise InputError(f"expected a ridge of 0 or more, found {self.ridge:g}")
        if self.domain not in ("auto", *get_args(Domain)):
            raise InputError(f"expected a domain of auto, sphere, hemisphere, found {self.domain!r}")
        if self.encoding not in get_args(Encoding):
            raise InputError(f"expected an encoding of half, float, uint8, found {self.encoding!r}")

    def basis_for(self, directions: Float64[ndarray, "L 3"]) -> tuple[GaussianBasis, Domain]:
        """Centers, spread and domain for a capture whose train lights stand at `directions`."""
        domain = domain_of(directions) if self.domain == "auto" else self.domain
        centers = point_set(self.centers, self.k, domain)
        return GaussianBasis(centers, spread_of(centers, self.spread)), domain

    def encode(self, capture: Capture, progress: Callable[[int, int], None] = lambda done, total: None) -> Asset:
        """Fit the train lights of a capture: one k x L factorisation, each image read once, never a solve a texel.

        InputError where the lights are too few for k without a ridge. Numerical trouble (condition, rank, residual) is data in
        the manifest's `source.fit`; coefficients past half's range are kept by a scale and warned of.
        """
        train = capture.indices("train")
        if not train:
            raise InputError(f"expected train lights in {capture.folder}, found none")
        if len(train) < self.k and self.ridge == 0:
            raise InputError(
                f"expected at least as many train lights as maps, found {len(train)} lights for -k {self.k}; lower -k, or add --ridge 0.1"
            )
        directions = capture.directions(train)
        basis, domain = self.basis_for(directions)
        table = r_table(basis.spread)
        solve = StreamedLeastSquares(basis.evaluate(directions), self.ridge)
        for first, block in capture.blocks(train):
            solve.add(first, block.reshape(len(block), -1))
            progress(first + len(block), len(train))
        coefficients = solve.solve().reshape(self.k, capture.height, capture.width, 3)
        coverage = capture.coverage()
        nearest = nearest_covered(coverage)
        if nearest is not None:
            for i in range(self.k):
                coefficients[i] = dilate(coefficients[i], nearest)
        stored, scale, bias = quantize(coefficients, self.encoding)
        report = solve.report()
        images = _geometry(capture, coverage, nearest)
        manifest: dict[str, Any] = {
            "format": "srbf-asset",
            "version": 1,
            "method": "relighting-map",
            "quantity": capture.quantity,
            "transport": capture.transport,
            "width": capture.width,
            "height": capture.height,
            "basis": {"kind": "gaussian", "centers": basis.centers.tolist(), "spread": basis.spread},
            "domain": domain,
            "maps": [
                {
                    "file": f"map_{i:02d}." + ("png" if self.encoding == "uint8" else "exr"),
                    "encoding": self.encoding,
                    "scale": scale[i].astype(float).tolist(),
                    "bias": bias[i].astype(float).tolist(),
                }
                for i in range(self.k)
            ],
            "r_table": {"file": "r_table.exr", "size": len(table)},
            **{name: f"{name}.exr" for name in images},
            **_kept_apart(capture),
            "row_origin": "top",
            "axes": "z-up-right-handed",
            "asset_from_world": np.eye(4).tolist(),
            "source": {
                "srbf": srbf.__version__,
                **{key: capture.manifest[key] for key in ("receiver", "receivers") if key in capture.manifest},
                **{key: made[key] for key in ("scene_sha256",) if key in (made := capture.manifest.get("source", {}))},
                "settings": asdict(self),
                "fit": {"train_lights": len(train), **_finite(asdict(report))},
            },
        }
        scene = capture.scene() if "scene" in manifest else None
        return Asset(manifest, stored, scale, bias, table, images, scene)


def quantize(
    coefficients: Float32[ndarray, "K H W 3"], encoding: Encoding
) -> tuple[ndarray, Float32[ndarray, "K 3"], Float32[ndarray, "K 3"]]:
    """(stored, scale, bias) with coefficients ~ stored * scale + bias; a uint8 counts as byte / 255.

    float and half keep scale 1 and bias 0, unless a half would overflow (then that map's channel is scaled down, with a warning) or
    is so dim that half floats thin out.
    """
    k = len(coefficients)
    scale, bias = np.ones((k, 3), np.float32), np.zeros((k, 3), np.float32)
    if encoding == "float":
        return coefficients, scale, bias
    if encoding == "half":
        largest = np.abs(coefficients).max(axis=(1, 2))  # (K, 3)
        dim = (largest > 0) & (largest < HALF_DIM)
        scale[dim] = largest[dim]
        too_large = largest > HALF_MAX
        if too_large.any():
            scale[too_large] = (largest[too_large] / (HALF_MAX * 0.999)).astype(np.float32)
            warnings.warn(
                f"coefficients reach {largest.max():.3g}, past half float's {HALF_MAX:.0f}: scaled, but such maps cancel each other "
                "and lose the picture in any half or 8-bit file; add --ridge, or match --domain to the lights",
                stacklevel=2,
            )
        return (coefficients / scale[:, None, None]).astype(np.float16), scale, bias
    low, high = coefficients.min(axis=(1, 2)), coefficients.max(axis=(1, 2))
    bias = low
    scale = np.where(high > low, high - low, 1).astype(np.float32)
    stored = np.empty(coefficients.shape, np.uint8)
    for i in range(k):
        stored[i] = np.round(np.clip((coefficients[i] - bias[i]) / scale[i], 0, 1) * 255)
    return stored, scale, bias


def relight(asset: Asset, lights: Sequence[Light]) -> Float32[ndarray, "H W 3"]:
    """max(0, sum over lights) + ambient, for any number of lights of any kind at once.

    Directional and environment lights fold into one weight a map and colour, so a hundred of them cost as one; a point or
    spot light weighs every receiver by itself [Wong2005, "Directional-Source Relighting", "Point-Source Relighting"].
    """
    total = linear_response(asset, lights)
    np.maximum(total, 0, out=total)
    if "ambient" in asset.images:
        total += asset.images["ambient"]
    return total


def linear_response(asset: Asset, lights: Sequence[Light]) -> Float32[ndarray, "H W 3"]:
    """The sum over lights before the clamp and without ambient: linear in every light's colour."""
    total = np.zeros((asset.height, asset.width, 3), np.float32)
    weights = folded_weights(asset, lights)
    local = [lamp for light in lights if isinstance(lamp := moved(light, asset.asset_from_world), PointLight)]
    folded = bool(weights.any())
    rows_at_a_time = max(1, CHUNK // asset.width)
    for start in range(0, asset.height if folded or local else 0, rows_at_a_time):
        rows = slice(start, start + rows_at_a_time)
        c = asset.coefficients(rows)  # (K, h, W, 3)
        if folded:
            total[rows] += np.einsum("khwc,kc->hwc", c, weights.astype(np.float32), optimize=True)
        for light in local:
            total[rows] += _lamp(asset, light, rows, c)
    return total


def directional_responses(asset: Asset, directions: Float64[ndarray, "b 3"]) -> Float32[ndarray, "b H W 3"]:
    """`linear_response` to a white light from each of many unit directions: one (b, K) x (K, H W 3) product."""
    inside = normalize(directions @ asset.asset_from_world[:3, :3].T)
    weights = lookup(asset.table, inside @ asset.basis.centers.T).astype(np.float32)  # (b, K)
    images = np.empty((len(weights), asset.height, asset.width, 3), np.float32)
    rows_at_a_time = max(1, CHUNK // asset.width)
    for start in range(0, asset.height, rows_at_a_time):
        rows = slice(start, start + rows_at_a_time)
        c = asset.coefficients(rows)
        images[:, rows] = (weights @ c.reshape(asset.k, -1)).reshape(len(weights), *c.shape[1:])
    return images


def folded_weights(asset: Asset, lights: Sequence[Light]) -> Float64[ndarray, "K 3"]:
    """One weight a map and colour for all directional and environment lights: sum of color R_i(L) and of W_i = int E R_i."""
    weights = np.zeros((asset.k, 3))
    for light in lights:
        if isinstance(light, DirectionalLight):
            weights += directional_weights(asset, np.array(light.direction))[:, None] * light.color
        elif isinstance(light, EnvironmentLight):
            weights += environment_weights(asset, light)
    return weights


def directional_weights(asset: Asset, direction: Float64[ndarray, " 3"]) -> Float64[ndarray, " K"]:
    """R_i(L) of every map for one unit direction, from the asset's table [Wong2005, fig. 6]."""
    return lookup(asset.table, asset.basis.centers @ normalize(asset.asset_from_world[:3, :3] @ direction))


def environment_weights(asset: Asset, light: EnvironmentLight) -> Float64[ndarray, "K 3"]:
    """W_i = integral of E(w) R_i(w) over the captured domain: no cosine (T holds it), no normalisation. H W K table reads."""
    linear = asset.asset_from_world[:3, :3]
    rotation = linear / np.cbrt(np.linalg.det(linear))
    directions, solid_angle = environment_samples(light.image, asset.domain, rotation)
    height, width = light.image.shape[:2]
    centers = asset.basis.centers
    weights = np.zeros((asset.k, 3))
    rows_at_a_time = max(1, CHUNK // width)
    for start in range(0, height, rows_at_a_time):
        rows = slice(start, start + rows_at_a_time)
        radiance = light.image[rows] * solid_angle[rows, :, None]
        weights += lookup(asset.table, directions[rows].reshape(-1, 3) @ centers.T).T @ radiance.reshape(-1, 3)
    return weights * light.color


def receiver_weights(
    asset: Asset, light: PointLight, positions: Float32[ndarray, "*p 3"]
) -> tuple[Float64[ndarray, "*p K"], Float64[ndarray, "*p"]]:
    """R_i(L^) and the attenuation (times a spot's cone) for receivers at `positions`, in the asset's frame [Wong2005, fig. 8-10]."""
    vectors = np.array(light.position) - positions  # L = S - P, eq. 3
    distance = np.linalg.norm(vectors, axis=-1)
    unit = vectors / np.maximum(distance, 1e-30)[..., None]
    weights = lookup(asset.table, unit @ asset.basis.centers.T)
    strength = attenuation(distance, light)
    if isinstance(light, SpotLight):
        cos_angle = -(unit @ np.array(light.direction))
        strength = strength * spot_cone(cos_angle, np.cos(light.inner), np.cos(light.outer))
    return weights, strength


def outside_domain(asset: Asset, lights: Sequence[Light]) -> list[str]:
    """A line for each light that shines from where nothing was captured; such lights evaluate unchanged."""
    if asset.domain == "sphere":
        return []
    notes = []
    for i, light in enumerate(lights):
        light = moved(light, asset.asset_from_world)
        if isinstance(light, DirectionalLight) and light.direction[2] <= 0:
            notes.append(f"light {i} comes from below the captured hemisphere (z = {light.direction[2]:.3g}): its answer is extrapolated")
        elif isinstance(light, PointLight) and "position" in asset.images:
            heights = asset.images["position"][..., 2]
            below = float((light.position[2] <= heights[asset.covered]).mean()) if asset.covered.any() else 0.0
            if below > 0:
                notes.append(f"light {i} is below {below:.0%} of the receivers, outside the captured hemisphere: extrapolated there")
    return notes


def _lamp(asset: Asset, light: PointLight, rows: slice, c: np.ndarray) -> np.ndarray:
    if "position" not in asset.images:
        raise InputError("point and spot lights need a position map, and this asset has none; relight it by directional lights")
    weights, strength = receiver_weights(asset, light, asset.images["position"][rows])
    weights *= strength[..., None]
    return np.einsum("khwc,hwk->hwc", c, weights.astype(np.float32), optimize=True) * np.array(light.color, np.float32)


def _geometry(capture: Capture, coverage: np.ndarray, nearest: np.ndarray | None) -> dict[str, np.ndarray]:
    """The receivers' images that go along, dilated as the maps are."""
    images: dict[str, np.ndarray] = {}
    for name in GEOMETRY:
        if name not in capture.manifest or (name == "albedo" and not _needs_albedo(capture)):
            continue
        if name == "coverage":
            images[name] = coverage
        else:
            image = capture.ambient() if name == "ambient" else capture.geometry(name)  # type: ignore[arg-type]
            assert image is not None
            images[name] = dilate(image, nearest)
    return images


def _needs_albedo(capture: Capture) -> bool:
    """Direct light is added as irradiance; only radiance has the albedo in it."""
    return capture.transport == "indirect" and capture.quantity == "radiance"


def _kept_apart(capture: Capture) -> dict[str, Any]:
    """What an indirect asset says of the direct light to be added: how it was sampled, and the scene that shadows it."""
    if capture.transport != "indirect":
        return {}
    keys = {"direct": capture.manifest["direct"]} if "direct" in capture.manifest else {}
    return {**keys, **({"scene": SCENE_FILE} if "scene" in capture.manifest else {})}


def _finite(report: dict[str, Any]) -> dict[str, Any]:
    """JSON has no infinity: an infinite condition number is written as null."""
    return {key: value if np.isfinite(value) else None for key, value in report.items()}
