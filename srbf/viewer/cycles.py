"""Renders by Cycles for the page: one at a time, of the lights that it sends, in a thread of the server's."""

from __future__ import annotations

import json
import tempfile
import threading
from collections.abc import Sequence
from http import HTTPStatus
from pathlib import Path
from typing import Any

from srbf.asset import Asset
from srbf.bake.given_reference import GivenReference, StoppedError, changed_line, render_given, require_view
from srbf.errors import InputError, SrbfError
from srbf.io.image import float_exr
from srbf.light_entries import entry_with_file, lights_of
from srbf.light_profile import Profile
from srbf.lights import Light
from srbf.relighting.scene_lights import profiles_of

PLACE = "cycles"  # what the page posts to, and the folder of what it gets
MOST_BYTES = 1 << 20  # of a request
MOST_LIGHTS = 64

Reply = tuple[HTTPStatus, dict[str, Any]]


class CyclesRenders:
    """What `srbf view --scene` renders for the page: `start`, `stop`, `status` and the last finished `image`.

    Raises InputError where the asset is not of a view, or there is no .blend.
    """

    def __init__(self, asset: Asset, scene: Path, blender: Path | None = None, profiles: Sequence[Profile] = ()) -> None:
        require_view(asset, scene)
        self._asset, self._scene, self._blender = asset, scene, blender
        self._given = {profile.name: profile for profile in profiles}
        self._mutex = threading.Lock()
        self._thread: threading.Thread | None = None
        self._halt = threading.Event()
        self._status: dict[str, Any] = {"state": "idle"}
        self._image: GivenReference | None = None
        self._number = 0
        self.changed = changed_line(asset, scene)

    def facts(self) -> dict[str, Any]:
        """For viewer.json: where the page asks, the scene's name, and a line where it has changed since the bake."""
        return {"place": PLACE, "scene": self._scene.name, "changed": self.changed}

    def start(self, body: bytes) -> Reply:
        """Begin a render of {lights, samples}: entries as of FRAMES.json. CONFLICT while another one runs."""
        try:
            asked = json.loads(body)
            lights, samples = asked["lights"], asked["samples"]
            if not (isinstance(lights, list) and len(lights) <= MOST_LIGHTS and isinstance(samples, int)):
                raise InputError(f"expected at most {MOST_LIGHTS} `lights` and a number of `samples`, found others")
            lights = lights_of(lights, "the page's lights", profiles=self._profile)
        except (ValueError, KeyError, TypeError, SrbfError) as error:
            return HTTPStatus.BAD_REQUEST, {"error": " ".join(str(error).split())}
        with self._mutex:
            if self._thread is not None and self._thread.is_alive():
                return HTTPStatus.CONFLICT, {"error": "a render by Cycles is running; wait for its end, or stop it"}
            self._number += 1
            self._halt = threading.Event()
            self._status = {"state": "rendering", "number": self._number, "done": 0, "samples": samples}
            self._thread = threading.Thread(target=self._render, args=(self._number, lights, samples, self._halt), daemon=True)
            self._thread.start()
            return HTTPStatus.ACCEPTED, dict(self._status)

    def _profile(self, name: str) -> Profile:
        return self._given.get(name) or profiles_of(self._asset)(name)

    def stop(self) -> Reply:
        """End the render that runs, if one does, and wait for its process to be gone."""
        self._halt.set()
        thread = self._thread
        if thread is not None:
            thread.join()
        return HTTPStatus.OK, dict(self._status)

    def status(self) -> bytes:
        """JSON: state (idle, rendering, done, stopped, failed), number of the render, samples done, seconds, error."""
        with self._mutex:
            return json.dumps(self._status).encode()

    def image(self) -> bytes:
        """The last finished render as an EXR, (H, W, 3) float; InputError before there is one."""
        if self._image is None:
            raise InputError("expected a finished render by Cycles, found none yet")
        return float_exr(self._image.image)

    def _render(self, number: int, lights: list[Light], samples: int, halt: threading.Event) -> None:
        def progress(done: int, total: int) -> None:
            self._tell(number, state="rendering", done=done, samples=total)

        try:
            with tempfile.TemporaryDirectory(prefix="srbf-") as folder:
                entries = [entry_with_file(light, Path(folder), f"{i}") for i, light in enumerate(lights)]
                found = render_given(
                    self._asset, self._scene, entries, samples, progress, blender=self._blender, stop=halt, profiles=Path(folder)
                )
        except StoppedError:
            self._tell(number, state="stopped")
        except SrbfError as error:
            self._tell(number, state="failed", error=" ".join(str(error).split()))
        except Exception as error:  # noqa: BLE001 - told to the page, which would wait forever
            self._tell(number, state="failed", error=f"{type(error).__name__}: {error}")
        else:
            self._image = found
            told = {"seconds": round(found.seconds, 2), "render_seconds": round(found.render_seconds, 2)}
            self._tell(number, state="done", done=samples, samples=samples, **told)

    def _tell(self, number: int, **status: Any) -> None:
        with self._mutex:
            self._status = {"number": number, **status}
