"""The message that host and worker exchange for every image, and what becomes of a reply to another one."""

from __future__ import annotations

import importlib.util
import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from srbf.bake.light_sets import PlacedLight
from srbf.bake.planned_lights import PlannedLight
from srbf.bake.request import RenderRequest
from srbf.bake.worker_pool import Task

LIGHT = PlannedLight(7, PlacedLight("directional", (0.0, 0.6, 0.8)), "train", 2, 5)
needs_bpy = pytest.mark.skipif(importlib.util.find_spec("bpy") is None, reason="this Python has no bpy")


def test_a_request_is_one_json_object() -> None:
    request = RenderRequest(LIGHT, 4, 11, (3, 1), ("response", "direct"))
    assert json.loads(json.dumps(request.message())) == {
        "light": {"index": 7, "kind": "directional", "direction": [0.0, 0.6, 0.8]},
        "samples": 4,
        "seed": 11,
        "region": [3, 1],
        "channels": ["response", "direct"],
    }
    assert RenderRequest(None, 4, 11).message() == {"light": None, "samples": 4, "seed": 11, "region": None, "channels": ["response"]}


def test_a_task_asks_for_the_images_that_it_takes() -> None:
    assert Task(LIGHT, 2, 3).request == RenderRequest(LIGHT, 2, 3)
    assert Task(replace(LIGHT, parts=("response", "direct")), 2, 3).request.channels == ("response", "direct")
    assert Task(LIGHT, 2, 3, denoise=True).request.channels == ("denoised",)


@needs_bpy
@pytest.mark.parametrize(
    ("request_", "words"),
    [
        (RenderRequest(LIGHT, 2, 3, (0, 4)), "expected a request for the whole receiver, found a region of 2: a vertices"),
        (RenderRequest(LIGHT, 2, 3, None, ("response", "direct")), "among response from a vertices.*direct"),
    ],
)
def test_a_worker_refuses_what_its_receiver_cannot_render(request_: RenderRequest, words: str) -> None:
    from blender_bake.ipc import WorkerError
    from blender_bake.request import RenderRequest as Received

    receiver = SimpleNamespace(kind="vertices", renders={"response"}, render=lambda request, switch: {"response": np.ones((1, 1, 3))})
    assert list(Received.of(RenderRequest(LIGHT, 2, 3).message()).render(receiver)) == ["response"]
    with pytest.raises(WorkerError, match=words) as caught:
        Received.of(request_.message()).render(receiver)
    assert "\n" not in str(caught.value)


@needs_bpy
def test_a_worker_refuses_other_messages_and_channels() -> None:
    from blender_bake.channels import chosen
    from blender_bake.ipc import WorkerError
    from blender_bake.request import RenderRequest as Received

    with pytest.raises(WorkerError, match="expected a request of light, samples"):
        Received.of({"index": 3, "samples": 2, "seed": 1})
    makers = {"position": lambda: np.zeros((1, 1, 3)), "seams": lambda: None}
    assert list(chosen(["position", "seams"], makers, "view")) == ["position"]
    with pytest.raises(WorkerError, match="among position, seams of a view, found a job that asks for roughness"):
        chosen(["position", "roughness"], makers, "view")
