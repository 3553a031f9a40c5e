"""`gltf`: a mesh that any viewer shows with a plain lightmap, and that viewers with SRBF_relighting_map relight."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from srbf.arrays import Float32
from srbf.asset import MANIFEST, Asset
from srbf.errors import InputError, ManifestError
from srbf.export import texture_array
from srbf.export.settings import PLAIN, Settings, Written
from srbf.export.texel_mesh import texel_mesh
from srbf.io.files import atomic_path
from srbf.io.glb import DAMAGE, Glb
from srbf.light_domain import Cloud, Named, domain_of_asset
from srbf.lights import EnvironmentLight, NamedLight
from srbf.methods import method_of, relight
from srbf.methods.over_lights import finish
from srbf.relighting.alpha import alpha_of, write_png

EXTENSION = "SRBF_relighting_map"
UNLIT = "KHR_materials_unlit"
MODEL = "model.glb"
UV_SET = 1  # TEXCOORD_1
LINEAR_FILTER, CLAMP = 9729, 33071
ENVIRONMENT_SIZE = (16, 32)  # texels of the white environment map
CLOUD_PLACES = 24


def write(asset: Asset, folder: Path, settings: Settings = PLAIN) -> Written:
    """Fill `folder` with the asset, its layers in a .ktx2 file, and `model.glb` that points to it.

    The mesh is `settings.mesh`, else rebuilt from the position map, for a view a picture of its size. Its materials carry the extension,
    {manifest, texCoord, and the `surface` material they had}; without it they show the asset as `under_white`, unlit.
    """
    notes: list[str] = []
    document, lit = _lit_document(asset, settings.mesh, notes)
    if asset.transport == "indirect":
        notes.append("without the extension, viewers show the indirect light only")
    with atomic_path(folder / MODEL) as temporary:
        temporary.write_bytes(document.pack())
    written = texture_array.write(".ktx2", asset, folder, settings)
    return Written((f"{MODEL}: {lit} triangles relit by TEXCOORD_{UV_SET}", *notes, *written.notes))


def model(asset: Asset, mesh: Path | None = None) -> bytes:
    """Only `model.glb`, as `write` writes it."""
    return _lit_document(asset, mesh, [])[0].pack()


def under_white(asset: Asset) -> Float32[np.ndarray, "H W 3"]:
    """The asset under a uniform environment map of radiance 1/pi (irradiance 1 on an open plane), or for radiance assets of radiance 1.

    Named lights: all of them as the scene has them set. A cloud: the mean over lights of irradiance 1 at 1 m all over the free space.
    """
    domain = domain_of_asset(asset.manifest)
    if isinstance(domain, Named):
        return relight(asset, [NamedLight(name) for name in domain.names])
    if isinstance(domain, Cloud):
        return finish(asset, method_of(asset).responses(asset, domain.probes(CLOUD_PLACES)).mean(axis=0))
    radiance = 1 / np.pi if asset.quantity == "irradiance" else 1.0
    return relight(asset, [EnvironmentLight(np.full((*ENVIRONMENT_SIZE, 3), radiance, np.float32))])


def _lit_document(asset: Asset, mesh: Path | None, notes: list[str]) -> tuple[Glb, int]:
    """The mesh with the lightmap on its materials, and how many of its triangles have it."""
    document = _document(asset, notes) if mesh is None else _given(mesh)
    return document, _light_up(document, asset, _fallback(document, asset), mesh)


def _given(path: Path) -> Glb:
    """The mesh of a .glb whose buffer is its own; ManifestError, in one line, on anything else."""
    try:
        data = path.read_bytes()
    except OSError as error:
        raise ManifestError(f"cannot read {path}: {error.strerror}; expected the mesh as binary glTF (.glb)") from error
    try:
        document = Glb.parse(data)
        buffers = document.json.get("buffers", [])
        if not document.json.get("meshes") or len(buffers) != 1 or "uri" in buffers[0]:
            raise ValueError("no mesh in a buffer of its own")
    except DAMAGE as error:
        raise ManifestError(f"expected a mesh as binary glTF 2.0 in {path}, found {error}; export it from Blender as .glb") from error
    return document


def _document(asset: Asset, notes: list[str]) -> Glb:
    """One node of one primitive: a view's picture, or the lightmap's texels. Adds to `notes` which."""
    document = Glb({"asset": {"version": "2.0", "generator": "srbf export"}})
    kind = asset.receiver.get("kind")
    if kind == "vertices":
        raise InputError("expected a lightmap or a view, found an asset of vertices; give the `mesh` with a UV for each, a .glb")
    if kind == "probes":
        raise InputError("expected a lightmap or a view, found an asset of probes, which have no surface; export another target")
    if kind == "view":
        wide, high = asset.width / max(asset.width, asset.height), asset.height / max(asset.width, asset.height)
        around = np.array([[-1, 1, 0], [-1, -1, 0], [1, -1, 0], [1, 1, 0]], np.float32)
        positions = around * np.array([wide, high, 1], np.float32) / 2
        normals: np.ndarray | None = np.tile(np.array([0, 0, 1], np.float32), (4, 1))
        uv = np.array([[0, 0], [0, 1], [1, 1], [1, 0]], np.float32)
        triangles = np.array([[0, 1, 2], [0, 2, 3]])
        notes.append("a view is a picture: its mesh is a rectangle of the same proportions")
    else:
        mesh = texel_mesh(asset)
        positions, uv, triangles = _y_up(mesh.positions), mesh.uv, mesh.triangles
        normals = None if mesh.normals is None else _y_up(mesh.normals)
        notes.append("the mesh is rebuilt from the lightmap's texels; `mesh`, a .glb, takes the scene's own")
    attributes = {"POSITION": document.add_accessor(positions, bounds=True)}
    if normals is not None:
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        attributes["NORMAL"] = document.add_accessor(
            np.where(length > 0, normals / np.where(length > 0, length, 1), [0, 1, 0]).astype(np.float32)
        )
    attributes["TEXCOORD_0"] = document.add_accessor(uv)
    primitive = {"attributes": attributes, "indices": document.add_accessor(triangles.astype(np.uint32).ravel())}
    mesh_index = document.add("meshes", {"primitives": [primitive]})
    name = asset.receiver.get("object", "receiver")
    document.json["scenes"] = [{"nodes": [document.add("nodes", {"name": str(name), "mesh": mesh_index})]}]
    document.json["scene"] = 0
    return document


def _y_up(vectors: Float32[np.ndarray, "V 3"]) -> Float32[np.ndarray, "V 3"]:
    """Blender's z-up frame in glTF's: x, z, -y."""
    return np.ascontiguousarray(np.stack([vectors[:, 0], vectors[:, 2], -vectors[:, 1]], axis=1))


def _fallback(document: Glb, asset: Asset) -> int:
    """The asset under a white environment map as a texture of the document; its index."""
    with tempfile.TemporaryDirectory(prefix="srbf-") as folder:
        path = Path(folder) / "lightmap.png"
        write_png(path, under_white(asset), alpha_of(asset))
        view = document.add_view(path.read_bytes())
    image = document.add("images", {"name": "lightmap", "mimeType": "image/png", "bufferView": view})
    sampler = document.add("samplers", {"magFilter": LINEAR_FILTER, "minFilter": LINEAR_FILTER, "wrapS": CLAMP, "wrapT": CLAMP})
    return document.add("textures", {"source": image, "sampler": sampler})


def _light_up(document: Glb, asset: Asset, picture: int, path: Path | None) -> int:
    """Give the receivers' primitives TEXCOORD_1 and a material with the extension; how many triangles they have."""
    receivers = _receivers(document, asset)
    made: dict[int | None, int] = {}
    lit = 0
    for index, mesh in enumerate(document.json["meshes"]):
        if index not in receivers:
            continue
        for primitive in mesh["primitives"]:
            attributes = primitive["attributes"]
            uv = attributes.get("TEXCOORD_1", attributes.get("TEXCOORD_0"))
            if uv is None:
                continue
            attributes.setdefault("TEXCOORD_0", uv)
            attributes["TEXCOORD_1"] = uv
            before = primitive.get("material")
            if before not in made:
                made[before] = document.add("materials", _material(document, before, picture, alpha_of(asset) is not None))
            primitive["material"] = made[before]
            count = document.json["accessors"][primitive.get("indices", attributes["POSITION"])]["count"]
            lit += count // 3
    if not lit:
        raise InputError(f"expected a mesh with a UV set in {path}, found none; unwrap it, or leave `mesh` out")
    document.use_extension(EXTENSION)
    document.use_extension(UNLIT)
    return lit


