"""From what a user asks for to a method with its settings: by name, by bytes a texel, or by decibels."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from srbf.asset import Asset
from srbf.capture import Capture, Look
from srbf.encode.uv_seams import Stitch
from srbf.errors import InputError
from srbf.fitting.auto_method import DEFAULT_BUDGET, Planes, within_budget
from srbf.methods.clustered_eigen_map import ClusteredEigenMap
from srbf.methods.eigen_map import EigenMap
from srbf.methods.relighting_map import RelightingMap, Tiles

__all__ = ["DEFAULT_BUDGET", "DEFAULT_METHOD", "encode", "method_for", "method_of", "more_maps_than_lights", "settings_of"]

DEFAULT_METHOD = "relighting-map"

CLASSES: dict[str, type[RelightingMap] | type[EigenMap] | type[ClusteredEigenMap]] = {
    "relighting-map": RelightingMap,
    "eigen-map": EigenMap,
    "clustered-eigen-map": ClusteredEigenMap,
}
OF_METHOD = {
    "relighting-map": {"k", "basis", "centers", "encoding"},
    "eigen-map": {"scalars", "weighting", "encoding"},
    "clustered-eigen-map": {"scalars", "clusters", "encoding"},
    "auto": {"budget", "psnr"},
}


IMPLIED_BY = (  # the first that was given names the method
    ("auto", ("budget", "psnr")),
    ("relighting-map", ("k", "basis", "centers")),
    ("clustered-eigen-map", ("clusters",)),
    ("eigen-map", ("scalars", "weighting")),
)


def method_of(method: str | None, given: dict[str, Any]) -> str:
    """The method asked for, else the one that has the settings that were `given` (None: not), else the default."""
    if method is not None:
        return method
    return next((name for name, settings in IMPLIED_BY if any(given.get(s) is not None for s in settings)), DEFAULT_METHOD)


def settings_of(method: str, given: dict[str, Any], domain: str, spread: str, ridge: str) -> dict[str, Any]:
    """The settings of `method` out of what was `given` (None: not); InputError on one that it does not have."""
    settings = {name: value for name, value in given.items() if value is not None}
    for name in settings:
        if name not in OF_METHOD[method]:
            others = [other for other, names in OF_METHOD.items() if name in names]
            flag = "-k" if name == "k" else f"--{name}"
            raise InputError(f"expected {flag} with --method {' or '.join(others)}, found it with --method {method}")
    settings |= {"domain": domain, "spread": _spread(spread, method), "ridge": _number("ridge", ridge)}
    return settings


def method_for(
    capture: Capture, method: str, settings: dict[str, Any], say: Callable[[str], None] = lambda line: None
) -> RelightingMap | Planes:
    """The method with its settings; `auto` tries what fits on a sample of the capture. InputError where its lights are not directional."""
    capture.require_directional(f"--method {method}")
    if settings.get("domain") == "hemisphere":
        _require_above(capture, "--domain hemisphere")
    if settings.get("basis") == "hemispherical-harmonics":
        _require_above(capture, "--basis hemispherical-harmonics")
    if method == "auto":
        return within_budget(capture, say=say, **settings)
    return CLASSES[method](**settings)


def more_maps_than_lights(chosen: RelightingMap | Planes, capture: Capture) -> str | None:
    """A caution where a relighting map has more maps than the capture has train lights: the ridge alone decides between solutions."""
    lights = len(capture.indices("train"))
    if not isinstance(chosen, RelightingMap) or chosen.k <= lights:
        return None
    return (
        f"caution: {chosen.k} maps of {lights} train lights hold more than was seen; more photographs, or `k={lights}` and fewer, cost less"
    )


def encode(
    chosen: RelightingMap | Planes,
    capture: Capture,
    progress: Callable[[int, int], None] = lambda done, total: None,
    look: Look = lambda row, image: None,
    stitched: bool = True,
    tiles: Tiles | None = None,
) -> Asset:
    """The asset of a method, the capture's UV seams closed where it has any and `stitched` says so; by `tiles` a relighting map."""
    stitch = Stitch.of(capture) if stitched else None
    if isinstance(chosen, RelightingMap):
        return chosen.encode(capture, progress, look, stitch, tiles)
    if tiles is not None:
        raise InputError("expected a relighting map to be fitted by tiles, found another method")
    return chosen.encode(capture, progress, look, stitch)


def _require_above(capture: Capture, flags: str) -> None:
    """InputError where all train lights are below the hemisphere that `flags` ask for."""
    heights = capture.directions(capture.indices("train"))[:, 2]
    if len(heights) and (heights <= 0).all():
        raise InputError(f"expected train lights above the horizon (z > 0) for {flags}, found all {len(heights)} below; leave it out")


def _spread(text: str, method: str) -> Any:
    if method == "relighting-map" and text in ("mean", "min"):
        return text
    return _number("spread", text, ", mean, min" if method == "relighting-map" else "")


def _number(name: str, text: str, words: str = "") -> Any:
    if text == "auto":
        return text
    try:
        return float(text)
    except ValueError as error:
        raise InputError(f"expected --{name} auto{words} or a number, found {text!r}") from error
