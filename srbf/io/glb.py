"""Binary glTF 2.0, read and written by pygltflib: a JSON document and one buffer [Khronos, glTF 2.0]."""

from __future__ import annotations

import json
import struct
import warnings
from typing import Any

import numpy as np
from numpy import ndarray
from pygltflib import ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER, FLOAT, GLTF2, SCALAR, UNSIGNED_BYTE, UNSIGNED_INT, UNSIGNED_SHORT, VEC2, VEC3

ALIGNMENT = 4  # bytes
DTYPES = {UNSIGNED_BYTE: np.uint8, UNSIGNED_SHORT: np.uint16, UNSIGNED_INT: np.uint32, FLOAT: np.float32}
WIDTHS = {SCALAR: 1, VEC2: 2, VEC3: 3}
TYPES = {width: name for name, width in WIDTHS.items()}
DAMAGE = (struct.error, ValueError, KeyError, IndexError, TypeError, AttributeError, OSError, RecursionError)  # what reading one may raise


class Glb(GLTF2):
    """A .glb to read, or to add to: `json` is its document as dictionaries, `body` its buffer.

    pygltflib handles the file; its classes for the parts of a document are left out: they take 0.25 ms per object to read, 20 times what
    the rest of a scene takes, and drop keys that they do not know.
    """

    def __init__(self, document: dict[str, Any], body: bytes = b"") -> None:
        super().__init__()
        self.json = document
        self.body = bytearray(body)

    @classmethod
    def parse(cls, data: bytes) -> Glb:
        """The file's content. Raises one of DAMAGE where the data are no glTF 2.0 or cut short."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # chunks of extensions
            found = cls.load_from_bytes(data)
        if found is None or not str(found.json["asset"]["version"]).startswith("2."):
            raise ValueError("no glTF 2.0")
        found.body = bytearray(found.binary_blob() or b"")
        buffers = found.json.get("buffers", [])
        if buffers and "uri" not in buffers[0] and len(found.body) < buffers[0]["byteLength"]:
            raise ValueError("a file cut short")
        return found

    @classmethod
    def from_json(cls, s: str, **options: Any) -> Glb:
        """pygltflib's hook: the JSON chunk."""
        return cls(json.loads(s))

    def gltf_to_json(self, separators: tuple[str, str] | None = None, indent: str | None = None) -> str:
        """pygltflib's hook: the JSON chunk."""
        return json.dumps(self.json, allow_nan=False, separators=separators, indent=indent)

    def buffers_to_binary_blob(self) -> bytearray:
        """pygltflib's hook: the binary chunk."""
        return self.body

    def values(self, index: int) -> ndarray:
        """Accessor `index` as an array (n,) or (n, 2 or 3), a view of the buffer. ValueError where its vertices are interleaved."""
        accessor = self.json["accessors"][index]
        view = self.json["bufferViews"][accessor["bufferView"]]
        dtype, width = DTYPES[accessor["componentType"]], WIDTHS[accessor["type"]]
        if view.get("byteStride", 0) not in (0, width * np.dtype(dtype).itemsize):
            raise ValueError("interleaved vertices")
        start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        array = np.frombuffer(self.body, dtype, accessor["count"] * width, start)
        return array.reshape(-1, width) if width > 1 else array

    def add(self, name: str, value: Any) -> int:
        """Append to a top-level list of the document; its index there."""
        self.json.setdefault(name, []).append(value)
        return len(self.json[name]) - 1

    def add_view(self, data: bytes, target: int | None = None) -> int:
        """Append a buffer view of `data`; its index."""
        self.body += bytes(-len(self.body) % ALIGNMENT)
        view = {"buffer": 0, "byteOffset": len(self.body), "byteLength": len(data), **({"target": target} if target else {})}
        self.body += data
        return self.add("bufferViews", view)

    def add_accessor(self, values: ndarray, bounds: bool = False) -> int:
        """Append an accessor of float32 (n, 2) or (n, 3) attributes, or of uint32 (n,) indices; its index."""
        is_index = values.dtype == np.uint32
        accessor: dict[str, Any] = {
            "bufferView": self.add_view(values.tobytes(), ELEMENT_ARRAY_BUFFER if is_index else ARRAY_BUFFER),
            "componentType": UNSIGNED_INT if is_index else FLOAT,
            "count": len(values),
            "type": TYPES[1 if values.ndim == 1 else values.shape[1]],
        }
        if bounds:
            accessor |= {"min": values.min(axis=0).tolist(), "max": values.max(axis=0).tolist()}
        return self.add("accessors", accessor)

    def use_extension(self, name: str) -> None:
        """Name an extension among those that are used."""
        used = self.json.setdefault("extensionsUsed", [])
        if name not in used:
            used.append(name)

    def pack(self) -> bytes:
        """The bytes of the file."""
        self.body += bytes(-len(self.body) % ALIGNMENT)
        self.json["buffers"] = [{"byteLength": len(self.body)}]
        return b"".join(self.save_to_bytes())
