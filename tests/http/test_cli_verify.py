# SPDX-License-Identifier: MIT
"""`vitrail render --note`, `vitrail verify`: an image is made again, what differs is said."""
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
        request["width"] = 40
        self.note(request=json.dumps(request), device="another card", version="0.0.9")
        self.run_cli("verify", self.image, "-o", self.path("new.png"), code=3)
        said = self.stdout
        self.assertIn("other pixels", said)
        self.assertIn('device: "another card" then', said)
        self.assertIn('version: "0.0.9" then', said)
        self.assertTrue(os.path.exists(self.path("new.png")))

    def test_a_damaged_image_a_missing_note_and_a_missing_scene(self):
        with open(self.image, "ab") as file:
            file.write(b"more")
        self.run_cli("verify", self.image, code=3)
        self.assertIn("was changed after it was rendered", self.stderr)
        self.run_cli("verify", self.scene, code=66)
        self.assertIn("--note", self.stderr)
        self.run_cli("render", self.scene, "-o", self.image, "--size", "32x16", "--note")
        self.daemon.request("DELETE", f"/v1/scenes/{self.note()['scene']}")
        self.run_cli("verify", self.image, code=1)
        self.assertIn("there is no scene", self.stderr)
        self.run_cli("render", self.scene, "-o", "-", "--format", "png", "--note", code=2)


if __name__ == "__main__":
    support.run_tests()
