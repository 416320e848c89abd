#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Writes a GLB of a large assembly: nodes that share few meshes, and many triangles.

Usage: tests/bench/assembly.py NODES MESHES TRIANGLES FILE
TRIANGLES is the number of all meshes together. Nodes hang in groups of a hundred below a root, in
rows and columns; each has a name of its own, and one in seven is of glass."""
import array
import io
import json
import math
import struct
import sys

GROUP = 100
FLOATS = {"componentType": 5126, "type": "VEC3"}


def tile(side, height):
    """Positions and normals, interleaved, of a bent sheet of side x side cells."""
    rows = [(math.sin(9 * i / side), 9 * math.cos(9 * i / side)) for i in range(side + 1)]
    out = array.array("f")
    for z in range(side + 1):
        for x in range(side + 1):
            rise, slope = rows[x]
            length = math.sqrt(1 + (height * slope) ** 2)
            out.extend((x / side, height * rise, z / side))
            out.extend((-height * slope / length, 1 / length, 0))
    return out


def tile_indices(side):
    out = array.array("I")
    for z in range(side):
        for x in range(side):
            a = z * (side + 1) + x
            out.extend((a, a + side + 1, a + 1, a + 1, a + side + 1, a + side + 2))
    return out


def look(node, meshes):
    """Its tile, and whether that is of glass."""
    return node % meshes, node % 7 == 0


def add_meshes(gltf, binary, count, triangles, looks):
    """Those that nodes show, by their looks, and the number of their triangles."""
    of_look = {}
    side = max(1, round(math.sqrt(triangles / count / 2)))
    vertices, indices = (side + 1) ** 2, 6 * side * side
    index_bytes = tile_indices(side).tobytes()
    for i in range(count):
        height = 0.05 + 0.1 * i / count
        for data, stride in ((tile(side, height).tobytes(), 24), (index_bytes, 0)):
            view = {"buffer": 0, "byteOffset": binary.tell(), "byteLength": len(data)}
            gltf["bufferViews"].append(view | ({"byteStride": stride} if stride else {}))
            binary.write(data)
        view, first = len(gltf["bufferViews"]) - 2, len(gltf["accessors"])
        gltf["accessors"] += [
            {"bufferView": view, **FLOATS, "count": vertices, "min": [0, -height, 0],
             "max": [1, height, 1]},
            {"bufferView": view, "byteOffset": 12, **FLOATS, "count": vertices},
            {"bufferView": view + 1, "componentType": 5125, "count": indices, "type": "SCALAR"}]
        for material in range(2):
            if (i, material) not in looks:
                continue
            of_look[i, material] = len(gltf["meshes"])
            gltf["meshes"].append({
                "name": f"Tile {i}{' of glass' if material else ''}",
                "primitives": [{"attributes": {"POSITION": first, "NORMAL": first + 1},
                                "indices": first + 2, "material": material}]})
    return of_look, count * indices // 3


def add_nodes(gltf, count, meshes, of_look):
    nodes, columns = gltf["nodes"], math.ceil(math.sqrt(count))
    groups = []
    for first in range(0, count, GROUP):
        children = []
        for i in range(first, min(first + GROUP, count)):
            children.append(len(nodes))
            nodes.append({"name": f"Part {i}", "mesh": of_look[look(i, meshes)],
                          "translation": [1.2 * (i % columns), 0.5 * (i % 3),
                                          1.2 * (i // columns)]})
        groups.append(len(nodes))
        nodes.append({"name": f"Group {first // GROUP}", "children": children})
    gltf["scenes"] = [{"nodes": [len(nodes)]}]
    nodes.append({"name": "Assembly", "children": groups})


def write_assembly(path, nodes, meshes, triangles):
    """Returns the number of triangles that its meshes have."""
    gltf = {"asset": {"version": "2.0"}, "scene": 0, "buffers": [], "bufferViews": [],
            "accessors": [], "meshes": [], "nodes": [],
            "materials": [{"name": "Paint", "doubleSided": True,
                           "pbrMetallicRoughness": {"baseColorFactor": [0.7, 0.6, 0.5, 1],
                                                    "metallicFactor": 0}},
                          {"name": "Glass", "doubleSided": True, "alphaMode": "BLEND",
                           "pbrMetallicRoughness": {"baseColorFactor": [0.2, 0.5, 0.9, 0.4],
                                                    "metallicFactor": 0}}]}
    binary = io.BytesIO()
    of_look, total = add_meshes(gltf, binary, meshes, triangles,
                                {look(i, meshes) for i in range(nodes)})
    add_nodes(gltf, nodes, meshes, of_look)
    gltf["buffers"] = [{"byteLength": binary.tell()}]
    text = json.dumps(gltf, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    data = binary.getbuffer()
    with open(path, "wb") as file:
        size = 12 + 8 + len(text) + 8 + len(data)
        file.write(struct.pack("<4sIIII", b"glTF", 2, size, len(text), 0x4E4F534A))
        file.write(text)
        file.write(struct.pack("<II", len(data), 0x004E4942))
        file.write(data)
    return total


if __name__ == "__main__":
    if len(sys.argv) != 5:
        sys.exit(__doc__)
    print(write_assembly(sys.argv[4], *map(int, sys.argv[1:4])), "triangles")
