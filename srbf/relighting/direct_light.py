"""Which way of adding direct light an asset takes, and making it."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from types import TracebackType
from typing import Literal, Protocol, runtime_checkable

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64
from srbf.asset import Asset
from srbf.capture import Capture
from srbf.errors import InputError, MissingLibraryError
from srbf.io.scene_glb import KNOTS, Triangles
from srbf.light_domain import Directions
from srbf.lights import EnvironmentLight, Light, NamedLight, moved
from srbf.methods import in_asset_frame, method_of
from srbf.methods.kept_visibility import kept_visibility, receiver_points
from srbf.visibility.embree import has_embree
from srbf.visibility.glossy_direct import GlossyMaps, GlossyRays, has_gloss
from srbf.visibility.pca_direct import PcaDirect
from srbf.visibility.rays import RayTracer
from srbf.visibility.receivers import Receivers
from srbf.visibility.shadow_map import ShadowMapper

Direct = Literal["none", "ray", "shadow-map", "pca"]
NAMES = {
    "ray": "exact direct light by rays",
    "shadow-map": "direct light by shadow maps",
    "pca": "direct light by compressed depths",
}


@runtime_checkable
class DirectLight(Protocol):
    """Adds what an indirect asset leaves out; lights are in the asset's frame."""

    def response(self, lights: Sequence[Light]) -> Float32[ndarray, "H W 3"]:
        """The direct light of `lights`, that of lobes included where a view has them; rays alone add environments, none named lights."""

    def directional(self, directions: Float64[ndarray, "b 3"]) -> Float32[ndarray, "b H W 3"]:
        """`response` to a white light from each of many directions."""


def chosen(asset: Asset, asked: Direct | None) -> Direct:
    """`asked`, or the default: none for a combined asset, rays for an indirect one where embreex is there (else a shadow map).

    InputError for direct light on a combined asset, which holds it already.
    """
    if asset.transport == "combined":
        if asked not in (None, "none"):
            raise InputError(f"expected an indirect asset for `direct={asked}`, found a combined one: it holds the direct light already")
        return "none"
    if asked is not None:
        return asked
    if asset.scene is None:
        return "none"
    return "ray" if has_embree() else "shadow-map"


def by_receiver_depths(source: Asset | Capture) -> PcaDirect:
    """InputError where the source is no asset, or one that does not keep what its receivers see."""
    if not isinstance(source, Asset) or "receiver_visibility" not in source.manifest:
        raise InputError(
            "expected an asset that keeps what its receivers see for `direct=pca`, found none; "
            "fit with `visibility=pca:50` and `receiver_visibility`"
        )
    _, normals = receiver_points(source)
    none = np.zeros((0, 3, 3), np.float32)  # no triangle is looked at
    triangles = Triangles(none, none, np.zeros(0, np.int64), np.zeros(0, bool), np.zeros((0, KNOTS, 3), np.float32))
    sampling = source.manifest.get("direct", {"sun_angle": 0.0})
    receivers = Receivers(source.width, source.height, source.quantity, dict(source.images), triangles, sampling)
    return PcaDirect(receivers, kept_visibility(source, "receiver_visibility", normals))


class BothSides:
    """What the pixels of a view reflect, and what they let through of the light on the backs of their surfaces."""

    def __init__(self, front: DirectLight, back: DirectLight) -> None:
        self._front, self._back = front, back

    def response(self, lights: Sequence[Light]) -> Float32[ndarray, "H W 3"]:
        """Of both sides."""
        return self._front.response(lights) + self._back.response(lights)

    def directional(self, directions: Float64[ndarray, "b 3"]) -> Float32[ndarray, "b H W 3"]:
        """Of both sides, to a white light from each of many directions."""
        return self._front.directional(directions) + self._back.directional(directions)


class Added:
    """The direct light of one asset or capture, made ready once; a context manager."""

    def __init__(self, source: Asset | Capture, kind: Direct) -> None:
        self._stack = ExitStack()
        self._kind, self._source = kind, source
        self._frame = source.asset_from_world if isinstance(source, Asset) else np.eye(4)
        self._emits = isinstance(source, Asset) and method_of(source).takes_objects
        self._light: DirectLight | None = None
        if kind == "pca":
            self._light = by_receiver_depths(source)
        elif kind != "none":
            receivers = Receivers.of(source)
            front, back = self._on(receivers, kind), receivers.behind()
            self._light = front if back is None else BothSides(front, self._on(back, kind))

    def _on(self, receivers: Receivers, kind: Literal["ray", "shadow-map"]) -> DirectLight:
        """What the surfaces of receivers reflect, lobes included."""
        if kind == "ray":
            if not has_embree():
                raise MissingLibraryError("exact direct light needs embreex: pip install embreex; or use `direct='shadow-map'`")
            tracer = RayTracer(receivers)
            return GlossyRays(receivers, tracer) if has_gloss(receivers) else tracer
        mapper = self._stack.enter_context(ShadowMapper(receivers))
        return GlossyMaps(receivers, mapper) if has_gloss(receivers) else mapper

    def __enter__(self) -> Added:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._stack.close()

    def response(self, lights: Sequence[Light]) -> Float32[ndarray, "H W 3"] | None:
        """The direct light of world-space `lights`, None where none is added."""
        return None if self._light is None else self._light.response(self._inside(lights))

    def _inside(self, lights: Sequence[Light]) -> list[Light]:
        """World-space lights in the frame of the asset or capture."""
        if isinstance(self._source, Asset):
            return in_asset_frame(self._source, lights)
        return [moved(light, self._frame) for light in lights]

    def directional(self, directions: Float64[ndarray, "b 3"]) -> Float32[ndarray, "b H W 3"] | float:
        """The responses to white lights from world-space `directions`, 0 where none is added."""
        return 0.0 if self._light is None else self._light.directional(Directions.moved(directions, self._frame))

    def notes(self, lights: Sequence[Light]) -> list[str]:
        """What is to be said of `lights`: what was added, and what was not."""
        if self._light is None:
            return []
        if self._emits:
            lights = [light for light in lights if not isinstance(light, NamedLight)]  # what it lays on receivers is in the asset
        if not lights:
            return []
        without = (NamedLight,) if self._kind == "ray" else (EnvironmentLight, NamedLight)
        lines = [] if all(isinstance(light, without) for light in lights) else [f"added {NAMES[self._kind]}"]
        if self._kind != "ray" and any(isinstance(light, EnvironmentLight) for light in lights):
            lines.append("an environment's direct light is not added: the picture holds only what it reflects on")
        if any(isinstance(light, NamedLight) for light in lights):
            lines.append("a named light's direct light is not added: the picture holds only what it reflects on")
        return lines
