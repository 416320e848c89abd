# SPDX-License-Identifier: MIT
"""STEP and IGES files through OpenCASCADE: names, assemblies, colours, units, and what is refused.
The files of tests/data/cad are an assembly of a plate with a green face, four bolts, and a tube of
glass, and a block of 1 x 2 x 3 inches."""
import json
import math
import os
import random as random_module
import subprocess
import sys
import unittest
import urllib.parse

import support

support.needs(support.FAKE)

HERE = os.path.dirname(os.path.abspath(__file__))
FOLDER = os.path.join(HERE, "../data/cad")
sys.path.insert(0, os.path.join(HERE, "../../clients/python"))
sys.dont_write_bytecode = True

import vitrail  # its folder is known only now

TURNS = 12  # of files that are changed at random; the library may crash, and the server goes on
NAMES = ["unit and axis of the file", "Lamp", "Plate", "Bolts", "Bolt 1", "Bolt 2", "Bolt 3",
         "Bolt 4", "Tube \u00e9"]
COLORS = {"color 33B34C": (0.2, 0.7, 0.3, 1), "color BF9966": (0.75, 0.6, 0.4, 1),
          "color CC1A1A": (0.8, 0.1, 0.1, 1), "color 1A80E6 30 %": (0.1, 0.5, 0.9, 0.3)}


def content(name):
    with open(os.path.join(FOLDER, name), "rb") as file:
        return file.read()


def linear(value):
    return value / 12.92 if value <= 0.04045 else ((value + 0.055) / 1.055) ** 2.4


