"""The main part and layer of an OpenEXR file, by the names of its channels."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from srbf.errors import ImageError
from srbf.importing.pictures.found import Found, Tags, stripped
from srbf.io.image import Part, parts_of, read_channels

MAIN_NAMES = {"combined", "rgb", "rgba", "beauty", "color", "final"}
VIEW_NAMES = {"left", "right"}
DATA_NAMES = {
    "ao",
    "ambientocclusion",
    "ambient",
    "depth",
    "z",
    "mist",
    "normal",
    "normals",
    "n",
    "position",
    "p",
    "pos",
    "uv",
    "st",
    "vector",
}
DATA_NAMES |= {
    "motion",
    "velocity",
    "indexob",
    "indexma",
    "id",
    "mask",
    "matte",
    "shadow",
    "denoising",
    "noisy",
    "albedo",
    "debug",
    "variance",
}
GRAY = ("Y", "L", "I", "gray", "grey", "luminance")  # words: ok


@dataclass(frozen=True)
class Layer:
    """Red, green and blue of one layer of one part; gray if it has one channel only. `name` is the value for `layer`."""

    part: Part
    prefix: str
    channels: tuple[int, ...]

    @property
    def name(self) -> str:
        """Part and layer; without the part if the layer includes it or the part has no name."""
        if self.prefix and (not self.part.name or self.prefix == self.part.name or self.prefix.startswith(f"{self.part.name}.")):
            return self.prefix
        return ".".join(word for word in (self.part.name, self.prefix) if word) or "R, G, B"

    @property
    def is_picture(self) -> bool:
        """Whether the name is that of a main image."""
        return not self.is_data and any(words & MAIN_NAMES for words in self._words())

    @property
    def is_data(self) -> bool:
        """Whether the last part of the name, views excluded, is that of data other than light."""
        words = ([words for words in self._words() if words and not words <= VIEW_NAMES] or [set()])[-1]
        return bool(words & DATA_NAMES) or any(word.startswith("crypto") for word in words)

    def _words(self) -> list[set[str]]:
        """The words of each part of the name, without trailing digits: `V.Crypto00` is v, crypto."""
        names = re.split(r"[.:/]+", self.name)
        return [{re.sub(r"[\W\d]+$", "", word).lower() for word in re.split(r"[\s_-]+", name)} - {""} for name in names]


def layers_of(parts: list[Part]) -> list[Layer]:
    """All layers with R, G and B; if there are none, those with luminance only; then a file's only channel."""
    colored, gray = [], []
    for part in parts:
        grouped: dict[str, dict[str, int]] = {}
        for index, channel in enumerate(part.channels):
            prefix, _, component = channel.rpartition(".")
            grouped.setdefault(prefix, {})[component.lower()] = index
        for prefix, by_name in grouped.items():
            for names in (("r", "g", "b"), ("red", "green", "blue")):
                if all(name in by_name for name in names):
                    colored.append(Layer(part, prefix, tuple(by_name[name] for name in names)))
                    break
            else:
                if not {"x", "z"} <= by_name.keys():  # there Y is a coordinate
                    gray += [Layer(part, prefix, (by_name[name.lower()],)) for name in GRAY if name.lower() in by_name][:1]
    return colored or gray


def chosen(path: Path, layers: list[Layer], wanted: str | None) -> Layer:
    """The layer named `wanted`; without a name, the only plain RGB layer, else the one named as main image, else the only one of light."""
    listed = ", ".join(layer.name for layer in layers)
    if wanted is not None:
        name = wanted.strip().lower()
        fits = [layer for layer in layers if layer.name.lower() == name] or [
            layer for layer in layers if name in (layer.part.name.lower(), layer.prefix.lower()) or layer.name.lower().endswith(f".{name}")
        ]
        if len(fits) != 1:
            found = f"several ({', '.join(layer.name for layer in fits)})" if fits else f"only {listed}"
            raise ImageError(f"expected one layer {wanted!r} in {path}, found {found}; name one of them by `layer`")
        return fits[0]
    if len(layers) == 1 and not layers[0].prefix and (not layers[0].is_data or layers[0].part.index == 0):
        return layers[0]
    plain = [layer for layer in layers if not layer.prefix]
    light = [layer for layer in layers if not layer.is_data]
    whole = [layer for layer in layers if layer.is_picture]
    for group in (plain, [layer for layer in plain if not layer.is_data], [layer for layer in plain if layer.is_picture], whole, light):
        if len(group) == 1 and not group[0].is_data:
            return group[0]
    raise ImageError(f"expected one layer of {path} to be the picture, found {listed}; name one by `layer`")


def read_exr(path: Path, layer: str | None) -> Found:
    """The main layer, in its display window. ImageError with a list of the layers if none or several qualify."""
    parts = parts_of(path)
    layers = layers_of(parts)
    if not layers and len(parts) == 1 and layer is None:
        names = parts[0].channels
        if len(names) == 1 and Layer(parts[0], names[0], (0,)).is_data is False:
            layers = [Layer(parts[0], "", (0,))]
    if not layers:
        names = tuple(name for part in parts for name in part.channels)
        raise ImageError(f"expected channels R, G, B in {path}, found {', '.join(names[:12])}{' …' if len(names) > 12 else ''}")
    layer_of = chosen(path, layers, layer)
    part = layer_of.part
    pixels, model = stripped(read_channels(path, part, layer_of.channels))
    notes = []
    if len(parts) > 1 or len(layers) > 1 or layer_of.prefix:
        notes.append(f"took {layer_of.name} of {{}}, which hold {len(parts)} parts and {len(layers)} layers of color")
    if part.data != part.display:
        notes.append("placed the data window of {} in their display window")
    return Found(pixels, model, part.bits, Tags(chromaticities=part.chromaticities, orientation=part.orientation), tuple(notes))
