# SPDX-License-Identifier: MIT
"""Environment maps of `vitrail` and of the Python client, against the daemon."""
import hashlib
import json
import os
import subprocess
import sys
import tempfile

import support

support.needs(support.FAKE)
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../clients/python"))
sys.dont_write_bytecode = True

import vitrail  # its folder is known only now

VITRAIL = os.path.join(support.BIN, "vitrail")


def hdr(width, height):
    return (b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y %d +X %d\n" % (height, width)
            + bytes((128, 64, 32, 129)) * (width * height))


class CommandLine(support.ServiceTest):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def write(self, name, content):
        path = os.path.join(self.folder, name)
        with open(path, "wb") as file:
            file.write(content)
        return path

    def run_cli(self, *arguments, code=0):
        done = subprocess.run(
            [VITRAIL, *arguments, "--server", f"http://127.0.0.1:{self.daemon.port}"], check=False,
            capture_output=True, text=True, timeout=120, cwd=self.folder)
        self.assertEqual(code, done.returncode, done.stderr)
        return done.stdout, done.stderr

    def maps(self):
        return self.daemon.request("GET", "/v1/environments").json()["environments"]

    def uploads(self):
        return self.daemon.log().count("POST /v1/environments 201")

    def test_a_map_is_pushed_once_and_listed_named_and_forgotten(self):
        content = hdr(8, 4)
        path = self.write("sky at dusk.hdr", content)
        environment = hashlib.sha256(content).hexdigest()
        for _ in range(2):
            self.assertEqual(environment + "\n", self.run_cli("push", path)[0])
        self.assertEqual(1, self.uploads())
        listed = self.run_cli("environments")[0]
        self.assertIn(f"{environment}  8 x 4, 1 0.5 0.25 nt  sky at dusk.hdr", listed)
        told = json.loads(self.run_cli("environments", "environment:sky at dusk.hdr", "--json")[0])
        self.assertEqual(environment, told["id"])
        self.run_cli("push", path, "--name", "dusk")
        self.run_cli("delete", "environment:dusk")
        self.assertNotIn(environment, [one["id"] for one in self.maps()])
        _, err = self.run_cli("delete", "environment:dusk", code=66)
        self.assertIn("the server has no environment map that is called 'dusk'", err)

    def test_warnings_of_a_map_are_told_and_can_be_failures(self):
        path = self.write("wide.hdr", hdr(2050, 2))
        out, err = self.run_cli("push", path)
        self.assertIn("is reduced to 2048 x 2", err)
        told = json.loads(self.run_cli("push", path, "--json")[0])
        self.assertEqual((out.strip(), False), (told["id"], told["sent"]))
        self.assertEqual(2, len(told["warnings"]))
        self.run_cli("push", path, "--strict", code=1)

    def test_a_render_is_lit_by_a_file_an_id_a_name_or_the_studio(self):
        scene = self.write("box.glb", support.triangle())
        content = hdr(10, 5)
        path, environment = self.write("a:b.hdr", content), hashlib.sha256(content).hexdigest()
        before = self.uploads()
        for light in (path, "a:b.hdr", environment, environment[:8], "environment:a:b.hdr",
                      "studio", "1:2", "0.5,0.5,1:0"):
            self.run_cli("render", scene, "-o", "out.png", "--environment", light)
        self.assertEqual(before + 1, self.uploads())
        self.run_cli("view", "create", scene, "--environment", path, "--environment-rotation", "30",
                     "--environment-intensity", "2", "--environment-background",
                     "--environment-samples", "4", "--environment-visibility", "rays")
        (view,) = self.daemon.request("GET", "/v1/views").json()["views"]
        members = self.daemon.request("GET", "/v1/views/" + view["id"]).json()["view"]
        self.assertEqual({"sky": [0, 0, 0], "ground": [0, 0, 0], "image": environment,
                          "rotation_deg": 30, "intensity": 2, "background": True},
                         members["environment"])
        self.assertEqual(4, members["quality"]["environment_samples"])
        self.assertEqual("rays", members["quality"]["environment_visibility"])
        self.run_cli("view", "patch", view["id"], "--environment", "studio")
        members = self.daemon.request("GET", "/v1/views/" + view["id"]).json()["view"]
        self.assertEqual(("studio", 30), (members["environment"]["image"],
                                          members["environment"]["rotation_deg"]))

    def test_what_is_no_map_is_refused_before_anything_is_sent(self):
        scene = self.write("box.glb", support.triangle("unsent"))
        picture = self.write("photo.png", b"\x89PNG\r\n\x1a\n")
        for light, meant in ((picture, "is no environment map: neither Radiance HDR nor OpenEXR"),
                             ("missing.hdr", "cannot read 'missing.hdr'"),
                             (self.folder, "cannot read")):
            _, err = self.run_cli("render", scene, "-o", "out.png", "--environment", light, code=66)
            self.assertIn(meant, err)
        _, err = self.run_cli("render", scene, "-o", "out.png", "--environment", "environment:none",
                              code=66)
        self.assertIn("the server has no environment map that is called 'none'", err)
        self.assertEqual(404, self.daemon.request(
            "HEAD", "/v1/scenes/" + support.sha256(support.triangle("unsent"))).status)
        broken = self.write("cut.hdr", hdr(8, 4)[:-9])
        _, err = self.run_cli("push", broken, code=1)
        self.assertIn("(invalid_environment)", err)
        _, err = self.run_cli("push", self.write("one.hdr", hdr(4, 2)), "--scene", "x", code=2)
        self.assertIn("is an environment map", err)


class Python(support.ServiceTest):
    def test_maps_are_posted_by_bytes_or_path_named_and_forgotten(self):
        content = hdr(12, 6)
        with vitrail.Client(f"http://127.0.0.1:{self.daemon.port}") as client, \
                tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "day.hdr")
            with open(path, "wb") as file:
                file.write(content)
            told = client.post_environment(path)
            self.assertEqual((support.sha256(content), "day.hdr"), (told["id"], told["name"]))
            self.assertEqual(told["id"], client.post_environment(content)["id"])
            self.assertEqual("noon", client.rename_environment(told["id"], "noon")["name"])
            self.assertEqual("noon", client.environment(told["id"])["name"])
            self.assertIn(told["id"], [one["id"] for one in client.environments()])
            scene = client.post_scene(support.triangle())["id"]
            self.assertTrue(client.render(scene, environment={"image": told["id"]}).data)
            client.delete_environment(told["id"])
            with self.assertRaises(vitrail.VitrailError) as refused:
                client.render(scene, environment={"image": told["id"]})
            self.assertEqual(("not_found", "/environment/image"),
                             (refused.exception.code, refused.exception.pointer))


if __name__ == "__main__":
    support.run_tests()
