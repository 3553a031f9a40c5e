"""The scene as rendered, as one binary glTF: the meshes of lightmaps in their surroundings."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32
from srbf.bake.worker import Worker
from srbf.capture import Capture
from srbf.errors import BakeError, InputError, ManifestError, OutputExistsError
from srbf.export.gltf_surface import mean_thickness, surface
from srbf.io import files
from srbf.io.glb import Glb
from srbf.io.image import write_picture
from srbf.receiver_images import MANIFEST

SUFFIX = ".glb"
Z_UP_TO_Y_UP = [-(0.5**0.5), 0.0, 0.0, 0.5**0.5]  # quaternion x, y, z, w: -90 degrees about x
LIGHTMAP_SET = 1  # TEXCOORD_1
LINEAR_FILTER, CLAMP = 9729, 33071
ATTRIBUTES = {"position": "POSITION", "normal": "NORMAL", "uv": "TEXCOORD_0", "lightmap": f"TEXCOORD_{LIGHTMAP_SET}", "color": "COLOR_0"}


@dataclass(frozen=True)
class SceneMesh:
    """Counts of objects, triangles, materials and bytes, and the names of the receivers among the objects."""

    objects: int
    triangles: int
    materials: int
    bytes: int
    receivers: tuple[str, ...]
    camera: str | None


def write_scene_mesh(
    scene: Path,
    output: Path,
    capture: Path | None = None,
    blender: Path | None = None,
    force: bool = False,
    say: Callable[[str], None] = lambda line: None,
    scene_name: str | None = None,
) -> SceneMesh:
    """Write the rendered objects of a .blend to `output`, a .glb, atomically: of its scene `scene_name`, else of the capture's
    scene, else of the active one.

    With a `capture` of a lightmap, its receivers get TEXCOORD_1, and its albedo for a base color; one of vertices has the middles of their
    texels there. InputError on what cannot be used,
    BakeError where Blender fails or the scene is not the one of the capture, OutputExistsError where `output` may not be replaced.
    """
    if output.suffix.lower() != SUFFIX:
        raise InputError(f"expected -o NAME{SUFFIX}, found {output.name!r}; a binary glTF is written")
    if output.exists() and not (force and output.is_file()):
        raise OutputExistsError(f"expected no {output} yet, found one; choose another, or `force=True`")
    if not scene.is_file():
        raise InputError(f"expected a .blend at {scene}, found {'a folder' if scene.is_dir() else 'no such file'}")
    opened = None if capture is None else Capture.open(capture)
    if scene_name is None and opened is not None:
        scene_name = opened.manifest.get("source", {}).get("settings", {}).get("scene")
    receivers = [] if opened is None else mesh_receivers(opened)
    with tempfile.TemporaryDirectory(prefix="srbf-") as name:
        scratch = Path(name)
        told = _ask(scene, scene_name, scratch, receivers, {} if opened is None else made_layers(opened, receivers), blender, say)
        has_texels = opened is not None and "uv_layer" in receivers[0]
        made = _Writer(told, scratch, opened.geometry("albedo") if opened is not None and has_texels else None)
        data = made.document.pack()
    with files.atomic_path(output) as temporary:
        temporary.write_bytes(data)
    return made.summary(len(data))


def mesh_receivers(capture: Capture) -> list[dict[str, Any]]:
    """The objects of a capture of a lightmap and their UV layers, or of vertices and their number; InputError on another kind."""
    manifest = capture.manifest
    found = manifest.get("receivers") or [manifest.get("receiver", {})]
    kinds = {str(one.get("kind", "none")) for one in found}
    needed = {"lightmap": {"object", "uv_layer"}, "vertices": {"object", "count"}}.get("".join(kinds))
    if needed is None or not all(needed <= one.keys() for one in found):
        raise InputError(
            f"expected a capture of a lightmap or vertices at {capture.folder}, found one of kind {', '.join(sorted(kinds))}; "
            "leave `capture` out"
        )
    return found


def made_layers(capture: Capture, receivers: list[dict[str, Any]]) -> dict[str, Float32[ndarray, "n 2"]]:
    """UV coordinates, v up, a loop each, of the receivers whose layers the bake made; ManifestError where they cannot be read."""
    name = capture.manifest.get("source", {}).get("uv")
    if name is None:
        return {}
    path = files.inside(capture.folder, str(name), capture.folder / MANIFEST)
    told = files.read_json(path)
    try:
        layers = told["objects"] if "objects" in told else [{"object": receivers[0]["object"], **told}]
        return {layer["object"]: np.array(layer["per_loop"], np.float32).reshape(-1, 2) for layer in layers}
    except (KeyError, TypeError, ValueError) as error:
        raise ManifestError(f"expected UV coordinates by loop in {path}, found {type(error).__name__}: {error}; bake again") from error


def _ask(
    scene: Path,
    scene_name: str | None,
    scratch: Path,
    receivers: list[dict[str, Any]],
    made: dict[str, Float32[ndarray, "n 2"]],
    blender: Path | None,
    say: Callable[[str], None],
) -> dict[str, Any]:
    """The worker's description of the scene; the arrays are in `scratch`."""
    asked = []
    for i, receiver in enumerate(receivers):
        if receiver["kind"] == "vertices":
            asked.append({"object": receiver["object"], "vertices": receiver["count"]})
            continue
        per_loop = None
        if receiver["object"] in made:
            per_loop = f"uv_{i}.npy"
            np.save(scratch / per_loop, made[receiver["object"]])
        asked.append({"object": receiver["object"], "uv_layer": receiver["uv_layer"], "per_loop": per_loop})
    job = {"scene": str(scene.resolve()), "scene_name": scene_name, "scratch": str(scratch.resolve()), "mesh": {"receivers": asked}}
    told: dict[str, Any] | None = None
    with Worker(job, scratch, scratch / "mesh.log", blender) as worker:
        for event in worker.events(say):
            if event["event"] == "mesh":
                told = event
    if told is None:
        raise BakeError("expected the scene's triangles from Blender, found none; run again, and check the scene if it happens again")
    return told


