# SPDX-License-Identifier: MIT
"""Other scenes as parts of the one that shows: added, moved, picked, edited and taken out."""
from page import PageTest, support


MESSAGE = "return document.querySelector('.message')?.innerText"


def tool(root="Tool"):
    """A blade below a node of that name."""
    document = support.triangle_document("Blade")
    document["nodes"] = [{"name": root, "children": [1], "translation": [0, 1, 1]},
                         {"name": "Blade", "mesh": 0}]
    document["materials"] = [{"name": "Steel", "doubleSided": True, "pbrMetallicRoughness": {
        "baseColorFactor": [0.2, 0.4, 0.9, 1]}}]
    document["meshes"][0]["primitives"][0]["material"] = 0
    return support.multipart({"tool.glb": support.glb(document, support.TRIANGLE)})


class WithTool(PageTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.tool = cls.daemon.post_scene(*tool()).json()["id"]

    def add(self, below=None):
        self.panel("tree")
        if below:
            self.select(below)
        self.press("Add a part from another scene")
        self.enter("Scene", self.tool, "#help")
        if below:
            self.browser.click("#help input[type=checkbox]")
        self.press("Add", "#help")

    def rows(self):
        return self.browser.run("""return [...document.querySelectorAll('[role=treeitem]')]
          .map((row) => row.ariaLabel);""")

    def text(self):
        return self.browser.run("return document.getElementById('panel-properties').innerText")


class Parts(WithTool):
    def test_a_part_is_added_moved_edited_and_taken_out(self):
        first = self.load()
        added = self.changed_by(self.add)
        self.assertNotEqual(first, added)
        self.assertEqual(["Room", "Floor", "Wall", "Pane", "Lamp", "tool"], self.rows()[:6])
        self.assertEqual(self.tool, self.view()["parts"]["tool"]["scene"])
        self.assertIsNone(self.view()["parts"]["tool"]["parent"])
        moved = self.changed_by(lambda: self.enter("Position X", 0.5, "#panel-properties"))
        self.assertNotEqual(added, moved)
        self.assertEqual([0.5, 0, 0, 1], self.view()["parts"]["tool"]["matrix"][12:])
        self.changed_by(lambda: self.press("Hide tool"))
        self.assertFalse(self.view()["parts"]["tool"]["visible"])
        self.changed_by(lambda: self.press("Show tool"))
        back = self.changed_by(lambda: self.press("Remove", "#panel-properties"))
        self.assertEqual({}, self.view()["parts"])
        self.assertEqual(first, back)
        self.changed_by(lambda: self.press("Undo"))
        self.assertEqual(moved, self.changed_by(lambda: self.select("tool")))

    def test_what_is_in_a_part_is_picked_and_its_material_edited(self):
        self.load()
        self.changed_by(self.add)
        self.changed_by(lambda: self.press("Fit", "#panel-properties"))
        self.changed_by(lambda: self.enter("Standard views", "front"))
        self.changed_by(lambda: self.press("Fit", "#panel-properties"))
        x, y = self.center()
        self.browser.drag((x - 30, y + 30), (x - 30, y + 30))
        self.browser.wait("""return document.getElementById('panel-properties').innerText
          .includes('Clicked point')""", "something is hit")
        self.assertIn("tool › Tool", self.text())
        self.assertIn("tool: Steel", self.text())
        self.changed_by(lambda: self.browser.run("""
          const input = document.querySelector('#panel-properties input[type=color]');
          input.value = '#ff2040'; input.dispatchEvent(new Event('input'));"""))
        self.assertEqual(["tool/#0"], list(self.view()["overrides"]["materials"]))
        self.changed_by(lambda: self.enter("Position Z", 0.25, "#panel-properties"))
        [(key, override)] = self.view()["overrides"]["nodes"].items()
        self.assertEqual(("tool/#1", 0.25), (key, override["matrix"][14]))
        self.panel("tree")
        self.select("tool")
        self.changed_by(lambda: self.press("Remove", "#panel-properties"))
        overrides = self.view()["overrides"]
        self.assertEqual(({}, {}), (overrides["nodes"], overrides["materials"]))

    def test_a_part_hangs_on_a_node_moves_with_it_and_is_part_of_the_link(self):
        self.load()
        self.changed_by(lambda: self.add(below="Pane"))
        self.assertEqual("#3", self.view()["parts"]["tool"]["parent"])
        before = self.handle("center")
        self.select("Pane")
        self.changed_by(lambda: self.enter("Position Y", 0.5, "#panel-properties"))
        self.changed_by(lambda: self.select("tool"))
        self.assertIn("in Pane", self.text())
        self.assertLess(self.handle("center")[1], before[1] - 10)  # it moved up, too
        self.select("Wall")  # so that nothing of the part is selected in either picture
        self.focus_picture()
        self.browser.keys("Escape")
        picture = self.settle()
        self.assertEqual(picture, self.reload_link())
        self.assertIn("tool", self.rows())

    def test_two_of_a_kind_have_names_of_their_own(self):
        self.load()
        self.changed_by(self.add)
        self.changed_by(self.add)
        self.assertEqual(["tool", "tool 2"], sorted(self.view()["parts"]))


class GoneParts(WithTool):
    expects_refusal = True

    def setUp(self):
        super().setUp()
        self.tool = self.daemon.post_scene(*tool("Lost")).json()["id"]

    def forget(self):
        self.assertEqual(204, self.daemon.request("DELETE", f"/v1/scenes/{self.tool}").status)

    def key(self, key):
        self.browser.run("document.getElementById('surface').dispatchEvent("
                         "new KeyboardEvent('keydown', { key: arguments[0], bubbles: true }));",
                         key)

    def test_a_part_whose_scene_goes_is_taken_out_and_an_undo_brings_it_back_with_it(self):
        self.load()
        self.changed_by(self.add)
        self.changed_by(lambda: self.enter("Position X", 0.5, "#panel-properties"))
        self.key("Escape")
        self.changed_by(lambda: self.key("2"))
        with_part = self.settle()
        self.changed_by(lambda: self.key("1"))
        self.forget()
        without = self.changed_by(lambda: self.key("2"))
        self.assertNotEqual(with_part, without)
        self.assertIn("Without tool", self.browser.wait(MESSAGE, "a message"))
        self.assertEqual({}, self.view()["parts"])
        self.assertNotIn("tool", self.rows())
        self.daemon.post_scene(*tool("Lost"))
        self.changed_by(lambda: self.press("Undo"))
        self.assertEqual(with_part, self.settle())
        self.assertEqual(0.5, self.view()["parts"]["tool"]["matrix"][12])

    def test_a_link_with_a_part_that_is_gone_shows_the_rest(self):
        first = self.load()
        self.changed_by(self.add)
        self.key("Escape")
        self.settle()
        self.browser.run("return new Promise((done) => setTimeout(done, 600))")  # written late
        self.forget()
        self.assertEqual(first, self.reload_link())
        self.assertIn("Without tool", self.browser.wait(MESSAGE, "a message"))
        self.assertEqual({}, self.view()["parts"])
        self.daemon.post_scene(*tool("Lost"))
        self.changed_by(lambda: self.press("Undo"))
        self.assertIn("tool", self.rows())


if __name__ == "__main__":
    support.run_tests()
