# SPDX-License-Identifier: MIT
"""Nodes, meshes and materials as a binary glTF. A mesh with equal looks is stored once."""
import array
import json
import struct

from . import looks, space

FLOAT, UINT = 5126, 5125


class Writer:
    """add() in order, parents first; indices of nodes and materials are those of the server."""

    def __init__(self, glass):
        self.glass = glass
        self.nodes, self.materials, self.meshes = [], [], []
        self.accessors, self.views, self.content = [], [], bytearray()
        self.roots, self.known = [], {}  # known: mesh and materials by digest and looks

    def add(self, node, parent):
        """parent: index of its parent, or None. Returns the index and those of its materials."""
        made = {"name": node.label}
        if node.matrix != space.IDENTITY:
            made["matrix"] = node.matrix
        materials = []
        if node.mesh is not None:
            made["mesh"], materials = self.mesh_of(node)
        index = len(self.nodes)
        self.nodes.append(made)
        if parent is None:
            self.roots.append(index)
        else:
            self.nodes[parent].setdefault("children", []).append(index)
        return index, materials

    def mesh_of(self, node):
        key = (node.mesh.digest, node.looks)
        if key not in self.known:
            self.known[key] = self.store(node)
        return self.known[key]

    def store(self, node):
        kinds = looks.kinds(node.looks)
        materials, primitives = [], []
        for number, kind in enumerate(kinds):
            faces = [face for index, face in enumerate(node.mesh.faces)
                     if node.looks[index % len(node.looks)] == kind]
            name = node.label if len(kinds) == 1 else f"{node.label} {number + 1}"
            materials.append(len(self.materials))
            self.materials.append(looks.material(name, kind, self.glass))
            if any(len(corners) for _, _, corners in faces):
                primitives.append({**self.primitive(faces), "material": materials[-1]})
        self.meshes.append({"name": node.label, "primitives": primitives})
        return len(self.meshes) - 1, materials

    def primitive(self, faces):
        positions, normals, indices = array.array("f"), array.array("f"), array.array("I")
        for points, across, corners in faces:
            first = len(positions) // 3
            positions.extend(points)
            normals.extend(across or ())
            indices.extend(index + first for index in corners)
        attributes = {"POSITION": self.accessor(positions, 3, FLOAT, bounds=True)}
        if len(normals) == len(positions):
            attributes["NORMAL"] = self.accessor(normals, 3, FLOAT)
        return {"attributes": attributes, "indices": self.accessor(indices, 1, UINT)}

    def accessor(self, values, width, kind, bounds=False):
        made = {"bufferView": len(self.views), "componentType": kind, "count": len(values) // width,
                "type": "VEC3" if width == 3 else "SCALAR"}
        if bounds:
            made["min"] = [min(values[axis::3]) for axis in range(3)]
            made["max"] = [max(values[axis::3]) for axis in range(3)]
        self.accessors.append(made)
        content = values.tobytes()  # little-endian, as every machine that FreeCAD runs on
        self.views.append({"buffer": 0, "byteOffset": len(self.content),
                           "byteLength": len(content)})
        self.content += content
        return len(self.accessors) - 1

    def bytes(self):
        document = {"asset": {"version": "2.0", "generator": "vitrail_cad"}, "scene": 0,
                    "scenes": [{"nodes": self.roots}], "nodes": self.nodes, "meshes": self.meshes,
                    "materials": self.materials, "accessors": self.accessors,
                    "bufferViews": self.views, "buffers": [{"byteLength": len(self.content)}]}
        if any("extensions" in material for material in self.materials):
            document["extensionsUsed"] = ["KHR_materials_transmission"]
        text = json.dumps(document, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        return b"".join((b"glTF", struct.pack("<II", 2, 28 + len(text) + len(self.content)),
                         struct.pack("<I4s", len(text), b"JSON"), text,
                         struct.pack("<I4s", len(self.content), b"BIN\0"), self.content))
