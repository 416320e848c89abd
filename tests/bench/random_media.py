# SPDX-License-Identifier: MIT
"""Scenes of random media: grids of smoke of any size, place, colour and phase, haze, panes of
stained glass in and across them, a floor, a wall and a block, under lamps that may stand in the
smoke. A seed makes the same scene everywhere. Panes are rough: a smooth one mirrors a sun in so few
samples of a pixel that no two references agree about it."""
import json
import math
import random
import struct

PROCEDURES = ("smoke", "fog", "cloud")
SIDES_MOST = (14, 12, 14)  # voxels of grids with values of their own


class Parts:
    """What a glTF is made of, with its one buffer."""

    def __init__(self):
        self.binary = b""
        self.document = {
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}], "nodes": [],
            "meshes": [], "materials": [], "accessors": [], "bufferViews": [],
            "extensionsUsed": ["VITRAIL_density_grids", "KHR_materials_transmission"]}
        self.grids = []

    def accessor(self, numbers, kind, width):
        data = struct.pack(f"<{len(numbers)}f", *numbers)
        view = {"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data)}
        self.document["bufferViews"].append(view)
        self.binary += data
        entry = {"bufferView": len(self.document["bufferViews"]) - 1, "componentType": 5126,
                 "count": len(numbers) // width, "type": kind}
        if width == 3:
            entry["min"] = [min(numbers[k::3]) for k in range(3)]
            entry["max"] = [max(numbers[k::3]) for k in range(3)]
        self.document["accessors"].append(entry)
        return len(self.document["accessors"]) - 1

    def node(self, **members):
        self.document["scenes"][0]["nodes"].append(len(self.document["nodes"]))
        self.document["nodes"].append(members)

    def quads(self, name, material, corners, **place):
        """corners: four points for each quad, counter-clockwise seen from its front."""
        numbers = [x for quad in corners for i in (0, 1, 2, 0, 2, 3) for x in quad[i]]
        self.document["materials"].append({"name": name, **material})
        self.document["meshes"].append({"primitives": [{
            "attributes": {"POSITION": self.accessor(numbers, "VEC3", 3)},
            "material": len(self.document["materials"]) - 1}]})
        self.node(name=name, mesh=len(self.document["meshes"]) - 1, **place)

    def grid(self, name, grid, **place):
        self.grids.append({"name": name, **grid})
        self.node(name=name, extensions={"VITRAIL_density_grids": {"grid": len(self.grids) - 1}},
                  **place)

    def glb(self):
        if self.grids:
            self.document["extensions"] = {"VITRAIL_density_grids": {"grids": self.grids}}
        self.binary += bytes(-len(self.binary) % 4)
        self.document["buffers"] = [{"byteLength": len(self.binary)}]
        text = json.dumps(self.document).encode()
        text += b" " * (-len(text) % 4)
        chunks = (struct.pack("<I4s", len(text), b"JSON") + text +
                  struct.pack("<I4s", len(self.binary), b"BIN\0") + self.binary)
        return b"glTF" + struct.pack("<II", 2, 12 + len(chunks)) + chunks


def turn(some):
    """A random unit quaternion: four normal numbers, made one long."""
    numbers = [some.gauss(0, 1) for _ in range(4)]
    length = math.sqrt(sum(x * x for x in numbers))
    return [x / length for x in numbers]


def colour(some, low=0.05):
    return [round(some.uniform(low, 1), 3) for _ in range(3)]


def log_uniform(some, low, high):
    return math.exp(some.uniform(math.log(low), math.log(high)))


def box(low, high):
    x, y, z = zip(low, high)
    return [[(x[a], y[0], z[b]) for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))],
            [(x[a], y[1], z[b]) for a, b in ((0, 1), (1, 1), (1, 0), (0, 0))],
            [(x[a], y[b], z[0]) for a, b in ((0, 0), (0, 1), (1, 1), (1, 0))],
            [(x[a], y[b], z[1]) for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))],
            [(x[0], y[a], z[b]) for a, b in ((0, 0), (0, 1), (1, 1), (1, 0))],
            [(x[1], y[a], z[b]) for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]]