class CadFiles(support.ServiceTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        formats = cls.daemon.request("GET", "/v1/capabilities").json()["scene_formats"]
        if "step" not in json.dumps(formats):
            raise unittest.SkipTest("this build has no OpenCASCADE")

    def post(self, name, query="", body=None):
        kind = "step" if name.endswith(".step") else "iges"
        return self.daemon.post_scene(content(name) if body is None else body, f"model/{kind}",
                                      query)

    def expect_bounds(self, summary, low, high, delta=1e-6):
        for wanted, told in zip((*low, *high),
                                (*summary["bounds"]["min"], *summary["bounds"]["max"])):
            self.assertAlmostEqual(wanted, told, delta=delta)

    def outline(self, summary):
        return self.daemon.request("GET", f"/v1/scenes/{summary['id']}/outline").json()

    def test_an_assembly_keeps_its_names_places_and_colours(self):
        summary = self.post("lamp.step").json()
        self.assertEqual([], summary["warnings"])
        self.expect_bounds(summary, (0, 0, -0.12), (0.2, 0.12, 0))
        outline = self.outline(summary)
        self.assertEqual(NAMES, [node["name"] for node in outline["nodes"]])
        self.assertEqual([None, 0, 1, 1, 3, 3, 3, 3, 1],
                         [node["parent"] for node in outline["nodes"]])
        low = outline["nodes"][7]["bounds"][:3]  # the bolt at (185, 105, 20) of radius 6
        for wanted, told in zip((0.179, 0.02, -0.111), low):
            self.assertAlmostEqual(wanted, told, delta=1e-6)
        found = {material["name"]: material for material in outline["materials"]}
        self.assertEqual(set(COLORS), set(found))
        for name, (*rgb, alpha) in COLORS.items():
            for wanted, told in zip((*map(linear, rgb), alpha), found[name]["base_color"]):
                self.assertAlmostEqual(wanted, told, delta=2e-6)
            self.assertEqual("blend" if alpha < 1 else "opaque", found[name]["alpha_mode"])

    def test_units_and_axes_are_told_and_may_be_asked_for(self):
        block = self.post("block-inch.step").json()
        self.assertEqual({"format": "step", "converter": "opencascade", "unit": "in",
                          "unit_m": 0.0254, "unit_by": "file", "up": "z", "up_by": "default"},
                         block["source"])
        self.expect_bounds(block, (0, 0, -0.0508), (0.0254, 0.0762, 0))
        asked = self.post("block-inch.step", "?unit=cm&up=y").json()
        self.expect_bounds(asked, (0, 0, 0), (0.01, 0.02, 0.03))
        self.assertEqual(("cm", "request", "y", "request"),
                         tuple(asked["source"][key] for key in ("unit", "unit_by", "up", "up_by")))
        self.assertNotEqual(block["id"], asked["id"])

    def test_iges_is_read_with_its_colours(self):
        summary = self.post("lamp.iges").json()
        self.expect_bounds(summary, (0, 0, -0.12), (0.2, 0.12, 0))
        self.assertEqual(("iges", "mm", "file"), tuple(summary["source"][key] for key in
                                                       ("format", "unit", "unit_by")))
        self.assertLess({"color BF9966", "color 33B34C", "color CC1A1A"},
                        {one["name"] for one in self.outline(summary)["materials"]})

    def test_circles_keep_the_stated_deviation(self):
        summary = self.post("lamp.step").json()
        tube = self.outline(summary)["nodes"][8]["bounds"]
        diagonal = math.hypot(0.06, 0.06, 0.1)
        self.assertLess(abs(tube[3] - tube[0] - 0.06), 2 * 0.001 * diagonal)
        # two circles of the tube and one of the bolt, of at least 2 pi / acos(1 - s / r) / 2 sides
        self.assertGreater(summary["triangles"], 8 * math.pi / math.acos(1 - 0.132 / 30) / 2)
        self.assertLess(summary["triangles"], 5000)

    def test_the_deflection_is_what_was_asked_for(self):
        """Of the tube's outer circle of 30 mm: n sides are off by 30 (1 - cos(pi / n))."""
        counts = []
        for asked in ("10", "0.03", "0.003"):
            summary = self.post("lamp.step", "?deflection=" + asked).json()
            self.assertEqual(float(asked), summary["source"]["deflection"])
            tube = self.outline(summary)["nodes"][8]["bounds"]
            self.assertLess(abs(tube[3] - tube[0] - 0.06), 2 * 0.001 * float(asked))
            counts.append(summary["triangles"])
        self.assertEqual(sorted(counts), counts)
        self.assertGreater(counts[2], 2 * math.pi / math.acos(1 - 0.003 / 30) / 2 * 4)
        usual = self.post("lamp.step").json()
        self.assertNotIn("deflection", usual["source"])
        self.assertLess(usual["triangles"], counts[1])
        line = "vitrail-scene-as-1\n{} step - - 0.003\n"
        own = support.sha256(content("lamp.step"))
        self.assertEqual(support.sha256(line.format(own).encode()), summary["id"])
        self.assertEqual(summary["id"], vitrail.scene_id(os.path.join(FOLDER, "lamp.step"),
                                                         deflection=0.003))
        iges = self.post("lamp.iges", "?deflection=0.003&unit=m").json()
        self.assertGreater(iges["triangles"], counts[1])

    def test_a_deflection_that_is_none_is_refused(self):
        for asked in ("0", "-1", "nan", "inf", "1e-10", "1e10", "1e999", "1mm", "0x1", " 1", "a"):
            reply = self.post("block-inch.step", "?deflection=" + urllib.parse.quote(asked))
            self.assertEqual((400, "invalid_request"), (reply.status, reply.code), asked)
            self.assertIn(f"?deflection={asked} is no number of units of the file in [1e-09,",
                          reply.json()["detail"])
        empty = self.post("block-inch.step", "?deflection=")
        self.assertEqual(400, empty.status)
        other = self.daemon.post_scene(b"solid", "model/stl", "?deflection=1")
        self.assertEqual(400, other.status)
        self.assertIn("?deflection= is for STEP and IGES", other.json()["detail"])

    def test_broken_files_are_refused_by_what_is_wrong(self):
        step, iges = content("lamp.step"), content("lamp.iges")
        data = step.index(b"DATA;")
        end = b"\nENDSEC;\nEND-ISO-10303-21;\n"
        for name, body, words in (
                ("a.step", step[:-400], "does not end with END-ISO-10303-21;"),
                ("a.step", b"\0" * 4000, "does not begin with ISO-10303-21;"),
                ("a.step", b"ISO-10303-21;" + os.urandom(5000) + end, "STEP: "),
                ("a.step", step[:data + 5] + end, "holds no product"),
                ("a.step", step[:step.index(b"\n#400 ")] + end, "is named, and is not there"),
                ("a.step", step.replace(b"#35)", b"#999999)"), "entity #999999 is named"),
                ("a.iges", iges[:-81], "STEP"),
                ("a.iges", b"solid", "first line is not one of an IGES file"),
                ("a.iges", iges[:82 * 20] + iges[-82:], "IGES: ")):
            reply = self.post(name, body=body)
            if words == "STEP":
                words = "the file is cut"
            self.assertEqual((422, "invalid_scene"), (reply.status, reply.code), words)
            self.assertIn(words, reply.json()["detail"])
        self.assertIn(self.post("block-inch.step").status, (200, 201))

    def test_what_is_changed_at_random_ends_in_a_scene_or_a_refusal(self):
        random = random_module.Random(7)
        with support.Daemon("--decode-timeout-s", "15") as daemon:
            daemon.wait_ready()
            for turn in range(TURNS):
                name = ("lamp.step", "lamp.iges")[turn % 2]
                body = bytearray(content(name))
                for _ in range(1 + turn):
                    at = random.randrange(1000, len(body) - 100)
                    body[at:at + 1] = random.choice((b"9", b"0", b",", b"(", b"#1", b"", b"-"))
                reply = daemon.post_scene(bytes(body), "model/" + name[5:])
                self.assertIn(reply.status, (200, 201, 422), reply.body)
                if reply.status == 422:
                    self.assertRegex(reply.json()["detail"], "^(STEP|IGES)")
            self.assertEqual(201, daemon.post_scene(content("block-inch.step"),
                                                    "model/step").status)

    def test_clients_send_them(self):
        path = os.path.join(FOLDER, "block-inch.step")
        url = f"http://127.0.0.1:{self.daemon.port}"
        push = subprocess.run([os.path.join(support.BIN, "vitrail"), "push", "--json", "--server",
                               url, path], capture_output=True, text=True, check=True)
        with vitrail.Client(url) as client:
            summary = client.post_scene(path)
            self.assertEqual(json.loads(push.stdout)["id"], summary["id"])
            self.assertEqual(vitrail.scene_id(path), summary["id"])
            summary = client.post_scene(path, deflection=0.25)
            self.assertEqual(vitrail.scene_id(path, deflection=0.25), summary["id"])
        program = [os.path.join(support.BIN, "vitrail"), "push", "--json", "--server", url,
                   "--deflection"]
        push = subprocess.run([*program, "0.25", path], capture_output=True, text=True, check=True)
        self.assertEqual(json.loads(push.stdout)["id"], summary["id"])
        push = subprocess.run([*program, "-3", path], capture_output=True, text=True, check=False)
        self.assertNotEqual(0, push.returncode)
        self.assertIn("?deflection=-3 is no number of units of the file", push.stderr)


if __name__ == "__main__":
    support.run_tests()
