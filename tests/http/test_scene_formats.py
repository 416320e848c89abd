# SPDX-License-Identifier: MIT
"""Scenes in other formats than glTF: by upload, command line and Python, in metres, with the format
that their name, media type or query tells; and what is refused."""

import hashlib
import io
import json
import os
import struct
import subprocess
import sys
import tempfile
import zipfile
import zlib

import image_files
import support

support.needs(support.FAKE)

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../clients/python"))
sys.dont_write_bytecode = True

import vitrail  # its folder is known only now
from vitrail.upload import multipart

FACETS = [((0, 0, 0), (0, 2, 0), (1, 0, 0)), ((0, 0, 0), (1, 0, 0), (0, 0, 3)),
          ((0, 0, 0), (0, 0, 3), (0, 2, 0)), ((1, 0, 0), (0, 2, 0), (0, 0, 3))]
OBJ = (b"mtllib m.mtl\nusemtl tinted\nv 0 0 0\nv 1 0 0\nv 0 2 0\nv 0 0 3\n"
       b"vt 0 0\nf 1/1 3/1 2/1\nf 1/1 2/1 4/1\nf 1/1 4/1 3/1\nf 2/1 3/1 4/1\n")
MTL = b"newmtl tinted\nillum 6\nTf 0.2 0.5 0.3\nmap_Kd wood.png\n"


def stl(count=None):
    body = b"".join(struct.pack("<3f", 0, 0, 0)
                    + b"".join(struct.pack("<3f", *corner) for corner in facet) + b"\0\0"
                    for facet in FACETS)
    return bytes(80) + struct.pack("<I", len(FACETS) if count is None else count) + body


def fbx_property(value):
    """Of the binary form: a text, a 64-bit number, a real one, ("I", a 32-bit one), or (kind,
    values), which is compressed."""
    if isinstance(value, str):
        return b"S" + struct.pack("<I", len(value.encode())) + value.encode()
    if isinstance(value, int):
        return b"L" + struct.pack("<q", value)
    if isinstance(value, float):
        return b"D" + struct.pack("<d", value)
    kind, values = value
    if kind == "I":
        return b"I" + struct.pack("<i", values)
    packed = zlib.compress(struct.pack(f"<{len(values)}{kind}", *values))
    kind = "l" if kind == "q" else kind
    return kind.encode() + struct.pack("<III", len(values), 1, len(packed)) + packed


def fbx_node(at, name, properties, *children):
    """At an offset of the file, which its end is told by."""
    own = b"".join(map(fbx_property, properties))
    begin, inner = at + 13 + len(name) + len(own), b""
    for child in children:
        inner += fbx_node(begin + len(inner), *child)
    inner += bytes(13) if children else b""
    return (struct.pack("<IIIB", begin + len(inner), len(properties), len(own), len(name))
            + name.encode() + own + inner)


