"""Captures under a cubemap of a ground below a ball, in closed form except the shadow of the ball."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from closed_forms import ball

from srbf.capture import Capture
from srbf.cubemap import Cubemap
from srbf.cubemap_transport import BOUNCES_FILE, TESTED_FILE, VISIBILITY_FILE, write_arrays
from srbf.io import files
from srbf.io.image import write_image
from srbf.visibility.element_tracer import ElementTracer
from srbf.visibility.embree import EmbreeTriangles

WIDTH, HEIGHT, SIDE = 24, 20, 8
RANK = 2


TESTED = ((0.0, 0.0, 1.0), (0.6, 0.0, 0.8))  # lights of glossy captures


def made(
    folder: Path,
    transport: str = "combined",
    quantity: str = "irradiance",
    uncovered: int = 7,
    rank: int = RANK,
    roughness: np.ndarray | None = None,
    bounced_gloss: bool = False,
) -> Capture:
    """A ground of WIDTH x HEIGHT places below a ball, the last few texels empty; bounces of made-up shapes; two lights that test.

    With a `roughness` (HEIGHT, WIDTH) it is of colored metal on the left and of plastic on the right; `bounced_gloss`: with harmonics of
    bounces, made up, too.
    """
    rng = np.random.default_rng(4)
    cubemap = Cubemap(SIDE)
    x, y = np.meshgrid(np.linspace(-1, 1, WIDTH), np.linspace(1, -1, HEIGHT))
    position = np.stack([x, y, np.zeros_like(x)], axis=2).astype(np.float32)
    coverage = np.ones(WIDTH * HEIGHT, np.float32)
    coverage[len(coverage) - uncovered :] = 0
    receivers = np.flatnonzero(coverage)
    normals = np.tile(np.array([0, 0, 1], np.float32), (len(receivers), 1))
    starts = position.reshape(-1, 3)[receivers] + np.array([0, 0, 1e-4], np.float32)
    tracer = ElementTracer(
        starts, normals, cubemap.directions.astype(np.float32), EmbreeTriangles(ball(0.4, [0, 0, 0.6]).astype(np.float32))
    )
    (folder / "lights").mkdir(parents=True)
    write_arrays(folder / VISIBILITY_FILE, "made", bits=tracer.all_seen(), receivers=receivers.astype(np.int32), normals=normals)
    shapes, weights = rng.random((len(receivers), rank), np.float32), 0.1 * rng.random((rank, cubemap.count, 3), np.float32)
    waves = (
        {}
        if roughness is None or not bounced_gloss
        else {"harmonics": 0.3 * np.random.default_rng(5).random((16, len(receivers), rank), np.float32)}
    )
    write_arrays(folder / BOUNCES_FILE, "made", shapes=shapes, weights=weights, **waves)
    images = {
        "position": position,
        "coverage": coverage.reshape(HEIGHT, WIDTH, 1),
        "albedo": rng.random((HEIGHT, WIDTH, 3), np.float32),
    }
    channels = {}
    if roughness is not None:
        images |= gloss_of(roughness)
        channels = {"channels": {name: {"file": f"{name}.exr", "components": 3} for name in ("glossy", "lobe")}}
        tested = ElementTracer(starts, normals, np.array(TESTED, np.float32), tracer.occluders)
        write_arrays(folder / TESTED_FILE, "made", bits=tested.all_seen(), weights=0.1 * rng.random((2, rank, 3), np.float32))
    for name, image in images.items():
        write_image(folder / f"{name}.exr", image, "float")
    lights = []
    for i in range(2):
        image = rng.random((HEIGHT, WIDTH, 3), np.float32)
        write_image(folder / f"lights/{i:04d}.exr", image, "float")
        direct = {"direct": f"lights/{i:04d}.exr"} if transport == "indirect" else {}
        direction = [0, 0, 1] if roughness is None else list(TESTED[i])
        lights.append({"kind": "directional", "direction": direction, "role": "holdout", "file": f"lights/{i:04d}.exr", **direct})
    manifest = {
        "format": "srbf-capture",
        "version": 1,
        "quantity": quantity,
        "transport": transport,
        "width": WIDTH,
        "height": HEIGHT,
        "lights": lights,
        "cubemap": {"side": SIDE, "visibility": VISIBILITY_FILE, "bounces": BOUNCES_FILE},
        **{name: f"{name}.exr" for name in images if name not in ("glossy", "lobe")},
        **channels,
    }
    if roughness is not None:
        told = {"side": SIDE, "visibility": VISIBILITY_FILE, "bounces": BOUNCES_FILE, "gloss": {"terms": 4}, "tested": TESTED_FILE}
        manifest["cubemap"] = told
    files.write_json(folder / "capture.json", manifest)
    return Capture.open(folder)


def gloss_of(roughness: np.ndarray) -> dict[str, np.ndarray]:
    """Channels of the ground: its normals, and lobes."""
    shape = (HEIGHT, WIDTH, 3)
    metal = np.arange(WIDTH)[None, :, None] < WIDTH // 2
    glossy = np.where(metal, np.array([0.9, 0.6, 0.3]), 0.05)
    lobe = np.stack([roughness, np.ones((HEIGHT, WIDTH)), np.ones((HEIGHT, WIDTH))], axis=2)
    return {
        "normal": np.broadcast_to(np.array([0, 0, 1], np.float32), shape),
        "glossy": np.broadcast_to(glossy, shape).astype(np.float32),
        "lobe": lobe.astype(np.float32),
    }