def _receivers(document: Glb, asset: Asset) -> set[int]:
    """The meshes of the nodes that are named as the asset's receivers; all of them where none is."""
    names = {receiver["object"] for receiver in asset.receivers if "object" in receiver}
    named = {node["mesh"] for node in document.json.get("nodes", []) if "mesh" in node and node.get("name") in names}
    return named or set(range(len(document.json["meshes"])))


def _material(document: Glb, before: int | None, picture: int, cut_out: bool) -> dict[str, Any]:
    """The lightmap unlit, in the color of the material before where the map holds none, and the extension; a view by its alpha."""
    old = document.json["materials"][before] if before is not None else {}
    base = old.get("pbrMetallicRoughness", {})
    factor = {"baseColorFactor": base["baseColorFactor"]} if "baseColorFactor" in base else {}
    return {
        "name": f"{old.get('name', 'receiver')}, relit",
        "doubleSided": old.get("doubleSided", True),
        **({"alphaMode": "BLEND"} if cut_out else {}),
        "pbrMetallicRoughness": {
            **factor,
            "baseColorTexture": {"index": picture, "texCoord": UV_SET},
            "metallicFactor": 0,
            "roughnessFactor": 1,
        },
        "extensions": {
            UNLIT: {},
            EXTENSION: {"manifest": MANIFEST, "texCoord": UV_SET, **({"surface": before} if before is not None else {})},
        },
    }
