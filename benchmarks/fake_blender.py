"""A worker with the messages of blender_bake that renders by a formula: a `--blender` for tests of the host alone.

SRBF_FAULT is KIND:LIGHT; a kind that ends in -once occurs once (SRBF_FAULT_STATE is a file that records it). Kinds: die, stop (the
process hangs), error, nan, short (a truncated file), small (another size), wrong (another light). `garbage` prints invalid lines
between its events, `slow` waits.
"""

from __future__ import annotations

import json
import os
import signal
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

SLOW = 0.03  # seconds per light


class FakeBlender:
    """One job: the scene's facts and the receiver's channels, then requests."""

    def __init__(self, job: dict[str, Any]) -> None:
        self._job = job
        self._size = (job["height"], job["width"])
        kind, _, light = os.environ.get("SRBF_FAULT", "").partition(":")
        self._once, self._kind, self._light = kind.endswith("-once"), kind.removesuffix("-once"), int(light or -1)

    def serve(self) -> None:
        self._prepare()
        for request in _requests():
            if self._kind == "slow":
                time.sleep(SLOW)
            self._render(request, self._kind if request["light"]["index"] == self._light and self._strikes() else "")
        self._emit("done")

    def _prepare(self) -> None:
        receiver = {"kind": "lightmap", "object": self._job["receiver"].get("object"), "uv_layer": "UV"}
        self._emit("scene", blender="4.5.0", receivers=[receiver], polygons=1)
        y, x = (np.mgrid[: self._size[0], : self._size[1]] + 0.5) / np.array(self._size)[:, None, None]
        ones = np.ones((*self._size, 1), np.float32)
        plane = np.stack([x, y, np.zeros_like(x)], axis=2)
        self._normal = np.stack([x - 0.5, y - 0.5, np.ones_like(x)], axis=2)
        self._normal /= np.linalg.norm(self._normal, axis=2, keepdims=True)
        hole = ones.copy()
        hole[0, 0] = 0
        images = {"position": plane, "normal": self._normal, "albedo": plane, "coverage": hole, "valid": hole, "hit": hole}
        for name in [name for name in self._job["channels"] if name in images]:
            self._emit("image", name=name, file=self._hand_over(name, images[name]), seconds=0.0)
        if self._job["ambient"]:
            self._emit("image", name="ambient", file=self._hand_over("ambient", plane), seconds=0.0)
            self._emit("image", name="residual", file=self._hand_over("residual", plane * 0.01), seconds=0.0)
        if self._job["transport"] == "indirect" and self._job["transmittances"] is None:
            (Path(self._job["scratch"]) / "scene.glb").write_bytes(b"glTF" + bytes(range(256)))
            self._emit("file", file="scene.glb", sampling={"footprint": 0.5}, transmittances={})
        self._emit("ready")

    def _render(self, request: dict[str, Any], fault: str) -> None:
        light, samples = request["light"], request["samples"]
        if fault == "die":
            os.kill(os.getpid(), signal.SIGKILL)
        if fault == "stop":
            os.kill(os.getpid(), signal.SIGSTOP)
        if fault == "error":
            self._emit("error", message="Blender could not bake 'Plane': as requested")
            sys.exit(1)
        noise = np.random.default_rng([request["seed"], samples]).normal(scale=samples**-0.5, size=(*self._size, 1))
        direct = np.maximum(self._normal @ np.array(light["direction"]), 0)[:, :, None] * np.array([1.0, 0.5, 0.25])
        whole = direct + 0.02 * noise + 0.1
        if fault == "nan":
            whole[1, 1] = np.nan
        if region := request["region"]:
            (x, y), step = region["offset"], region["step"]
            whole, direct = whole[y::step, x::step], direct[y::step, x::step]
        images = {"response": whole[1:] if fault == "small" else whole, "direct": direct}
        files = {name: self._hand_over(f"light_{light['index']}_{name}", images[name]) for name in request["channels"]}
        if fault == "short":
            os.truncate(Path(self._job["scratch"]) / files["response"], 100)
        self._emit("rendered", light=light["index"] + (fault == "wrong"), files=files, seconds=0.001)

    def _strikes(self) -> bool:
        if not self._once:
            return True
        state = Path(os.environ["SRBF_FAULT_STATE"])
        if state.exists():
            return False
        state.touch()
        return True

    def _hand_over(self, name: str, array: np.ndarray) -> str:
        np.save(Path(self._job["scratch"]) / f"{name}.npy", array.astype(np.float32))
        return f"{name}.npy"

    def _emit(self, event: str, **fields: Any) -> None:
        if self._kind == "garbage":
            sys.stdout.write('Fra:1 Mem:1M\n{"event"\n[]\n\x00\x1b[2J\n"event"\n')
        sys.stdout.write(json.dumps({"event": event, **fields}) + "\n")
        sys.stdout.flush()


def _requests() -> Iterator[dict[str, Any]]:
    """Requests until the host closes the pipe or exits."""
    for line in iter(sys.stdin.readline, ""):
        request = json.loads(line)
        if request.get("end"):
            return
        yield request


if __name__ == "__main__":
    FakeBlender(json.loads(Path(sys.argv[-1]).read_text(encoding="utf-8"))).serve()
