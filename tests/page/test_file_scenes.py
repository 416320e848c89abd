# SPDX-License-Identifier: MIT
"""A file with several scenes: the one that is shown is chosen among all. A file of another format:
its unit and its axis are."""
import os
import tempfile

from page import PageTest, room, support

UNIT, UP = (f"document.querySelector('#panel-scenes [aria-label=\"{name}\"]')"
            for name in ("Unit of the file", "Axis of the file"))
CHOICE = "document.querySelector('#panel-scenes [aria-label=\"Scene of the file\"]')"


def town(document, binary):
    document["scenes"] = [{"name": "Day", "nodes": [0]}, {"name": "Pane only", "nodes": [3]}]
    document["nodes"][0]["children"] = [1, 2, 4]
    return binary


SOLID = """solid wedge
facet normal 0 0 1
outer loop
vertex 0 0 0
vertex 40 0 0
vertex 0 20 0
endloop
endfacet
facet normal 0 1 0
outer loop
vertex 0 0 0
vertex 40 0 0
vertex 0 0 10
endloop
endfacet
endsolid wedge
"""


class FileScenes(PageTest):
    def opened(self):
        return self.daemon.request("GET", f"/v1/scenes/{self.view()['scene']}").json()

    def test_unit_and_axis_of_another_format_are_chosen(self):
        formats = self.daemon.request("GET", "/v1/capabilities").json()["scene_formats"]
        if not any(form["name"] == "stl" for form in formats):
            self.skipTest("built without assimp")
        self.load()
        self.assertIsNone(self.browser.run(f"return {UNIT}"))
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "wedge.stl")
            with open(path, "w", encoding="ascii") as file:
                file.write(SOLID)
            self.browser.type("#scene-files", path)
            self.browser.wait(f"return {UNIT}?.value === 'm'", "the file is open")
            self.assertEqual("metres, assumed", self.browser.run(
                f"return {UNIT}.selectedOptions[0].textContent"))
            self.settle()
            self.enter("Unit of the file", "mm", "#panel-scenes")
            self.browser.wait(f"return {UNIT}?.value === 'mm'", "it is in millimetres")
            self.settle()
            up = self.opened()["source"]["up"]
            other = "y" if up == "z" else "z"
            self.enter("Axis of the file", other, "#panel-scenes")
            self.browser.wait(f"return {UP}?.value === '{other}'", "the other axis is up")
            self.settle()
        source = self.opened()["source"]
        self.assertEqual(("mm", "request", other, "request"), (
            source["unit"], source["unit_by"], source["up"], source["up_by"]))
        box = self.opened()["bounds"]
        self.assertAlmostEqual(0.04, box["max"][0] - box["min"][0], places=6)

    def test_the_deflection_of_a_cad_file_can_be_chosen(self):
        formats = self.daemon.request("GET", "/v1/capabilities").json()["scene_formats"]
        if not any(form["name"] == "step" for form in formats):
            self.skipTest("built without OpenCASCADE")
        self.load()
        field = "document.querySelector('[aria-label=\"Deflection of the file\"]')"
        folder = os.path.dirname(os.path.abspath(__file__))
        self.browser.type("#scene-files",
                          os.path.realpath(os.path.join(folder, "../data/cad/lamp.step")))
        self.browser.wait(f"return {field}?.value === ''", "the file is open")
        self.settle()
        usual = self.opened()["triangles"]
        self.browser.run(f"{field}.value = '0.01'; {field}.dispatchEvent(new Event('change'))")
        self.browser.wait(f"return {field}?.value === '0.01'", "the file is open with it")
        self.settle()
        self.assertEqual(0.01, self.opened()["source"]["deflection"])
        self.assertGreater(self.opened()["triangles"], usual)

    def test_files_of_cad_programs_are_sent(self):
        self.expects_refusal = True
        self.load()
        with tempfile.TemporaryDirectory() as folder:
            for name in ("part.stp", "part.igs"):
                path = os.path.join(folder, name)
                with open(path, "w", encoding="ascii") as file:
                    file.write("neither of them\n")
                self.browser.type("#scene-files", path)
                self.browser.wait("return document.body.innerText.includes("
                                  f"'{name} could not be opened')", "the server has refused it")

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
