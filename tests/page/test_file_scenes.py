# SPDX-License-Identifier: MIT
"""A file with several scenes: the one that is shown is chosen among all."""
import os
import tempfile

from page import PageTest, room, support

CHOICE = "document.querySelector('#panel-scenes [aria-label=\"Scene of the file\"]')"


def town(document, binary):
    document["scenes"] = [{"name": "Day", "nodes": [0]}, {"name": "Pane only", "nodes": [3]}]
    document["nodes"][0]["children"] = [1, 2, 4]
    return binary


class FileScenes(PageTest):
    def test_another_scene_of_the_file_is_opened(self):
        self.load()
        self.assertIsNone(self.browser.run(f"return {CHOICE}"))
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "town.glb")
            with open(path, "wb") as file:
                file.write(room(town))
            self.browser.type("#scene-files", path)
            self.browser.wait(f"return {CHOICE}?.value === '0'", "the first scene is open")
            self.assertEqual(["Day", "Pane only"], self.browser.run(
                f"return [...{CHOICE}.options].map((option) => option.textContent)"))
            self.settle()
            self.enter("Scene of the file", "1", "#panel-scenes")
            self.browser.wait(f"return {CHOICE}?.value === '1'", "the second scene is open")
            self.settle()
        scene = self.daemon.request("GET", f"/v1/scenes/{self.view()['scene']}").json()
        self.assertEqual(1, scene["file_scene"])
        self.panel("tree")
        shown = self.browser.run("return document.querySelector('[role=tree]').innerText")
        self.assertIn("Pane", shown)
        self.assertNotIn("Wall", shown)

    def test_a_scene_whose_file_is_not_at_hand_says_what_to_do(self):
        content = room(town)
        scene = self.daemon.post_scene(*support.multipart({"town.glb": content})).json()["id"]
        self.load(scene=scene)
        self.browser.wait(f"return {CHOICE}?.disabled", "the choice shows and is disabled")
        self.assertIn("Bring the file again", self.browser.run(f"return {CHOICE}.title"))


if __name__ == "__main__":
    support.run_tests()
