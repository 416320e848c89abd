# SPDX-License-Identifier: MIT
"""What tests of the viewer share: a small scene, and a window over a daemon that shows it."""
import os
import struct
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../http"))

import support
from browser import Browser, needs_browser

REAL = os.path.join(support.BIN, "vitraild")
support.needs(REAL)
needs_browser()

EXACT = "return document.getElementById('picture').dataset.exact === 'true'"
SETTLED = "return document.getElementById('picture').dataset.settled === 'true'"
FRAMES = "return Number(document.getElementById('picture').dataset.frames ?? 0)"
HANDLE = """const found = document.querySelector(`[data-handle=${arguments[0]}] .gizmo-tip`);
  const box = found.getBoundingClientRect();
  return box.width > 0 && [box.x + box.width / 2, box.y + box.height / 2];"""
PICTURE = """const canvas = document.getElementById('picture');
  return canvas.width + 'x' + canvas.height + canvas.toDataURL('image/png');"""


def quad(corners):
    """Two triangles with their normal."""
    a, b, c, d = corners
    u, v = ([q - p for p, q in zip(a, e)] for e in (b, d))
    n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
    size = sum(x * x for x in n) ** 0.5
    points = [a, b, c, a, c, d]
    return points, [[x / size for x in n]] * 6


QUADS = {
    "Floor": [(-2, 0, 2), (2, 0, 2), (2, 0, -2), (-2, 0, -2)],
    "Wall": [(-2, 0, -2), (2, 0, -2), (2, 3, -2), (-2, 3, -2)],
    "Pane": [(-0.8, 0.5, 0), (0.8, 0.5, 0), (0.8, 2.2, 0), (-0.8, 2.2, 0)],
}
COLORS = {"Floor": [0.5, 0.5, 0.5, 1], "Wall": [0.8, 0.7, 0.5, 1], "Pane": [0.9, 0.1, 0.1, 0.6]}


