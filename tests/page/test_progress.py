# SPDX-License-Identifier: MIT
"""How far a picture is that takes long."""
import re

from page import PageTest, support

LISTEN = """window.told = [];
  const box = document.getElementById('frame-progress');
  new MutationObserver(() => box.hidden || window.told.push(
    [box.textContent, box.querySelector('progress').value])).observe(box,
      { attributes: true, childList: true, characterData: true, subtree: true });"""
HIDDEN = "return document.getElementById('frame-progress').hidden"


class Progress(PageTest):
    size = (640, 420)

    def patch(self, **members):
        (view,) = self.daemon.request("GET", "/v1/views").json()["views"]
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


if __name__ == "__main__":
    support.run_tests()
