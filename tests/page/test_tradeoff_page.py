# SPDX-License-Identifier: MIT
"""The page of a trade-off in a real browser: pictures, plot and table of a view in haze, with a
renderer whose errors and times are known."""
from page import PageTest, support

SMALL = {"width": 64, "height": 48, "atmosphere": {"density": 0.1}}
# The marks, by their labels, at the ends of the threads between samples of media.
THREADS = """return [...document.querySelectorAll('svg .media')].slice(0, -1).map((thread) => {
    const ends = thread.getAttribute('d').slice(1).split('L');
    return ends.map((end) => end.split(' ').map(Number))
      .map(([x, y]) => [...document.querySelectorAll('svg .point[id]')].filter((mark) => {
      const box = mark.getBBox();
      return Math.hypot(box.x + box.width / 2 - x, box.y + box.height / 2 - y) < 1.5;
    }).map((mark) => mark.querySelector('title').textContent.split(': ')[0]));
  });"""
SHOWN = """return [...document.querySelectorAll('.pick > figure')].filter((figure) =>
    getComputedStyle(figure).visibility === 'visible').map((figure) =>
    [figure.querySelector('figcaption').textContent, figure.querySelector('img').naturalWidth])"""


def scene():
    document = support.triangle_document("fake:tradeoff")
    return support.glb(document, support.TRIANGLE)


class TradeoffPage(PageTest):
    program = support.FAKE

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        path = cls.daemon.request("POST", "/v1/tradeoffs", {
            "scene": cls.daemon.push(scene()), **SMALL, "quality": {"shadows": "raytraced"},
            "tradeoff": {"repeats": 1}}).header("Location")
        support.wait_until(lambda: cls.daemon.request("GET", path).json()["state"] == "done",
                           "it is measured", 60)
        cls.path = path

    def setUp(self):
        super().setUp()
        self.browser.go(f"http://127.0.0.1:{self.daemon.port}{self.path}?format=html")

    def test_threads_join_settings_that_differ_in_their_samples_of_media_alone(self):
        threads = self.browser.run(THREADS)
        self.assertEqual(4, len(threads))  # of 1 and of 4 samples, to fewer and to more
        for base, other in threads:
            self.assertEqual((1, 1), (len(base), len(other)), threads)
            self.assertIn(other[0], [f"{base[0]}, media {count}" for count in (16, 256)])

    def test_pointing_at_a_line_shows_the_picture_of_its_samples_of_media(self):
        for count in (16, 256):
            label = f"raytraced, 4 samples, media {count}"
            x, y = self.browser.run("""const rows = [...document.querySelectorAll('tbody tr')];
              const row = rows.find((one) => one.cells[0].textContent === arguments[0]);
              row.scrollIntoView({ block: 'center' });
              const box = row.getBoundingClientRect();
              return [box.x + 40, box.y + box.height / 2];""", label)
            self.browser.actions([{"type": "pointer", "id": "mouse", "actions": [
                {"type": "pointerMove", "x": round(x), "y": round(y), "duration": 0}]}])
            (said, width), = self.browser.run(SHOWN)
            self.assertTrue(said.startswith(label + ": RMSE"), said)
            self.assertEqual(SMALL["width"], width)


support.run_tests()
