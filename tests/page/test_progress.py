# SPDX-License-Identifier: MIT
"""How far a picture is that takes long."""
import os
import re
import sys

from page import PageTest, support

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "bench"))
from assembly import write_assembly  # noqa: E402

LISTEN = """window.told = [];
  const box = document.getElementById('frame-progress');
  new MutationObserver(() => box.hidden || window.told.push(
    [box.textContent, box.querySelector('progress').value])).observe(box,
      { attributes: true, childList: true, characterData: true, subtree: true });"""
HIDDEN = "return document.getElementById('frame-progress').hidden"


class Progress(PageTest):
    size = (640, 420)

    def patch(self, **members):
        view = self.only_view()
        reply = self.daemon.request("PATCH", "/v1/views/" + view["id"], members)
        self.assertEqual(200, reply.status, reply.body)

    def test_a_long_picture_says_how_far_it_is_until_it_is_there(self):
        self.load()
        self.assertTrue(self.browser.run(HIDDEN))
        self.browser.run(LISTEN)
        self.patch(quality={"reference": True, "samples": 256})
        self.browser.wait("return window.told.length > 2", "it tells how far it is")
        self.browser.wait(HIDDEN, "the picture is there", timeout_s=240)
        told = self.browser.run("return window.told")
        for text, share in told:
            self.assertRegex(text, r"^Tracing rays, \d+ %(, about \d+ s|, nearly done)?$")
            self.assertEqual(int(100 * share + 1e-9), int(re.search(r"(\d+) %", text)[1]))
        self.assertEqual(sorted(share for _, share in told), [share for _, share in told])
        self.assertIn("about", "".join(text for text, _ in told))

    def test_a_change_takes_the_bar_away(self):
        self.load()
        self.patch(quality={"reference": True, "samples": 256})
        self.browser.wait("return !document.getElementById('frame-progress').hidden", "a bar")
        self.focus_picture()
        self.browser.keys("2")
        self.assertTrue(self.browser.wait(HIDDEN, "no bar", timeout_s=2))
        self.patch(quality={"reference": False, "samples": 1})

    def test_a_large_upload_says_how_far_its_reading_is(self):
        path = os.path.join(self.daemon.folder.name, "assembly.glb")
        write_assembly(path, 20_000, 200, 24_000)
        self.load()
        self.browser.run("""window.read = new Set();
          new MutationObserver(() => window.read.add(
            document.querySelector('.uploading .fine')?.textContent)).observe(
              document.body, { childList: true, characterData: true, subtree: true });""")
        self.browser.type("#scene-files", path)
        told = self.browser.wait("""
          const told = [...window.read].filter((text) => text?.startsWith('decoding:'));
          return told.length && told""", "the stage of reading", timeout_s=120)
        self.browser.run("document.querySelector('.uploading button').click()")
        for text in told:
            self.assertRegex(text, r"^decoding: (file|meshes|nodes|outline)(, \d+ %)?$")
        self.browser.wait("return !document.querySelector('.uploading')", "it is cancelled")


if __name__ == "__main__":
    support.run_tests()
