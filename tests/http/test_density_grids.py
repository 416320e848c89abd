# SPDX-License-Identifier: MIT
"""Smoke over HTTP: a scene of one density grid, alone and as a part of another, in pictures, the
summary, refusals, and what is chosen for it."""
import json
import math
import os
import pathlib
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest

import support
from exr_reader import Exr
from test_service_real import REAL, lit_floor

support.needs(REAL)

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../clients/python"))
sys.dont_write_bytecode = True

import vitrail  # its folder is known only now

NODE = shutil.which("node")
CLIENT = os.path.join(os.path.dirname(os.path.abspath(__file__)),
                      "../../clients/viewer/vitrail.js")
WRITER = os.path.join(support.BIN, "vdb_files")  # built with OpenVDB

LOOK = {"width": 24, "height": 16, "camera": {"eye": [0, 2.5, 2.5], "target": [0, 0.5, 0]},
        "format": "exr"}
LIGHTS = [{"type": "directional", "direction": [0, -1, 0], "intensity": 5}]


def smoke(value=1.0, **members):
    grid = {"name": "smoke", "size": [1, 1, 1], "values": 0, "min": [-0.5, 0.2, -0.5],
            "max": [0.5, 1.2, 0.5], **members}
    return support.glb({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
        "extensionsUsed": ["VITRAIL_density_grids"],
        "nodes": [{"name": "Smoke", "extensions": {"VITRAIL_density_grids": {"grid": 0}}}],
        "buffers": [{"byteLength": 4}], "bufferViews": [{"buffer": 0, "byteLength": 4}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 1, "type": "SCALAR"}],
        "extensions": {"VITRAIL_density_grids": {"grids": [grid]}}}, struct.pack("<f", value))


