# SPDX-License-Identifier: MIT
"""Maps over the picture with their numbers, and what is said of the point under the pointer."""
import re

from page import PageTest, support

MAPPED = "return document.getElementById('picture-heat').dataset.exact === 'true'"
SAID = "return document.querySelector('.legend-said')?.textContent"
PLACE = "return document.getElementById('status-place').textContent"
COLOR = """const canvas = document.getElementById('picture-heat');
  return [...canvas.getContext('2d').getImageData(Math.floor(arguments[0] * canvas.width),
    Math.floor(arguments[1] * canvas.height), 1, 1).data];"""


class Maps(PageTest):
    def show(self, text):
        """Chooses what the picture shows, and waits for the exact map."""
        self.browser.run("document.getElementById('picture-heat').dataset.exact = 'false';")
        self.enter("What the picture shows", text)
        self.browser.wait(MAPPED, "the map is there")

    def point(self, x, y):
        self.browser.actions([{"type": "pointer", "id": "mouse", "parameters": {
            "pointerType": "mouse"}, "actions": [{"type": "pointerMove", "duration": 20,
                                                  "x": round(x), "y": round(y)}]}])

    def test_layers_are_counted_where_the_glass_is_and_nowhere_else(self):
        self.load()
        self.show("layers")
        self.assertRegex(self.browser.run(SAID), r"^Most 1, mean 1\.0 where there are any: \d")
        x, y = self.center()
        self.point(x, y)
        self.browser.wait(f"{PLACE}.endsWith('1 layer')", "one layer in the middle")
        self.point(x - 48, y + 70)
        self.browser.wait(f"{PLACE}.endsWith('Floor material · 0 layers')", "none on the floor")
        self.assertEqual(255, self.browser.run(COLOR, 0.5, 0.5)[3])
        self.assertEqual(0, self.browser.run(COLOR, 0.355, 0.62)[3])  # the picture shows through

    def test_the_scale_is_that_of_the_picture_or_one_for_all(self):
        self.load()
        self.show("layers")
        ticks = "return document.querySelector('.legend-ticks').innerText.split(/\\s+/)"
        self.assertEqual(["1", "2"], self.browser.run(ticks))
        self.browser.click("#legend input[type=checkbox]")
        self.assertEqual(["1", "4", "16", "64", "256", "1024+"], self.browser.run(ticks))
        self.assertEqual([28, 40, 150, 255], self.browser.run(COLOR, 0.5, 0.5))  # as the API has 1

    def test_lights_are_counted_anew_when_some_are_added(self):
        self.load()
        self.show("lights")
        self.assertIn("Most 1,", self.browser.run(SAID))
        self.panel("lights")
        for _ in range(2):
            self.press("Add a point light")
        self.browser.wait(f"{SAID}.includes('Most 3,')", "three lights are counted")

    def test_a_map_is_part_of_the_link_and_goes_with_its_key(self):
        self.load()
        self.show("normal")
        self.reload_link(lambda: self.browser.wait(MAPPED, "the map is there again"))
        self.assertEqual("Normals", self.browser.run(
            "return document.querySelector('#legend h3').textContent"))
        self.focus_picture()
        self.browser.keys("m")  # from a map that counts nothing: none
        self.assertTrue(self.browser.run("return document.getElementById('legend').hidden"))
        self.browser.keys("m")
        self.browser.wait(f"{MAPPED} && !document.getElementById('legend').hidden", "layers")

    def test_the_point_under_the_pointer_is_the_one_that_the_server_picks(self):
        self.load()
        x, y = self.center()
        self.point(x + 30, y - 20)
        text = self.browser.wait(PLACE, "the place is said")
        self.assertTrue(text.endswith("Pane · Pane material"), text)
        view = self.only_view()
        path = f"/v1/views/{view['id']}/pick?x={view['width'] / 2 + 30}&y={view['height'] / 2 - 20}"
        hit = self.daemon.request("GET", path).json()["hit"]
        said = [float(value) for value in re.match(r"(\S+)  (\S+)  (\S+) m", text).groups()]
        for got, expected in zip(said, hit["position"]):
            self.assertAlmostEqual(expected, got, delta=0.01)  # the pointer has whole pixels
        self.point(2, 2)
        self.browser.wait(f"return !({PLACE.removeprefix('return ')})", "left, it says nothing")

    def test_things_are_picked_where_pictures_come_as_stills(self):
        self.load("?line=stills")
        x, y = self.center()
        self.browser.drag((x, y), (x, y))
        self.browser.wait("""return document.getElementById('panel-properties').innerText
          .includes('Pane material')""", "the pane is picked")
        support.wait_until(lambda: not self.daemon.request("GET", "/v1/views").json()["views"],
                           "no view is left behind")


if __name__ == "__main__":
    support.run_tests()
