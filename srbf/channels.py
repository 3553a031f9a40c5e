"""The channels of a capture: images of its receivers beside the lights' responses, by name."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

from srbf.errors import ManifestError

Mask = Literal["hit", "coverage", "valid"]


@dataclass(frozen=True)
class Channel:
    """An image (H, W, components) of the receivers.

    `real_where` names the mask of the texels that hold measured values; the others hold the nearest measured one (dilation), so that
    filtering at a chart's edge meets no hole. None: the channel is not dilated.
    Masks: `hit`, the texel's center lies on the surface; `coverage`, some of the texel is covered; `valid`, light can be read there.
    """

    name: str
    components: int
    meaning: str
    unit: str = "1"
    dtype: str = "float32"
    real_where: Mask | None = "coverage"


CHANNELS: dict[str, Channel] = {
    channel.name: channel
    for channel in (
        Channel("position", 3, "world position of the texel's center", "m", real_where="hit"),
        Channel("normal", 3, "unit world normal at the texel's center", real_where="hit"),
        Channel("albedo", 3, "diffuse reflectance, linear Rec.709, 0 to 1"),
        Channel("coverage", 1, "covered part of the texel, 0 to 1", real_where=None),
        Channel(
            "ambient",
            3,
            "response with all lights of the capture off, in the capture's quantity",
            "irradiance or radiance",
            real_where="valid",
        ),
        Channel("glossy", 3, "specular reflectance toward the camera, linear Rec.709, 0 to 1"),
        Channel("transmission", 3, "diffuse transmittance of translucent surfaces, linear Rec.709, 0 to 1"),
        Channel("lobe", 3, "roughness, share with a Fresnel term, and 1 where there is a specular lobe"),
    )
}
TOP_LEVEL = (
    "position",
    "normal",
    "albedo",
    "coverage",
    "ambient",
)  # capture.json names their files by keys of its own; every other channel is in its `channels`
GEOMETRY = ("position", "normal", "albedo", "coverage")  # what every bake asks a receiver for
GLOSS = ("glossy", "lobe")  # and that of a deep framebuffer its view,
THROUGH = "transmission"  # and this, where surfaces in it are translucent


def file_name(name: str) -> str:
    """The file that a bake writes a channel to, relative to the capture's folder."""
    return f"{name}.exr"


def manifest_keys(names: Iterable[str]) -> dict[str, Any]:
    """The keys of capture.json for channels of CHANNELS, each in its `file_name`, in the order given."""
    listed = list(names)
    keys: dict[str, Any] = {name: file_name(name) for name in listed if name in TOP_LEVEL}
    further = {name: {"file": file_name(name), "components": CHANNELS[name].components} for name in listed if name not in TOP_LEVEL}
    return {**keys, **({"channels": further} if further else {})}


def channels_of(manifest: Mapping[str, Any], where: str) -> dict[str, tuple[Channel, str]]:
    """{name: (channel, file)} of a checked capture.json; names without a row in CHANNELS are as the manifest has them.

    ManifestError, naming the manifest as `where`, for a known channel with another number of components.
    """
    found = {name: (CHANNELS[name], str(manifest[name])) for name in TOP_LEVEL if name in manifest}
    for name, entry in manifest.get("channels", {}).items():
        count = int(entry["components"])
        channel = CHANNELS.get(name) or Channel(name, count, "not known to this version of srbf")
        if channel.components != count:
            raise ManifestError(f"expected {channel.components} components of channel {name!r} in {where}, found {count}")
        found[name] = (channel, str(entry["file"]))
    return found
