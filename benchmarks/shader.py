"""Time of the shaders of every method against a minimal one that only sums as many layers: `python benchmarks/shader.py`.

`--sides 1024 4096`: texels per side; `--screen`: frames per second of a lightmapped surface that fills 1920 x 1080; `--formula`: point
lights also by formula. Assets have random half floats, since values do not change the time: 25 relighting maps, eigen maps of 28 and 16
components, 64 clusters of 8 components, and of 12 for named lights: there 1, 4 and 16 lights include making their weights, all that they
cost. In software all draw into one RGBA32F target, blended, by the host's clock; on a GPU into RGBA16F without blending, by the GPU's own
queries of elapsed time over DRAWS draws. Milliseconds are medians of alternating runs, with the weights of distant lights projected
beforehand; `host` is the CPU time of that. GB/s: the texel data over the time, against copying a
buffer on the same device, counting reads and writes.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from contextlib import ExitStack
from typing import Any

import numpy as np

from srbf.asset import Asset
from srbf.basis.gaussian import r_table, spread_of
from srbf.basis.light_functions import LightFunctions
from srbf.basis.octahedral_table import octahedral_table
from srbf.encode.light_function_fit import dense_centers
from srbf.gl.context import Limits, compile_program, create_context
from srbf.gl.includes import resolve, resolve_text
from srbf.gl.programs import Programs
from srbf.gl.textures import AssetTextures
from srbf.gl.uniforms import packed_point_lights, padded
from srbf.light_domain import Directions
from srbf.lights import DirectionalLight, Light, NamedLight, PointLight
from srbf.methods import projected_weights
from srbf.registry import method_named
from srbf.sphere import point_set

LIGHTS = 400  # of a capture, which sets the density of the light functions
SPREADS = (0.2, 0.4)  # rad
MAPS = "relighting map, k = 25"
METHODS: dict[str, dict[str, int]] = {
    MAPS: {"k": 25},
    "eigen map, 28 components": {"components": 28},
    "eigen map, 16 components": {"components": 16},
    "clustered, 64 x 8 components": {"clusters": 64, "components": 8},
    "named lights, 64 x 12 components": {"clusters": 64, "components": 12, "names": 24},
}
MINIMAL = "minimal sum of 25 layers"
SUN: list[Light] = [DirectionalLight((0.3, 0.2, 0.9), (1.0, 0.9, 0.7))]
NAMED: list[Light] = [NamedLight(f"light {i}", (0.9, 1.0, 0.8)) for i in range(24)]
POINT_LIGHTS = [PointLight((0.2 + 0.05 * i, 0.1 - 0.07 * i, 0.7), (0.9, 1.0, 0.8)) for i in range(16)]
Clock = Callable[[], float]
PATCH = 16  # texels per side of a patch in one cluster
SCREEN = (1920, 1080)
COPIED = 256 << 20  # bytes
DRAWS = 5  # in a query of a GPU

MINIMAL_SHADER = """#version 330 core
uniform sampler2DArray maps;
out vec4 response;
void main() {
    vec2 uv = gl_FragCoord.xy / vec2(textureSize(maps, 0).xy);
    vec3 sum = vec3(0.0);
    for (int i = 0; i < 25; ++i) {
        sum += textureLod(maps, vec3(uv, float(i)), 0.0).rgb;
    }
    response = vec4(sum, 1.0);
}
"""


def make_asset(side: int, k: int = 0, components: int = 0, clusters: int = 0, names: int = 0) -> Asset:
    """Random layers over a plane, in half floats."""
    rng = np.random.default_rng(0)
    layers, channels = (k, 3) if k else (-(-components // 4), 4)
    layer = rng.standard_normal((side, side, channels), np.float32).astype(np.float16)
    stored = np.stack([np.roll(layer, i, axis=0) for i in range(layers)])
    scale, bias = np.ones((layers, channels), np.float32), np.zeros((layers, channels), np.float32)
    x = np.linspace(-1, 1, side, dtype=np.float32)
    images = {"position": np.stack([*np.meshgrid(x, -x), np.zeros((side, side), np.float32)], axis=-1)}
    manifest: dict[str, Any] = {"width": side, "height": side, "domain": "hemisphere"}
    entries = [{"encoding": "half"} for _ in range(layers)]
    if k:
        centers = point_set("fibonacci", k, "hemisphere")
        spread = spread_of(centers, "mean")
        manifest |= {"method": "relighting-map", "maps": entries}
        manifest["basis"] = {"kind": "gaussian", "centers": centers.tolist(), "spread": spread}
        return Asset(manifest, stored, scale, bias, {"r_table": r_table(spread)}, images)
    centers = dense_centers(point_set("fibonacci", LIGHTS, "hemisphere"), Directions("hemisphere"))
    count = max(clusters, 1) * (components + 1)
    coefficients = rng.normal(size=(count, len(centers), 3)).astype(np.float32)
    functions = LightFunctions(centers, rng.choice(SPREADS, count), coefficients)
    table = octahedral_table(functions, "hemisphere")
    manifest |= {"method": "clustered-eigen-map" if clusters else "eigen-map", "scalars": components, "planes": entries}
    manifest["light_basis"] = {"kind": "gaussian", "centers": centers.tolist(), "spreads": functions.spreads.tolist()}
    manifest["w_table"] = {"size": table.size, "columns": table.columns}
    tables = {"light_coefficients": coefficients, "w_table": table.atlas}
    if clusters:
        manifest["clusters"] = clusters
        patches = rng.integers(0, clusters, (-(-side // PATCH), -(-side // PATCH))).astype(np.uint8)
        tables["cluster_index"] = np.ascontiguousarray(patches.repeat(PATCH, axis=0).repeat(PATCH, axis=1)[:side, :side])
    if names:
        manifest |= {"method": "light-mix", "light_domain": "named", "lights": [{"name": light.name} for light in NAMED[:names]]}  # type: ignore[union-attr]
        manifest["light_values"] = {"lights": names, "scale": 1.0}
        tables = {"cluster_index": tables["cluster_index"], "light_values": rng.normal(size=(count, names, 3)).astype(np.float16)}
    return Asset(manifest, stored, scale, bias, tables, images)


def distant_of(asset: Asset) -> list[Light]:
    """The lights whose weights are projected."""
    return NAMED[:1] if asset.method == "light-mix" else SUN


class Bench:
    """All shaders at one size, drawing into one target."""

    def __init__(self, context: Any, side: int, counts: list[int], formula: bool, clock: Clock, resources: ExitStack) -> None:
        self._context, self._resources, self._clock = context, resources, clock
        self.assets = {name: make_asset(side, **shape) for name, shape in METHODS.items()}
        limits, programs = Limits.of(context), Programs(context, resources)
        self._query = None if limits.software else context.query(time=True)
        self._target = self._framebuffer((side, side), "f4" if limits.software else "f2")
        self.draws: dict[tuple[str, str], Callable[[], None]] = {}
        for name, asset in self.assets.items():
            textures = AssetTextures(context, asset, limits, resources)
            textures.layers()
            if context.error == "GL_OUT_OF_MEMORY":
                raise SystemExit(f"expected room for the layers of {name} at {side} x {side}, found none on this device; use fewer --sides")
            weights = projected_weights(asset, distant_of(asset))
            for by_formula in (False, True) if formula and name == MAPS else (False,):
                passes = method_named(asset.method).gl_passes()(asset, programs, textures, limits, by_formula)
                shown = f"{name}, formula" if by_formula else name
                if not by_formula:
                    self.draws[shown, "directional"] = lambda passes=passes, weights=weights: passes.distant(weights, None)
                for count in counts:
                    if asset.method == "light-mix":
                        self.draws[shown, f"{count} lights"] = lambda passes=passes, asset=asset, count=count: passes.distant(
                            projected_weights(asset, NAMED[:count]), None
                        )
                        continue
                    self.draws[shown, f"{count} lights"] = lambda passes=passes, none=0 * weights, count=count: passes.point_lights(
                        POINT_LIGHTS[:count], none, None
                    )
            if name == MAPS:
                self.draws[MINIMAL, "directional"] = self._bare(textures)

    def run(self, draw: Callable[[], None]) -> float:
        """Seconds of one shader, until it finishes."""
        self._target.use()
        if self._query is not None:
            self._context.enable_only(self._context.NOTHING)
            with self._query:
                for _ in range(DRAWS):
                    draw()
            return 1e-9 * float(self._query.elapsed) / DRAWS
        self._context.enable_only(self._context.BLEND)
        self._context.blend_func = self._context.ONE, self._context.ONE
        self._context.finish()
        started = self._clock()
        draw()
        self._context.finish()
        return self._clock() - started

    def _bare(self, textures: AssetTextures) -> Callable[[], None]:
        program = compile_program(self._context, resolve("stages/fullscreen.vert"), resolve_text(MINIMAL_SHADER, "bare.frag"))
        corners = self._kept(self._context.buffer(np.array([[-1, -1], [3, -1], [-1, 3]], np.float32)))
        drawn = self._kept(self._context.vertex_array(self._kept(program), [(corners, "2f", "corner")]))

        def draw() -> None:
            textures.layers().use(0)
            program["maps"].value = 0
            drawn.render(vertices=3)

        return draw

    def _framebuffer(self, size: tuple[int, int], dtype: str) -> Any:
        return self._kept(self._context.framebuffer([self._kept(self._context.texture(size, 4, dtype=dtype))]))

    def _kept(self, resource: Any) -> Any:
        self._resources.callback(resource.release)
        return resource


def medians(draws: dict[Any, Callable[[], float]], runs: int) -> dict[Any, float]:
    """Milliseconds of each, in alternation; the first round, which compiles and uploads, does not count."""
    times: dict[Any, list[float]] = {}
    for run in range(-1, runs):
        for key, draw in draws.items():
            taken = draw()
            if run >= 0:
                times.setdefault(key, []).append(taken)
    return {key: 1e3 * float(np.median(taken)) for key, taken in times.items()}


def copy_rate(context: Any, runs: int) -> float:
    """GB/s of copying a buffer, reads and writes counted."""
    with ExitStack() as resources:
        buffers = [context.buffer(reserve=COPIED) for _ in range(2)]
        for buffer in buffers:
            resources.callback(buffer.release)

        query = None if Limits.of(context).software else context.query(time=True)

        def copy() -> float:
            if query is not None:
                with query:
                    for _ in range(DRAWS):
                        context.copy_buffer(buffers[1], buffers[0])
                return 1e-9 * float(query.elapsed) / DRAWS
            context.finish()
            started = time.perf_counter()
            context.copy_buffer(buffers[1], buffers[0])
            context.finish()
            return time.perf_counter() - started

        return 2 * COPIED / 1e6 / medians({0: copy}, runs)[0]


def host_times(assets: dict[str, Asset], runs: int) -> dict[str, float]:
    """Milliseconds to project the weights of one directional light."""

    def fold(asset: Asset) -> float:
        started = time.perf_counter()
        projected_weights(asset, distant_of(asset))
        return time.perf_counter() - started

    return medians({name: lambda asset=asset: fold(asset) for name, asset in assets.items()}, runs)


def table(context: Any, side: int, runs: int, counts: list[int], formula: bool, clock: Clock, copied: float) -> None:
    """Print the times of all shaders at one size."""
    with ExitStack() as resources:
        bench = Bench(context, side, counts, formula, clock, resources)
        took = medians({key: lambda draw=draw: bench.run(draw) for key, draw in bench.draws.items()}, runs)
        host = host_times(bench.assets, runs)
        bare = took[MINIMAL, "directional"]
        kinds = ["directional", *(f"{count} lights" for count in counts)]
        print(f"\n{side:<33}{'B / texel':>9}{'host':>7}" + "".join(f"{kind:>18}" for kind in kinds) + f"{'GB/s':>7}{'of a copy':>11}")
        for name in dict.fromkeys(name for name, _ in took):
            size = bench.assets.get(name, bench.assets[MAPS]).bytes_per_texel()["directional"]
            cells = [f"{took[name, kind]:.2f} = {took[name, kind] / bare:.2f}x" if (name, kind) in took else "" for kind in kinds]
            row = f"{name:<33}{size:>9}{host.get(name, float('nan')):>7.2f}" + "".join(f"{cell:>18}" for cell in cells)
            if (name, "directional") in took:
                rate = size * side**2 / 1e6 / took[name, "directional"]
                row += f"{rate:>7.1f}{rate / copied:>11.0%}"
            print(row)
        maps = took[MAPS, "directional"]
        print("directional, times faster than 25 maps: " + ", ".join(f"{name} {maps / took[name, 'directional']:.2f}" for name in METHODS))


def screen(context: Any, runs: int, counts: list[int], side: int = 1024) -> None:
    """Print the frames per second of a surface that fills a screen, under a directional light and some point lights."""
    counts = [0, *counts]
    print(f"\nframes per second at {SCREEN[0]} x {SCREEN[1]}, lightmap of {side}" + "".join(f"{count:>9} lights" for count in counts))
    with ExitStack() as resources:
        target = context.framebuffer([context.texture(SCREEN, 4, dtype="f2")])
        square = np.array([[-1, -1], [1, -1], [1, 1], [-1, -1], [1, 1], [-1, 1]], np.float32)
        corners = context.buffer(np.column_stack([square, np.zeros(6), 0.5 * square + 0.5]).astype(np.float32))
        draws: dict[tuple[str, int], Callable[[], float]] = {}
        directional = {name: shape for name, shape in METHODS.items() if "names" not in shape}
        for name, shape in directional.items():
            asset = make_asset(side, **shape)
            textures = AssetTextures(context, asset, Limits.of(context), resources)
            for count in counts:
                mesh = _surface(context, asset, textures, corners, count)

                def draw(mesh: Callable[[], None] = mesh) -> float:
                    target.use()
                    context.enable_only(context.NOTHING)
                    context.finish()
                    started = time.perf_counter()
                    mesh()
                    context.finish()
                    return time.perf_counter() - started

                draws[name, count] = draw
        took = medians(draws, runs)
        for name in directional:
            print(f"{name:<50}" + "".join(f"{1e3 / took[name, count]:>15.1f}" for count in counts))
        target.release()
        corners.release()


def _surface(context: Any, asset: Asset, textures: AssetTextures, corners: Any, count: int) -> Callable[[], None]:
    maps = asset.method == "relighting-map"
    stage = "lightmap.frag" if maps else f"{asset.method.replace('-', '_')}_lightmap.frag"
    places = max(count, 1)
    defines = {"SRBF_POINT_LIGHTS": places, "SRBF_PLAIN": 1} | (
        {"SRBF_K": asset.k, "SRBF_PAIRS": 1} if maps else {"SRBF_COMPONENTS": asset.components}
    )
    program = compile_program(context, resolve("stages/lightmap.vert"), resolve(f"stages/{stage}", defines=defines))
    drawn = context.vertex_array(program, [(corners, "3f 2f", "position", "lightmapUv")])
    weights = projected_weights(asset, SUN)
    layers = textures.layers()
    used = {"maps" if maps else "planes": layers, "ambient": textures.ambient()}
    arrays = {"pointLights": packed_point_lights(POINT_LIGHTS[:count], places)}
    if maps:
        layers.filter = (context.LINEAR, context.LINEAR)
        used["rTable"] = textures.r_pairs()
        arrays |= {"weights": padded(weights), "centers": padded(asset.basis.centers)}
    else:
        if "cluster_index" in asset.tables:
            used["clusters"] = textures.clusters()
        else:
            layers.filter = (context.LINEAR, context.LINEAR)
        rows = np.pad(weights.reshape(asset.clusters, -1, 3), ((0, 0), (0, 0), (0, 1)))
        used |= {"wTable": textures.w_table(), "weights": textures.kept(rows.astype(np.float32))}
        program["tableSize"].value = asset.manifest["w_table"]["size"]
    for name in ("worldFromObject", "assetFromWorld", "clipFromWorld"):
        program[name].write(np.eye(4, dtype=np.float32))
    for name, array in arrays.items():
        if name in program:
            program[name].write(np.ascontiguousarray(array, np.float32))
    program["pointLightCount"].value = count

    def draw() -> None:
        for unit, (name, texture) in enumerate(used.items()):
            texture.use(unit)
            if name in program:
                program[name].value = unit
        drawn.render(vertices=6)

    return draw


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sides", type=int, nargs="+", default=[1024])
    parser.add_argument("--runs", type=int, default=15)
    parser.add_argument("--point-lights", type=int, nargs="*", default=[1, 4, 16], help="numbers of point lights, at most 16")
    parser.add_argument("--formula", action="store_true", help="point lights also by formula")
    parser.add_argument("--screen", action="store_true", help="frames per second at 1920 x 1080 too")
    parser.add_argument("--busy", action="store_true", help="CPU time of a software renderer, for a shared machine")
    arguments = parser.parse_args()
    clock = time.process_time if arguments.busy else time.perf_counter
    context = create_context()
    copied = copy_rate(context, arguments.runs)
    print(f"{context.info['GL_RENDERER']}; ms and times the minimal shader, medians of {arguments.runs}; copying moves {copied:.1f} GB/s")
    for side in arguments.sides:
        table(context, side, arguments.runs, arguments.point_lights, arguments.formula, clock, copied)
    if arguments.screen:
        screen(context, arguments.runs, arguments.point_lights)
    context.release()


if __name__ == "__main__":
    main()
