"""Time of the passes that relight deep framebuffers under one light that moves: `python benchmarks/deep_framebuffer_passes.py ASSET...`.

Milliseconds are medians, beside a plain pass that lights as many pixels by the same shadow cube, from positions and normals, without
bounces: shadow (six faces), surfels (direct light on them), bounces, links (to view clusters), pixels (mixed from clusters), direct
(light at pixels). `all` is what a frame costs with direct light, `still` what it costs when no light has moved, over the plain pass.
The plain pass looks all faces up at once: direct light takes a pass for each face here, of which each discards the pixels of the others,
and the time of that is not in `plain`. `--screen W H`: the asset's pixels, repeated, as a picture of that size. `--busy`: CPU time of a
software renderer, for a shared machine.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from shader import medians

from srbf.asset import Asset
from srbf.gl.context import Limits, create_context
from srbf.gl.programs import Programs
from srbf.gl.textures import AssetTextures
from srbf.lights import PointLight
from srbf.visibility.pool_passes import PoolPasses

NO_FACE = 6
PARTS = ("shadow", "surfels", "bounces", "links", "pixels", "direct")


def at_size(asset: Asset, width: int, height: int) -> Asset:
    """The pixels of an asset side by side until they fill a picture."""
    rows, columns = np.arange(height) % asset.height, np.arange(width) % asset.width
    images = {name: np.ascontiguousarray(image[rows][:, columns]) for name, image in asset.images.items()}
    stored = np.ascontiguousarray(asset.stored[:, rows][:, :, columns])
    return replace(asset, manifest={**asset.manifest, "width": width, "height": height}, stored=stored, images=images)


def free_light(asset: Asset) -> PointLight:
    """A point light before the surfaces that the view sees."""
    position, normal = (asset.images[name].reshape(-1, 3) for name in ("position", "normal"))
    x, y, z = (float(value) for value in np.median(position + 0.5 * normal, axis=0))
    return PointLight((x, y, z), falloff="inverse-square")


def draws_of(asset: Asset, context: Any, resources: ExitStack) -> dict[str, Callable[[], None]]:
    """What each part draws; `surfels` and `direct` draw the shadow cube, too, `links` the bounces, and `discard` nothing at any pixel."""
    limits, programs = Limits.of(context), Programs(context, resources)
    textures = AssetTextures(context, asset, limits, resources)
    passes: Any = PoolPasses(asset, programs, textures, limits)
    passes.shadow_rays = False  # the GPU alone
    light = free_light(asset)
    passes.prepare([light])
    surfels, links = passes._surfels, passes._links
    _, clusters = programs.target(links.cluster_size)
    _, screen = programs.target((asset.width, asset.height))
    local = asset.images["position"] - surfels.center.astype(np.float32)
    places, normals = textures.kept(local.astype(np.float32)), textures.kept(asset.images["normal"].astype(np.float32))

    def nothing_blends() -> None:
        context.enable_only(context.NOTHING)

    def shadow() -> None:
        for _ in surfels.faces(light):
            pass

    def bounces() -> None:
        nothing_blends()
        links.bounced(surfels.texture)

    def to_clusters() -> None:
        nothing_blends()
        links.clusters(surfels.texture, clusters)

    def pixels() -> None:
        nothing_blends()
        screen.use()
        passes.pixels()

    def direct_at(uniforms: dict[str, Any], face: int) -> None:
        screen.use()
        nothing_blends()
        for unit, texture in enumerate((places, normals, surfels.maps.heights[0])):
            texture.use(unit)
        units = {"points": 0, "normals": 1, "heights": 2, "wallHeights": 2, "transmittance": 2}
        programs.run("direct_point.frag", {}, {**uniforms, **units, "face": face, "lambertian": 0.0, "weight": 1.0})

    def direct() -> None:
        for uniforms in surfels.faces(light):
            direct_at(uniforms, uniforms["cubeFace"])

    last = list(surfels.faces(light))[-1]

    made: dict[str, Callable[[], None]] = {"shadow": shadow, "surfels": lambda: surfels.draw(light), "bounces": bounces}
    return made | {"links": to_clusters, "pixels": pixels, "direct": direct, "discard": lambda: direct_at(last, NO_FACE)}


def main() -> None:
    """Print a row per asset."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("assets", type=Path, nargs="+")
    parser.add_argument("--screen", type=int, nargs=2, metavar=("W", "H"))
    parser.add_argument("--runs", type=int, default=9)
    parser.add_argument("--busy", action="store_true")
    asked = parser.parse_args()
    clock = time.process_time if asked.busy else time.perf_counter
    context = create_context()
    print(f"{context.info['GL_RENDERER']}; ms, medians of {asked.runs}")
    print(f"{'asset':>16}{'pixels':>12}{'bounces':>9}" + "".join(f"{part:>9}" for part in PARTS) + f"{'plain':>9}{'all':>8}{'still':>8}")
    for path in asked.assets:
        asset = Asset.open(path)
        asset = asset if asked.screen is None else at_size(asset, *asked.screen)
        with ExitStack() as resources:

            def timed(draw: Callable[[], None]) -> float:
                context.finish()
                started = clock()
                draw()
                context.finish()
                return clock() - started

            draws = draws_of(asset, context, resources)
            took = medians({name: partial(timed, draw) for name, draw in draws.items()}, asked.runs)
        plain, still = took["direct"] - 5 * took["discard"], took["direct"] - took["shadow"] + took["pixels"]
        whole = took["surfels"] + took["links"] + took["pixels"] + took["direct"] - took["shadow"]
        took |= {"surfels": took["surfels"] - took["shadow"], "direct": took["direct"] - took["shadow"]}
        took["links"] -= took["bounces"]
        cells = "".join(f"{took[part]:>9.1f}" for part in PARTS)
        size, bounces = f"{asset.width}x{asset.height}", asset.manifest["gather"].get("bounces", "all")
        print(f"{path.name:>16}{size:>12}{bounces:>9}{cells}{plain:>9.1f}{whole / plain:>7.2f}x{still / plain:>7.2f}x", flush=True)
    context.release()


if __name__ == "__main__":
    main()
