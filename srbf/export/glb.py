"""Writing and reading binary glTF 2.0: a JSON document and one buffer [Khronos, glTF 2.0]."""

from __future__ import annotations

import json
import struct
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy import ndarray

from srbf.errors import ManifestError
from srbf.io.scene_glb import BINARY_CHUNK, JSON_CHUNK, MAGIC

ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER = 34962, 34963
FLOAT, UNSIGNED_INT = 5126, 5125
TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3"}
ALIGNMENT = 4
HEADER = 12  # bytes


@dataclass
class Document:
    """A glTF document under construction, and its buffer."""

    json: dict[str, Any] = field(default_factory=lambda: {"asset": {"version": "2.0", "generator": "srbf export"}})
    body: bytearray = field(default_factory=bytearray)

    @staticmethod
    def read(path: Path) -> Document:
        """A .glb whose buffer is its own; ManifestError, in one line, on anything else."""
        try:
            data = path.read_bytes()
            if len(data) < HEADER:
                raise ValueError("no glTF 2.0 header, or a file cut short")
            magic, version, length = struct.unpack_from("<III", data)
            if magic != MAGIC or version != 2 or length > len(data):
                raise ValueError("no glTF 2.0 header, or a file cut short")
            document, at = Document({}), 12
            while at + 8 <= length:
                size, kind = struct.unpack_from("<II", data, at)
                chunk = data[at + 8 : at + 8 + size]
                if kind == JSON_CHUNK:
                    document.json = json.loads(chunk)
                elif kind == BINARY_CHUNK:
                    document.body = bytearray(chunk)
                at += 8 + size
            buffers = document.json.get("buffers", [])
            if not document.json.get("meshes") or len(buffers) != 1 or "uri" in buffers[0]:
                raise ValueError("no mesh in a buffer of its own")
        except OSError as error:
            raise ManifestError(f"cannot read {path}: {error.strerror}; expected the mesh as binary glTF (.glb)") from error
        except (struct.error, ValueError, KeyError, TypeError, AttributeError) as error:
            raise ManifestError(f"expected a mesh as binary glTF 2.0 in {path}, found {error}; export it from Blender as .glb") from error
        return document

    def add(self, name: str, value: Any) -> int:
        """Append to a top-level list; its index there."""
        self.json.setdefault(name, []).append(value)
        return len(self.json[name]) - 1

    def view(self, data: bytes, target: int | None = None) -> int:
        """A buffer view of more bytes; its index."""
        self.body += bytes(-len(self.body) % ALIGNMENT)
        told = {"buffer": 0, "byteOffset": len(self.body), "byteLength": len(data), **({"target": target} if target else {})}
        self.body += data
        return self.add("bufferViews", told)

    def accessor(self, values: ndarray, bounds: bool = False) -> int:
        """An accessor of float32 (n, 2) or (n, 3) attributes, or of uint32 (n,) indices; its index."""
        indices = values.dtype == np.uint32
        told: dict[str, Any] = {
            "bufferView": self.view(values.tobytes(), ELEMENT_ARRAY_BUFFER if indices else ARRAY_BUFFER),
            "componentType": UNSIGNED_INT if indices else FLOAT,
            "count": len(values),
            "type": TYPES[1 if values.ndim == 1 else values.shape[1]],
        }
        if bounds:
            told |= {"min": values.min(axis=0).tolist(), "max": values.max(axis=0).tolist()}
        return self.add("accessors", told)

    def uses(self, extension: str) -> None:
        """Name an extension among those that are used."""
        used = self.json.setdefault("extensionsUsed", [])
        if extension not in used:
            used.append(extension)

    def pack(self) -> bytes:
        """The bytes of a .glb."""
        self.body += bytes(-len(self.body) % ALIGNMENT)
        self.json["buffers"] = [{"byteLength": len(self.body)}]
        text = json.dumps(self.json, allow_nan=False, separators=(",", ":")).encode()
        text += b" " * (-len(text) % ALIGNMENT)
        length = 12 + 8 + len(text) + 8 + len(self.body)
        return (
            struct.pack("<III", MAGIC, 2, length)
            + struct.pack("<II", len(text), JSON_CHUNK)
            + text
            + struct.pack("<II", len(self.body), BINARY_CHUNK)
            + bytes(self.body)
        )
