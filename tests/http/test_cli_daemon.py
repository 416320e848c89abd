#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""`vitrail` with the real `vitraild`, started by --spawn: scenes in, images out, nothing left."""
import base64
import json
import os
import shutil
import struct
import subprocess
import sys
import tempfile
import zlib

from cli_support import BIN, VITRAIL, CliTest, main

POSITIONS = struct.pack("<9f", -1, 0, 0, 1, 0, 0, 0, 2, 0)


def document(buffer, **more):
    return {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0, "name": "Triangle"}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, **more.pop("part", {})}]}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
                           "min": [-1, 0, 0], "max": [1, 2, 0]}],
            "bufferViews": [{"buffer": 0, "byteLength": 36}],
            "buffers": [dict(buffer, byteLength=36)], **more}


def triangle_glb(**more):
    text = json.dumps(document({}, **more)).encode()
    text += b" " * (-len(text) % 4)
    return (b"glTF" + struct.pack("<II", 2, 12 + 8 + len(text) + 8 + 36) +
            struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", 36, b"BIN\0") +
            POSITIONS)


def png(red, green, blue):
    def chunk(kind, data):
        body = kind + data
        return struct.pack(">I", len(data)) + body + struct.pack(">I", zlib.crc32(body))
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", 1, 1, 8, 2, 0, 0, 0)) +
            chunk(b"IDAT", zlib.compress(bytes([0, red, green, blue]))) + chunk(b"IEND", b""))


def processes_with(text):
    """Command lines of running processes that mention the text."""
    found = []
    for entry in os.listdir("/proc"):
        if entry.isdigit() and int(entry) != os.getpid():
            try:
                with open("/proc/%s/cmdline" % entry, "rb") as file:
                    line = file.read()
            except OSError:
                continue
            if text.encode() in line:
                found.append(line.replace(b"\0", b" ").decode())
    return found


