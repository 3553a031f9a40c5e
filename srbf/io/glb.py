"""Binary glTF 2.0, read and written by pygltflib: a JSON document and one buffer [Khronos, glTF 2.0]."""

from __future__ import annotations

import json
import struct
import warnings
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numpy as np
from numpy import ndarray

from srbf.errors import MissingLibraryError

ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER = 34962, 34963
UNSIGNED_BYTE, UNSIGNED_SHORT, UNSIGNED_INT, FLOAT = 5121, 5123, 5125, 5126
DTYPES = {UNSIGNED_BYTE: np.uint8, UNSIGNED_SHORT: np.uint16, UNSIGNED_INT: np.uint32, FLOAT: np.float32}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}
TYPES = {width: name for name, width in WIDTHS.items()}
ALIGNMENT = 4  # bytes
DAMAGE = (struct.error, ValueError, KeyError, IndexError, TypeError, AttributeError, OSError, RecursionError)  # what reading one may raise


@cache
def _file() -> Any:
    """pygltflib's class of a file, with the JSON left as text.

    Its classes for nodes, meshes and the rest take 0.25 ms per object to read, 20 times what this module takes, and drop keys that they
    do not know.
    """
    try:
        from pygltflib import GLTF2
    except ImportError as error:
        raise MissingLibraryError("binary glTF needs pygltflib, which is not installed; run: pip install pygltflib") from error

    class File(GLTF2):  # type: ignore[misc]
        text = ""

        @classmethod
        def from_json(cls, s: str, **options: Any) -> File:
            made = cls()
            made.text = s
            return made

        def gltf_to_json(self, separators: tuple[str, str] | None = None, indent: str | None = None) -> str:
            return self.text

        def buffers_to_binary_blob(self) -> bytearray:
            return self.binary_blob()

    return File


@dataclass
class Glb:
    """A .glb to read, or to add to: its document as dictionaries, and its buffer."""

    json: dict[str, Any]
    body: bytearray = field(default_factory=bytearray)

    @staticmethod
    def parse(data: bytes) -> Glb:
        """The file's content. Raises one of DAMAGE where the data are no glTF 2.0 or cut short."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # chunks of extensions
            file = _file().load_from_bytes(data)
        document, body = json.loads(file.text), bytearray(file.binary_blob() or b"")
        if not str(document["asset"]["version"]).startswith("2."):
            raise ValueError("no glTF 2.0")
        buffers = document.get("buffers", [])
        if buffers and "uri" not in buffers[0] and len(body) < buffers[0]["byteLength"]:
            raise ValueError("a file cut short")
        return Glb(document, body)

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
        file = _file()()
        file.text = json.dumps(self.json, allow_nan=False, separators=(",", ":"))
        file.set_binary_blob(self.body)
        return b"".join(file.save_to_bytes())
