# SPDX-License-Identifier: MIT
"""`vitrail view` and `vitrail orbit` against a daemon on the test double."""
import json
import os
import subprocess

import support
from cli_service import VITRAIL, CliServiceTest
from support import triangle


class CliViews(CliServiceTest):
    def create(self, *arguments):
        return self.run_cli("view", "create", self.scene, "--size", "32x16", *arguments).strip()

    def test_a_view_is_made_shown_patched_and_forgotten(self):
        view = self.create("--camera", "fit:iso")
        shown = json.loads(self.run_cli("view", "show", view, "--json"))
        self.assertEqual(("iso", 32, 1), (shown["view"]["camera"]["fit"], shown["width"],
                                          shown["revision"]))
        self.run_cli("view", "patch", view, "--set", "/overrides/nodes/Triangle/visible=false",
                     "--set", "/exposure_ev=2")
        shown = json.loads(self.run_cli("view", "show", view, "--json"))
        self.assertEqual((2, 2, False), (
            shown["revision"], shown["view"]["exposure_ev"],
            shown["view"]["overrides"]["nodes"]["Triangle"]["visible"]))
        self.assertIn(view, self.run_cli("view", "show"))
        self.run_cli("view", "delete", view)
        self.assertIn("there is no view", self.run_cli("view", "show", view, code=1))

    def test_a_view_takes_the_look_options_of_a_render(self):
        view = self.create("--clip", "0,-1,0,2", "--highlight", "Triangle", "--shadows", "map",
                           "--part", f"twin={self.scene};parent=Triangle;pos=0,0,1")
        shown = json.loads(self.run_cli("view", "show", view, "--json"))["view"]
        self.assertEqual([0, -1, 0, 2], shown["clip_planes"][0])
        self.assertEqual(["Triangle"], shown["highlight"]["nodes"])
        self.assertEqual("map", shown["quality"]["shadows"])
        self.assertEqual(shown["scene"], shown["parts"]["twin"]["scene"])
        self.run_cli("view", "patch", view, "--clip", "1,0,0,0;cap=true", "--edges", "default",
                     "--part", f"third={self.scene}", "--set", "/parts/twin=null")
        shown = json.loads(self.run_cli("view", "show", view, "--json"))["view"]
        self.assertEqual([{"plane": [1, 0, 0, 0], "shadows": True, "cap": True}],
                         shown["clip_planes"])
        self.assertEqual(["third"], list(shown["parts"]))
        self.assertEqual(30, shown["edges"]["crease_deg"])
        self.run_cli("view", "patch", view, "--light", "point:pos=0,0,5",
                     "--light", "point:pos=0,1,5")
        self.run_cli("view", "patch", view, "--set", "/lights/1/intensity=7")
        lights = json.loads(self.run_cli("view", "show", view, "--json"))["view"]["lights"]
        self.assertEqual([1, 7], [light["intensity"] for light in lights])

    def test_long_images_of_views_and_files_tell_how_far_they_are(self):
        server = ("--server", f"http://127.0.0.1:{self.daemon.port}", "--progress", "json", "-q")
        with open(self.scene, "wb") as file:
            file.write(triangle("fake:slow=2000"))
        for command in (("view", "image", self.create()), ("render", self.scene),
                        ("orbit", self.scene, "--count", "1")):
            picture = self.path("%d.png" if command[0] == "orbit" else "a.png")
            done = subprocess.run([VITRAIL, *command, "-o", picture, *server],
                                  capture_output=True, text=True, timeout=60, check=True)
            lines = [json.loads(line) for line in done.stderr.splitlines()]
            told = [line for line in lines if "pass" in line]
            self.assertGreater(len(told), 1, done.stderr)
            self.assertEqual({("rendering", "rendering", "shading")},
                             {(line["stage"], line["state"], line["pass"]) for line in told})
            shares = [line["share"] for line in told]
            self.assertEqual(sorted(shares), shares)
            percents = [line["progress"] for line in told]
            self.assertGreater(percents[-1], percents[0])

    def test_an_image_is_that_of_the_server(self):
        view = self.create()
        for name, query in (("a.png", ""), ("a.webp", "?format=webp")):
            self.run_cli("view", "image", view, "-o", self.path(name))
            with open(self.path(name), "rb") as file:
                body = self.daemon.request("GET", f"/v1/views/{view}/image{query}").body
                self.assertEqual(body, file.read())
        self.run_cli("view", "image", view, "--aov", "depth", "-o", self.path("d.exr"))

    def test_a_pick_tells_node_and_layers(self):
        view = self.create()
        hit = json.loads(self.run_cli("view", "pick", view, "2.5,3.5", "--json"))["hit"]
        self.assertEqual("Triangle", hit["node"]["name"])
        found = json.loads(self.run_cli("view", "pick", view, "2.5,3.5", "--through", "--json"))
        self.assertEqual(2, len(found["hits"]))

    def test_wrong_calls_are_usage_errors(self):
        view = "0" * 16
        for arguments in (("view",), ("view", "jump"), ("view", "create"), ("view", "show", "x"),
                          ("view", "image", view), ("view", "image", view, "-o", "a.gif"),
                          ("view", "pick", view), ("view", "pick", view, "5"),
                          ("view", "delete"), ("orbit", self.scene),
                          ("view", "patch", view, "--clip", "1,0,0"),
                          ("orbit", self.scene, "-o", "%d.png", "--edges", "thick"),
                          ("orbit", self.scene, "-o", "a.png"),
                          ("orbit", self.scene, "-o", "%d%d.png"),
                          ("orbit", self.scene, "-o", "%s.png"),
                          ("orbit", self.scene, "-o", "%n%d.png"),
                          ("orbit", self.scene, "-o", "%2d.gif"),
                          ("orbit", self.scene, "-o", "%d.png", "-n", "0"),
                          ("orbit", self.scene, "-o", "%d.png", "-n", "1.5"),
                          ("orbit", self.scene, "-o", "%d.png", "--elevation", "90")):
            self.run_cli(*arguments, code=2)

    def test_an_orbit_is_one_view_and_leaves_none(self):
        before = self.daemon.stats()["views"]
        names = self.run_cli("orbit", self.scene, "-n", "4", "-o", self.path("v_%02d.png"),
                             "--size", "32x16", "--shadows", "map", "--edges", "default").split()
        self.assertEqual([self.path(f"v_0{i}.png") for i in range(4)], names)
        self.assertTrue(all(os.path.getsize(name) > 0 for name in names))
        views = self.daemon.stats()["views"]
        self.assertEqual((before["made"] + 1, before["open"]), (views["made"], views["open"]))


if __name__ == "__main__":
    support.run_tests()
