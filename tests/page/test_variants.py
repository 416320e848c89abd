# SPDX-License-Identifier: MIT
"""Variants of materials in the viewer: chosen, taken back, kept in links."""
from page import PageTest, room, support

EXTENSION = "KHR_materials_variants"


def paint(document, binary):
    """Another material for everything that is the wall's by night."""
    document["materials"].append({"name": "Ink", "pbrMetallicRoughness": {
        "baseColorFactor": [0.02, 0.02, 0.3, 1]}})
    ink = len(document["materials"]) - 1
    document["extensionsUsed"] = [*document.get("extensionsUsed", []), EXTENSION]
    document.setdefault("extensions", {})[EXTENSION] = {
        "variants": [{"name": "Day"}, {"name": "Night"}]}
    wall = next(node for node in document["nodes"] if node.get("name") == "Wall")
    [primitive] = document["meshes"][wall["mesh"]]["primitives"]
    primitive["extensions"] = {EXTENSION: {"mappings": [{"material": ink, "variants": [1]}]}}
    return binary


class Variants(PageTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.plain = cls.scene
        files = support.multipart({"painted.glb": room(paint)})
        cls.scene = cls.daemon.post_scene(*files).json()["id"]

    def choices(self):
        return self.browser.run("""return [...document.querySelectorAll(
          '#panel-tree select option')].map((one) => one.textContent);""")

    def test_a_scene_without_variants_has_no_chooser(self):
        self.load(scene=self.plain)
        self.panel("tree")
        self.assertEqual([], self.choices())

    def test_a_variant_is_chosen_taken_back_and_part_of_the_link(self):
        first = self.load()
        self.panel("tree")
        self.assertEqual(["As in the file", "Day", "Night"], self.choices())
        night = self.changed_by(lambda: self.enter("Materials", "Night", "#panel-tree"))
        self.assertNotEqual(first, night)
        self.assertEqual("Night", self.view()["variant"])
        self.assertEqual(night, self.reload_link())
        self.panel("tree")
        self.assertEqual(first, self.changed_by(lambda: self.enter("Materials", "",
                                                                   "#panel-tree")))
        self.assertIsNone(self.view().get("variant"))


if __name__ == "__main__":
    support.run_tests()
