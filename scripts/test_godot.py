"""Compare Godot's pixels with numpy's, on both renderers, in the chroot that scripts/godot-chroot makes; exits 1 if they differ.

Every method, as a picture (canvas) and on a mesh (spatial), lit by Godot's own directional, omni and spot lights; mixes of named lights; a
light cloud by its table of places. Lights on surfels: scripts/test_godot_surfels.py. CI runs neither.
    python scripts/test_godot.py [--keep] [--only WORD]
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import godot_renderers as godot
import numpy as np
from godot_lights import ASKEW, LIGHTS, MIX, RANGE, STRAIGHT, SUN, TIPPED, Z_UP, Lit, transform
from made_assets import build_asset, build_planes
from made_tables import KINDS, by_places, linear, made
from numpy import ndarray

from srbf.asset import Asset
from srbf.export.godot import write
from srbf.export.settings import PLAIN, Settings
from srbf.io.image import decode_srgb, encode_srgb
from srbf.light_geometry import attenuation
from srbf.lights import DirectionalLight, EnvironmentLight, Light, NamedLight, PointLight
from srbf.methods import in_asset_frame, relight
from srbf.methods.over_lights import finish

HALF_STEP = 2.0**-10  # of a value: targets are half floats, and a renderer may cut instead of rounding
STEPS = {"canvas": 1, "spatial": 2, "white": 2}  # a 3D picture goes through a buffer of its own before the viewport's
FLOAT_ERROR = 1e-4  # single precision, of sums whose terms reach 10
BYTE_STEP = 1.5 / 255
FAR = 1e6  # meters

ENVIRONMENT = (
    np.random.default_rng(5).random((8, 16, 3)).astype(np.float32) ** 4
)  # a panorama in Godot's layout, which starts at x = 0, -z forward
ENVIRONMENT_ENERGY = 0.7


def affine(asset: Asset) -> Asset:
    """The asset on a slanted plane whose texels are the pixels of a camera above."""
    x = (np.arange(asset.width) + 0.5) * 0.2 - 0.1 * asset.width
    y = 0.1 * asset.height - (np.arange(asset.height) + 0.5) * 0.2
    position = np.empty((asset.height, asset.width, 3), np.float32)
    position[..., 0], position[..., 1] = x, y[:, None]
    position[..., 2] = 0.1 * position[..., 0] + 0.2 * position[..., 1]
    return replace(asset, images={**asset.images, "position": position})


def assets() -> Iterator[tuple[str, Asset, Settings]]:
    """Each method and encoding, of 14 x 9 random texels without symmetry; compressed ones have whole blocks of 4 x 4."""
    makers: dict[str, Callable[[], Asset]] = {
        "relighting map, half": lambda: build_asset(25, "half", ambient=True),
        "relighting map, uint8": lambda: build_asset(7, "uint8"),
        "relighting map, bc7": lambda: build_asset(7, "float", 12, 16),
        "eigen map, half": lambda: build_planes(9, None, "half", ambient=True),
        "eigen map, indirect": lambda: build_planes(9, None, "half"),
        "eigen map, bc7, mips": lambda: build_planes(9, None, "float", 12, 16),
        "clustered eigen map, half": lambda: build_planes(9, 5, "half", ambient=True),
        "clustered eigen map, uint8": lambda: build_planes(6, 4, "uint8"),
        **{kind: lambda kind=kind: made(kind, "uint8" if kind == "light-mix" else "half") for kind in KINDS},  # type: ignore[misc]
        "named-maps, bc7, mips": lambda: made("named-maps", "float", height=12, width=16),
    }
    for name, make in makers.items():
        asset = make()
        asset.images.pop("coverage", None)  # a picture's alpha, which the background would show through
        asset.manifest["quantity"] = "irradiance" if asset.method in ("eigen-map", "light-cloud") else "radiance"
        if name.endswith("uint8"):
            asset.manifest["asset_from_world"] = [[0, 1.5, 0, 0.2], [-1.5, 0, 0, 0.1], [0, 0, 1.5, -0.3], [0, 0, 0, 1]]
        else:
            asset = affine(asset)
        if name.endswith("indirect"):
            asset.manifest["transport"] = "indirect"
        yield name, asset, Settings("bc7", 3 if name.endswith("mips") else 1) if "bc7" in name else PLAIN


def jobs(asset: Asset) -> Iterator[dict[str, Any]]:
    """The jobs of godot_compare.gd: name, mode, whether the viewport is linear, transform of the asset, lights."""
    if "light_domain" in asset.manifest:
        yield from jobs_of_weights(asset)
        return
    every = [name for name in LIGHTS if name not in ("by table", "environment", "mix", "inside")]
    for name in every:
        placed = ASKEW if name == "all" else STRAIGHT
        yield {"name": name, "mode": "canvas", "hdr": True, "placed": placed}
    yield {"name": "all", "mode": "canvas", "hdr": False, "placed": STRAIGHT}
    for placed in (STRAIGHT, ASKEW, TIPPED):
        yield {"name": "environment", "mode": "canvas", "hdr": True, "placed": placed}
    if asset.method != "relighting-map":
        yield {"name": "by table", "mode": "canvas", "hdr": True, "placed": STRAIGHT, "by_table": True}
    if np.array_equal(asset.asset_from_world, np.eye(4)):
        for name in every if asset.transport == "combined" else ("directional", "point", "squared"):
            yield {"name": name, "mode": "spatial", "hdr": True, "placed": STRAIGHT}
            yield {"name": name, "mode": "spatial", "hdr": False, "placed": STRAIGHT}
        for name in ("directional", "point", "squared", "spot"):
            yield {"name": name, "mode": "white", "hdr": True, "placed": STRAIGHT}


def jobs_of_weights(asset: Asset) -> Iterator[dict[str, Any]]:
    """The jobs of assets whose lights are all in the weights."""
    names = ("mix",) if asset.manifest["light_domain"] == "named" else ("squared", "spot", "inside")
    for name in names:
        for placed in (STRAIGHT, ASKEW):
            yield {"name": name, "mode": "canvas", "hdr": True, "placed": placed}
    if np.array_equal(asset.asset_from_world, np.eye(4)):
        yield {"name": names[0], "mode": "spatial", "hdr": True, "placed": STRAIGHT}


def expected(asset: Asset, job: dict[str, Any]) -> ndarray:
    """The result of srbf.methods.relight; for irradiance, the radiance of a white surface."""
    world_from_asset = Z_UP @ job["placed"] @ np.linalg.inv(Z_UP)
    moved = asset.asset_from_world @ np.linalg.inv(world_from_asset)
    instance = replace(asset, manifest={**asset.manifest, "asset_from_world": moved.tolist()})
    lights: list[Light] = [lit.light() for lit in LIGHTS[job["name"]]]
    if job["name"] == "environment":
        lights.append(
            EnvironmentLight(np.roll(ENVIRONMENT, 4, axis=1), (ENVIRONMENT_ENERGY,) * 3)
        )  # this layout starts a quarter turn later
    if job["name"] == "mix":
        named = {name: MIX.get(name, (1.0, (1.0, 1.0, 1.0))) for name in (entry["name"] for entry in asset.manifest["lights"])}
        lights = [NamedLight(name, tuple((value * decode_srgb(np.array(color))).tolist())) for name, (value, color) in named.items()]
    if asset.manifest.get("light_domain") == "cloud":
        inside = [light for light in in_asset_frame(instance, lights) if isinstance(light, PointLight)]
        picture = finish(asset, linear(asset, by_places(asset, inside)))
    else:
        picture = far_point_light(instance, SUN) if job.get("by_table") else relight(instance, lights)
    if asset.quantity == "irradiance":
        picture = picture / np.pi
    if asset.transport == "indirect" and job["mode"] == "spatial":
        picture = picture + white(asset, *LIGHTS[job["name"]])  # Godot's own direct light
    return picture


def far_point_light(asset: Asset, sun: Lit) -> ndarray:
    """A directional light read from the table: a point light so distant that its direction is the same at all receivers."""
    far = sun.light()
    assert isinstance(far, DirectionalLight)
    place = tuple((np.array(far.direction) * FAR).tolist())
    return relight(asset, [PointLight(place, far.color, a0=FAR)])


def white(asset: Asset, lit: Lit) -> ndarray:
    """Radiance of a white diffuse plane under Godot's own light, by its documentation: the irradiance over pi."""
    light = lit.light()
    if isinstance(light, DirectionalLight):
        towards, strength = np.array(light.direction), np.ones((asset.height, asset.width))
    else:
        assert isinstance(light, PointLight)
        vector = np.array(light.position) - asset.images["position"]
        distance = np.linalg.norm(vector, axis=2)
        towards, strength = vector / distance[..., None], attenuation(distance, light) * (1 - (distance / RANGE) ** 4) ** 2
        if lit.spot is not None:
            outer, edge = np.cos(lit.spot[0]), lit.spot[1]
            past = (1 - np.maximum(towards @ lit.direction_z_up, outer)) / (1 - outer)
            strength = strength * (1 - np.maximum(past, 1e-4) ** (1 / edge))
    normal = np.array([-0.1, -0.2, 1.0]) / np.linalg.norm([-0.1, -0.2, 1.0])
    cosine = np.maximum(towards @ normal, 0) * strength
    return cosine[..., None] * np.array(light.color) / np.pi