FBX_SECOND = 46186158000
FBX_VERSION = ("Version", [("I", 100)])
FBX_WALK = (  # along +X by 0, 1 and 4 inches at 0, 0.25 and 3 s
    [("AnimationStack", [51, "Walk\0\1AnimStack", ""], FBX_VERSION),
     ("AnimationLayer", [52, "L\0\1AnimLayer", ""], FBX_VERSION),
     ("AnimationCurveNode", [53, "T\0\1AnimCurveNode", ""], FBX_VERSION),
     ("AnimationCurve", [61, "\0\1AnimCurve", ""],
      ("Default", [0.0]), ("KeyVer", [("I", 4008)]),
      ("KeyTime", [("q", (0, FBX_SECOND // 4, 3 * FBX_SECOND))]),
      ("KeyValueFloat", [("f", (0, 1, 4))]),
      ("KeyAttrFlags", [("i", (24836,))]),
      ("KeyAttrDataFloat", [("f", (0, 0, 0, 0))]),
      ("KeyAttrRefCount", [("i", (3,))]))],
    [("C", ["OO", 52, 51]), ("C", ["OO", 53, 52]), ("C", ["OP", 53, 12, "Lcl Translation"]),
     ("C", ["OP", 61, 53, "d|X"])])


def binary_fbx(objects=(), connections=()):
    """A triangle of width 1 and height 2 in inches, with +Z up."""
    content = b"Kaydara FBX Binary  \0\x1a\0" + struct.pack("<I", 7300)
    for top in (
            ("FBXHeaderExtension", [], ("FBXHeaderVersion", [("I", 1003)]),
             ("FBXVersion", [("I", 7300)])),
            ("GlobalSettings", [], ("Properties70", [],
                                    ("P", ["UpAxis", "int", "Integer", "", ("I", 2)]),
                                    ("P", ["UnitScaleFactor", "double", "Number", "", 2.54]))),
            ("Objects", [],
             ("Geometry", [11, "G\0\1Geometry", "Mesh"],
              ("Vertices", [("d", (0, 0, 0, 1, 0, 0, 0, 0, 2))]),
              ("PolygonVertexIndex", [("i", (0, 1, -3))])),
             ("Model", [12, "N\0\1Model", "Mesh"], ("Version", [("I", 232)])), *objects),
            ("Connections", [], ("C", ["OO", 12, 0]), ("C", ["OO", 11, 12]), *connections)):
        content += fbx_node(len(content), *top)
    return content + bytes(13 + 160)


def has_assimp(daemon):
    formats = daemon.request("GET", "/v1/capabilities").json()["scene_formats"]
    return any(form["name"] == "stl" for form in formats)


class SceneFormats(support.ServiceTest):
    def setUp(self):
        self.url = f"http://127.0.0.1:{self.daemon.port}"
        if not has_assimp(self.daemon):
            self.skipTest("built without assimp")

    def post(self, body, media_type, query=""):
        return self.daemon.request("POST", "/v1/scenes" + query, body,
                                   {"Content-Type": media_type})

    def expect_bounds(self, summary, low, high):
        for wanted, told in zip((low, high), (summary["bounds"]["min"], summary["bounds"]["max"])):
            for a, b in zip(wanted, told):
                self.assertAlmostEqual(a, b, delta=1e-7)

    def test_unit_and_axis_are_those_of_the_query(self):
        summary = self.post(stl(), "model/stl", "?unit=mm&up=z").json()
        self.expect_bounds(summary, (0, 0, -0.002), (0.001, 0.003, 0))
        self.assertEqual({"format": "stl", "converter": "assimp", "unit": "mm", "unit_m": 0.001,
                          "unit_by": "request", "up": "z", "up_by": "request"}, summary["source"])
        self.assertEqual([], summary["warnings"])
        plain = self.post(stl(), "application/octet-stream", "?format=stl").json()
        self.assertNotEqual(summary["id"], plain["id"])
        self.expect_bounds(plain, (0, 0, 0), (1, 2, 3))
        self.assertEqual("default", plain["source"]["unit_by"])
        self.assertIn("metres are assumed", plain["warnings"][0])
        line = f"vitrail-scene-as-1\n{hashlib.sha256(stl()).hexdigest()} stl 0.001 z\n"
        self.assertEqual(hashlib.sha256(line.encode()).hexdigest(), summary["id"])
        again = self.post(stl(), "model/stl", "?unit=mm&up=z")
        self.assertEqual((200, summary["id"]), (again.status, again.json()["id"]))

    def test_an_obj_finds_its_materials_in_the_upload(self):
        body, media_type = multipart({"a/lamp.obj": OBJ, "a/m.mtl": MTL})
        summary = self.post(body, media_type, "?unit=m").json()
        self.assertEqual(("a/lamp.obj", ["tinted"]), (summary["name"], summary["materials"]))
        self.assertEqual(["texture 'wood.png' is left out: it is not among the uploaded files"],
                         summary["warnings"])
        outline = self.daemon.request("GET", f"/v1/scenes/{summary['id']}/outline").json()
        for wanted, told in zip((0.2, 0.5, 0.3, 1), outline["materials"][0]["base_color"]):
            self.assertAlmostEqual(wanted, told, delta=1e-6)
        wood = bytes([0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 1, 0, 24, 0, 99, 50, 20])
        files = {"lamp.obj": OBJ, "m.mtl": MTL.replace(b"wood.png", b"wood.tga"), "wood.tga": wood}
        summary = self.post(*multipart(files), "?unit=m").json()
        self.assertEqual([], summary["warnings"])
        files["wood.tga"] = wood[:-1]
        cut = self.post(*multipart(files), "?unit=m")
        self.assertEqual((422, "invalid_scene"), (cut.status, cut.code))
        self.assertIn("image 0 'wood.tga'", cut.json()["detail"])
        body, media_type = multipart({"lamp.obj": OBJ})
        self.assertIn("'m.mtl' is not among the uploaded files",
                      " ".join(self.post(body, media_type).json()["warnings"]))

    def test_what_is_wrong_is_told(self):
        stored = self.daemon.request("GET", "/v1/scenes").json()["scenes"]
        for body, media_type, query, status, words in (
                (stl(400000000), "model/stl", "", 422,
                 "STL: its head declares 400000000 triangles"),
                (stl()[:-20], "model/stl", "", 422, "STL: its head declares 4 triangles"),
                (b"", "model/stl", "", 422, "empty"),
                (b"v 0 0 0\nv 1 nan 0\nv 0 1 0\nf 1 2 3\n", "model/obj", "", 422, "(1, nan, 0)"),
                (b"v 0 0 0\nf 1 2 3\n", "model/obj", "", 422, "index out of range"),
                (b"ply\nformat ascii 1.0\n", "application/octet-stream", "?format=ply", 422,
                 "PLY: the file ends within its header"),
                (stl(), "application/octet-stream", "", 415, "?format="),
                (stl(), "text/plain", "", 415, "text/plain"),
                (stl(), "model/stl", "?unit=parsec", 400, "?unit=parsec is not mm"),
                (stl(), "model/stl", "?up=x", 400, "?up=x is neither"),
                (stl(), "model/stl", "?format=max", 400, "?format=max is no format"),
                (support.triangle(), "model/gltf-binary", "?unit=mm", 400, "glTF is in metres"),
                (support.triangle(), "model/gltf-binary", "?up=z", 400, "?up= is for other")):
            reply = self.post(body, media_type, query)
            self.assertEqual(status, reply.status, (media_type, query))
            self.assertIn(words, reply.json()["detail"])
        self.assertEqual(stored, self.daemon.request("GET", "/v1/scenes").json()["scenes"])

    def test_a_3mf_package_tells_its_unit(self):
        model = """<?xml version="1.0"?><model unit="inch" xml:lang="en-US"
            xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"><resources>
            <basematerials id="2"><base name="Pane" displaycolor="#FF800033"/></basematerials>
            <object id="1" type="model" pid="2" pindex="0"><mesh><vertices>
            <vertex x="0" y="0" z="0"/><vertex x="1" y="0" z="0"/><vertex x="0" y="0" z="2"/>
            </vertices><triangles><triangle v1="0" v2="1" v3="2"/></triangles></mesh></object>
            </resources><build><item objectid="1"/></build></model>"""
        relations = """<?xml version="1.0"?><Relationships
            xmlns="http://schemas.openxmlformats.org/package/2006/relationships"><Relationship
            Target="/3D/3dmodel.model" Id="rel0"
            Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>"""
        for method in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            package = io.BytesIO()
            with zipfile.ZipFile(package, "w", method) as archive:
                archive.writestr("_rels/.rels", relations)
                archive.writestr("3D/3dmodel.model", model)
            summary = self.post(package.getvalue(), "model/3mf").json()
            self.expect_bounds(summary, (0, 0, 0), (0.0254, 2 * 0.0254, 0))
            self.assertEqual(("in", "file", "z", "file"),
                             tuple(summary["source"][key] for key in ("unit", "unit_by", "up",
                                                                      "up_by")))
            outline = self.daemon.request("GET", f"/v1/scenes/{summary['id']}/outline").json()
            pane = outline["materials"][0]
            self.assertEqual("blend", pane["alpha_mode"])
            for wanted, told in zip((1, 0.2158605, 0, 0.2), pane["base_color"]):
                self.assertAlmostEqual(wanted, told, delta=1e-6)
        broken = self.post(package.getvalue()[:-40], "model/3mf")
        self.assertEqual(422, broken.status)
        self.assertIn("3MF: ", broken.json()["detail"])

    def test_a_binary_fbx_tells_its_unit(self):
        summary = self.post(binary_fbx(), "application/octet-stream", "?format=fbx").json()
        self.expect_bounds(summary, (0, 0, 0), (0.0254, 2 * 0.0254, 0))
        self.assertEqual(("fbx", "in", "z"),
                         tuple(summary["source"][key] for key in ("format", "unit", "up")))
        cut = self.post(binary_fbx()[:-300], "application/octet-stream", "?format=fbx")
        self.assertEqual((422, "invalid_scene"), (cut.status, cut.code))
        self.assertIn("FBX: ", cut.json()["detail"])

    def test_a_binary_fbx_moves(self):
        summary = self.post(binary_fbx(*FBX_WALK), "application/octet-stream", "?format=fbx").json()
        still = self.post(binary_fbx(), "application/octet-stream", "?format=fbx").json()
        self.assertEqual([], still["animations"])
        self.assertEqual([("Walk", 3)], [(one["name"], one["duration_s"])
                                         for one in summary["animations"]])

    def test_a_converter_that_fails_is_named(self):
        with support.Daemon("--decode-timeout-s", "4") as daemon:
            daemon.wait_ready()
            for fault, words in (("crash", "the decoder ended with"),
                                 ("hang", "decoding took longer than 4 s")):
                body = OBJ + f"# fake:decoder-{fault}\n".encode()
                reply = daemon.post_scene(body, "model/obj")
                self.assertEqual((422, "invalid_scene"), (reply.status, reply.code))
                self.assertIn("Wavefront OBJ, read through assimp: " + words,
                              reply.json()["detail"])
            self.assertEqual(201, daemon.post_scene(OBJ, "model/obj").status)

    def test_clients_send_them_with_their_files(self):
        with tempfile.TemporaryDirectory() as folder:
            for name, content in (("lamp.obj", OBJ), ("m.mtl", MTL), ("part.stl", stl()),
                                  ("wood.png", image_files.png_bytes(1, 1, b"\xff\x80\x00"))):
                with open(os.path.join(folder, name), "wb") as file:
                    file.write(content)
            path = os.path.join(folder, "lamp.obj")
            push = subprocess.run(
                [os.path.join(support.BIN, "vitrail"), "push", "--json", "--unit", "cm",
                 "--up", "y", "--server", self.url, path, os.path.join(folder, "part.stl")],
                capture_output=True, text=True, check=True)
            first, second = map(json.loads, push.stdout.splitlines())
            self.assertEqual([[], []], [first["warnings"], second["warnings"]])
            self.assertEqual(vitrail.scene_id(path, unit="cm", up="y"), first["id"])
            with vitrail.Client(self.url) as client:
                summary = client.post_scene(path, unit="cm", up="y")
                self.assertEqual(first["id"], summary["id"])
                self.assertEqual(1, summary["images"])
                self.expect_bounds(client.scene(second["id"]), (0, 0, 0), (0.01, 0.02, 0.03))
                self.assertEqual(vitrail.scene_id(os.path.join(folder, "part.stl"), unit="cm",
                                                  up="y"), second["id"])


if __name__ == "__main__":
    support.run_tests()