def add_grid(some, parts, index):
    grid = {"min": [-0.5, -0.5, -0.5], "max": [0.5, 0.5, 0.5],
            "density": log_uniform(some, 0.2, 12), "color": colour(some),
            "extinction": [round(some.uniform(0, 2), 3) for _ in range(3)],
            "anisotropy": round(some.uniform(-0.7, 0.8), 3)}
    if some.random() < 0.4:
        side = some.choice((8, 16, 24))
        grid |= {"size": [side] * 3, "procedure": {"type": some.choice(PROCEDURES),
                                                   "seed": some.randrange(2**32)}}
    else:
        size = [some.randint(1, most) for most in SIDES_MOST]
        empty = some.uniform(0, 0.7)
        values = [some.random() if some.random() >= empty else 0.0
                  for _ in range(math.prod(size))]
        grid |= {"size": size, "values": parts.accessor(values, "SCALAR", 1)}
    parts.grid(f"smoke {index}", grid, rotation=turn(some),
               scale=[log_uniform(some, 0.4, 3) for _ in range(3)],
               translation=[some.uniform(-1.2, 1.2), some.uniform(0, 1.6), some.uniform(-1, 1)])


def add_panes(some, parts, count):
    for i in range(count):
        half = log_uniform(some, 0.3, 1.2)
        corners = [(-half, -half, 0), (half, -half, 0), (half, half, 0), (-half, half, 0)]
        parts.quads(f"pane {i}", {
            "doubleSided": True,
            "pbrMetallicRoughness": {"baseColorFactor": [*colour(some), 1], "metallicFactor": 0,
                                     "roughnessFactor": round(some.uniform(0.3, 1), 2)},
            "extensions": {"KHR_materials_transmission": {"transmissionFactor": 1}}}, [corners],
            rotation=turn(some), translation=[some.uniform(-1.2, 1.2), some.uniform(0.2, 2),
                                              some.uniform(-1, 1.2)])


def light(some):
    kind = some.choice(("point", "point", "spot", "directional"))
    place = [some.uniform(-1.8, 1.8), some.uniform(0.4, 3), some.uniform(-1.5, 1.8)]
    lamp = {"type": kind, "color": colour(some, 0.3)}
    if kind != "point":
        lamp["direction"] = [-x + some.uniform(-0.5, 0.5) for x in place[:1]] + [-place[1]] + [
            -place[2] + some.uniform(-0.5, 0.5)]
    if kind == "directional":
        return {**lamp, "intensity": round(log_uniform(some, 0.5, 5), 3)}
    if kind == "spot":
        lamp |= {"inner_cone_deg": 15, "outer_cone_deg": round(some.uniform(20, 45), 1)}
    return {**lamp, "position": place, "intensity": round(log_uniform(some, 1, 15), 3)}


def haze(some):
    if some.random() < 0.5:
        return {}
    air = {"density": round(log_uniform(some, 0.01, 0.2), 4), "color": colour(some, 0.3),
           "anisotropy": round(some.uniform(-0.5, 0.7), 3)}
    if some.random() < 0.4:
        air |= {"base_m": round(some.uniform(-0.5, 1), 3),
                "falloff_m": round(some.uniform(0.3, 3), 3)}
    return {"atmosphere": air}


def make(seed):
    """(name, GLB, request): the request without its scene, size and quality."""
    some = random.Random(seed)
    parts = Parts()
    grids, panes, lights = some.randint(1, 3), some.randint(0, 3), some.randint(1, 3)
    matte = {"metallicFactor": 0, "roughnessFactor": 0.9}
    parts.quads("room", {"pbrMetallicRoughness": {
        "baseColorFactor": [*colour(some, 0.3), 1], **matte}},
                box((-4, -0.4, -4), (4, 0, 4))[1:2] + box((-4, 0, -3), (4, 4, -2))[3:4])
    if some.random() < 0.6:
        parts.quads("block", {"pbrMetallicRoughness": {
            "baseColorFactor": [*colour(some, 0.2), 1], **matte}}, box((-0.25,) * 3, (0.25,) * 3),
            rotation=turn(some), translation=[some.uniform(-1, 1), some.uniform(0.3, 1.2),
                                              some.uniform(-0.8, 0.8)])
    for i in range(grids):
        add_grid(some, parts, i)
    add_panes(some, parts, panes)
    air = haze(some)
    is_inside = some.random() < 0.2  # the eye in what is in the middle
    eye = [some.uniform(-1.5, 1.5), some.uniform(0.5, 2.5), 0.6 if is_inside else 4]
    request = {"camera": {"eye": eye, "target": [0, 0.8, -0.5], "fov_y_deg": 45},
               "lights": [light(some) for _ in range(lights)], "scene_lights": False, **air}
    name = f"media {seed}: {grids} grids, {panes} panes, {lights} lights{', haze' if air else ''}"
    return name, parts.glb(), request