class DaemonTest(CliTest):
    @classmethod
    def setUpClass(cls):
        cls.state = tempfile.mkdtemp()

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.state, ignore_errors=True)

    def setUp(self):
        super().setUp()
        self.environment.pop("VITRAIL_SERVER")
        os.mkdir(self.path("tmp"))
        self.environment["TMPDIR"] = self.path("tmp")

    def tearDown(self):
        self.assertEqual(os.listdir(self.path("tmp")), [])
        self.assertEqual(processes_with(self.state), [])
        self.assertEqual(processes_with(self.folder), [])

    def spawn(self, *arguments, **options):
        return self.run_cli(*arguments, "--spawn", "--state-dir", self.state, **options)

    def size_of(self, name):
        content = self.read(name)
        self.assertEqual(content[:8], b"\x89PNG\r\n\x1a\n")
        return struct.unpack(">II", content[16:24])

    def test_glb_becomes_an_image_in_each_format(self):
        scene = self.scene(triangle_glb())
        self.spawn("render", scene, "-o", "a.png", "--size", "64x48")
        self.assertEqual(self.size_of("a.png"), (64, 48))
        for name, magic in (("a.jpg", b"\xff\xd8\xff"), ("a.webp", b"RIFF"),
                            ("a.exr", b"\x76\x2f\x31\x01")):
            self.spawn("render", scene, "-o", name, "--size", "64x48")
            self.assertTrue(self.read(name).startswith(magic), name)

    def test_explain_writes_the_plan_in_each_form(self):
        scene = self.scene(triangle_glb())
        text, _ = self.spawn("explain", scene, "--size", "64x48", "--shadows", "none")
        self.assertIn("A frame of 64x48 pixels", text)
        self.assertIn("gbuffer", text)
        self.assertLess(text.index("Not required:"), text.index("filtered-shadows"))
        plan = json.loads(self.spawn("explain", scene, "--json")[0])
        self.assertEqual((plan["width"], plan["height"]), (1280, 720))
        for name, start in (("p.txt", b"A frame"), ("p.json", b"{"), ("p.dot", b"digraph"),
                            ("p.svg", b"<svg"), ("p.glsl", b"// ==== ")):
            self.spawn("explain", scene, "-o", name, "--shadows", "none")
            self.assertTrue(self.read(name).startswith(start), name)
        sources, _ = self.spawn("explain", scene, "--shadows", "none", "--shaders")
        self.assertIn("-gbuffer.frag.glsl ====", sources)
        self.spawn("explain", scene, "--shaders", "--shadows", "raytraced", "-o", "sources")
        self.assertEqual(b"// such a frame needs no shader program\n", self.read("sources"))
        _, errors = self.spawn("explain", scene, "-o", "p.gif", code=2)
        self.assertIn("p.gif", errors)
        _, errors = self.spawn("explain", scene, "--camera", "node:Nobody", code=1)
        self.assertIn("Nobody", errors)

    def test_scene_kept_in_the_state_dir_is_not_sent_again(self):
        scene = self.scene(triangle_glb(extras={"only": "here"}))
        first, _ = self.spawn("render", scene, "-o", "a.png", "--size", "32x32", "--json")
        again, _ = self.spawn("render", scene, "-o", "b.png", "--size", "32x32", "--json")
        self.assertEqual((json.loads(first)["sent"], json.loads(again)["sent"]), (True, False))
        self.assertEqual(self.read("a.png"), self.read("b.png"))
        scene_id = json.loads(first)["scene"]
        self.assertIn(scene_id, self.spawn("scenes")[0])
        self.assertEqual(json.loads(self.spawn("scenes", scene_id, "--json")[0])["triangles"], 1)
        self.spawn("render", scene_id, "-o", "c.png", "--size", "32x32")
        self.assertEqual(self.read("a.png"), self.read("c.png"))
        self.spawn("delete", scene_id)
        self.assertNotIn(scene_id, self.spawn("scenes")[0])
        self.spawn("delete", scene_id, code=1)

    def test_gltf_with_files_in_folders_with_odd_names_is_understood(self):
        self.write("a b/scene.gltf", json.dumps(document(
            {"uri": "./ge%20o/../ge%20o/tri%C3%A4ngle%2B1.bin"},
            images=[{"uri": "tex/r%22d;x.png"},
                    {"uri": "data:image/png;base64," + base64.b64encode(png(0, 9, 0)).decode()}],
            textures=[{"source": 0}, {"source": 1}],
            materials=[{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}},
                        "emissiveTexture": {"index": 1}}], part={"material": 0})))
        self.write("a b/ge o/triängle+1.bin", POSITIONS)
        self.write('a b/tex/r"d;x.png', png(200, 0, 0))
        self.spawn("render", "a b/scene.gltf", "-o", "a.png", "--size", "16x16")
        self.assertEqual(self.size_of("a.png"), (16, 16))

    def test_demo_scene_is_rendered_and_always_the_same(self):
        for name in ("demo.glb", "again.glb"):
            self.run_cli("demo-scene", "-o", name)
        self.assertEqual(self.read("demo.glb"), self.read("again.glb"))
        self.run_cli("demo-scene", code=2)
        self.run_cli("demo-scene", "-o", "x.glb", "--texture-size", "5000", code=2)
        self.run_cli("demo-scene", "-o", "small.glb", "--texture-size", "64", "--no-curtains")
        self.assertLess(len(self.read("small.glb")), len(self.read("demo.glb")))
        self.run_cli("demo-scene", "-o", "none/demo.glb", code=73)
        self.spawn("render", "demo.glb", "-o", "a.png", "--size", "96x54")
        self.assertEqual(self.size_of("a.png"), (96, 54))

    def test_every_option_is_one_that_the_server_takes(self):
        self.spawn("render", self.scene(triangle_glb()), "-o", "a.exr", "--size", "32x24",
                   "--camera", "eye=0,1,4 target=0,1,0 up=0,1,0 fov=40", "--shadows", "deep",
                   "--shadow-resolution", "256", "--samples", "1", "--light-lists", "clustered",
                   "--transparency", "lists", "--blend-filter", "coverage", "--output",
                   "color,depth", "--exposure", "0.5", "--tone-mapping", "none", "--background",
                   "0,0,0,1", "--environment", "1:0.5", "--no-scene-lights",
                   "--light", "point:pos=0,3,2;color=1,0.8,0.6;intensity=100;range=9",
                   "--light", "spot:pos=0,4,0;dir=0,-1,0;inner=20;outer=35;intensity=800",
                   "--light", "directional:dir=0,-1,-0.3;intensity=5;shadow=false",
                   "--light", "rect:pos=0,3,0;dir=0,-1,0;width=1;height=0.5;up=0,0,1;intensity=50",
                   "--light", "disk:pos=0,3,0;dir=0,-1,0;radius=0.5;intensity=50",
                   "--stats", "a.json")
        self.assertTrue(json.loads(self.read("a.json"))["plan"])

    def test_refusals_of_the_server_come_through(self):
        scene = self.scene(triangle_glb())
        _, err = self.spawn("render", scene, "-o", "a.png", "--shadows", "witchcraft", code=1)
        self.assertIn("(invalid_request at /quality/shadows)", err)
        _, err = self.spawn("render", scene, "-o", "a.png", "--camera", "node:Nobody", code=1)
        self.assertIn("Nobody", err)
        _, err = self.spawn("render", "0" * 64, "-o", "a.png", code=1)
        self.assertIn("not_found", err)
        broken = triangle_glb().replace(b'"count": 3', b'"count": 9')
        _, err = self.spawn("render", self.write("broken.glb", broken), "-o", "a.png", code=1)
        self.assertIn("broken.glb", err)
        self.assertIn("invalid_scene", err)
        self.assertFalse(os.path.exists(self.path("a.png")))

    def test_questions_are_answered(self):
        self.assertIn("ready", self.spawn("health")[0])
        self.assertIn("device", json.loads(self.spawn("capabilities", "--json")[0]))
        self.assertTrue(json.loads(self.spawn("stats", "--json")[0]))

    def test_temporary_state_is_gone_afterwards(self):
        self.run_cli("render", self.scene(triangle_glb()), "-o", "a.png", "--size", "8x8",
                     "--spawn")

    def test_kill_of_the_client_leaves_no_daemon(self):
        process = subprocess.Popen(
            [VITRAIL, "render", self.scene(triangle_glb()), "-o", "a.png", "--size", "4096x4096",
             "--spawn", "--progress", "json"], cwd=self.folder, env=self.environment,
            stderr=subprocess.PIPE, stdout=subprocess.DEVNULL)
        for line in process.stderr:
            if b"uploading" in line or b"rendering" in line:
                break
        process.kill()
        process.communicate()  # returns when nobody holds stderr any more
        for _ in range(500):
            if not processes_with(self.folder) and not os.listdir(self.path("tmp")):
                return
            subprocess.run(["sleep", "0.02"], check=True)
        self.fail("left behind: %r" % processes_with(self.folder))


if __name__ == "__main__":
    if not os.path.exists(os.path.join(BIN, "vitraild")):
        print("skipped: no vitraild in " + BIN)
        sys.exit(77)
    main()
