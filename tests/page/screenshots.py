#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Takes the pictures of the viewer that the documentation shows.

    tests/page/screenshots.py BIN FOLDER [NAME ...]

BIN holds vitraild and vitrail; each picture goes to FOLDER/NAME.webp, all of them where no NAME is
given. They show the demo scene, each on a page that was loaded anew.
"""
import base64
import os
import subprocess
import sys

BIN, FOLDER, *NAMES = sys.argv[1:]
sys.argv[1:] = [BIN]

from page import PageTest, support  # reads BIN from the arguments

BYTES_MAX = 300 << 10
DESKTOP = {"width": 1440, "height": 900, "phone": False}
PHONE = {"width": 390, "height": 844, "phone": True}
BUILDING, SKY, VESSEL = 2, 45, 80  # nodes of the demo scene


class Camera(PageTest):
    """A window over a daemon with the demo scene, and the picture of each page."""

    def runTest(self):  # no test: the class has a window and a daemon to drive
        pass

    def is_there(self, selector, what):
        self.browser.wait(f"return document.querySelector('{selector}')", what, 120)

    def node(self, index):
        """Selects a node of the tree, which scrolls to it."""
        self.panel("tree")
        self.enter("Find a part", "")
        self.browser.run("""const row = (at) => document.querySelector(`[data-index="${at}"]`);
          const panel = document.getElementById('panel-tree');
          for (let top = 0; !row(arguments[0]) && top < panel.scrollHeight; top += 200) {
            panel.scrollTop = top;
            panel.dispatchEvent(new Event('scroll'));
          }
          row(arguments[0]).click();""", index)

    def save(self, name):
        self.browser.run("document.activeElement.blur()")
        shown = self.browser.cdp("Page.captureScreenshot", format="webp", quality=84)
        content = base64.b64decode(shown["data"])
        if len(content) > BYTES_MAX:
            raise SystemExit(f"{name}: {len(content)} bytes are too many")
        with open(os.path.join(FOLDER, f"{name}.webp"), "wb") as file:
            file.write(content)
        print(f"{name}: {len(content) >> 10} KiB")

    # ---- the pictures ----

    def viewer(self):
        self.panel("tree")
        self.panel("lights")
        self.press("Statistics (I)")
        self.settle()
        self.is_there("#overlay table", "the passes")

    def viewer_compare(self):
        self.panel("tree")
        self.panel("render")
        self.enter("Shadows", "deep", "#panel-render")
        self.enter("Compare with", "map", "#panel-render")
        self.settle()
        self.is_there("#picture-b[data-exact=true]", "the second picture")

    def viewer_maps(self):
        self.panel("tree")
        self.enter("What the picture shows", "layers")
        self.is_there("#picture-heat[data-exact=true]", "the map")

    def viewer_handles(self):
        self.changed_by(lambda: self.enter("Standard views", "camera-1"))
        self.node(VESSEL)
        self.focus_picture()
        self.browser.keys("g")

    def viewer_section(self):
        self.node(SKY)
        self.changed_by(lambda: self.press("Hide", "#panel-properties"))
        self.enter("Standard views", "iso")
        self.node(BUILDING)
        self.changed_by(lambda: self.press("Fit", "#panel-properties"))
        self.focus_picture()
        self.browser.keys("Escape", "Left", "Left", "+", "+", "+")
        self.panel("lights")
        self.browser.run("""[...document.querySelectorAll('#panel-lights label')].find((label) =>
          label.textContent === 'Light from everywhere').click();""")
        self.panel("section")
        self.press("Cut X")
        self.settle()
        self.enter("Cut bodies", "colored", "#panel-section")

    def viewer_light(self):
        self.press("Crimson curtain", "#panel-properties")
        self.panel("tree")

    def viewer_phone(self):
        self.panel("lights")


SHOTS = {
    "viewer": DESKTOP, "viewer-compare": DESKTOP, "viewer-maps": DESKTOP,
    "viewer-handles": DESKTOP, "viewer-section": DESKTOP, "viewer-light": DESKTOP,
    "viewer-phone": PHONE,
}


def main():
    scene = os.path.join(FOLDER, ".demo.glb")
    subprocess.run([os.path.join(BIN, "vitrail"), "demo-scene", "-o", scene], check=True)
    with open(scene, "rb") as file:
        content = file.read()
    os.unlink(scene)
    for phone in (False, True):
        names = [name for name, window in SHOTS.items()
                 if window["phone"] == phone and (not NAMES or name in NAMES)]
        if not names:
            continue
        window = PHONE if phone else DESKTOP
        kind = type("Window", (Camera,), {"size": (window["width"], window["height"]),
                                          "phone": phone})
        kind.setUpClass()
        try:
            shown = kind()
            posted = support.multipart({"chapel.glb": content})
            scene = kind.daemon.post_scene(*posted).json()["id"]
            kind.daemon.request("DELETE", f"/v1/scenes/{kind.scene}")  # that of the tests
            for name in names:
                kind.browser.go("about:blank")
                kind.browser.scheme("light" if name.endswith("light") else "dark")
                shown.load(scene=scene)
                getattr(shown, name.replace("-", "_"))()
                shown.settle()
                shown.save(name)
        finally:
            kind.doClassCleanups()


main()