def room(change=lambda document, binary: binary):
    """A floor, a wall and a red pane of glass between them and a lamp, under one root."""
    binary, views, accessors, meshes, materials = b"", [], [], [], []
    nodes = [{"name": "Room", "children": [1, 2, 3, 4]}]
    for name, corners in QUADS.items():
        points, normals = quad(corners)
        for values in (points, normals):
            views.append({"buffer": 0, "byteOffset": len(binary), "byteLength": 72})
            accessors.append({"bufferView": len(views) - 1, "componentType": 5126, "count": 6,
                              "type": "VEC3", "min": [min(p[i] for p in values) for i in range(3)],
                              "max": [max(p[i] for p in values) for i in range(3)]})
            binary += b"".join(struct.pack("<3f", *point) for point in values)
        meshes.append({"primitives": [{"attributes": {
            "POSITION": len(accessors) - 2, "NORMAL": len(accessors) - 1},
            "material": len(materials)}]})
        materials.append({"name": f"{name} material", "doubleSided": True,
                          "alphaMode": "BLEND" if name == "Pane" else "OPAQUE",
                          "pbrMetallicRoughness": {"baseColorFactor": COLORS[name],
                                                   "metallicFactor": 0, "roughnessFactor": 0.8}})
        nodes.append({"name": name, "mesh": len(meshes) - 1})
    nodes.append({"name": "Lamp", "translation": [0, 2.6, 1.6],
                  "extensions": {"KHR_lights_punctual": {"light": 0}}})
    document = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": nodes,
        "meshes": meshes, "materials": materials, "accessors": accessors, "bufferViews": views,
        "buffers": [{"byteLength": len(binary)}], "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": {"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 60}]}}}
    binary = change(document, binary)
    document["buffers"][0]["byteLength"] = len(binary)
    return support.glb(document, binary)


class PageTest(unittest.TestCase):
    """Tests that share a daemon and a window; each begins with the page loaded anew."""

    size = (900, 640)
    phone = False
    auto = "raster"  # pictures are compared by their bits, and a technique learned may be another
    program, environment = REAL, None

    @classmethod
    def setUpClass(cls):
        cls.daemon = support.Daemon("--render-timeout-s", "60", "--auto", cls.auto,
                                    program=cls.program, environment=cls.environment)
        cls.addClassCleanup(cls.daemon.__exit__)
        reply = cls.daemon.raw("GET", "/readyz")
        if reply.status != 200 and reply.code == "no_device":
            raise unittest.SkipTest("no graphics device")
        cls.daemon.wait_ready()
        cls.scene = cls.daemon.post_scene(*support.multipart({"room.glb": room()})).json()["id"]
        cls.browser = Browser(*cls.size, phone=cls.phone)
        cls.addClassCleanup(cls.browser.close)

    def setUp(self):
        self.browser.go("about:blank")
        self.browser.log()

    def tearDown(self):
        """Nothing that the page did may have broken its policy or thrown."""
        self.assertEqual([], [line for line in self.browser.log() if not self.is_expected(line)])

    def is_expected(self, line):
        # what asks how far a picture or a reading is may come when it is done
        if ("/v1/renders/js-" in line or "/v1/uploads/js-" in line) and "a status of 404" in line:
            return True
        return "the server responded with a status of 4" in line and self.expects_refusal

    expects_refusal = False

    def load(self, query="", scene=None):
        self.browser.go(f"http://127.0.0.1:{self.daemon.port}/{query}#scene={scene or self.scene}")
        return self.settle()

    def settle(self, after=0):
        """The refined picture of what shows now, once it came and nothing followed it."""
        newer = f" && Number(document.getElementById('picture').dataset.frames) > {after}"
        self.browser.wait(EXACT + newer, "the exact picture is there")
        # which is drawn four times more
        self.browser.wait(SETTLED + newer, "the refined picture is there", timeout_s=160)
        while True:
            frames = self.browser.run(FRAMES)
            self.browser.run("return new Promise((done) => setTimeout(done, 350))")
            if frames == self.browser.run(FRAMES) and self.browser.run(SETTLED):
                return self.browser.run(PICTURE)

    def changed_by(self, action):
        """The picture after an action that must make a new one."""
        before = self.browser.run(FRAMES)
        action()
        return self.settle(before)

    def panel(self, name):
        self.browser.click(f"#tab-{name}")

    def press(self, text, within="body"):
        """Clicks the button of that text or label."""
        self.browser.run("""const [text, within] = arguments;
          const found = [...document.querySelector(within).querySelectorAll('button')].find((b) =>
            b.textContent.trim() === text || b.getAttribute('aria-label') === text);
          if (!found) throw new Error('no button ' + text);
          found.click();""", text, within)

    def focus_picture(self):
        self.browser.run("document.getElementById('surface').focus()")

    def reload_link(self, settle=None):
        """Opens the address of the page in one that knows nothing; its picture."""
        self.browser.run("return new Promise((done) => setTimeout(done, 600))")  # written late
        url = self.browser.run("return location.href")
        self.browser.go("about:blank")
        self.browser.go(url)
        return (settle or self.settle)()

    def center(self):
        box = self.browser.run("""const box = document.getElementById('surface')
          .getBoundingClientRect(); return [box.x, box.y, box.width, box.height];""")
        return box[0] + box[2] / 2, box[1] + box[3] / 2

    def only_view(self):
        """The summary of the page's view, once that of a page which was left is gone."""
        views = []

        def is_one():
            views[:] = self.daemon.request("GET", "/v1/views").json()["views"]
            return len(views) == 1
        support.wait_until(is_one, "the page has one view", timeout_s=60)
        return views[0]

    def view(self):
        """All members of the view that the page shows, as the server has them."""
        summary = self.only_view()
        return self.daemon.request("GET", f"/v1/views/{summary['id']}").json()["view"]

    def handle(self, name):
        """The middle of a handle in the picture."""
        return self.browser.wait(f"return (function () {{ {HANDLE} }})('{name}')", f"handle {name}")

    def enter(self, label, value, within="body"):
        """Types into the field of that label."""
        self.browser.run("""const [label, value, within] = arguments;
          const nameOf = (i) => i.getAttribute('aria-label')
            ?? i.labels?.[0]?.firstChild.textContent;
          const found = [...document.querySelector(within).querySelectorAll('input, select')]
            .find((i) => nameOf(i) === label);
          if (!found) throw new Error('no field ' + label);
          found.value = value;
          found.dispatchEvent(new Event(found.type === 'search' ? 'input' : 'change'));""",
                         label, str(value), within)

    def select(self, name):
        """Selects a node by its name in the tree."""
        self.panel("tree")
        self.browser.run("""document.querySelector(`[role=treeitem][aria-label="${arguments[0]}"]`)
          .click();""", name)
