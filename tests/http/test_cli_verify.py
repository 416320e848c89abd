# SPDX-License-Identifier: MIT
"""Provenance in images, `vitrail render --note` and `vitrail verify`: an image is made again, what
differs is said."""
import json
import os

import support
from cli_service import CliServiceTest


class CliVerify(CliServiceTest):
    def setUp(self):
        super().setUp()
        self.image = self.path("a.png")
        self.run_cli("render", self.scene, "-o", self.image, "--size", "32x16", "--shadows", "map",
                     "--note")

    def note(self, **changes):
        with open(self.image + ".json", encoding="utf-8") as file:
            note = json.load(file)
        note.update(changes)
        with open(self.image + ".json", "w", encoding="utf-8") as file:
            json.dump(note, file)
        return note

    def test_an_image_is_made_again_to_the_bit(self):
        note = self.note()
        with open(self.image, "rb") as file:
            self.assertEqual(support.sha256(file.read()), note["sha256"])
        self.assertEqual({"sha256", "request", "scene", "version", "device", "techniques",
                          "error", "frame"}, set(note) - {"chosen"})
        self.assertIn("the same to the bit", self.run_cli("verify", self.image))
        self.assertEqual(["a.png", "a.png.json", "scene.glb"], sorted(os.listdir(self.folder)))
        found = json.loads(self.run_cli("verify", self.image, "--json"))
        self.assertEqual([True, {}], [found["same"], found["differences"]])

    def test_what_is_different_is_said(self):
        request = json.loads(self.note()["request"])
        request["background"] = [1, 0, 0, 1]
        self.note(request=json.dumps(request), device="another card", version="0.0.9")
        self.run_cli("verify", self.image, "-o", self.path("new.png"), code=3)
        said = self.stdout
        self.assertRegex(said, r"other pixels: \S+ % of the values, RMSE \S+, at most \S+")
        self.assertIn('device: "another card" then', said)
        self.assertIn('version: "0.0.9" then', said)
        self.assertTrue(os.path.exists(self.path("new.png")))
        request["width"] = 40
        self.note(request=json.dumps(request))
        self.run_cli("verify", self.image, code=3)
        self.assertIn("cannot be compared", self.stderr)  # of another size

    # ---- what images hold ----

    def make(self, name, *options):
        path = self.path(name)
        self.run_cli("render", self.scene, "-o", path, "--size", "32x16", *options)
        return path

    def test_images_of_each_format_are_made_again_without_a_note(self):
        for name in ("b.png", "b.jpg", "b.webp", "b.exr"):
            with self.subTest(name):
                path = self.make(name, "--shadows", "map")
                self.assertIn("the same to the bit", self.run_cli("verify", path))
                with open(path, "rb") as file:
                    found = support.provenance(file.read())
                self.assertEqual(found["request"], self.shown(path)["request"])
                self.assertEqual("map", found["request"]["quality"]["shadows"])
                self.assertEqual([32, 16], [found["request"][key] for key in ("width", "height")])
                self.assertEqual(found["scene"], found["request"]["scene"])
                self.assertTrue(found["software"].startswith("Vitrail "))
                self.assertTrue(found["device"])

    def shown(self, path):
        return json.loads(self.run_cli("verify", path, "--show", "--json"))

    def edit(self, path, before, after):
        """Other bytes of the same length, so that the containers stay whole."""
        with open(path, "rb") as file:
            data = file.read()
        self.assertEqual(1, data.count(before))
        self.assertEqual(len(before), len(after))
        with open(path, "wb") as file:
            file.write(data.replace(before, after))

    def test_what_an_image_says_is_compared_with_what_is_made_now(self):
        path = self.make("b.exr")
        device = json.dumps(self.shown(path)["device"]).encode()
        self.edit(path, b'"device":' + device, b'"device":"' + b"x" * (len(device) - 2) + b'"')
        self.run_cli("verify", path)
        self.assertIn("the same pixels, in another file", self.stdout)
        self.assertIn('device: "xxx', self.stdout)
        path = self.make("b.jpg")
        self.edit(path, b'"background":[0.0,0.0,0.0,0.0]',
                  b'"background":[1.0,0.0,0.0,1.0]')
        self.run_cli("verify", path, "--json", code=3)
        found = json.loads(self.stdout)
        self.assertEqual([False, False], [found["same"], found["same_file"]])
        self.assertGreater(found["pixels"]["differing_share"], 0)
        self.assertEqual({}, found["differences"])

    def test_several_outputs_are_compared_each(self):
        path = self.make("b.exr", "--output", "color", "--output", "depth")
        self.assertIn("the same to the bit", self.run_cli("verify", path))
        self.edit(path, b'"Vitrail 0', b'"Vitrail 9')
        self.run_cli("verify", path)
        self.assertIn('version: "9', self.stdout)
        self.assertIn("the same pixels", self.stdout)

    def test_it_can_be_left_out_and_views_have_none(self):
        path = self.make("b.png", "--set", "/provenance=false")
        self.run_cli("verify", path, code=66)
        self.assertIn("holds no provenance", self.stderr)
        view = self.daemon.request("POST", "/v1/views", {"scene": self.note()["scene"]}).json()
        image = self.daemon.request("GET", f"/v1/views/{view['id']}/image")
        self.assertEqual(200, image.status)
        self.assertIsNone(support.provenance(image.body))
        reply = self.daemon.request("PATCH", f"/v1/views/{view['id']}", {"provenance": True})
        self.assertEqual([400, "/provenance"], [reply.status, reply.json()["pointer"]])

    def test_files_of_jobs_have_the_bytes_of_renders(self):
        scene = self.note()["scene"]
        job = self.daemon.request("POST", "/v1/jobs", {
            "scene": scene, "view": {"width": 32, "height": 16}, "frames": "1",
            "animate": False}).json()
        self.daemon.request("GET", f"/v1/jobs/{job['id']}", headers={"Prefer": "wait=60"})
        file = self.daemon.request("GET", f"/v1/jobs/{job['id']}/frames/1/color").body
        one = self.daemon.request("POST", "/v1/renders", {"scene": scene, "width": 32,
                                                          "height": 16, "format": "png"}).body
        self.assertEqual(support.provenance(one), support.provenance(file))
        self.assertEqual(one, file)
        plain = self.daemon.request("POST", "/v1/jobs", {
            "scene": scene, "view": {"width": 32, "height": 16}, "provenance": False}).json()
        self.daemon.request("GET", f"/v1/jobs/{plain['id']}", headers={"Prefer": "wait=60"})
        file = self.daemon.request("GET", f"/v1/jobs/{plain['id']}/frames/1/color").body
        self.assertIsNone(support.provenance(file))

    def test_a_picture_of_tiles_that_no_single_render_makes(self):
        job = self.run_cli("job", "submit", self.scene, "--size", "20000x12", "--tiles", "4999",
                           "--file", "big.%d.jpg", "--exposure", "0", "-q").strip()
        self.run_cli("job", "watch", job, "-q")
        self.run_cli("job", "fetch", job, "-o", self.folder, "-q")
        path = self.path("big.1.jpg")
        with open(path, "rb") as file:
            self.assertEqual({"width": 2501, "height": 256},  # cuts it into eight again
                             support.provenance(file.read())["tiles"])
        self.assertIn("the same to the bit", self.run_cli("verify", path))
        self.edit(path, b'"background":[0.0,0.0,0.0,0.0]', b'"background":[1.0,0.0,0.0,1.0]')
        self.run_cli("verify", path, code=3)
        self.assertRegex(self.stdout, r"other pixels: \S+ % of the values")
        jobs = self.daemon.request("GET", "/v1/jobs").json()["jobs"]
        self.assertEqual([job], [one["id"] for one in jobs if one["tiles"]], "others are forgotten")

    def test_a_request_that_is_too_long_for_the_file_says_so(self):
        names = {f"node {index} " + "x" * 60: {"visible": False} for index in range(1000)}
        with open(self.path("request.json"), "w", encoding="utf-8") as file:
            json.dump({"overrides": {"nodes": names}}, file)
        path = self.make("b.jpg", "--request", self.path("request.json"))
        with open(path, "rb") as file:
            found = support.provenance(file.read())
        self.assertIsNone(found["request"])
        self.assertGreater(found["request_bytes"], 60000)
        self.run_cli("verify", path, code=66)
        self.assertIn("--note", self.stderr)

    def test_a_damaged_image_a_missing_note_and_a_missing_scene(self):
        with open(self.image, "ab") as file:
            file.write(b"more")
        self.run_cli("verify", self.image, code=3)
        self.assertIn("was changed after it was rendered", self.stderr)
        self.run_cli("verify", self.scene, code=66)
        self.assertIn("holds no provenance", self.stderr)
        self.run_cli("render", self.scene, "-o", self.image, "--size", "32x16", "--note")
        self.daemon.request("DELETE", f"/v1/scenes/{self.note()['scene']}")
        self.run_cli("verify", self.image, code=1)
        self.assertIn("there is no scene", self.stderr)
        self.run_cli("render", self.scene, "-o", "-", "--format", "png", "--note", code=2)


if __name__ == "__main__":
    support.run_tests()