class DensityGrids(support.ServiceTest):
    @classmethod
    def setUpClass(cls):
        cls.daemon = support.Daemon(program=REAL).wait_device()

    def pixels(self, scene, **members):
        reply = self.daemon.render(scene, **{**LOOK, **members})
        self.assertEqual(200, reply.status, reply.body[:300])
        return Exr(reply.body).pixels

    def test_it_is_seen_alone_and_told_of(self):
        scene = self.daemon.push(smoke())
        summary = self.daemon.request("GET", f"/v1/scenes/{scene}").json()
        self.assertEqual((1, ["smoke"]), (summary["density_grid_count"], summary["density_grids"]))
        self.assertEqual({"min": [-0.5, 0.2, -0.5], "max": [0.5, 1.2, 0.5]},
                         {key: [round(x, 5) for x in summary["bounds"][key]]
                          for key in ("min", "max")})
        for quality in ({}, {"shadows": "raytraced"}, {"shadows": "deep"}, {"max_error": 0.1},
                        {"shadows": "raytraced", "reference": True}):
            seen = self.pixels(scene, lights=LIGHTS, quality=quality)
            middle, corner = seen[8 * 24 + 12], seen[0]
            self.assertGreater(middle["A"], 0.3)
            self.assertGreater(middle["G"], 0.01)
            self.assertEqual(0, corner["A"])

    def test_an_array_of_python_is_seen_where_it_is_dense(self):
        thin_left = [[[0, 0, 1, 1]], [[0, 0, 1, 1]]]  # [z][y][x]: dense for x > 0
        scene = self.daemon.push(vitrail.density_grid(
            thin_left, (-0.5, 0.2, -0.5), (0.5, 1.2, 0.5), density=3, color=(1, 0.5, 0)))
        summary = self.daemon.request("GET", f"/v1/scenes/{scene}").json()
        self.assertEqual(["smoke"], summary["density_grids"])
        seen = self.pixels(scene, lights=LIGHTS)
        left, right = seen[8 * 24 + 9], seen[8 * 24 + 14]
        self.assertGreater(right["A"], 0.5)
        self.assertLess(left["A"], 0.2 * right["A"])
        self.assertAlmostEqual(0.5, right["G"] / right["R"], delta=0.01)
        self.assertEqual(0, right["B"])

    def test_an_array_without_three_dimensions_is_refused(self):
        for values in ([], [[1, 2]], [[[1], [1, 2]]], [[[1, 2], [1]]], [[[]]]):
            with self.assertRaises(ValueError):
                vitrail.density_grid(values, (0, 0, 0), (1, 1, 1))

    @unittest.skipUnless(NODE, "no node")
    def test_an_array_of_javascript_makes_the_scene_of_python(self):
        program = """
          import { Vitrail, densityGrid } from "./vitrail.mjs";
          const look = { density: 3, color: [1, 0.5, 0] };
          const box = { min: [-0.5, 0.2, -0.5], max: [0.5, 1.2, 0.5], ...look };
          const thinLeft = Float32Array.of(0, 0, 1, 1, 0, 0, 1, 1);  // x first
          const { id } = await new Vitrail("%s").postScene(densityGrid(thinLeft, [4, 1, 2], box));
          let refused = 0;
          for (const size of [[4, 1], [4, 2, 2], [8]])
            try { densityGrid(thinLeft, size, box); } catch { refused++; }
          console.log(id, refused);
        """ % f"http://127.0.0.1:{self.daemon.port}"
        with tempfile.TemporaryDirectory() as folder:
            shutil.copyfile(CLIENT, os.path.join(folder, "vitrail.mjs"))
            pathlib.Path(folder, "main.mjs").write_text(program, encoding="utf-8")
            done = subprocess.run([NODE, "main.mjs"], cwd=folder, text=True, capture_output=True,
                                  check=False, timeout=60)
        self.assertEqual(0, done.returncode, done.stderr)
        scene, refused = done.stdout.split()
        self.assertEqual("3", refused)
        python = self.daemon.push(vitrail.density_grid(
            [[[0, 0, 1, 1]], [[0, 0, 1, 1]]], (-0.5, 0.2, -0.5), (0.5, 1.2, 0.5), density=3,
            color=(1, 0.5, 0)))
        self.assertEqual(self.pixels(python, lights=LIGHTS), self.pixels(scene, lights=LIGHTS))

    def test_the_command_line_brings_smoke_by_procedures(self):
        def push(*arguments, status=0):
            done = subprocess.run([os.path.join(support.BIN, "vitrail"), "push", *arguments],
                                  env={**os.environ,
                                       "VITRAIL_SERVER": f"http://127.0.0.1:{self.daemon.port}"},
                                  text=True, capture_output=True, check=False, timeout=60)
            self.assertEqual(status, done.returncode, done.stderr)
            return done.stdout.split() if status == 0 else done.stderr
        scenes = push("--procedure", "smoke:min=-0.5,0,-0.5;max=0.5,1.5,0.5;size=8,12,8;seed=3",
                      "--procedure", "fog", "--procedure", "cloud:seed=4294967295;detail=2")
        names, bounds = [], []
        for scene in scenes:
            summary = self.daemon.request("GET", f"/v1/scenes/{scene}").json()
            names += summary["density_grids"]
            bounds.append([summary["bounds"][end] for end in ("min", "max")])
        self.assertEqual(["smoke", "fog", "cloud"], names)
        self.assertEqual([[[-0.5, 0, -0.5], [0.5, 1.5, 0.5]], [[-4, 0, -4], [4, 1, 4]],
                          [[-2, 0, -2], [2, 2, 2]]], bounds)
        self.assertGreater(max(pixel["A"] for pixel in self.pixels(scenes[0])), 0.5)
        self.assertIn("min", push("--procedure", "fog:max=0,0,0", status=1))

    def test_it_shades_another_scene_as_a_part(self):
        floor, scene = self.daemon.push(lit_floor()), self.daemon.push(
            smoke(density=2, color=[0, 0, 0]))
        bare = self.pixels(floor, quality={"shadows": "raytraced"})
        part = {"smoke": {"scene": scene, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0,
                                                     0, 0, 0, 1]}}
        shown = self.pixels(floor, parts=part)
        moved = json.loads(json.dumps(part))
        moved["smoke"]["matrix"][12] = 100
        away = self.pixels(floor, parts=moved, quality={"shadows": "raytraced"})
        self.assertNotEqual(bare, shown)
        self.assertLess(sum(p["G"] for p in shown), sum(p["G"] for p in bare) - 1)
        self.assertAlmostEqual(1, sum(p["G"] for p in away) / sum(p["G"] for p in bare), delta=0.05)

    def test_trade_offs_know_of_grids_that_come_with_a_part(self):
        floor, scene = self.daemon.push(lit_floor()), self.daemon.push(smoke())
        body = {"scene": floor, "width": 16, "height": 12, "parts": {"a": {"scene": scene}},
                "tradeoff": {"max_settings": 2, "reference_samples": 16}}
        path = self.daemon.request("POST", "/v1/tradeoffs", body).header("Location")

        def document():
            return self.daemon.request("GET", path).json()
        support.wait_until(lambda: document()["state"] not in ("queued", "running"), "it ends", 240)
        self.assertEqual("done", document()["state"], document()["problem"])
        tried = {one["shadows"] for one in document()["settings"]}
        self.assertTrue(tried)
        self.assertTrue(tried.isdisjoint({"raytraced-shadows", "area", "volume", "silhouette"}))

    def test_trade_offs_of_more_grids_than_are_rasterised_are_measured_by_rays(self):
        floor, scene = self.daemon.push(lit_floor()), self.daemon.push(smoke())
        parts = {f"a{i}": {"scene": scene} for i in range(9)}
        path = self.daemon.request("POST", "/v1/tradeoffs", {
            "scene": floor, "width": 16, "height": 12, "parts": parts,
            "tradeoff": {"max_settings": 3, "reference_samples": 16}}).header("Location")

        def document():
            return self.daemon.request("GET", path).json()
        support.wait_until(lambda: document()["state"] not in ("queued", "running"), "it ends", 240)
        self.assertEqual("done", document()["state"], document()["problem"])
        self.assertEqual({"raytraced"}, {one["shadows"] for one in document()["settings"]})

    def middle(self, scene, **members):
        return self.pixels(scene, quality={"shadows": "raytraced", "samples": 1},
                           **members)[8 * 24 + 12]

    def test_overrides_change_its_look(self):
        scene = self.daemon.push(smoke())
        outline = self.daemon.request("GET", f"/v1/scenes/{scene}/outline").json()
        self.assertEqual([{"name": "smoke", "density": 1, "extinction": [1, 1, 1],
                           "color": [1, 1, 1], "anisotropy": 0}], outline["grids"])
        plain = self.middle(scene, lights=LIGHTS)
        look = {"smoke": {"density": 3, "color": [1, 0, 0.5]}}
        red = self.middle(scene, lights=LIGHTS, overrides={"grids": look})
        self.assertGreater(red["A"], plain["A"] + 0.2)
        self.assertEqual(0, red["G"])
        self.assertAlmostEqual(0.5, red["B"] / red["R"], delta=0.001)
        forward = {"anisotropy": 0.9}
        dark = self.middle(scene, lights=LIGHTS, overrides={"grids": {"#0": forward}})
        self.assertLess(dark["G"], plain["G"] / 2)  # the light falls past the camera
        clear = {"smoke": {"density": 0}}
        self.assertEqual(0, self.middle(scene, lights=LIGHTS, overrides={"grids": clear})["A"])
        floor = self.daemon.push(lit_floor())
        part = {"a": {"scene": scene}}
        for key, is_seen in (("a/smoke", False), ("a/#0", False), (None, True)):
            grids = {key: clear["smoke"]} if key else {}
            shown = self.middle(floor, parts=part, overrides={"grids": grids})
            bare = self.middle(floor)
            self.assertEqual(is_seen, shown != bare, key)

    def test_overrides_that_are_wrong_are_told_where(self):
        scene = self.daemon.push(smoke())
        for grids, status, pointer, what in (
                ({"smoke": {"density": -1}}, 400, "/overrides/grids/smoke/density", "1e+12"),
                ({"smoke": {"color": [1, 2, 1]}}, 400, "/overrides/grids/smoke/color/1", "to 1"),
                ({"smoke": {"anisotropy": 1}}, 400, "/overrides/grids/smoke/anisotropy", "0.999"),
                ({"smoke": {"opacity": 1}}, 400, "/overrides/grids/smoke/opacity", "density"),
                ({"fog": {}}, 404, "/overrides/grids", "fog")):
            reply = self.daemon.render(scene, **LOOK, overrides={"grids": grids})
            self.assertEqual(status, reply.status, reply.body[:300])
            self.assertEqual(pointer, reply.json()["pointer"])
            self.assertIn(what, reply.json()["detail"])

    def test_a_view_keeps_them(self):
        scene = self.daemon.push(smoke())
        made = self.daemon.request("POST", "/v1/views", {"scene": scene})
        view = "/v1/views/" + made.json()["id"]

        def patch(grids):
            return self.daemon.request("PATCH", view, {"overrides": {"grids": grids}})

        def kept():
            return self.daemon.request("GET", view).json()["view"]["overrides"]["grids"]
        self.assertEqual(200, patch({"smoke": {"density": 3}}).status)
        self.assertEqual(200, patch({"smoke": {"anisotropy": 0.5}}).status)
        self.assertEqual({"smoke": {"density": 3, "anisotropy": 0.5}}, kept())
        reply = patch({"fog": {"density": 1}})
        self.assertEqual((404, "/overrides/grids/fog"), (reply.status, reply.json()["pointer"]))
        self.assertEqual(200, patch({"smoke": None}).status)
        self.assertEqual({}, kept())

    def test_a_job_draws_them_as_a_render_does(self):
        scene = self.daemon.push(smoke())
        quality, grids = {"shadows": "raytraced", "samples": 1}, {"smoke": {"density": 3}}
        view = {**{key: LOOK[key] for key in ("width", "height", "camera")}, "lights": LIGHTS,
                "quality": quality, "overrides": {"grids": grids}}
        body = {"scene": scene, "view": view, "frames": "1", "frame_rate": 1,
                "outputs": [{"file": "smoke.%04d.exr", "outputs": ["color"]}]}
        reply = self.daemon.request("POST", "/v1/jobs", body)
        self.assertEqual(202, reply.status, reply.body[:300])
        job = reply.header("Location")
        support.wait_until(
            lambda: self.daemon.request("GET", job).json()["state"] == "done", "it is done", 60)
        drawn = Exr(self.daemon.request("GET", job + "/frames/1/color").body).pixels
        self.assertEqual(self.pixels(scene, lights=LIGHTS, quality=quality,
                                     overrides={"grids": grids}), drawn)
        self.assertNotEqual(self.pixels(scene, lights=LIGHTS, quality=quality), drawn)

    def test_every_technique_draws_or_refuses_it(self):
        scene = self.daemon.push(smoke())
        for shadows in ("none", "map", "deep-linked"):
            self.assertEqual(200, self.daemon.render(scene, **LOOK,
                                                     quality={"shadows": shadows}).status)
        for shadows in ("area", "volume", "silhouette", "raytraced-shadows"):
            reply = self.daemon.render(scene, **LOOK, quality={"shadows": shadows})
            self.assertEqual((400, "invalid_request"), (reply.status, reply.json()["code"]))
            self.assertIn("density grids", reply.json()["detail"])
            self.assertIn("raytraced", reply.json()["detail"])
        reply = self.daemon.render(scene, **{**LOOK, "output": "depth"})
        self.assertEqual(200, reply.status)

    def test_bad_grids_are_refused_by_name(self):
        for content, what in ((smoke(float("nan")), "smoke"), (smoke(size=[1, 1, 9000]), "9000"),
                              (smoke(density=-1), "density"), (smoke(max=[0, 0, 0]), "max"),
                              (smoke(color=[2, 0, 0]), "color")):
            reply = self.daemon.post_scene(content)
            self.assertEqual((422, "invalid_scene"), (reply.status, reply.json()["code"]))
            self.assertIn(what, reply.json()["detail"])


