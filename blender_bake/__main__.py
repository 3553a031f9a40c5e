# SPDX-License-Identifier: GPL-3.0-or-later
"""`python -m blender_bake JOB.json`, or `blender --background --python blender_bake/__main__.py -- JOB.json`.

The job has the scene, the receiver and what to render or report; see `run`. Events go out as JSON lines:
scene, warning, image (name, file, seconds), file, ready, rendered (light, files, seconds), facts, mesh, error, done.
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

from blender_bake.ipc import Events, Requests, WorkerError, hand_over, leave


def main() -> None:
    """Run the job named by the last argument; exit 0 when done, 1 after an error event."""
    events = Events()
    requests = Requests()
    try:
        job = json.loads(Path(sys.argv[-1]).read_text(encoding="utf-8"))
        run(job, chain(job.get("requests", ()), requests if job.get("serve") else ()), events)
    except WorkerError as error:
        events.emit("error", message=str(error))
        leave(1)
    except Exception as error:  # reported as an event, so that the process does not end silently
        traceback.print_exc()
        events.emit("error", message=f"Blender's worker failed: {type(error).__name__}: {error}".replace("\n", " "))
        leave(1)
    events.emit("done")
    leave(0)


def run(job: dict[str, Any], messages: Iterable[dict[str, Any]], events: Events) -> None:
    """Open the scene, prepare the receiver, send the images that the job asks for, emit `ready`, then render `messages` as they come.

    Every job: scene, scene_name (null: the active one), scratch (folder for files handed over). A job with `query` gets the facts
    that it asks for (see `scene_query`), one with `mesh` the scene's triangles and materials (see `scene_mesh`), and no more.
    Others: receiver {kind, object | objects, uv_layer, unwrap | camera | file, described}, width, height, quantity, transport,
    keep_scene_lights, sun_angle (rad), no_shadow (names of objects), coverage_samples;
    channels: names of the receiver's images to send first (see `channels`);
    ambient: a request without a light, or null; rendered only where the scene may emit;
    lit_by: {kind: own}, suns and point lights of ours; {kind: named, groups}, the scene's own lights; {kind: cloud | patches, file}, point
    lights, and patches of the surfaces (see `emissive_patches`); {kind: given, lights, sun_angle}, all of these lights at once in every
    image, with what the scene itself emits (and its lights and world where `keep_scene_lights`);
    direct_gloss: whether direct light includes what gloss reflects; needs a view;
    viewers: unit directions that radiance is rendered toward where a request asks for it, or null;
    requests, serve: requests (see `RenderRequest`) in the job, and whether more come on stdin;
    transmittances, probes: where `transport` is indirect, the transmittances of translucent materials, by name; if null, fitted under
    the lights `probes`, and sent with the scene's triangles.
    """
    from blender_bake import emission, given_lights, no_shadow, scene_file, scene_mesh, scene_query, translucency, without_triangles
    from blender_bake import scene as scenes
    from blender_bake.frame import Frame
    from blender_bake.light import SoleLight
    from blender_bake.lightmap import LightmapReceiver
    from blender_bake.named_lights import NamedLights
    from blender_bake.probes import ProbeReceiver
    from blender_bake.request import RenderRequest
    from blender_bake.vertices import VertexReceiver
    from blender_bake.view import ViewReceiver

    scratch = Path(job["scratch"])
    scene = scenes.open_scene(job["scene"], events, job.get("scene_name"))
    frame = Frame.of(scene)
    scenes.configure(scene)
    if "query" in job:
        events.emit("facts", **scene_query.facts(scene, job["query"], events, frame, job["scratch"]))
        return
    if "mesh" in job:
        events.emit("mesh", **scene_mesh.response(scene, job))
        return
    kinds = {"lightmap": LightmapReceiver, "vertices": VertexReceiver, "view": ViewReceiver, "probes": ProbeReceiver}
    kind = kinds[job["receiver"]["kind"]]
    left_out = [*scenes.left_out(scene), *(frame.left_out(job["width"], job["height"]) if kind is ViewReceiver else ())]
    no_shadow.let_light_through(scene, job["no_shadow"])
    lit_by = job["lit_by"]
    named = NamedLights(scene, lit_by["groups"]) if lit_by["kind"] == "named" else None
    own_light = None if named else scenes.OwnLight(scene)
    apart = job["transport"] == "indirect"
    if apart:
        scene_file.show_as_rendered(scene)
    receiver = kind(scene, job, events)
    for line in left_out:  # only where the receiver exists
        events.warn(line)
    events.emit("scene", blender=scenes.version(), receivers=receiver.descriptions(), **receiver.facts())

    def send(name: str, array: Any, started: float) -> None:
        events.emit("image", name=name, file=hand_over(scratch, name, array), seconds=time.perf_counter() - started)

    for name, array in receiver.channels(job["channels"]).items():
        send(name, array, time.perf_counter())
    ambient = None
    if own_light is not None and job["ambient"] and (job["keep_scene_lights"] or emission.may_shine()):
        ambient = RenderRequest.of(job["ambient"])
        started = time.perf_counter()
        if job["keep_scene_lights"]:
            own_light.restore()
        send("ambient", ambient.render(receiver)["response"], started)
        own_light.off()
    given = lit_by["kind"] == "given"
    if given:
        if job["keep_scene_lights"] and own_light is not None:
            own_light.restore()
        given_lights.make(scene, lit_by["lights"], lit_by["sun_angle"])
    elif named is None:
        emission.switch_off()
    if ambient is not None:
        started = time.perf_counter()
        send("residual", ambient.render(receiver)["response"], started)
    light = SoleLight(scene, job["sun_angle"], bool(job["no_shadow"]), named, lit_by.get("file"))
    switch = None
    if apart:
        if names := translucency.cut_out(scene):
            listed = ", ".join(repr(name) for name in names[:8]) + (", …" if len(names) > 8 else "")
            events.warn(
                f"cut-out transparency of {listed} is not in scene.glb: rays and shadow maps dim the light behind it evenly, "
                "without its outline; bake combined if its shadows matter"
            )
        translucent = translucency.find(scene)
        transmittances = job["transmittances"]
        if transmittances is None:
            aims = [partial(light.aim, probe) for probe in job["probes"]]
            transmittances = translucency.fit_transmittances(translucent, aims, lambda: receiver.direct(1, 0))
            described = receiver.descriptions() if kind is LightmapReceiver else []
            layers = None if kind in (VertexReceiver, ViewReceiver) else {one["object"]: one["uv_layer"] for one in described}
            (scratch / "scene.glb").write_bytes(scene_file.write_glb(list(scene_file.parts(layers)), transmittances))
            if missed := without_triangles.line(scene):
                events.warn(missed)
            events.emit("file", file="scene.glb", sampling=receiver.sampling(), transmittances=transmittances)
        switch = translucency.Switch(translucent, transmittances)
    events.emit("ready")
    for message in messages:
        started = time.perf_counter()
        request = RenderRequest.of(message)
        light.aim(request.light)
        index = None if request.light is None else request.light["index"]
        images = request.render(receiver, switch)
        names = {name: hand_over(scratch, f"light_{index}_{name}", image) for name, image in images.items()}
        events.emit("rendered", light=index, files=names, seconds=time.perf_counter() - started)


if __name__ == "__main__":
    main()