class _Writer:
    """Builds the document: a node and a mesh for each object, a primitive for each look and set of attributes."""

    def __init__(self, told: dict[str, Any], scratch: Path, albedo: Float32[ndarray, "H W 3"] | None) -> None:
        self.document = Glb({"asset": {"version": "2.0", "generator": "srbf mesh"}})
        self._looks, self._albedo = told["materials"], albedo
        self._materials: dict[tuple[Any, ...], int] = {}
        self._picture: int | None = None
        self._triangles = 0
        self._receivers: list[str] = []
        self._camera = told["camera"]
        objects: dict[str, list[dict[str, Any]]] = {}
        for part in told["parts"]:
            objects.setdefault(part["object"], []).append(part)
        nodes = [self._object(name, parts, scratch) for name, parts in objects.items()]
        self._objects = len(nodes)
        if self._camera is not None:
            nodes.append(self._view(self._camera))
        root = self.document.add("nodes", {"name": "z-up to y-up", "rotation": Z_UP_TO_Y_UP, "children": nodes})
        self.document.json |= {"scene": 0, "scenes": [{"nodes": [root]}]}

    def summary(self, size: int) -> SceneMesh:
        camera = None if self._camera is None else str(self._camera["name"])
        return SceneMesh(self._objects, self._triangles, len(self._materials), size, tuple(self._receivers), camera)

    def _object(self, name: str, parts: list[dict[str, Any]], scratch: Path) -> int:
        grouped: dict[tuple[Any, ...], list[Float32[ndarray, "n C"]]] = {}
        for part in parts:
            key = (part["material"], tuple((column, int(width)) for column, width in part["columns"]))
            grouped.setdefault(key, []).append(np.load(scratch / part["file"]))
        corners = np.concatenate([rows[:, :3] for group in grouped.values() for rows in group]).reshape(-1, 3, 3)
        glass = any(self._looks[look]["transmission"] > 0 for look, _ in grouped)
        thickness = mean_thickness(corners) if glass else 0.0
        primitives = [self._primitive(look, columns, np.concatenate(rows), thickness) for (look, columns), rows in grouped.items()]
        if any("TEXCOORD_1" in primitive["attributes"] for primitive in primitives):
            self._receivers.append(name)
        return self.document.add("nodes", {"name": name, "mesh": self.document.add("meshes", {"name": name, "primitives": primitives})})

    def _primitive(
        self, look: int, columns: tuple[tuple[str, int], ...], rows: Float32[ndarray, "n C"], thickness: float
    ) -> dict[str, Any]:
        ends = np.cumsum([width for _, width in columns])
        parts = {name: rows[:, end - width : end] for (name, width), end in zip(columns, ends.tolist(), strict=True)}
        is_lit = "lightmap" in parts and self._albedo is not None and self._is_diffuse(look)
        if is_lit:
            parts.pop("color", None)
        for name in ("uv", "lightmap"):
            if name in parts:
                parts[name] = parts[name] * np.array([1, -1], np.float32) + np.array([0, 1], np.float32)  # glTF's v points down
        if "lightmap" in parts:
            parts.setdefault("uv", parts["lightmap"])  # sets are numbered without a gap
        welded, index = _welded(np.concatenate(list(parts.values()), axis=1))
        attributes, at = {}, 0
        for name, values in parts.items():
            width = values.shape[1]
            attributes[ATTRIBUTES[name]] = self.document.add_accessor(np.ascontiguousarray(welded[:, at : at + width]), name == "position")
            at += width
        self._triangles += len(index) // 3
        return {
            "attributes": attributes,
            "indices": self.document.add_accessor(index),
            "material": self._material(look, thickness, is_lit, "color" in parts),
        }

    def _material(self, look: int, thickness: float, is_lit: bool, colored: bool) -> int:
        told = self._looks[look]
        key = (look, round(thickness, 6) if told["transmission"] > 0 else 0, is_lit, colored)
        if key not in self._materials:
            picture = {"index": self._texture(), "texCoord": LIGHTMAP_SET} if is_lit else None
            material = surface(told, thickness, picture, colored)
            for extension in material.get("extensions", {}):
                self.document.use_extension(extension)
            self._materials[key] = self.document.add("materials", material)
        return self._materials[key]

    def _is_diffuse(self, look: int) -> bool:
        return self._looks[look]["metallic"] < 0.5 and self._looks[look]["transmission"] < 0.5

    def _texture(self) -> int:
        """The capture's albedo as a texture; its index."""
        if self._picture is None:
            assert self._albedo is not None
            with tempfile.TemporaryDirectory(prefix="srbf-") as folder:
                path = Path(folder) / "albedo.png"
                write_picture(path, self._albedo)
                view = self.document.add_view(path.read_bytes())
            image = self.document.add("images", {"name": "albedo", "mimeType": "image/png", "bufferView": view})
            sampler = {"magFilter": LINEAR_FILTER, "minFilter": LINEAR_FILTER, "wrapS": CLAMP, "wrapT": CLAMP}
            self._picture = self.document.add("textures", {"source": image, "sampler": self.document.add("samplers", sampler)})
        return self._picture

    def _view(self, camera: dict[str, Any]) -> int:
        """The scene's camera as a node: Blender's cameras look along -z with y up, as in glTF."""
        near = max(float(camera["near"]), 0.0)
        reach = {"znear": near, "zfar": max(float(camera["far"]), near + 1e-3)}
        if "yfov" in camera:
            reach["znear"] = max(near, 1e-4)
            lens = {"type": "perspective", "perspective": {"yfov": camera["yfov"], "aspectRatio": camera["aspect"], **reach}}
        else:
            size = {"xmag": camera["ymag"] * camera["aspect"], "ymag": camera["ymag"]}
            lens = {"type": "orthographic", "orthographic": {**size, **reach}}
        pose = np.array(camera["pose"]).T.ravel().tolist()
        return self.document.add("nodes", {"name": camera["name"], "camera": self.document.add("cameras", lens), "matrix": pose})


def _welded(rows: Float32[ndarray, "n C"]) -> tuple[Float32[ndarray, "m C"], ndarray]:
    """(rows without repetition, (n,) uint32 index of each among them)."""
    rows = np.ascontiguousarray(rows + np.float32(0))  # -0 becomes 0: equal rows have equal bytes
    keys = rows.view(np.dtype((np.void, rows.itemsize * rows.shape[1]))).ravel()
    _, first, index = np.unique(keys, return_index=True, return_inverse=True)
    return rows[first], index.ravel().astype(np.uint32)
