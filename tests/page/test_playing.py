# SPDX-License-Identifier: MIT
"""Animations in the viewer: played, paused, scrubbed, looped, and kept in links."""
import struct

from page import PageTest, room, support

TIME = "return document.querySelector('#timeline input').valueAsNumber"
PLAYS = "return document.querySelector('#timeline button').ariaLabel === 'Pause'"


def animate(document, binary):
    """The pane goes 2 m to the right in 1.5 s; the wall, by its own animation, 3 m up in 3 s."""
    document["animations"] = []
    for name, node, way, duration in (("Pane goes", 3, (2, 0, 0), 1.5),
                                      ("Wall goes", 2, (0, 3, 0), 3)):
        first = len(document["accessors"])
        for values, kind, size in ((struct.pack("<2f", 0, duration), "SCALAR", 1),
                                   (struct.pack("<6f", 0, 0, 0, *way), "VEC3", 3)):
            document["bufferViews"].append({"buffer": 0, "byteOffset": len(binary),
                                            "byteLength": len(values)})
            flat = struct.unpack(f"<{2 * size}f", values)
            document["accessors"].append({
                "bufferView": len(document["bufferViews"]) - 1, "componentType": 5126, "count": 2,
                "type": kind, "min": [min(flat[i::size]) for i in range(size)],
                "max": [max(flat[i::size]) for i in range(size)]})
            binary += values
        document["animations"].append({
            "name": name, "samplers": [{"input": first, "output": first + 1}],
            "channels": [{"sampler": 0, "target": {"node": node, "path": "translation"}}]})
    return binary


class Playing(PageTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.still = cls.scene
        files = support.multipart({"moving.glb": room(animate)})
        cls.scene = cls.daemon.post_scene(*files).json()["id"]

    def scrub(self, time):
        return self.changed_by(lambda: self.browser.run("""
          const slider = document.querySelector('#timeline input');
          slider.value = arguments[0];
          slider.dispatchEvent(new Event('input'));""", time))

    def test_a_scene_without_animations_has_no_bar(self):
        self.load(scene=self.still)
        self.assertTrue(self.browser.run("return document.getElementById('timeline').hidden"))
        self.focus_picture()
        self.browser.keys("Space", ".")
        self.assertIsNone(self.view().get("animation"))

    def test_the_slider_shows_a_time_and_stop_the_scene_at_rest(self):
        first = self.load()
        halfway = self.scrub(0.75)
        self.assertNotEqual(first, halfway)
        self.assertEqual(0.75, self.view()["animation"]["time_s"])
        self.assertEqual("0.75 / 3.00 s", self.browser.run(
            "return document.querySelector('.time-said').textContent"))
        self.assertEqual(first, self.changed_by(
            lambda: self.press("Stop: as the file has it at rest")))

    def test_one_of_several_animations_is_chosen(self):
        self.load()
        both = self.scrub(0.75)
        pane = self.changed_by(lambda: self.enter("Animation", "#0", "#timeline"))
        self.assertNotEqual(both, pane)
        self.assertEqual("#0", self.view()["animation"]["name"])
        self.assertEqual("1.5", self.browser.run(
            "return document.querySelector('#timeline input').max"))
        self.assertEqual(both, self.changed_by(lambda: self.enter("Animation", "", "#timeline")))

    def test_the_blank_plays_and_pauses_and_the_exact_picture_follows(self):
        self.load()
        self.focus_picture()
        self.browser.keys("Space")
        self.browser.wait(f"{PLAYS} && document.querySelector('#timeline input').value > 0.2",
                          "it plays")
        self.browser.keys("Space")
        self.settle()
        time = self.browser.run(TIME)
        self.assertGreater(time, 0.2)
        self.assertAlmostEqual(time, self.view()["animation"]["time_s"], places=9)
        self.changed_by(lambda: self.browser.keys("."))
        self.assertAlmostEqual(time + 1 / 30, self.browser.run(TIME), delta=1e-3)

    def test_it_goes_round_or_stops_at_the_end(self):
        self.load()
        self.enter("Speed", "4", "#timeline")
        self.scrub(2.9)
        self.press("Play")
        self.browser.wait(f"{PLAYS} && {TIME.removeprefix('return ')} < 2", "it goes round")
        self.press("Pause")
        self.press("Loop")
        self.scrub(2.9)
        self.press("Play")
        self.browser.wait("return document.querySelector('#timeline [aria-label=Play]')",
                          "it stops by itself")
        self.assertEqual(3, self.browser.run(TIME))

    def test_the_time_is_part_of_the_link_and_undo_leaves_it_alone(self):
        self.load()
        picture = self.scrub(1)
        self.assertEqual(picture, self.reload_link())
        self.panel("tree")
        self.changed_by(lambda: self.press("Hide Pane"))
        self.scrub(1.25)
        self.changed_by(lambda: self.press("Undo"))
        self.assertEqual(1.25, self.browser.run(TIME))
        self.assertEqual(1.25, self.view()["animation"]["time_s"])


if __name__ == "__main__":
    support.run_tests()
