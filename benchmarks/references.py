"""What Cycles renders of lights that no bake saw: every light twice, so that its noise drops out of the errors."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from srbf.bake.job import base_job
from srbf.bake.settings import BakeSettings, Receiver
from srbf.bake.worker import Worker
from srbf.capture import Capture
from srbf.lights import AreaLight, EnvironmentLight, Light, PointLight, SpotLight


def settings_of(capture: Capture) -> BakeSettings:
    """Those that render the receivers of a capture again."""
    receiver = capture.manifest["source"]["settings"]["receiver"]
    chosen = Receiver(receiver["kind"], receiver["name"], receiver.get("uv_layer"), tuple(receiver.get("also", ())))
    return BakeSettings(chosen, capture.width, capture.height, quantity=capture.quantity)


def rendered(
    scene: Path,
    settings: BakeSettings,
    lights: Sequence[Light],
    samples: int,
    channels: tuple[str, ...] = ("indirect",),
    gloss: bool = False,
    same_noise: bool = False,
) -> dict[str, np.ndarray]:
    """(2, N, H, W, 3) of each channel, `indirect` or `direct`: every light, twice.

    `gloss`: direct light includes what lobes reflect. `same_noise`: all lights have the same random numbers, so that noise drops out of the
    difference of lights that are next to each other.
    """
    images: dict[str, list[np.ndarray]] = {channel: [] for channel in channels}
    with tempfile.TemporaryDirectory(prefix="srbf-") as name:
        scratch = Path(name)
        requests = [
            {
                "light": {"index": i, **_message(light, scratch / f"environment_{i}.npy")},
                "samples": samples,
                "seed": 7919 * ((0 if same_noise else i) + len(lights) * again) + 11,
                "region": None,
                "channels": list(channels),
            }
            for again in range(2)
            for i, light in enumerate(lights)
        ]
        job = {
            **base_job(scene, settings, scratch),
            "transport": "indirect",
            "transmittances": {},
            "requests": requests,
            "direct_gloss": gloss,
        }
        with Worker(job, scratch, scratch / "bake.log", None) as worker:
            for event in worker.events(print):
                if event["event"] == "rendered":
                    for channel, found in images.items():
                        found.append(np.load(scratch / event["files"][channel]))
    return {name: np.array(found).reshape(2, len(lights), settings.height, settings.width, 3) for name, found in images.items()}


def _message(light: Light, file: Path) -> dict[str, Any]:
    """As the worker takes it; an environment's image goes to `file`."""
    if isinstance(light, EnvironmentLight):
        np.save(file, light.image)
        return {"kind": "environment", "file": str(file)}
    if isinstance(light, SpotLight):
        return {"kind": "spot", "position": light.position, "direction": light.direction, "outer": light.outer}
    if isinstance(light, AreaLight):
        return {"kind": "area", "position": light.position, "u": light.u, "v": light.v}
    assert isinstance(light, PointLight)
    return {"kind": "point", "position": light.position}
