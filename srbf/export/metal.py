"""The shader pack as Metal: whole stages by spirv-cross, since no Metal compiler outside macOS could check our own translation."""

from __future__ import annotations

from pathlib import Path

from srbf.asset import Asset
from srbf.export import exr, spirv
from srbf.export.asset_shader import by_weights_alone, counts
from srbf.export.settings import PLAIN, Settings, Written
from srbf.io import files
from srbf.methods import method_of

LANGUAGE: spirv.Language = "metal"


def stages_of(asset: Asset) -> dict[str, str]:
    """The Metal text of every stage that relights an asset, by name: its method's for directional and point lights, and the last pass;
    one for all lights where these are named, or in a cloud, with the weights as a texture.

    Raises InputError on an asset that no shader relights, MissingLibraryError without glslang and spirv-cross.
    """
    defines = counts(asset)
    stem = method_of(asset).shader_parts(asset).stages
    names = ["fullscreen.vert", f"{stem}directional.frag", f"{stem}point.frag", "finish.frag"]
    if by_weights_alone(asset):
        names[1:3] = [f"{stem}directional.frag" if stem else "weighted.frag"]
    return {name: spirv.cross_compile(spirv.compile_stage(name, defines), LANGUAGE) for name in names}


def write(asset: Asset, folder: Path, settings: Settings = PLAIN) -> Written:
    """Fill an empty folder: the asset as EXRs, and its stages as `.metal` files, each with `main0`.

    Raises what `stages_of` raises.
    """
    texts = stages_of(asset)
    written = exr.write(asset, folder, settings)
    for name, text in texts.items():
        files.write_text(folder / f"{name.replace('.', '_')}.metal", text)
    return Written((*written.notes, "Metal by spirv-cross: not compiled with Apple's compiler"))
