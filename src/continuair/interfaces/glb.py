"""Binary glTF files: arrays, which accessors name, and the JSON that names those (glTF 2.0)."""

from __future__ import annotations

import json
import struct
from collections.abc import Sequence
from typing import Any

import numpy as np

from continuair.interfaces.meshes import Mesh
from continuair.vehicle.coordinates import unflipped

_COMPONENTS = {"f": 5126, "B": 5121, "H": 5123}
"""NumPy's letters -> glTF's numbers of component types."""

_KINDS = {(): "SCALAR", (3,): "VEC3", (4,): "VEC4", (4, 4): "MAT4"}
ATTRIBUTE, INDEX = 34962, 34963
"""Purpose of a mesh's buffer."""


class Glb:
    """A glTF document under way: `document` is its JSON."""

    def __init__(self) -> None:
        self.document: dict[str, Any] = {"asset": {"version": "2.0", "generator": "continuair"}}
        self._bytes = bytearray()
        self._samplers: list[dict[str, Any]] = []
        self._channels: list[dict[str, Any]] = []

    def add(self, kind: str, entry: dict[str, Any]) -> int:
        """Append to a list of the document, such as nodes or meshes; return the entry's index."""
        entries = self.document.setdefault(kind, [])
        entries.append(entry)
        return len(entries) - 1

    def accessor(self, array: np.ndarray, dtype: str = "f", target: int | None = None) -> int:
        """Add an array whose rows are scalars, vectors or matrices, with its bounds."""
        rows = np.asarray(array, dtype=np.dtype(dtype).newbyteorder("<"))
        kind = _KINDS[rows.shape[1:]]
        # Matrices are column by column.
        flat = (np.swapaxes(rows, 1, 2) if rows.ndim == 3 else rows).reshape(len(rows), -1)
        view = {"buffer": 0, "byteOffset": len(self._bytes), "byteLength": flat.nbytes}
        if target is not None:
            view["target"] = target
        self._bytes += flat.tobytes() + bytes(-flat.nbytes % 4)
        entry = {"bufferView": self.add("bufferViews", view), "componentType": _COMPONENTS[dtype]}
        bounds = {"min": flat.min(axis=0).tolist(), "max": flat.max(axis=0).tolist()}
        return self.add("accessors", {**entry, "count": len(rows), "type": kind, **bounds})

    def node(self, name: str, children: Sequence[int] = (), **properties: Any) -> int:
        """Add a node: translation, rotation x y z w, scale, mesh, skin or camera as properties."""
        found: dict[str, Any] = {"name": name}
        if children:
            found["children"] = list(children)
        for key, value in properties.items():
            found[key] = value if isinstance(value, int) else np.asarray(value, float).tolist()
        return self.add("nodes", found)

    def material(self, red: float, green: float, blue: float, opacity: float = 1.0) -> int:
        """Add a matt material."""
        surface = {"baseColorFactor": [red, green, blue, opacity], "metallicFactor": 0.1,
                   "roughnessFactor": 0.7}  # fmt: skip
        mode = {"alphaMode": "BLEND"} if opacity < 1.0 else {}
        return self.add("materials", {"pbrMetallicRoughness": surface} | mode)

    def mesh(self, shape: Mesh, material: int, joints: np.ndarray | None = None) -> int:
        """Add a mesh; joints: of a skin, the joint of each vertex."""
        attributes = {
            "POSITION": self.accessor(shape.vertices, target=ATTRIBUTE),
            "NORMAL": self.accessor(shape.normals, target=ATTRIBUTE),
        }
        if joints is not None:
            only = np.array([[1, 0, 0, 0]])
            attributes["JOINTS_0"] = self.accessor(joints[:, None] * only, "B", ATTRIBUTE)
            weights = np.repeat(only, len(joints), axis=0)
            attributes["WEIGHTS_0"] = self.accessor(weights, target=ATTRIBUTE)
        indices = self.accessor(shape.triangles.ravel(), "H", INDEX)
        one = {"attributes": attributes, "indices": indices, "material": material}
        return self.add("meshes", {"primitives": [one]})

    def track(self, times: int, values: np.ndarray) -> int:
        """Add a sampler of translations (n, 3) or rotations (n, 4), at the times of an accessor."""
        if values.shape[1] == 4:
            values = unflipped(values)
        self._samplers.append({"input": times, "output": self.accessor(values)})
        return len(self._samplers) - 1

    def move(self, node: int, path: str, sampler: int) -> None:
        """Let a node's translation or rotation follow a track."""
        self._channels.append({"sampler": sampler, "target": {"node": node, "path": path}})

    def content(self) -> bytes:
        """Return the complete file."""
        moving = {"samplers": self._samplers, "channels": self._channels}
        self.document["animations"] = [{"name": "flight", **moving}]
        self.document["buffers"] = [{"byteLength": len(self._bytes)}]
        text = json.dumps(self.document, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        chunks = _chunk(b"JSON", text) + _chunk(b"BIN\0", bytes(self._bytes))
        return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def _chunk(kind: bytes, content: bytes) -> bytes:
    return struct.pack("<I4s", len(content), kind) + content
