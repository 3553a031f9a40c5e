"""Files written here, read by pygltflib's own classes; files of other writers; damaged files."""

from __future__ import annotations

import json
import struct

import numpy as np
import pytest
from pygltflib import FLOAT, GLTF2, UNSIGNED_INT

from srbf.io.glb import DAMAGE, Glb

POINTS = np.array([[0, 0, 0], [1, 0, 0], [0, 2, 3], [-1, 5, 2]], np.float32)
INDICES = np.array([0, 1, 2, 2, 1, 3], np.uint32)


def made() -> Glb:
    glb = Glb({"asset": {"version": "2.0"}})
    glb.add_view(b"odd")  # three bytes: the next view is aligned
    primitive = {"attributes": {"POSITION": glb.add_accessor(POINTS, bounds=True)}, "indices": glb.add_accessor(INDICES)}
    glb.add("meshes", {"primitives": [primitive]})
    glb.add("nodes", {"mesh": 0, "weights": [0.5], "extras": {"kept": True}})
    glb.use_extension("KHR_materials_unlit")
    glb.use_extension("KHR_materials_unlit")
    return glb


def container(document: bytes, body: bytes = b"", between: bytes = b"") -> bytes:
    """A .glb put together by the specification: its header, chunks of JSON, `between` and binary."""
    document += b" " * (-len(document) % 4)
    chunks = struct.pack("<I4s", len(document), b"JSON") + document + between
    if body:
        chunks += struct.pack("<I4s", len(body), b"BIN\0") + body
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def test_pygltflib_reads_what_is_written() -> None:
    read = GLTF2.load_from_bytes(made().pack())
    (primitive,) = read.meshes[0].primitives
    for index, expected, component in ((primitive.attributes.POSITION, POINTS, FLOAT), (primitive.indices, INDICES, UNSIGNED_INT)):
        accessor = read.accessors[index]
        view = read.bufferViews[accessor.bufferView]
        assert (accessor.componentType, accessor.count, view.byteOffset % 4) == (component, len(expected), 0)
        assert read.binary_blob()[view.byteOffset : view.byteOffset + view.byteLength] == expected.tobytes()
    assert (read.accessors[0].min, read.accessors[0].max) == ([-1, 0, 0], [1, 5, 3])
    assert read.extensionsUsed == ["KHR_materials_unlit"]
    assert [buffer.byteLength for buffer in read.buffers] == [len(read.binary_blob())]


def test_a_file_comes_back_whole() -> None:
    first = made()
    second = Glb.parse(first.pack())
    assert second.json == first.json  # keys that pygltflib's classes lack, such as a node's weights, too
    np.testing.assert_array_equal(second.values(0), POINTS)
    np.testing.assert_array_equal(second.values(1), INDICES)
    assert second.pack() == first.pack()


def test_chunks_of_extensions_are_left_out() -> None:
    glb = Glb.parse(container(b'{"asset":{"version":"2.0"}}', b"body", between=struct.pack("<I4s4s", 4, b"XTRA", b"more")))
    assert (glb.json, glb.body) == ({"asset": {"version": "2.0"}}, b"body")


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"glTF",
        b"solid scene, in words",
        made().pack()[:-24],
        made().pack()[:40],
        container(b"[]"),
        container(b"{}"),
        container(b'{"asset":{"version":"1.0"}}'),
        container(b'{"asset":'),
        container(b"[" * 100_000),
        container(json.dumps({"asset": {"version": "2.0"}, "buffers": [{"byteLength": 8}]}).encode(), b"half"),
        struct.pack("<4sII", b"glTF", 2, 12),
        struct.pack("<4sII", b"glTF", 2, 1 << 30),
        struct.pack("<4sIII4s", b"glTF", 2, 24, 4, b"\xff\xfe\xfd\xfc"),
        struct.pack("<4sIII4s", b"glTF", 2, 24, 4, b"BIN\0") + b"body",
    ],
    ids=lambda data: f"{len(data)} bytes",
)
def test_what_is_no_gltf_raises_what_is_announced(data: bytes) -> None:
    with pytest.raises(DAMAGE):
        Glb.parse(data)


def test_interleaved_vertices_are_refused() -> None:
    glb = made()
    glb.json["bufferViews"][1]["byteStride"] = 24
    with pytest.raises(ValueError, match="interleaved"):
        glb.values(0)
