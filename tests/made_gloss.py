"""Captures of glossy rooms in closed form: every cell of a box reflects a light diffusely and in a Phong lobe, without bounces."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from made_rooms import Room, write_room

from srbf.bake.viewers import project, viewer_directions
from srbf.basis.exitant_harmonics import lifted
from srbf.capture import Capture
from srbf.io import files
from srbf.io.image import write_image

ORDER = 3
DIFFUSE, GLOSS, EXPONENT = 0.2, 0.5, 3
OFF_WALLS = 0.5  # m: nearer lights make spots that no few lights interpolate


def radiance_of(room: Room, place: np.ndarray, toward: np.ndarray, gloss: float = GLOSS) -> np.ndarray:
    """(N, 3) radiance of the cells toward unit directions (N, 3) under a point light of unit irradiance at 1 m."""
    ways = place - room.places
    squared = np.maximum((ways**2).sum(axis=1, keepdims=True), 1e-9)
    ways = ways / np.sqrt(squared)
    cosine = np.maximum((ways * room.normals).sum(axis=1, keepdims=True), 0)
    mirrored = 2 * (ways * room.normals).sum(axis=1, keepdims=True) * room.normals - ways
    lobe = np.maximum((mirrored * toward).sum(axis=1, keepdims=True), 0) ** EXPONENT
    return cosine / squared * (DIFFUSE * room.albedo + gloss * lobe)


def glossy_room(folder: Path, room: Room, count: int, gloss: float = GLOSS, tested: int = 6, **keys: Any) -> Capture:
    """`count` train lights, 4 of validation and `tested` held out, with harmonics of the radiance."""
    lights: list[dict[str, Any]] = []
    places = []
    rng = np.random.default_rng(8)
    low, high = room.places.min(axis=0) + OFF_WALLS, room.places.max(axis=0) - OFF_WALLS
    own_places = rng.uniform(low, high, (count, 3))
    unseen = rng.uniform(low + 0.2, high - 0.2, (4 + tested, 3))  # within the train lights
    for role, own in (("train", own_places), ("validation", unseen[:4]), ("holdout", unseen[4:])):
        for place in own:
            lights.append({"kind": "point", "position": place.tolist(), "role": role})
            places.append(place)
    images = [radiance_of(room, place, room.normals, gloss) for place in places]
    capture = write_room(folder, room, lights, images, room.patches(48), quantity="radiance")
    manifest = files.read_json(folder / "capture.json")
    manifest |= {"harmonics": {"order": ORDER}, **keys}
    (folder / "harmonics").mkdir()
    size = capture.height * capture.width
    normals = np.zeros((size, 3), np.float32)
    normals[: len(room.places)] = room.normals
    for number, place in enumerate(places):
        views = np.zeros((size, 0), np.float32)
        for viewer in viewer_directions(ORDER):
            toward = lifted(np.broadcast_to(viewer, room.normals.shape), room.normals)
            one = np.zeros((size, 3), np.float32)
            one[: len(room.places)] = radiance_of(room, place, toward, gloss)
            views = np.concatenate([views, one], axis=1)
        shape = (capture.height, capture.width, -1)
        terms = project(views.reshape(shape), normals.reshape(shape), ORDER)
        names = [f"harmonics/{number:04d}_{k:02d}.exr" for k in range((ORDER + 1) ** 2)]
        for k, name in enumerate(names):
            write_image(folder / name, terms[:, :, 3 * k : 3 * k + 3], "half")
        manifest["lights"][number]["harmonics"] = names
    files.write_json(folder / "capture.json", manifest)
    return Capture.open(folder)
