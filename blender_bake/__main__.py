# SPDX-License-Identifier: GPL-3.0-or-later
"""`python -m blender_bake JOB.json`, or `blender --background --python blender_bake/__main__.py -- JOB.json`.

The job says scene, receiver, size, quantity, lights and scratch folder; see `run`. Events come out as JSON lines:
scene, warning, image (name or light, file, seconds), file, ready, survey, mesh, error, done.
"""

from __future__ import annotations

import json
import sys
import time
import traceback
from collections.abc import Iterable
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any

if not __package__:  # run as a script by an installed Blender
    sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from blender_bake.channel import Channel, Requests, WorkerError, hand_over, leave


def main() -> None:
    """Run the job named by the last argument; exit 0 when done, 1 after an error event."""
    channel = Channel()
    requests = Requests()
    try:
        job = json.loads(Path(sys.argv[-1]).read_text(encoding="utf-8"))
        run(job, chain(job.get("lights", ()), requests if job.get("serve") else ()), channel)
    except WorkerError as error:
        channel.emit("error", message=str(error))
        leave(1)
    except Exception as error:  # the one place where anything unforeseen becomes an event instead of a silent death
        traceback.print_exc()
        channel.emit("error", message=f"Blender's worker failed: {type(error).__name__}: {error}".replace("\n", " "))
        leave(1)
    channel.emit("done")
    leave(0)


def run(job: dict[str, Any], lights: Iterable[dict[str, Any]], channel: Channel) -> None:
    """Open the scene, prepare the receiver, hand over what `job` asks for, say that it is ready, then answer `lights` as they come.

    job: scene, scene_name (null: the active one), receiver {kind, object | objects, uv_layer, unwrap | camera}, no_shadow (names of
    objects), width, height, quantity, keep_scene_lights, sun_angle, scratch, geometry (bool), ambient {samples, seed} or
    null; `serve` where
    lights are asked for on stdin, after those in the job. A light: index, kind, direction | position, samples, seed, denoise (bool).
    Where `transport` is indirect, also the scene's triangles, and the direct diffuse light beside every answer; `probes` are the lights
    by which the tints of translucent materials are chosen, unless `tints` has them already. A job with `survey` gets what that asks for,
    one with `mesh` the scene's triangles and looks (see `scene_mesh`), and no light is baked.
    """
    from blender_bake import emission, no_shadow, scene_file, scene_mesh, survey, translucency, without_triangles
    from blender_bake import scene as scenes
    from blender_bake.frame import Frame
    from blender_bake.illuminant import Illuminant
    from blender_bake.lightmap import LightmapReceiver
    from blender_bake.vertices import VertexReceiver
    from blender_bake.view import ViewReceiver

    scratch = Path(job["scratch"])
    scene = scenes.open_scene(job["scene"], channel, job.get("scene_name"))
    frame = Frame.of(scene)
    scenes.configure(scene)
    if "survey" in job:
        channel.emit("survey", **survey.response(scene, job, channel, frame))
        return
    if "mesh" in job:
        channel.emit("mesh", **scene_mesh.response(scene, job))
        return
    is_view = job["receiver"]["kind"] == "view"
    left_out = [*scenes.left_out(scene), *(frame.left_out(job["width"], job["height"]) if is_view else ())]
    no_shadow.let_light_through(scene, job["no_shadow"])
    own_light = scenes.OwnLight(scene)
    kind = {"lightmap": LightmapReceiver, "vertices": VertexReceiver, "view": ViewReceiver}[job["receiver"]["kind"]]
    apart = job.get("transport") == "indirect"
    if apart:
        scene_file.show_as_rendered(scene)
    receiver = kind(scene, job, channel)
    for line in left_out:  # of a receiver that is there
        channel.warn(line)
    channel.emit("scene", blender=scenes.version(), receivers=receiver.descriptions(), **receiver.facts())

    def image(name: str, array: Any, started: float, **fields: Any) -> None:
        channel.emit("image", name=name, file=hand_over(scratch, name, array), seconds=time.perf_counter() - started, **fields)

    if job["geometry"]:
        for name, array in receiver.geometry().items():
            image(name, array, time.perf_counter())
    ambient = job["ambient"] if job["keep_scene_lights"] or emission.may_shine() else None
    started = time.perf_counter()
    if ambient:
        if job["keep_scene_lights"]:
            own_light.restore()
        image("ambient", receiver.response(ambient["samples"], ambient["seed"]), started)
        own_light.off()
    emission.switch_off()
    if ambient:
        started = time.perf_counter()
        image("left", receiver.response(ambient["samples"], ambient["seed"]), started)
    illuminant = Illuminant(scene, job["sun_angle"], by_shadow_rays_alone=bool(job["no_shadow"]))
    switch = None
    if apart:
        if names := translucency.cut_out(scene):
            listed = ", ".join(repr(name) for name in names[:8]) + (", …" if len(names) > 8 else "")
            channel.warn(
                f"cut-out transparency of {listed} is not in scene.glb: rays and shadow maps tint evenly what it lets through, "
                "without its outline; bake combined if its shadows matter"
            )
        translucent = translucency.find(scene)
        tints = job.get("tints")
        if tints is None:
            aims = [partial(illuminant.aim, light) for light in job["probes"]]
            tints = translucency.fit_tints(translucent, aims, lambda: receiver.direct(1, 0))
            lightmap = job["receiver"]["kind"] == "lightmap"
            layers = {described["object"]: described["uv_layer"] for described in receiver.descriptions()} if lightmap else None
            (scratch / "scene.glb").write_bytes(scene_file.write_glb(list(scene_file.parts(layers)), tints))
            if missed := without_triangles.line(scene):
                channel.warn(missed)
            channel.emit("file", file="scene.glb", sampling=receiver.sampling(), tints=tints)
        switch = translucency.Switch(translucent, tints)
    channel.emit("ready")
    for light in lights:
        started = time.perf_counter()
        illuminant.aim(light)
        name = f"light_{light['index']}"
        if switch is None:
            response = receiver.response(light["samples"], light["seed"])
            image(name, receiver.denoised(response) if light.get("denoise") else response, started, light=light["index"])
            continue
        whole, direct = receiver.responses(light["samples"], light["seed"], switch)
        image(name, whole, started, light=light["index"], direct=hand_over(scratch, f"direct_{light['index']}", direct))


if __name__ == "__main__":
    main()
