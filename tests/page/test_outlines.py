# SPDX-License-Identifier: MIT
"""What is drawn beside the scene: the outline of the selection, feature edges, and the ground."""
from page import PageTest, support


class Outlines(PageTest):
    def check(self, label):
        self.browser.run("""
          const found = [...document.querySelectorAll('#panel-render .field-check label')]
            .find((one) => one.textContent === arguments[0]);
          document.getElementById(found.htmlFor).click();""", label)

    def test_the_selected_part_is_outlined_until_it_is_no_more(self):
        first = self.load()
        outlined = self.changed_by(lambda: self.select("Pane"))
        self.assertNotEqual(first, outlined)
        self.assertEqual(["#3"], self.view()["highlight"]["nodes"])
        other = self.changed_by(lambda: self.select("Wall"))
        self.assertNotEqual(outlined, other)
        self.focus_picture()
        self.assertEqual(first, self.changed_by(lambda: self.browser.keys("Escape")))
        self.assertIsNone(self.view()["highlight"])

    def test_the_ground_catches_shadows(self):
        self.load()
        self.assertIsNone(self.view()["ground_plane"])
        self.panel("render")
        shown = self.changed_by(lambda: self.check("Shadows on the ground"))
        self.assertEqual({"height": None}, self.view()["ground_plane"])
        self.changed_by(lambda: self.enter("Height of the ground", -0.5, "#panel-render"))
        self.assertEqual({"height": -0.5}, self.view()["ground_plane"])
        self.assertEqual(shown, self.changed_by(lambda: self.press("Undo")))
        self.changed_by(lambda: self.press("Undo"))
        self.assertIsNone(self.view()["ground_plane"])

    def test_selecting_shades_nothing_again(self):
        self.load()
        quick = self.daemon.stats()["views"]["moving_frames"]
        self.changed_by(lambda: self.select("Pane"))
        report = self.report()
        self.assertIn("picture", report["reused"])
        self.assertEqual(["overlay.highlight"], [line["pass"] for line in report["plan"]])
        counts = report["counts"]
        self.assertEqual((0, 0), (counts["lookups"], counts["gbuffers_drawn"]))
        self.focus_picture()
        rendered = self.daemon.stats()["views"]["rendered"]
        self.changed_by(lambda: self.browser.keys("Escape"))
        self.assertEqual(rendered, self.daemon.stats()["views"]["rendered"])  # it was kept whole
        self.assertEqual(quick, self.daemon.stats()["views"]["moving_frames"])

    def report(self):
        """Of the picture that the page shows."""
        frame = self.browser.run("return document.getElementById('picture').dataset.frame")
        return self.daemon.request("GET", "/v1/frames/" + frame).json()

    def test_the_outline_can_be_left_away(self):
        first = self.load()
        self.changed_by(lambda: self.select("Pane"))
        self.panel("render")
        self.assertEqual(first, self.changed_by(lambda: self.check("Outline what is selected")))

    def test_feature_edges_are_drawn_as_said_and_taken_back(self):
        first = self.load()
        self.panel("render")
        edges = self.changed_by(lambda: self.check("Feature edges"))
        self.assertNotEqual(first, edges)
        wider = self.changed_by(lambda: self.enter("Width", 4, "#panel-render"))
        self.assertNotEqual(edges, wider)
        self.assertEqual(4, self.view()["edges"]["width_px"])
        self.assertEqual(first, self.changed_by(lambda: self.check("Feature edges")))
        self.assertIsNone(self.view()["edges"])


if __name__ == "__main__":
    support.run_tests()