@unittest.skipUnless(os.path.exists(WRITER), "this build has no OpenVDB")
class OpenVdbFiles(support.ServiceTest):
    """Voxels two deep; on the middle line of (2, 2) their values sum up to 42/64."""
    @classmethod
    def setUpClass(cls):
        cls.daemon = support.Daemon(program=REAL).wait_device()

    def push(self, folder, name, query):
        body = pathlib.Path(folder, name + ".vdb").read_bytes()
        reply = self.daemon.post_scene(body, "application/octet-stream", query)
        self.assertIn(reply.status, (200, 201), reply.body[:300])
        return reply.json()

    def depth(self, scene, middle):
        """Of the whole way along z through a point."""
        eye, target = [*middle[:2], middle[2] + 20], middle
        camera = {"eye": eye, "target": target, "ortho_height": 1e-4}
        reply = self.daemon.render(scene, **{**LOOK, "width": 2, "height": 2, "camera": camera},
                                   quality={"shadows": "raytraced", "samples": 1}, lights=[])
        self.assertEqual(200, reply.status, reply.body[:300])
        return -math.log(1 - Exr(reply.body).pixels[0]["A"])

    def test_density_is_per_unit_of_the_file_whatever_its_voxels_measure(self):
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run([WRITER, folder], check=True)
            for name, query, middle, voxel in (
                    ("block", "", (2, 2, 3.5), 1),
                    ("scaled", "", (11, 20.5, 37), 2),
                    ("scaled", "&unit=cm", (0.11, 0.205, 0.37), 2),
                    ("block", "&unit=m&up=z", None, 1)):
                summary = self.push(folder, name, "?format=vdb" + query)
                self.assertEqual(["density"], summary["density_grids"])
                if not middle:  # z is up: the way along the view's z lies across the layers
                    low, high = summary["bounds"]["min"], summary["bounds"]["max"]
                    self.assertAlmostEqual(4, high[1] - low[1], delta=1e-5)
                    continue
                self.assertAlmostEqual(voxel * 42 / 64, self.depth(summary["id"], middle),
                                       delta=1e-3, msg=name + query)
            flame = self.push(folder, "several", "?format=vdb&scene=flame")
            self.assertEqual((["flame"], ["flame", "density"], 0), (
                flame["density_grids"], flame["file_scenes"], flame["file_scene"]))
            none = self.daemon.post_scene(pathlib.Path(folder, "several.vdb").read_bytes(),
                                          "application/octet-stream", "?format=vdb&scene=smoke")
            self.assertEqual((400, "invalid_request"), (none.status, none.json()["code"]))
            self.assertIn("no scene 'smoke' among its 2: 'flame', 'density'", none.json()["detail"])
            refused = self.daemon.post_scene(pathlib.Path(folder, "limits.vdb").read_bytes(),
                                             "application/octet-stream", "?format=vdb")
            self.assertEqual((422, "invalid_scene"), (refused.status, refused.json()["code"]))
            self.assertIn("2147483652 x 2147483654 x 7 voxels", refused.json()["detail"])


if __name__ == "__main__":
    support.run_tests()
