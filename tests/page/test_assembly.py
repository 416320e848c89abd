# SPDX-License-Identifier: MIT
"""An assembly of ten thousand parts in the viewer: found, walked, selected, hidden and moved."""
from page import PageTest, support

PARTS = 10000
ROWS = "return document.querySelectorAll('[role=treeitem]').length"
FOCUS = "return document.activeElement.ariaLabel"


def assembly():
    """Ten groups of a thousand triangles each, side by side."""
    document = support.triangle_document("Part")
    nodes = [{"name": "Assembly", "children": list(range(1, 11))}]
    nodes += [{"name": f"Group {g}", "translation": [0, 2 * g, 0],
               "children": [11 + 1000 * g + i for i in range(1000)]} for g in range(10)]
    nodes += [{"name": f"Part {i}", "mesh": 0, "translation": [2 * (i % 1000 % 40), 0,
                                                              -2 * (i % 1000 // 40)]}
              for i in range(PARTS)]
    document["nodes"] = nodes
    return support.glb(document, support.TRIANGLE)


class Assembly(PageTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        files = support.multipart({"assembly.glb": assembly()})
        cls.scene = cls.daemon.post_scene(*files).json()["id"]

    def setUp(self):
        super().setUp()
        self.load()
        self.panel("tree")

    def row(self, name, what="return found && found.getBoundingClientRect().height > 0"):
        return self.browser.run(f"""const found = document.querySelector(
          `[role=treeitem][aria-label="${{arguments[0]}}"]`); {what};""", name)

    def test_only_rows_in_sight_are_in_the_page_and_all_can_be_reached(self):
        self.browser.run("document.querySelector('[role=treeitem][tabindex=\"0\"]').focus()")
        self.browser.keys("Down", "Right")
        self.assertEqual("Group 0", self.browser.run(FOCUS))
        self.assertLess(self.browser.run(ROWS), 80)
        self.browser.keys("Right", "End")
        self.assertEqual("Group 9", self.browser.run(FOCUS))
        self.browser.keys("Up", "Right", "Right")
        self.assertEqual("Part 8000", self.browser.run(FOCUS))
        self.assertEqual(["1", "1000", "3"], self.row("Part 8000", """return ['posinset', 'setsize',
          'level'].map((name) => found.getAttribute(`aria-${name}`))"""))
        self.browser.keys("Left", "Up")
        self.assertEqual("Group 7", self.browser.run(FOCUS))
        self.assertLess(self.browser.run(ROWS), 80)
        height = self.browser.run("return document.querySelector('[role=tree]').offsetHeight")
        self.assertEqual((11 + 2000) * 25, height)

    def test_a_part_is_found_by_its_name_and_its_way_is_opened(self):
        self.enter("Find a part", "part 98")
        found = 1 + 10 + 100  # 98, 980 to 989, 9800 to 9899
        self.assertEqual(f"{found} found", self.browser.run(
            "return document.querySelector('.tree-head p').textContent"))
        self.browser.run("document.querySelector('[type=search]').focus()")
        self.browser.keys("Down", "End")
        self.assertEqual("Part 9899", self.browser.run(FOCUS))
        self.browser.keys("Enter")
        self.enter("Find a part", "")
        self.browser.run("""document.querySelector('#panel-tree').scrollTop = 0;""")
        self.enter("Find a part", "zzz")
        self.assertEqual("Nothing found", self.browser.run(
            "return document.querySelector('.tree-head p').textContent"))
        text = self.browser.run("return document.getElementById('panel-properties').innerText")
        self.assertIn("Assembly › Group 9", text)

    def test_a_picked_part_is_scrolled_to_hidden_and_moved(self):
        first = self.settle()
        x, y = self.center()
        part = None
        for down in range(-60, 80, 10):  # there are gaps between the triangles
            self.browser.drag((x, y + down), (x, y + down))
            part = self.browser.run("""return new Promise((done) => setTimeout(() => done(document
              .querySelector('[aria-selected=true][role=treeitem]')?.ariaLabel), 250));""")
            if part:
                break
        self.assertRegex(part or "", r"Part \d+")
        self.assertTrue(self.row(part))
        hidden = self.changed_by(lambda: self.press(f"Hide {part}"))
        self.assertNotEqual(first, hidden)
        self.changed_by(lambda: self.press(f"Show {part}"))
        self.changed_by(lambda: self.enter("Position Y", 3, "#panel-properties"))
        index = self.row(part, "return found.dataset.index")
        self.assertEqual(3, self.view()["overrides"]["nodes"][f"#{index}"]["matrix"][13])

    def test_searching_and_scrolling_change_only_the_rows_in_sight(self):
        changed = self.browser.run("""const search = document.querySelector('[type=search]');
          const panel = document.getElementById('panel-tree');
          const watch = new MutationObserver(() => {});
          watch.observe(panel, { attributes: true, childList: true, subtree: true });
          return ['p', 'pa', 'part 1', 'part 12', 'part 123', 'p', ''].map((text) => {
            search.value = text;
            search.dispatchEvent(new Event('input'));
            panel.scrollTop = 5000;
            panel.dispatchEvent(new Event('scroll'));
            panel.offsetHeight;
            return watch.takeRecords().reduce((sum, record) => sum + 1
              + record.addedNodes.length + record.removedNodes.length, 0);
          });""")
        self.assertGreater(max(changed), 0)
        self.assertLess(max(changed), 400, changed)  # of ten thousand parts


if __name__ == "__main__":
    support.run_tests()