def held(picture: ndarray, job: dict[str, Any], renderer: str) -> ndarray:
    """The image as stored in that target. Compatibility encodes 3D, also in half floats, by a curve without sRGB's linear segment."""
    if job["mode"] != "canvas" and renderer == "gl_compatibility":
        encoded = np.maximum(1.055 * picture ** (1 / 2.4) - 0.055, 0)
        return encoded if job["hdr"] else np.minimum(encoded, 1)
    return picture if job["hdr"] else encode_srgb(np.clip(picture, 0, 1))


def compare(title: str, made: Asset, settings: Settings, chroot: Path, keep: bool) -> int:
    """Print a line per renderer and job; returns the number of differences."""
    folder = Path(tempfile.mkdtemp(prefix="srbf-", dir=chroot / "tmp"))
    write(made, folder, settings)
    asset = Asset.open(folder)  # blocks decoded
    shutil.copy(godot.ROOT / "tests" / "export" / "godot_compare.gd", folder)
    asked = list(jobs(asset))
    camera = np.array([[1, 0, 0, 0], [0, 0, 1, 5], [0, -1, 0, 0], [0, 0, 0, 1]], np.float64)  # looks down, north up
    written = [
        {
            **{key: job[key] for key in ("name", "mode", "hdr")},
            "sky": ENVIRONMENT.ravel().tolist() if job["name"] == "environment" else None,  # words: ok
            "by_table": job.get("by_table", False),
            "mix": MIX if job["name"] == "mix" else {},
            "transform": transform(job["placed"]),
            "lights": [lit.node for lit in LIGHTS[job["name"]]],
            "camera": transform(camera),
            "size": 0.2 * asset.height,
            "output": f"{i}.raw",
        }
        for i, job in enumerate(asked)
    ]
    (folder / "jobs.json").write_text(json.dumps(written))
    godot.run(folder, chroot, "--headless", "--import")
    missed = 0
    for renderer, arguments in godot.RENDERERS.items():
        godot.run(folder, chroot, *arguments, "--script", "res://godot_compare.gd", display=True)
        for i, job in enumerate(asked):
            found = np.frombuffer((folder / f"{i}.raw").read_bytes(), np.float32).reshape(asset.height, asset.width, 4)[..., :3]
            wanted = held(white(asset, *LIGHTS[job["name"]]) if job["mode"] == "white" else expected(asset, job), job, renderer)
            allowed = wanted * STEPS[job["mode"]] * HALF_STEP + FLOAT_ERROR if job["hdr"] else np.full_like(wanted, BYTE_STEP)
            error = np.abs(found - wanted)
            steps = float((error / allowed).max())
            missed += steps > 1
            target = "half" if job["hdr"] else "8 bit"
            verdict = "" if steps <= 1 else "  MISSED"
            godot.say(
                f"{title:28}{renderer:18}{job['mode']:9}{target:7}{job['name']:13}"
                f"{float(wanted.max()):7.2f}{float(error.max()):11.6f}{steps:7.2f}{verdict}"
            )
    if keep:
        godot.say(f"kept {folder}")
    else:
        shutil.rmtree(folder)
    return missed


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--keep", action="store_true", help="leave the projects in the chroot's /tmp")
    parser.add_argument("--only", default="", metavar="WORD", help="only assets with this word in their title")
    arguments = parser.parse_args()
    chroot = godot.chroot_of_godot()
    godot.say(f"{'asset':28}{'renderer':18}{'mode':9}{'target':7}{'lights':13}{'largest':>7}{'error':>11}{'/ bound':>7}")
    missed = sum(compare(title, asset, settings, chroot, arguments.keep) for title, asset, settings in assets() if arguments.only in title)
    if missed:
        sys.exit(f"{missed} pictures differ from numpy's by more than the bound")
    godot.say("all within the bound")


if __name__ == "__main__":
    main()
